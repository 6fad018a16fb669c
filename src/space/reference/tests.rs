//! Properties of reference elements, checked for every kind in the table.

use super::*;

/// A point inside every reference domain.
const INSIDE: [f64; 3] = [0.17, 0.29, 0.23];

fn elements() -> impl Iterator<Item = &'static ReferenceElement> {
    ElementKind::ALL.into_iter().map(reference)
}

fn shapes(element: &ReferenceElement, xi: [f64; 3]) -> Vec<f64> {
    let mut n = vec![0.0; element.kind.nodes()];
    element.shape(&xi, &mut n);
    n
}

/// Exponents of the polynomials that an element contains. The total degree is limited by its order
/// on simplices and serendipity elements, the degree in each direction on tensor products.
fn contained(element: &ReferenceElement) -> Vec<[i32; 3]> {
    let (total, each) = match layout(element.kind).family {
        Family::Lagrange(p) => (i32::MAX, i32::from(p)),
        Family::Simplex(p) => (i32::from(p), i32::from(p)),
        // The product of the two coordinates of the triangle is taken out below.
        Family::Wedge => (2, 1),
        Family::Serendipity => (2, 2),
        Family::Pyramid => (1, 1),
    };
    let top = |k: usize| if k < element.dim { each } else { 0 };
    let mut all = Vec::new();
    for a in 0..=top(0) {
        for b in 0..=top(1) {
            all.extend((0..=top(2)).map(|c| [a, b, c]).filter(|e| e.iter().sum::<i32>() <= total));
        }
    }
    if element.is_wedge() {
        all.retain(|e| e[0] + e[1] <= 1);
    }
    all
}

/// Each entry of the list has the index of its kind and the correct number of nodes.
#[test]
fn every_kind_has_its_element() {
    for (kind, element) in ElementKind::ALL.into_iter().zip(elements()) {
        assert_eq!(element.kind, kind);
        assert_eq!(element.coordinates.len(), kind.nodes());
        assert_eq!(element.functions.len(), kind.nodes());
    }
}

/// Every node is the mean of the corners that the mesh defines as its parents: both use one node
/// order.
#[test]
fn nodes_stand_between_their_corners() {
    for element in elements() {
        for (node, parents) in element.coordinates.iter().zip(element.kind.parents()) {
            for k in 0..3 {
                let sum: f64 = parents.iter().map(|&c| element.coordinates[c as usize][k]).sum();
                assert_eq!(node[k], sum / parents.len() as f64, "{:?}", element.kind);
            }
        }
    }
}

/// A shape function is one at its node and zero at the others.
#[test]
fn shape_functions_are_one_at_their_node() {
    for element in elements() {
        for (b, node) in element.coordinates.iter().enumerate() {
            for (a, n) in shapes(element, *node).into_iter().enumerate() {
                assert!((n - f64::from(u8::from(a == b))).abs() < 1e-15, "{:?} {a} {b}", element.kind);
            }
        }
    }
}

/// Interpolation reproduces the constant (partition of unity) and all polynomials of the element's
/// order.
#[test]
fn polynomials_of_the_order_are_contained() {
    for element in elements() {
        let n = shapes(element, INSIDE);
        for e in contained(element) {
            let power = |p: &[f64; 3]| (0..3).map(|k| p[k].powi(e[k])).product::<f64>();
            let found: f64 = n.iter().zip(element.coordinates).map(|(n, p)| n * power(p)).sum();
            assert!((found - power(&INSIDE)).abs() < 1e-15, "{:?} {e:?}", element.kind);
        }
    }
}

/// Taylor test: with gradient and second gradient the remainder decreases with the third power of
/// the step.
#[test]
fn derivatives_pass_the_taylor_test() {
    for element in elements() {
        let (nodes, dim) = (element.kind.nodes(), element.dim);
        let (mut dn, mut d2n) = (vec![0.0; nodes * dim], vec![0.0; nodes * dim * dim]);
        element.gradient(&INSIDE, &mut dn);
        element.second_gradient(&INSIDE, &mut d2n);
        let start = shapes(element, INSIDE);
        let direction = [0.6, -0.5, 0.7];
        for a in 0..nodes {
            let slope: f64 = (0..dim).map(|k| dn[a * dim + k] * direction[k]).sum();
            let bend: f64 = (0..dim * dim)
                .map(|kl| d2n[a * dim * dim + kl] * direction[kl / dim] * direction[kl % dim])
                .sum();
            let remainder = |h: f64| {
                let at = std::array::from_fn(|k| INSIDE[k] + h * direction[k]);
                (shapes(element, at)[a] - start[a] - h * slope - h * h / 2.0 * bend).abs()
            };
            let (coarse, fine) = (remainder(2e-2), remainder(1e-2));
            assert!(
                fine < 1e-15 || (coarse / fine).log2() > 2.9,
                "{:?} node {a}: {coarse} {fine}",
                element.kind
            );
        }
    }
}

/// Every rule has positive weights that sum to the volume of the reference element.
#[test]
fn weights_are_positive_and_sum_to_the_volume() {
    for element in elements() {
        let simplex = matches!(layout(element.kind).family, Family::Simplex(_));
        let volume = match simplex {
            true => [0.5, 1.0 / 6.0][element.dim - 2],
            false if element.is_wedge() => 1.0,
            false if element.is_pyramid() => 4.0 / 3.0,
            false => f64::powi(2.0, element.dim as i32),
        };
        let rules = [&element.full, &element.reduced, &element.mass, &element.gauss_contact];
        for rule in rules.into_iter().chain(&element.nodal) {
            assert_eq!(rule.points.len(), rule.weights.len());
            assert!(rule.weights.iter().all(|&w| w > 0.0), "{:?}", element.kind);
            assert!(
                (rule.weights.iter().sum::<f64>() - volume).abs() < 1e-14 * volume.max(1.0),
                "{:?}",
                element.kind
            );
        }
    }
}

