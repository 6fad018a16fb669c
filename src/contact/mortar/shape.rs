//! Shape functions of facets in closed form, with first and second derivatives, for evaluation at
//! segment points.
//!
//! [`crate::space::reference`] has the same functions as data, for tables that are computed once.
//! Segment points have arbitrary positions.

use crate::mesh::ElementKind;
use crate::tensor::Vector;

/// Maximum number of nodes of a facet.
pub const MOST_NODES: usize = 9;

/// Shape functions of one facet at one point of its reference domain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FacetShape {
    /// `N_a`.
    pub value: [f64; MOST_NODES],
    /// `dN_a/dxi_k`.
    pub gradient: [[f64; 2]; MOST_NODES],
}

/// `d2N_a` by `xi_1 xi_1`, `xi_1 xi_2`, `xi_2 xi_2`.
pub type SecondDerivatives = [[f64; 3]; MOST_NODES];

/// `f_,k` of a nodal field.
pub fn tangents<const D: usize>(shape: &FacetShape, nodes: &[Vector<D>]) -> [Vector<D>; 2] {
    let mut tangents = [Vector::zeros(); 2];
    for (x, gradient) in nodes.iter().zip(&shape.gradient) {
        for k in 0..D - 1 {
            tangents[k] += x * gradient[k];
        }
    }
    tangents
}

impl FacetShape {
    /// The functions of a facet of `kind` at `xi`.
    ///
    /// # Panics
    /// If `kind` is not a facet.
    pub fn at(kind: ElementKind, xi: [f64; 2]) -> Self {
        let mut shape = Self::default();
        match kind {
            ElementKind::Line2 | ElementKind::Line3 => shape.line(kind.nodes(), xi[0]),
            ElementKind::Tri3 => shape.triangle(xi),
            ElementKind::Tri6 => shape.quadratic_triangle(xi),
            ElementKind::Quad4 | ElementKind::Quad9 => shape.product(kind.nodes(), xi),
            ElementKind::Quad8 => shape.serendipity(xi),
            _ => unreachable!("{kind} is no facet"),
        }
        shape
    }

    fn line(&mut self, nodes: usize, s: f64) {
        let along = Lagrange::at(if nodes == 2 { 1 } else { 2 }, s);
        for a in 0..nodes {
            self.value[a] = along.value[a];
            self.gradient[a][0] = along.slope[a];
        }
    }

    fn triangle(&mut self, [s, t]: [f64; 2]) {
        self.value[..3].copy_from_slice(&[1.0 - s - t, s, t]);
        self.gradient[..3].copy_from_slice(&BARYCENTRIC);
    }

    fn quadratic_triangle(&mut self, [s, t]: [f64; 2]) {
        let l = [1.0 - s - t, s, t];
        let d = BARYCENTRIC;
        for i in 0..3 {
            self.value[i] = l[i] * (2.0 * l[i] - 1.0);
            self.gradient[i] = d[i].map(|d| d * (4.0 * l[i] - 1.0));
            let j = (i + 1) % 3;
            self.value[3 + i] = 4.0 * l[i] * l[j];
            self.gradient[3 + i] = [0, 1].map(|k| 4.0 * (d[i][k] * l[j] + l[i] * d[j][k]));
        }
    }

    /// Quad4 and quad9: products of one-dimensional functions.
    fn product(&mut self, nodes: usize, [s, t]: [f64; 2]) {
        let order = if nodes == 4 { 1 } else { 2 };
        let (first, second) = (Lagrange::at(order, s), Lagrange::at(order, t));
        for (a, &[i, j]) in QUAD_PLACES[..nodes].iter().enumerate() {
            self.value[a] = first.value[i] * second.value[j];
            self.gradient[a] = [first.slope[i] * second.value[j], first.value[i] * second.slope[j]];
        }
    }

    /// Quad8.
    fn serendipity(&mut self, [s, t]: [f64; 2]) {
        for (i, &[a, b]) in QUAD_CORNERS.iter().enumerate() {
            let p = 1.0 + a * s;
            let q = 1.0 + b * t;
            let r = a * s + b * t - 1.0;
            self.value[i] = 0.25 * p * q * r;
            self.gradient[i] = [0.25 * a * q * (r + p), 0.25 * b * p * (r + q)];
        }
        for (i, b) in [(4, -1.0), (6, 1.0)] {
            let q = 1.0 + b * t;
            self.value[i] = 0.5 * (1.0 - s * s) * q;
            self.gradient[i] = [-s * q, 0.5 * (1.0 - s * s) * b];
        }
        for (i, a) in [(5, 1.0), (7, -1.0)] {
            let p = 1.0 + a * s;
            self.value[i] = 0.5 * (1.0 - t * t) * p;
            self.gradient[i] = [0.5 * (1.0 - t * t) * a, -t * p];
        }
    }

