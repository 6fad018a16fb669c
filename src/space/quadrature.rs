//! Quadrature rules with positive weights: Gauss-Legendre and its tensor products, symmetric rules
//! on simplices.

/// A quadrature rule on a reference element.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Reference coordinates, unused ones zero.
    pub points: Vec<[f64; 3]>,
    /// Positive weights; their sum is the volume of the reference element.
    pub weights: Vec<f64>,
    /// Degree of polynomials that are integrated exactly; on lines, quads and hexes it applies to
    /// each direction.
    pub degree: usize,
}

/// Points obtained by permuting the barycentric coordinates of a simplex. The weight of each point
/// is relative to a simplex of volume one.
enum Orbit {
    /// The centroid.
    Centre { weight: f64 },
    /// All coordinates `a` except one.
    One { weight: f64, a: f64 },
    /// Two coordinates `a`, two `1/2 - a`; tetrahedra only.
    Pairs { weight: f64, a: f64 },
    /// Coordinates `a`, `b` and `1 - a - b`; triangles only.
    Any { weight: f64, a: f64, b: f64 },
}

impl Rule {
    /// Gauss-Legendre in each of `dim` directions on `[-1, 1]^dim`, first direction fastest.
    pub fn tensor(dim: usize, degree: usize) -> Self {
        let line = gauss_legendre(degree / 2 + 1);
        let mut rule = Self { points: vec![[0.0; 3]], weights: vec![1.0], degree: 2 * line.len() - 1 };
        for k in 0..dim {
            let coarse = std::mem::replace(
                &mut rule,
                Self { points: vec![], weights: vec![], degree: 2 * line.len() - 1 },
            );
            for &(x, w) in &line {
                for (point, weight) in coarse.points.iter().zip(&coarse.weights) {
                    let mut point = *point;
                    point[k] = x;
                    rule.points.push(point);
                    rule.weights.push(weight * w);
                }
            }
        }
        rule
    }

    /// The rule of the unit triangle times that of `[-1, 1]`, exact for polynomials of `degree` on
    /// the triangle and along the axis.
    pub fn wedge(degree: usize) -> Self {
        let triangle = Self::simplex(2, degree);
        let line = Self::tensor(1, degree);
        let mut rule =
            Self { points: Vec::new(), weights: Vec::new(), degree: triangle.degree.min(line.degree) };
        for (height, upright) in line.points.iter().zip(&line.weights) {
            for (point, weight) in triangle.points.iter().zip(&triangle.weights) {
                rule.points.push([point[0], point[1], height[0]]);
                rule.weights.push(weight * upright);
            }
        }
        rule
    }

    /// The rule of the pyramid `|xi|, |eta| <= 1 - zeta`, `0 <= zeta <= 1`: Gauss-Legendre across the
    /// rays from the apex and Gauss-Jacobi along them. It is exact for polynomials of `degree`, and for
    /// functions that are such polynomials of `xi / (1 - zeta)`, of `eta / (1 - zeta)` and of `zeta`.
    pub fn pyramid(degree: usize) -> Self {
        let base = Self::tensor(2, degree);
        let heights = gauss_jacobi(degree / 2 + 1);
        let mut rule = Self { points: Vec::new(), weights: Vec::new(), degree: base.degree };
        for (height, upright) in heights {
            for (point, weight) in base.points.iter().zip(&base.weights) {
                let width = 1.0 - height;
                rule.points.push([point[0] * width, point[1] * width, height]);
                rule.weights.push(weight * upright);
            }
        }
        rule
    }

