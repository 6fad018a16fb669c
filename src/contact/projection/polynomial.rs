//! A facet as a polynomial seen from a point: what the search for the nearest point evaluates many times over.

use std::sync::LazyLock;

use super::newton::LARGEST;
use crate::mesh::ElementKind;
use crate::space::reference;
use crate::tensor::Vector;

/// The facet around one pair of reference coordinates, as a projected point sees it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct View<const D: usize> {
    /// `x - y`: from the facet's point to the projected one \[m\].
    pub offset: Vector<D>,
    /// `y_,k` \[m\]; the second zero in the plane.
    pub tangents: [Vector<D>; 2],
    /// `y_,kl` \[m\].
    pub second: [[Vector<D>; 2]; 2],
}

impl<const D: usize> View<D> {
    /// Tangent along the direction `d` of the reference domain.
    pub fn along(&self, d: &[f64; 2]) -> Vector<D> {
        self.tangents[0] * d[0] + self.tangents[1] * d[1]
    }

    /// `A_de = a_d . a_e - (x - y) . y_,de`, or the metric alone.
    pub fn hessian(&self, free: &[[f64; 2]], curvature: f64) -> [[f64; 2]; 2] {
        let bend: [[f64; 2]; 2] =
            std::array::from_fn(|k| std::array::from_fn(|l| curvature * self.offset.dot(&self.second[k][l])));
        let mut a = [[0.0; 2]; 2];
        for (i, d) in free.iter().enumerate() {
            for (j, e) in free.iter().enumerate() {
                let bent = d[0] * (bend[0][0] * e[0] + bend[0][1] * e[1])
                    + d[1] * (bend[1][0] * e[0] + bend[1][1] * e[1]);
                a[i][j] = self.along(d).dot(&self.along(e)) - bent;
            }
        }
        a
    }
}

/// `y(xi) - x` in powers of the reference coordinates: `coefficients[j][i]` belongs to `xi^i eta^j`.
///
/// Every facet is at most biquadratic. Relative to the point, so that rounding is that of the distance and not that of
/// the place in space.
#[derive(Debug, Clone)]
pub(super) struct Polynomial<const D: usize> {
    pub kind: ElementKind,
    coefficients: [[Vector<D>; 3]; 3],
}

impl<const D: usize> Polynomial<D> {
    /// Of the facet with nodes at `nodes` \[m\], seen from `x` \[m\].
    pub fn seen_from(x: &Vector<D>, kind: ElementKind, nodes: &[Vector<D>]) -> Self {
        let mut coefficients = [[Vector::zeros(); 3]; 3];
        for (node, powers) in nodes.iter().zip(&powers_of_shapes()[kind as usize]) {
            let from = node - x;
            for (sum, c) in coefficients.as_flattened_mut().iter_mut().zip(powers.as_flattened()) {
                *sum += from * *c;
            }
        }
        Self { kind, coefficients }
    }

    /// Whether it is linear along each line of its border.
    pub fn has_straight_edges(&self) -> bool {
        self.kind.nodes() == self.kind.corners()
    }

    /// Distance to the facet's point at `xi` \[m\].
    pub fn distance(&self, xi: &[f64; 2]) -> f64 {
        let rows = self.coefficients.map(|[a, b, c]| a + (b + c * xi[0]) * xi[0]);
        (rows[0] + (rows[1] + rows[2] * xi[1]) * xi[1]).norm()
    }

    /// `y_,112` and `y_,122` at `xi`; the other third derivatives vanish.
    pub fn third(&self, xi: &[f64; 2]) -> [Vector<D>; 2] {
        let c = &self.coefficients;
        [c[1][2] * 2.0 + c[2][2] * (4.0 * xi[1]), c[2][1] * 2.0 + c[2][2] * (4.0 * xi[0])]
    }

