//! Shape functions as data: a scale times a product of affine factors, on pyramids divided by another one.
//!
//! Every Lagrange and serendipity function of degree one and two has this form. An element is
//! therefore defined by its nodes and its [`Family`], and no function is derived by hand.

/// `c0 + c1 xi + c2 eta + c3 zeta`, as the four coefficients.
pub type Affine = [f64; 4];

/// One shape function, `scale` times the product of `factors` over `divisor`. Dimensionless.
#[derive(Debug, Clone, PartialEq)]
pub struct Product {
    /// Coefficient in front of the product.
    pub scale: f64,
    /// Affine factors of the reference coordinates.
    pub factors: Vec<Affine>,
    /// Affine divisor of two factors, which vanishes where they do: at the apex of a pyramid.
    pub divisor: Option<Affine>,
}

/// Construction of the shape functions from the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Tensor product of Lagrange polynomials on `[-1, 1]`, degree one or two.
    Lagrange(u8),
    /// Quadratic functions without interior nodes on `[-1, 1]^d` (quad8, hex20).
    Serendipity,
    /// Lagrange polynomials on the unit simplex, degree one or two.
    Simplex(u8),
    /// Linear polynomials on the unit triangle times linear ones on `[-1, 1]`.
    Wedge,
    /// Rational functions on a pyramid, linear on its triangles and bilinear on its base
    /// (Bedrosian 1992).
    Pyramid,
}

impl Product {
    /// Value at `xi`. Dimensionless.
    pub fn value(&self, xi: &[f64]) -> f64 {
        let product = self.without(xi, &[]);
        match &self.divisor {
            None => product,
            Some(divisor) => match affine(divisor, xi) {
                0.0 => 0.0,
                divisor => product / divisor,
            },
        }
    }

    /// Derivative in direction `k` of the reference coordinates. At the apex of a pyramid it depends on
    /// the direction from which the apex is approached; there it is that along the axis.
    pub fn derivative(&self, xi: &[f64], k: usize) -> f64 {
        let Some(divisor) = &self.divisor else { return self.product_derivative(xi, k) };
        match affine(divisor, xi) {
            0.0 => {
                self.scale * (self.factors.iter().map(|factor| factor[k + 1]).sum::<f64>() - divisor[k + 1])
            }
            d => (self.product_derivative(xi, k) - self.without(xi, &[]) * divisor[k + 1] / d) / d,
        }
    }

    /// Second derivative in directions `k` and `l`; symmetric. At the apex of a pyramid there is none,
    /// and zero is returned.
    pub fn second_derivative(&self, xi: &[f64], k: usize, l: usize) -> f64 {
        let Some(divisor) = &self.divisor else { return self.product_second_derivative(xi, k, l) };
        let d = affine(divisor, xi);
        if d == 0.0 {
            return 0.0;
        }
        let [dk, dl] = [k, l].map(|axis| divisor[axis + 1] / d);
        let mixed = self.product_derivative(xi, k) * dl + self.product_derivative(xi, l) * dk;
        (self.product_second_derivative(xi, k, l) - mixed + 2.0 * self.without(xi, &[]) * dk * dl) / d
    }

    fn product_derivative(&self, xi: &[f64], k: usize) -> f64 {
        let slope = |i: usize| self.factors[i][k + 1];
        (0..self.factors.len()).filter(|&i| slope(i) != 0.0).map(|i| slope(i) * self.without(xi, &[i])).sum()
    }

    fn product_second_derivative(&self, xi: &[f64], k: usize, l: usize) -> f64 {
        let mut sum = 0.0;
        for i in 0..self.factors.len() {
            for j in (0..self.factors.len()).filter(|&j| j != i) {
                let slopes = self.factors[i][k + 1] * self.factors[j][l + 1];
                if slopes != 0.0 {
                    sum += slopes * self.without(xi, &[i, j]);
                }
            }
        }
        sum
    }

    /// The product at `xi` without some of the factors.
    fn without(&self, xi: &[f64], skip: &[usize]) -> f64 {
        let kept = self.factors.iter().enumerate().filter(|(i, _)| !skip.contains(i));
        kept.fold(self.scale, |product, (_, factor)| product * affine(factor, xi))
    }
}