    /// The smallest available rule that integrates polynomials of `degree` exactly on the unit
    /// triangle (`dim` 2) or the unit tetrahedron (`dim` 3). It is symmetric if tabulated,
    /// otherwise a Gauss rule collapsed onto a corner.
    pub fn simplex(dim: usize, degree: usize) -> Self {
        let (exact, orbits) = match (dim, degree) {
            (_, 0 | 1) => (1, vec![Orbit::Centre { weight: 1.0 }]),
            (2, 2) => (2, vec![Orbit::One { weight: 1.0 / 3.0, a: 1.0 / 6.0 }]),
            (2, 3 | 4) => (4, strang_fix_6()),
            (2, 5) => (5, radon_7()),
            (2, 6) => (6, dunavant_12()),
            (3, 2) => (2, vec![Orbit::One { weight: 0.25, a: (5.0 - 5.0_f64.sqrt()) / 20.0 }]),
            (3, 3..=5) => (5, walkington_14()),
            _ => return collapsed(dim, degree),
        };
        let mut rule = Self { points: vec![], weights: vec![], degree: exact };
        let volume = if dim == 2 { 0.5 } else { 1.0 / 6.0 };
        for orbit in orbits {
            let (weight, points) = orbit.expand(dim);
            rule.weights.extend(std::iter::repeat_n(weight * volume, points.len()));
            rule.points.extend(points);
        }
        rule
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// Whether there are no points; no rule in this module is empty.
    pub fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }
}

impl Orbit {
    /// Weight and Cartesian points. The first barycentric coordinate belongs to the corner at the
    /// origin.
    fn expand(&self, dim: usize) -> (f64, Vec<[f64; 3]>) {
        let corner = |k: usize, at: f64, others: f64| {
            let mut point = [0.0; 3];
            point[..dim].fill(others);
            if k > 0 {
                point[k - 1] = at;
            }
            point
        };
        match *self {
            Orbit::Centre { weight } => (weight, vec![corner(0, 0.0, 1.0 / (dim + 1) as f64)]),
            Orbit::One { weight, a } => {
                (weight, (0..=dim).map(|k| corner(k, 1.0 - dim as f64 * a, a)).collect())
            }
            Orbit::Pairs { weight, a } => {
                let b = 0.5 - a;
                (weight, vec![[a, b, b], [b, a, b], [b, b, a], [b, a, a], [a, b, a], [a, a, b]])
            }
            Orbit::Any { weight, a, b } => {
                let c = 1.0 - a - b;
                let pairs = [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)];
                (weight, pairs.into_iter().map(|(x, y)| [x, y, 0.0]).collect())
            }
        }
    }
}

/// Strang and Fix: 6 points, degree 4, in closed form.
fn strang_fix_6() -> Vec<Orbit> {
    let root = 10.0_f64.sqrt();
    let point = (38.0 - 44.0 * 0.4_f64.sqrt()).sqrt();
    let weight = (213_125.0 - 53_320.0 * root).sqrt();
    vec![
        Orbit::One { weight: (620.0 + weight) / 3720.0, a: (8.0 - root + point) / 18.0 },
        Orbit::One { weight: (620.0 - weight) / 3720.0, a: (8.0 - root - point) / 18.0 },
    ]
}

/// Radon: 7 points, degree 5, in closed form.
fn radon_7() -> Vec<Orbit> {
    let root = 15.0_f64.sqrt();
    vec![
        Orbit::Centre { weight: 9.0 / 40.0 },
        Orbit::One { weight: (155.0 - root) / 1200.0, a: (6.0 - root) / 21.0 },
        Orbit::One { weight: (155.0 + root) / 1200.0, a: (6.0 + root) / 21.0 },
    ]
}

/// Dunavant (1985): 12 points, degree 6.
#[allow(clippy::excessive_precision)]
fn dunavant_12() -> Vec<Orbit> {
    vec![
        Orbit::One { weight: 0.116_786_275_726_379_366_03, a: 0.249_286_745_170_910_421_29 },
        Orbit::One { weight: 0.050_844_906_370_206_816_93, a: 0.063_089_014_491_502_228_34 },
        Orbit::Any {
            weight: 0.082_851_075_618_373_575_19,
            a: 0.053_145_049_844_816_947_35,
            b: 0.310_352_451_033_784_405_42,
        },
    ]
}

/// Walkington (2000): 14 points, degree 5.
#[allow(clippy::excessive_precision)]
fn walkington_14() -> Vec<Orbit> {
    vec![
        Orbit::One { weight: 6.0 * 0.012_248_840_519_393_658_26, a: 0.092_735_250_310_891_226_4 },
        Orbit::One { weight: 6.0 * 0.018_781_320_953_002_641_8, a: 0.310_885_919_263_300_609_8 },
        Orbit::Pairs { weight: 6.0 * 0.007_091_003_462_846_911_07, a: 0.045_503_704_125_649_649_49 },
    ]
}