/// The rules have the specified numbers of points.
#[test]
fn rules_have_their_points() {
    use ElementKind::*;
    let counts = |kind| {
        let e = reference(kind);
        [&e.full, &e.reduced, &e.mass, &e.gauss_contact].map(Rule::len)
    };
    assert_eq!(counts(Line2), [2, 1, 2, 2]);
    assert_eq!(counts(Line3), [3, 1, 3, 3]);
    assert_eq!(counts(Tri3), [1, 1, 3, 3]);
    assert_eq!(counts(Tri6), [3, 1, 6, 7]);
    assert_eq!(counts(Quad4), [4, 1, 4, 4]);
    assert_eq!(counts(Quad8), [9, 1, 9, 9]);
    assert_eq!(counts(Quad9), [9, 1, 9, 9]);
    assert_eq!(counts(Tet4), [1, 1, 4, 4]);
    assert_eq!(counts(Tet10), [4, 1, 14, 14]);
    assert_eq!(counts(Hex8), [8, 1, 8, 8]);
    assert_eq!(counts(Hex20), [27, 1, 27, 27]);
    assert_eq!(counts(Hex27), [27, 1, 27, 27]);
    assert_eq!(counts(Wedge6), [6, 1, 6, 6]);
    assert_eq!(counts(Pyramid5), [8, 1, 8, 8]);
}

/// The mass rule integrates all products of shape functions exactly: a much finer rule gives the
/// same result.
#[test]
fn mass_rule_is_exact_for_products() {
    for element in elements() {
        let mass = |rule: &Rule| {
            let t = element.tabulate(rule);
            let product =
                |a: usize, b: usize, q: usize| t.weights[q] * t.n[q * t.nodes + a] * t.n[q * t.nodes + b];
            let entry = move |a, b| (0..t.points).map(|q| product(a, b, q)).sum::<f64>();
            let nodes = element.kind.nodes();
            (0..nodes * nodes).map(|ab| entry(ab / nodes, ab % nodes)).collect::<Vec<f64>>()
        };
        for (entry, exact) in mass(element.mass_rule()).into_iter().zip(mass(&element.rule(8))) {
            assert!((entry - exact).abs() < 1e-15, "{:?}", element.kind);
        }
    }
}

/// Nodal rules: trapezoidal and Simpson's rule, absent if a node would have a nonpositive weight;
/// exact to their degree.
#[test]
fn nodal_rules_sit_on_the_nodes() {
    use ElementKind::*;
    let weights = |kind| reference(kind).nodal_rule().map(|rule| rule.weights.clone());
    let close = |kind, expected: &[f64]| {
        let found = weights(kind).expect("has a nodal rule");
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{kind:?} {found:?}");
    };
    close(Line2, &[1.0; 2]);
    close(Line3, &[1.0 / 3.0, 1.0 / 3.0, 4.0 / 3.0]);
    close(Tri3, &[1.0 / 6.0; 3]);
    close(Quad4, &[1.0; 4]);
    close(Quad9, &[1.0, 1.0, 1.0, 1.0, 4.0, 4.0, 4.0, 4.0, 16.0].map(|w: f64| w / 9.0));
    close(Pyramid5, &[0.25, 0.25, 0.25, 0.25, 1.0 / 3.0]);
    for kind in [Tri6, Quad8, Tet10, Hex20] {
        assert_eq!(weights(kind), None, "{kind:?}");
    }
    for element in elements() {
        let Some(rule) = element.nodal_rule() else { continue };
        assert_eq!(rule.points, element.coordinates);
        let finer = element.rule(rule.degree);
        let integral = |rule: &Rule| {
            let linear =
                |p: &[f64; 3]| (0.3 + p[0] - 0.4 * p[1] + 0.2 * p[2]).powi(rule.degree.min(3) as i32);
            rule.points.iter().zip(&rule.weights).map(|(p, w)| w * linear(p)).sum::<f64>()
        };
        let exact = integral(&Rule { degree: rule.degree, ..finer });
        assert!((integral(rule) - exact).abs() < 1e-14, "{:?}", element.kind);
    }
}

/// Gradients of a pyramid are constant along the rays from its apex, also at the apex from the axis: one
/// value of the strain belongs to each ray.
#[test]
fn gradients_of_a_pyramid_are_constant_along_rays() {
    let element = reference(ElementKind::Pyramid5);
    let mut below = vec![0.0; 15];
    let mut above = vec![0.0; 15];
    for (u, v) in [(0.0, 0.0), (0.3, -0.8), (-1.0, 1.0)] {
        element.gradient(&[u, v, 0.0], &mut below);
        element.gradient(&[0.001 * u, 0.001 * v, 0.999], &mut above);
        assert!(below.iter().zip(&above).all(|(a, b)| (a - b).abs() < 1e-12), "{u} {v}");
    }
    element.gradient(&[0.0; 3], &mut below);
    element.gradient(&[0.0, 0.0, 1.0], &mut above);
    assert_eq!(below, above);
}
