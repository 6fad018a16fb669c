//! Newton's method for the nearest point in the span of some directions of a facet.

use super::polynomial::Polynomial;

/// Newton steps before a start is given up: curved facets need four to eight.
const STEPS: usize = 40;
/// Reference coordinates are found to this.
const TOLERANCE: f64 = 1e-14;
/// Beyond these reference coordinates, three steps from the middle, the nearest point is not sought on: it lies on the
/// border.
const FAR: f64 = 3.0;
/// Nodes of the largest facet, quad9.
pub(super) const LARGEST: usize = 9;

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
    facet: &Polynomial<D>,
    mut xi: [f64; 2],
    free: &[[f64; 2]],
) -> Option<[f64; 2]> {
    for _ in 0..STEPS {
        let view = facet.at(&xi);
        let mut residual = [0.0; 2];
        for (r, d) in residual.iter_mut().zip(free) {
            *r = view.offset.dot(&view.along(d));
        }
        // Where the distance is not convex Gauss and Newton's matrix still points downhill.
        let step = solve(&view.hessian(free, 1.0), residual, free.len())
            .or_else(|| solve(&view.hessian(free, 0.0), residual, free.len()))?;
        let size = step[0].abs().max(step[1].abs());
        let damp = if size > 1.0 { 1.0 / size } else { 1.0 };
        for (s, d) in step.iter().zip(free) {
            xi = [xi[0] + damp * s * d[0], xi[1] + damp * s * d[1]];
        }
        if size < TOLERANCE {
            return Some(xi);
        }
        if xi.iter().any(|c| c.abs() > FAR) {
            return None;
        }
    }
    // Rounding on a large or distant facet may keep the step above the tolerance; the point is found all the same.
    let view = facet.at(&xi);
    let slack = 1e-8 * view.offset.norm().max(view.tangents[0].norm());
    free.iter().all(|d| view.offset.dot(&view.along(d)).abs() <= slack * view.along(d).norm()).then_some(xi)
}
