//! Shape functions as data: a scale times a product of affine factors.
//!
//! Every Lagrange and serendipity function of degree one and two has this form. An element is
//! therefore defined by its nodes and its [`Family`], and no function is derived by hand.

/// `c0 + c1 xi + c2 eta + c3 zeta`, as the four coefficients.
pub type Affine = [f64; 4];

/// One shape function, `scale` times the product of `factors`. Dimensionless.
#[derive(Debug, Clone, PartialEq)]
pub struct Product {
    /// Coefficient in front of the product.
    pub scale: f64,
    /// Affine factors of the reference coordinates.
    pub factors: Vec<Affine>,
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
}

impl Product {
    /// Value at `xi`. Dimensionless.
    pub fn value(&self, xi: &[f64]) -> f64 {
        self.without(xi, &[])
    }

    /// Derivative in direction `k` of the reference coordinates.
    pub fn derivative(&self, xi: &[f64], k: usize) -> f64 {
        let slope = |i: usize| self.factors[i][k + 1];
        (0..self.factors.len()).filter(|&i| slope(i) != 0.0).map(|i| slope(i) * self.without(xi, &[i])).sum()
    }

    /// Second derivative in directions `k` and `l`; symmetric.
    pub fn second_derivative(&self, xi: &[f64], k: usize, l: usize) -> f64 {
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
    let mut function = Product { scale: 1.0, factors: Vec::new() };
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
    let mut function = Product { scale: 1.0, factors: Vec::new() };
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
    let mut function = Product { scale: 1.0, factors: Vec::new() };
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

/// Barycentric coordinate of a corner of the unit simplex; corner 0 is the origin.
fn barycentric(corner: usize, dim: usize) -> Affine {
    if corner > 0 {
        return along(corner - 1, 0.0, 1.0);
    }
    let mut factor = [1.0, 0.0, 0.0, 0.0];
    factor[1..=dim].fill(-1.0);
    factor
}
