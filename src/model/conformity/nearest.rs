//! Distance of a point from a facet, by Newton's method over the facet and along its edges, and at
//! its corners.

use crate::contact::mortar::shape::FacetShape;
use crate::mesh::ElementKind;
use crate::tensor::Vector;

/// Maximum number of Newton steps from one start: curved facets need four to eight.
const STEPS: usize = 40;
/// Tolerance of the reference coordinates.
const TOLERANCE: f64 = 1e-14;
/// If the reference coordinates exceed this value after three steps from the centre, the nearest
/// point lies on the border.
const FAR: f64 = 3.0;
/// A point at most this far (reference coordinates) outside of a facet still counts as on it.
const SLACK: f64 = 1e-12;

/// Distance of `x` from the facet with nodes at `nodes` in the order of `kind` \[m\].
pub(in crate::model) fn distance<const D: usize>(
    x: &Vector<D>,
    kind: ElementKind,
    nodes: &[Vector<D>],
) -> f64 {
    let facet = Facet { x, kind, nodes };
    let axes = [[1.0, 0.0], [0.0, 1.0]];
    let centre = if kind.corners() == 3 { [1.0 / 3.0; 2] } else { [0.0; 2] };
    let inside = |xi: &[f64; 2]| match (kind.dimension(), kind.corners()) {
        (2, 3) => xi[0] >= -SLACK && xi[1] >= -SLACK && xi[0] + xi[1] <= 1.0 + SLACK,
        _ => xi.iter().all(|c| c.abs() <= 1.0 + SLACK),
    };
    let border = facet.distance_to_border();
    let within = facet.nearest(centre, &axes[..D - 1]).filter(inside);
    within.map_or(border, |xi| border.min(facet.offset(&xi).norm()))
}

/// A facet and the point from which its distance is measured.
struct Facet<'a, const D: usize> {
    x: &'a Vector<D>,
    kind: ElementKind,
    nodes: &'a [Vector<D>],
}

impl<const D: usize> Facet<'_, D> {
    /// Vector from the facet's point at `xi` to the given point \[m\].
    fn offset(&self, xi: &[f64; 2]) -> Vector<D> {
        let shape = FacetShape::at(self.kind, *xi);
        self.nodes.iter().zip(shape.value).map(|(node, n)| (self.x - node) * n).sum()
    }

    /// A point of stationary distance within the span of some directions from `xi`; `None` if
    /// Newton's method leaves the facet.
    fn nearest(&self, mut xi: [f64; 2], directions: &[[f64; 2]]) -> Option<[f64; 2]> {
        for _ in 0..STEPS {
            let shape = FacetShape::at(self.kind, xi);
            let second = FacetShape::second(self.kind, xi);
            let offset = self.offset(&xi);
            let sum = |weight: &dyn Fn(usize) -> f64| -> Vector<D> {
                self.nodes.iter().enumerate().map(|(a, node)| node * weight(a)).sum()
            };
            let along = |d: &[f64; 2]| sum(&|a| shape.gradient[a][0] * d[0] + shape.gradient[a][1] * d[1]);
            let bend = |d: &[f64; 2], e: &[f64; 2]| {
                let of = |[ss, st, tt]: [f64; 3]| {
                    ss * d[0] * e[0] + st * (d[0] * e[1] + d[1] * e[0]) + tt * d[1] * e[1]
                };
                offset.dot(&sum(&|a| of(second[a])))
            };
            let mut residual = [0.0; 2];
            let mut metric = [[0.0; 2]; 2];
            let mut hessian = [[0.0; 2]; 2];
            for (i, d) in directions.iter().enumerate() {
                residual[i] = offset.dot(&along(d));
                for (j, e) in directions.iter().enumerate() {
                    metric[i][j] = along(d).dot(&along(e));
                    hessian[i][j] = metric[i][j] - bend(d, e);
                }
            }
            // If the distance is not convex, the Gauss-Newton matrix still gives a descent
            // direction.
            let count = directions.len();
            let step = solve(&hessian, residual, count).or_else(|| solve(&metric, residual, count))?;
            let size = step[0].abs().max(step[1].abs());
            let damp = if size > 1.0 { 1.0 / size } else { 1.0 };
            for (s, d) in step.iter().zip(directions) {
                xi = [xi[0] + damp * s * d[0], xi[1] + damp * s * d[1]];
            }
            if size < TOLERANCE {
                return Some(xi);
            }
            if xi.iter().any(|c| c.abs() > FAR) {
                return None;
            }
        }
        // On a large or distant facet, rounding may keep the step above the tolerance.
        Some(xi)
    }

    /// Distance from the corners, and in space from the edges between them \[m\].
    fn distance_to_border(&self) -> f64 {
        let corners = &crate::space::reference(self.kind).node_coordinates()[..self.kind.corners()];
        let mut least = f64::INFINITY;
        for (number, corner) in corners.iter().enumerate() {
            let start = [corner[0], corner[1]];
            least = least.min(self.offset(&start).norm());
            if D == 2 {
                continue;
            }
            let end = corners[(number + 1) % corners.len()];
            let half = [0.5 * (end[0] - start[0]), 0.5 * (end[1] - start[1])];
            let middle = [start[0] + half[0], start[1] + half[1]];
            let Some(xi) = self.nearest(middle, &[half]) else { continue };
            let along = ((xi[0] - middle[0]) * half[0] + (xi[1] - middle[1]) * half[1])
                / (half[0] * half[0] + half[1] * half[1]);
            if along.abs() <= 1.0 {
                least = least.min(self.offset(&xi).norm());
            }
        }
        least
    }
}