    /// Point, tangents and curvature at `xi`.
    pub fn at(&self, xi: &[f64; 2]) -> View<D> {
        let [s, t] = *xi;
        let value = self.coefficients.map(|[a, b, c]| a + (b + c * s) * s);
        let slope = self.coefficients.map(|[_, b, c]| b + c * (2.0 * s));
        let bend = self.coefficients.map(|[_, _, c]| c * 2.0);
        let sum = |[a, b, c]: &[Vector<D>; 3]| a + (b + c * t) * t;
        let turn = |[_, b, c]: &[Vector<D>; 3]| b + c * (2.0 * t);
        let mixed = turn(&slope);
        View {
            offset: -sum(&value),
            tangents: [sum(&slope), turn(&value)],
            second: [[sum(&bend), mixed], [mixed, value[2] * 2.0]],
        }
    }
}

/// The shape functions of each kind of facet in powers of the reference coordinates.
///
/// Read off their values at -1, 0 and 1, which fix a quadratic.
fn powers_of_shapes() -> &'static [Vec<[[f64; 3]; 3]>] {
    static POWERS: LazyLock<Vec<Vec<[[f64; 3]; 3]>>> =
        LazyLock::new(|| ElementKind::ALL.iter().map(|&kind| powers(kind)).collect());
    &POWERS
}

fn powers(kind: ElementKind) -> Vec<[[f64; 3]; 3]> {
    if kind.dimension() > 2 {
        return Vec::new(); // No facet.
    }
    let places = [-1.0, 0.0, 1.0];
    let values = |xi: [f64; 2]| {
        let mut shape = [0.0; LARGEST];
        reference(kind).shape(&xi[..kind.dimension()], &mut shape[..kind.nodes()]);
        shape
    };
    let grid = places.map(|eta| places.map(|xi| values([xi, eta])));
    let quadratic = |[low, middle, high]: [f64; 3]| [middle, 0.5 * (high - low), 0.5 * (high + low) - middle];
    let of_node = |a: usize| {
        let rows = grid.map(|row| quadratic(row.map(|shape| shape[a])));
        let columns: [[f64; 3]; 3] = std::array::from_fn(|i| quadratic(std::array::from_fn(|j| rows[j][i])));
        std::array::from_fn(|j| std::array::from_fn(|i| columns[i][j]))
    };
    (0..kind.nodes()).map(of_node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{facet_curvature, facet_tangents};
    use crate::taylor::scatter;

    fn agrees<const D: usize>(kind: ElementKind) {
        let noise = scatter(D * kind.nodes(), 5);
        let nodes: Vec<Vector<D>> = noise.chunks_exact(D).map(Vector::from_column_slice).collect();
        let x = Vector::<D>::repeat(0.3);
        let facet = Polynomial::seen_from(&x, kind, &nodes);
        let dim = D - 1;
        for xi in [[0.3, 0.2], [-1.4, 0.7], [0.0, 0.0], [1.0, -1.0]] {
            let xi = [xi[0], if D == 2 { 0.0 } else { xi[1] }];
            let element = reference(kind);
            let (mut shape, mut gradient, mut second) = ([0.0; 9], [0.0; 18], [0.0; 36]);
            element.shape(&xi[..dim], &mut shape[..nodes.len()]);
            element.gradient(&xi[..dim], &mut gradient[..nodes.len() * dim]);
            element.second_gradient(&xi[..dim], &mut second[..nodes.len() * dim * dim]);
            let y: Vector<D> = nodes.iter().zip(&shape).map(|(y, n)| y * *n).sum();
            let tangents = facet_tangents(&nodes, &gradient[..nodes.len() * dim]);
            let bends = facet_curvature(&nodes, &second[..nodes.len() * dim * dim]);
            let view = facet.at(&xi);
            assert!((view.offset - (x - y)).norm() < 1e-13, "{kind}");
            assert!((facet.distance(&xi) - (x - y).norm()).abs() < 1e-13, "{kind}");
            for k in 0..2 {
                assert!((view.tangents[k] - tangents[k]).norm() < 1e-13, "{kind}");
                assert!((0..2).all(|l| (view.second[k][l] - bends[k][l]).norm() < 1e-13), "{kind}");
            }
        }
    }

    /// The polynomial is what the shape functions say, for every facet, in- and outside of it.
    #[test]
    fn polynomials_are_the_facets() {
        for kind in ElementKind::ALL {
            match kind.dimension() {
                1 => agrees::<2>(kind),
                2 => agrees::<3>(kind),
                _ => {}
            }
        }
    }
}