fn affine(factor: &Affine, xi: &[f64]) -> f64 {
    factor[0] + xi.iter().zip(&factor[1..]).map(|(x, c)| c * x).sum::<f64>()
}

/// The shape functions of the nodes at `nodes` (unused coordinates zero), one at each node and zero
/// at the others.
pub fn functions(family: Family, nodes: &[[f64; 3]], dim: usize) -> Vec<Product> {
    let function = |node: &[f64; 3]| match family {
        Family::Lagrange(degree) => lagrange(degree, node, dim),
        Family::Serendipity => serendipity(node, dim),
        Family::Simplex(degree) => simplex(degree, node, dim),
        Family::Wedge => wedge(node),
        Family::Pyramid => pyramid(node),
    };
    nodes.iter().map(function).collect()
}

/// `c + s xi_k`.
fn along(k: usize, c: f64, s: f64) -> Affine {
    let mut factor = [c, 0.0, 0.0, 0.0];
    factor[k + 1] = s;
    factor
}

fn lagrange(degree: u8, node: &[f64; 3], dim: usize) -> Product {
    let mut function = Product { scale: 1.0, factors: Vec::new(), divisor: None };
    for (k, &s) in node.iter().enumerate().take(dim) {
        if s == 0.0 {
            function.factors.extend([along(k, 1.0, 1.0), along(k, 1.0, -1.0)]);
            continue;
        }
        function.scale *= 0.5;
        function.factors.push(along(k, 1.0, s));
        if degree == 2 {
            function.factors.push(along(k, 0.0, s));
        }
    }
    function
}

fn serendipity(node: &[f64; 3], dim: usize) -> Product {
    let mut function = Product { scale: 1.0, factors: Vec::new(), divisor: None };
    for (k, &s) in node.iter().enumerate().take(dim) {
        if s == 0.0 {
            function.factors.extend([along(k, 1.0, 1.0), along(k, 1.0, -1.0)]);
        } else {
            function.scale *= 0.5;
            function.factors.push(along(k, 1.0, s));
        }
    }
    if node[..dim].iter().all(|&s| s != 0.0) {
        // Vanishes at the mid-edge nodes next to the corner.
        function.factors.push([1.0 - dim as f64, node[0], node[1], node[2]]);
    }
    function
}

fn simplex(degree: u8, node: &[f64; 3], dim: usize) -> Product {
    let mut function = Product { scale: 1.0, factors: Vec::new(), divisor: None };
    for corner in 0..=dim {
        let coordinate = barycentric(corner, dim);
        let at_node = affine(&coordinate, node);
        if at_node == 0.0 {
            continue;
        }
        function.factors.push(coordinate);
        if degree == 2 && at_node == 1.0 {
            function.factors.push([
                2.0 * coordinate[0] - 1.0,
                2.0 * coordinate[1],
                2.0 * coordinate[2],
                2.0 * coordinate[3],
            ]);
        } else if degree == 2 {
            function.scale *= 2.0;
        }
    }
    function
}

fn wedge(node: &[f64; 3]) -> Product {
    let mut function = simplex(1, &[node[0], node[1], 0.0], 2);
    function.scale *= 0.5;
    function.factors.push(along(2, 1.0, node[2]));
    function
}

/// `(1 - zeta + s xi) (1 - zeta + t eta) / (4 (1 - zeta))` at the base, `zeta` at the apex.
fn pyramid(node: &[f64; 3]) -> Product {
    if node[2] == 1.0 {
        return Product { scale: 1.0, factors: vec![along(2, 0.0, 1.0)], divisor: None };
    }
    let factors = vec![[1.0, node[0], 0.0, -1.0], [1.0, 0.0, node[1], -1.0]];
    Product { scale: 0.25, factors, divisor: Some(along(2, 1.0, -1.0)) }
}

/// Barycentric coordinate of a corner of the unit simplex; corner 0 is the origin.
fn barycentric(corner: usize, dim: usize) -> Affine {
    if corner > 0 {
        return along(corner - 1, 0.0, 1.0);
    }
    let mut factor = [1.0, 0.0, 0.0, 0.0];
    factor[1..=dim].fill(-1.0);
    factor
}