/// Solves one or two equations; `None` if they are singular or not definite.
fn solve(a: &[[f64; 2]; 2], b: [f64; 2], count: usize) -> Option<[f64; 2]> {
    if count == 1 {
        return (a[0][0] > 0.0).then(|| [b[0] / a[0][0], 0.0]);
    }
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let definite = a[0][0] > 0.0 && determinant > 1e-14 * a[0][0] * a[1][1].abs();
    definite.then(|| {
        [(a[1][1] * b[0] - a[0][1] * b[1]) / determinant, (a[0][0] * b[1] - a[1][0] * b[0]) / determinant]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::scatter;

    /// The smallest distance from many points of a facet.
    fn sampled<const D: usize>(x: &Vector<D>, kind: ElementKind, nodes: &[Vector<D>]) -> f64 {
        let facet = Facet { x, kind, nodes };
        let steps = if D == 2 { 4000 } else { 200 };
        let mut least = f64::INFINITY;
        for i in 0..=steps {
            for j in 0..=if D == 2 { 0 } else { steps } {
                let part = |k: usize| k as f64 / f64::from(steps as u32);
                let xi = match (D, kind.corners()) {
                    (2, _) => [2.0 * part(i) - 1.0, 0.0],
                    (_, 3) => [part(i) * (1.0 - part(j)), part(j)],
                    _ => [2.0 * part(i) - 1.0, 2.0 * part(j) - 1.0],
                };
                least = least.min(facet.offset(&xi).norm());
            }
        }
        least
    }

    fn is_the_least<const D: usize>(kind: ElementKind) {
        let noise = scatter(D * kind.nodes(), 3);
        let at = crate::space::reference(kind).node_coordinates();
        let nodes: Vec<Vector<D>> =
            (0..kind.nodes()).map(|a| Vector::from_fn(|i, _| at[a][i] + 0.08 * noise[a * D + i])).collect();
        for seed in 0..12 {
            let x = Vector::<D>::from_column_slice(&scatter(D, seed + 20)) * 2.0;
            let (found, least) = (distance(&x, kind, &nodes), sampled(&x, kind, &nodes));
            assert!(found <= least + 1e-12 && least - found < 0.02, "{kind} {seed}: {found} {least}");
        }
    }

    /// No point of a bent facet is nearer than the computed distance, for points over the facet and
    /// beyond its edges and corners.
    #[test]
    fn no_point_is_nearer() {
        [ElementKind::Line2, ElementKind::Line3].into_iter().for_each(is_the_least::<2>);
        let faces = [
            ElementKind::Tri3,
            ElementKind::Tri6,
            ElementKind::Quad4,
            ElementKind::Quad8,
            ElementKind::Quad9,
        ];
        faces.into_iter().for_each(is_the_least::<3>);
    }

    /// Exact on a flat facet, and finite on one without extent.
    #[test]
    fn flat_facets_are_exact() {
        let nodes = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]].map(Vector::from);
        let far = |x: [f64; 3]| distance(&Vector::from(x), ElementKind::Tri3, &nodes);
        assert!((far([0.5, 0.5, 3.0]) - 3.0).abs() < 1e-15);
        assert!((far([-3.0, 0.0, 4.0]) - 5.0).abs() < 1e-15);
        assert!((far([1.0, -3.0, 4.0]) - 5.0).abs() < 1e-14);
        let point = [Vector::<3>::zeros(); 3];
        assert!((distance(&Vector::from([0.0, 3.0, 4.0]), ElementKind::Tri3, &point) - 5.0).abs() < 1e-15);
    }
}