/// Gauss-Legendre points of the cube collapsed onto the simplex, by `x = u, y = v (1 - u), z = w (1
/// - u) (1 - v)`.
fn collapsed(dim: usize, degree: usize) -> Rule {
    // The Jacobian of the collapse has degree dim - 1 in u.
    let cube = Rule::tensor(dim, degree + dim - 1);
    let mut rule = Rule { points: vec![], weights: vec![], degree };
    for (point, weight) in cube.points.iter().zip(&cube.weights) {
        let mut left = 1.0;
        let mut jacobian = 1.0;
        let mut at = [0.0; 3];
        for k in 0..dim {
            let unit = 0.5 * (1.0 + point[k]);
            at[k] = left * unit;
            jacobian *= 0.5 * left;
            left *= 1.0 - unit;
        }
        rule.points.push(at);
        rule.weights.push(weight * jacobian);
    }
    rule
}

/// Points and weights of the `n`-point Gauss-Legendre rule on `[-1, 1]`, ascending and exactly
/// symmetric.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let mut rule = vec![(0.0, 0.0); n];
    for i in 0..n.div_ceil(2) {
        let centre = 2 * i + 1 == n;
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        for _ in 0..100 {
            let (value, slope) = legendre(n, x);
            x -= value / slope;
            if (value / slope).abs() < 1e-16 {
                break;
            }
        }
        if centre {
            x = 0.0;
        }
        let slope = legendre(n, x).1;
        let weight = 2.0 / ((1.0 - x * x) * slope * slope);
        rule[i] = (-x, weight);
        rule[n - 1 - i] = (x, weight);
    }
    rule
}

/// Points and weights of the `n`-point rule on `[0, 1]` with the weight `(1 - x)^2`, ascending. It is exact
/// for polynomials of degree `2 n - 1`.
fn gauss_jacobi(n: usize) -> Vec<(f64, f64)> {
    // Zeros of the Jacobi polynomials lie between those of the next lower degree.
    let mut zeros: Vec<f64> = Vec::new();
    for degree in 1..=n {
        let mut ends = vec![-1.0];
        ends.append(&mut zeros);
        ends.push(1.0);
        zeros = ends.windows(2).map(|ends| zero_between(|x| jacobi(degree, x), ends[0], ends[1])).collect();
    }
    // Weights are the integrals of the Lagrange polynomials.
    let line = gauss_legendre(n + 2);
    let weight = |i: usize| -> f64 {
        let lagrange = |x: f64| {
            let others = (0..n).filter(|&j| j != i);
            others.map(|j| (x - zeros[j]) / (zeros[i] - zeros[j])).product::<f64>()
        };
        line.iter().map(|&(x, w)| w * (1.0 - x).powi(2) * lagrange(x)).sum::<f64>() / 8.0
    };
    (0..n).map(|i| (0.5 * (1.0 + zeros[i]), weight(i))).collect()
}