    /// Second derivatives of the functions of a facet of `kind` at `xi`.
    ///
    /// # Panics
    /// If `kind` is not a facet.
    pub fn second(kind: ElementKind, xi: [f64; 2]) -> SecondDerivatives {
        match kind {
            ElementKind::Line2 | ElementKind::Tri3 => [[0.0; 3]; MOST_NODES],
            ElementKind::Line3 => {
                let mut second = [[0.0; 3]; MOST_NODES];
                second
                    .iter_mut()
                    .zip(Lagrange::at(2, xi[0]).bend)
                    .for_each(|(second, bend)| second[0] = bend);
                second
            }
            ElementKind::Tri6 => second_of_quadratic_triangle(),
            ElementKind::Quad4 | ElementKind::Quad9 => second_of_product(kind.nodes(), xi),
            ElementKind::Quad8 => second_of_serendipity(xi),
            _ => unreachable!("{kind} is no facet"),
        }
    }
}

fn second_of_quadratic_triangle() -> SecondDerivatives {
    let mut second = [[0.0; 3]; MOST_NODES];
    let d = BARYCENTRIC;
    for i in 0..3 {
        let j = (i + 1) % 3;
        second[i] = [4.0 * d[i][0] * d[i][0], 4.0 * d[i][0] * d[i][1], 4.0 * d[i][1] * d[i][1]];
        second[3 + i] =
            [8.0 * d[i][0] * d[j][0], 4.0 * (d[i][0] * d[j][1] + d[i][1] * d[j][0]), 8.0 * d[i][1] * d[j][1]];
    }
    second
}

/// Quad4 and quad9.
fn second_of_product(nodes: usize, [s, t]: [f64; 2]) -> SecondDerivatives {
    let mut second = [[0.0; 3]; MOST_NODES];
    let order = if nodes == 4 { 1 } else { 2 };
    let [along, across] = [Lagrange::at(order, s), Lagrange::at(order, t)];
    for (second, &[i, j]) in second.iter_mut().zip(&QUAD_PLACES[..nodes]) {
        *second = [
            along.bend[i] * across.value[j],
            along.slope[i] * across.slope[j],
            along.value[i] * across.bend[j],
        ];
    }
    second
}

/// Quad8.
fn second_of_serendipity([s, t]: [f64; 2]) -> SecondDerivatives {
    let mut second = [[0.0; 3]; MOST_NODES];
    for (i, &[a, b]) in QUAD_CORNERS.iter().enumerate() {
        let p = 1.0 + a * s;
        let q = 1.0 + b * t;
        second[i] = [0.5 * q, 0.25 * a * b * (a * s + b * t - 1.0 + p + q), 0.5 * p];
    }
    for (i, b) in [(4, -1.0), (6, 1.0)] {
        second[i] = [-(1.0 + b * t), -s * b, 0.0];
    }
    for (i, a) in [(5, 1.0), (7, -1.0)] {
        second[i] = [0.0, -t * a, -(1.0 + a * s)];
    }
    second
}

const BARYCENTRIC: [[f64; 2]; 3] = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
const QUAD_CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// For each node of a quad9 its index along either direction: 0 at -1, 1 at +1, 2 in the middle.
const QUAD_PLACES: [[usize; 2]; 9] = [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [1, 2], [2, 1], [0, 2], [2, 2]];

/// Lagrange functions on `[-1, 1]` of the nodes -1, 1 and, for order 2, 0.
struct Lagrange {
    value: [f64; 3],
    slope: [f64; 3],
    bend: [f64; 3],
}

impl Lagrange {
    fn at(order: usize, s: f64) -> Self {
        if order == 1 {
            return Self {
                value: [0.5 - 0.5 * s, 0.5 + 0.5 * s, 0.0],
                slope: [-0.5, 0.5, 0.0],
                bend: [0.0; 3],
            };
        }
        Self {
            value: [0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s],
            slope: [s - 0.5, s + 0.5, -2.0 * s],
            bend: [1.0, 1.0, -2.0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::reference;

    /// The closed forms equal the functions of the reference elements, with both derivatives.
    #[test]
    fn shape_functions_are_those_of_the_elements() {
        let facets = [
            ElementKind::Line2,
            ElementKind::Line3,
            ElementKind::Tri3,
            ElementKind::Tri6,
            ElementKind::Quad4,
            ElementKind::Quad8,
            ElementKind::Quad9,
        ];
        for kind in facets {
            let (nodes, dim) = (kind.nodes(), kind.dimension());
            let xi = [0.3, if dim == 2 { 0.17 } else { 0.0 }];
            let shape = FacetShape::at(kind, xi);
            let mut value = vec![0.0; nodes];
            let mut gradient = vec![0.0; nodes * dim];
            let mut second = vec![0.0; nodes * dim * dim];
            let bends = FacetShape::second(kind, xi);
            let element = reference(kind);
            element.shape(&xi, &mut value);
            element.gradient(&xi, &mut gradient);
            element.second_gradient(&xi, &mut second);
            for a in 0..nodes {
                assert!((shape.value[a] - value[a]).abs() < 1e-15, "{kind} {a}");
                for k in 0..dim {
                    assert!((shape.gradient[a][k] - gradient[a * dim + k]).abs() < 1e-15, "{kind} {a}");
                    for l in 0..dim {
                        let expected = second[(a * dim + k) * dim + l];
                        assert!((bends[a][k + l] - expected).abs() < 1e-14, "{kind} {a} {k} {l}");
                    }
                }
            }
        }
    }
}
