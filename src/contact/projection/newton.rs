//! Newton's method for the nearest point in the span of some directions of a facet.

use crate::mesh::ElementKind;
use crate::space::{facet_curvature, facet_tangents, reference};
use crate::tensor::Vector;

/// Newton steps before a start is given up: curved facets need four to eight.
const STEPS: usize = 40;
/// Reference coordinates are found to this.
const TOLERANCE: f64 = 1e-14;
/// Nodes of the largest facet, quad9.
const LARGEST: usize = 9;

/// Everything of the facet at one pair of coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FacetState<const D: usize> {
    pub nodes: usize,
    pub shape: [f64; LARGEST],
    pub gradient: [f64; 2 * LARGEST],
    /// From the facet's point to the projected one.
    pub offset: Vector<D>,
    pub tangents: [Vector<D>; 2],
    pub second: [[Vector<D>; 2]; 2],
}

impl<const D: usize> FacetState<D> {
    pub fn at(kind: ElementKind, nodes: &[Vector<D>], x: &Vector<D>, xi: &[f64; 2]) -> Self {
        let element = reference(kind);
        let mut shape = [0.0; LARGEST];
        let mut gradient = [0.0; 2 * LARGEST];
        let mut second = [0.0; 4 * LARGEST];
        let dim = D - 1;
        element.shape(&xi[..dim], &mut shape[..nodes.len()]);
        element.gradient(&xi[..dim], &mut gradient[..nodes.len() * dim]);
        element.second_gradient(&xi[..dim], &mut second[..nodes.len() * dim * dim]);
        let point: Vector<D> = nodes.iter().zip(&shape).map(|(y, m)| y * *m).sum();
        Self {
            nodes: nodes.len(),
            shape,
            gradient,
            offset: x - point,
            tangents: facet_tangents(nodes, &gradient[..nodes.len() * dim]),
            second: facet_curvature(nodes, &second[..nodes.len() * dim * dim]),
        }
    }

    /// Tangent along the direction `d` of the reference domain.
    pub fn along(&self, d: &[f64; 2]) -> Vector<D> {
        self.tangents[0] * d[0] + self.tangents[1] * d[1]
    }

    /// `y_,de`.
    fn second_along(&self, d: &[f64; 2], e: &[f64; 2]) -> Vector<D> {
        (0..2).flat_map(|k| (0..2).map(move |l| (k, l))).map(|(k, l)| self.second[k][l] * (d[k] * e[l])).sum()
    }

    /// `A_de = a_d . a_e - (x - y) . y_,de`, or the metric alone.
    pub fn hessian(&self, free: &[[f64; 2]], curvature: f64) -> [[f64; 2]; 2] {
        let mut a = [[0.0; 2]; 2];
        for (i, d) in free.iter().enumerate() {
            for (j, e) in free.iter().enumerate() {
                let bend = self.offset.dot(&self.second_along(d, e));
                a[i][j] = self.along(d).dot(&self.along(e)) - curvature * bend;
            }
        }
        a
    }
}

/// Solves the 0, 1 or 2 equations of the free directions; None where they are singular or not definite.
pub(super) fn solve(a: &[[f64; 2]; 2], b: [f64; 2], count: usize) -> Option<[f64; 2]> {
    match count {
        0 => Some([0.0; 2]),
        1 => (a[0][0] > 0.0).then(|| [b[0] / a[0][0], 0.0]),
        _ => {
            let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
            let definite = a[0][0] > 0.0 && det > 1e-14 * a[0][0] * a[1][1].abs();
            definite
                .then(|| [(a[1][1] * b[0] - a[0][1] * b[1]) / det, (a[0][0] * b[1] - a[1][0] * b[0]) / det])
        }
    }
}

/// Newton within the span of the free directions from `xi`; None where it does not converge.
pub(super) fn minimise<const D: usize>(
    facet: &(ElementKind, &[Vector<D>]),
    x: &Vector<D>,
    mut xi: [f64; 2],
    free: &[[f64; 2]],
) -> Option<[f64; 2]> {
    for _ in 0..STEPS {
        let state = FacetState::at(facet.0, facet.1, x, &xi);
        let mut residual = [0.0; 2];
        for (r, d) in residual.iter_mut().zip(free) {
            *r = state.offset.dot(&state.along(d));
        }
        // Where the distance is not convex Gauss and Newton's matrix still points downhill.
        let step = solve(&state.hessian(free, 1.0), residual, free.len())
            .or_else(|| solve(&state.hessian(free, 0.0), residual, free.len()))?;
        let size = step[0].abs().max(step[1].abs());
        let damp = if size > 1.0 { 1.0 / size } else { 1.0 };
        for (s, d) in step.iter().zip(free) {
            xi = [xi[0] + damp * s * d[0], xi[1] + damp * s * d[1]];
        }
        if size < TOLERANCE {
            return Some(xi);
        }
        if xi.iter().any(|c| c.abs() > 10.0) {
            return None;
        }
    }
    // Rounding on a large or distant facet may keep the step above the tolerance; the point is found all the same.
    let state = FacetState::at(facet.0, facet.1, x, &xi);
    let slack = 1e-8 * state.offset.norm().max(state.tangents[0].norm());
    free.iter()
        .all(|d| state.offset.dot(&state.along(d)).abs() <= slack * state.along(d).norm())
        .then_some(xi)
}