/// The zero of a function that changes its sign once between `low` and `high`, by bisection.
fn zero_between(function: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let rises = function(high) > 0.0;
    // Each step halves the interval; 60 of them reach the spacing of numbers.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (function(middle) > 0.0) == rises { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Jacobi polynomial of degree `n` for the weight `(1 - x)^2` on `[-1, 1]`.
fn jacobi(n: usize, x: f64) -> f64 {
    let (mut before, mut value) = (1.0, 1.0 + 2.0 * x);
    for k in 2..=n {
        let k = k as f64;
        let next = ((2.0 * k + 1.0) * ((2.0 * k + 2.0) * 2.0 * k * x + 4.0) * value
            - 2.0 * (k + 1.0) * (k - 1.0) * (2.0 * k + 2.0) * before)
            / (2.0 * k * (k + 2.0) * 2.0 * k);
        (before, value) = (value, next);
    }
    value
}

/// Legendre polynomial of degree `n` and its derivative, `|x| < 1`.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
    }
    (value, n as f64 * (before - x * value) / (1.0 - x * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn monomials(total: usize, each: usize, dim: usize) -> Vec<[usize; 3]> {
        let range = |k: usize| 0..=if k < dim { each } else { 0 };
        let mut all = Vec::new();
        for a in range(0) {
            for b in range(1) {
                all.extend(range(2).map(|c| [a, b, c]).filter(|e| e.iter().sum::<usize>() <= total));
            }
        }
        all
    }

    fn integral(rule: &Rule, e: [usize; 3]) -> f64 {
        let power = |p: &[f64; 3]| (0..3).map(|k| p[k].powi(e[k] as i32)).product::<f64>();
        rule.points.iter().zip(&rule.weights).map(|(p, w)| w * power(p)).sum()
    }

    fn factorial(n: usize) -> f64 {
        (1..=n).map(|k| k as f64).product()
    }

    /// Tensor rules integrate every monomial exactly up to their degree in each direction, and no
    /// higher degree.
    #[test]
    fn tensor_rules_are_exact_to_their_degree() {
        let line = |p: usize| if p.is_multiple_of(2) { 2.0 / (p + 1) as f64 } else { 0.0 };
        for dim in 1..=3 {
            for degree in 0..=9 {
                let rule = Rule::tensor(dim, degree);
                assert!(rule.degree >= degree && rule.weights.iter().all(|&w| w > 0.0));
                for e in monomials(usize::MAX, rule.degree, dim) {
                    let exact: f64 = (0..dim).map(|k| line(e[k])).product();
                    assert!((integral(&rule, e) - exact).abs() < 1e-13, "{dim} {degree} {e:?}");
                }
                let beyond = rule.degree + 1;
                assert!(
                    (integral(&rule, [beyond, 0, 0]) - line(beyond) * 2.0_f64.powi(dim as i32 - 1)).abs()
                        > 1e-4
                );
            }
        }
    }

    /// Simplex rules, tabulated and collapsed, have positive weights, interior points, and the
    /// stated degree.
    #[test]
    fn simplex_rules_are_exact_to_their_degree() {
        for dim in 2..=3 {
            for degree in 0..=9 {
                let rule = Rule::simplex(dim, degree);
                assert!(rule.degree >= degree && rule.weights.iter().all(|&w| w > 0.0));
                assert!(
                    rule.points.iter().all(|p| p.iter().all(|&x| x >= 0.0) && p.iter().sum::<f64>() < 1.0)
                );
                for e in monomials(rule.degree, rule.degree, dim) {
                    let exact = e.iter().map(|&n| factorial(n)).product::<f64>()
                        / factorial(e.iter().sum::<usize>() + dim);
                    let error = (integral(&rule, e) - exact).abs();
                    assert!(error < 1e-15, "{dim} {degree} {e:?}: {error:e}");
                }
            }
        }
        let counts = |dim: usize, degrees: &[usize]| {
            degrees.iter().map(|&d| Rule::simplex(dim, d).len()).collect::<Vec<_>>()
        };
        assert_eq!(counts(2, &[1, 2, 4, 5, 6]), [1, 3, 6, 7, 12]);
        assert_eq!(counts(3, &[1, 2, 5]), [1, 4, 14]);
    }

    /// Rules of the pyramid have positive weights, interior points, and the stated degree; that of one
    /// point is at the centroid.
    #[test]
    fn pyramid_rules_are_exact_to_their_degree() {
        let line = |p: usize| if p.is_multiple_of(2) { 2.0 / (p + 1) as f64 } else { 0.0 };
        for degree in 0..=9 {
            let rule = Rule::pyramid(degree);
            assert!(rule.degree >= degree && rule.weights.iter().all(|&w| w > 0.0));
            let inside = |p: &[f64; 3]| p[2] > 0.0 && p[0].abs().max(p[1].abs()) < 1.0 - p[2];
            assert!(rule.points.iter().all(inside));
            for e in monomials(rule.degree, rule.degree, 3) {
                let (a, b, c) = (e[0], e[1], e[2]);
                let beta = factorial(c) * factorial(a + b + 2) / factorial(a + b + c + 3);
                let exact = line(a) * line(b) * beta;
                assert!((integral(&rule, e) - exact).abs() < 1e-14, "{degree} {e:?}");
            }
        }
        assert_eq!([1, 2, 4].map(|degree| Rule::pyramid(degree).len()), [1, 8, 27]);
        assert!((Rule::pyramid(1).points[0][2] - 0.25).abs() < 1e-15);
    }
}
