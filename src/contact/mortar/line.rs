//! Overlap of two straight lines in the plane: an interval of the contactor line.
//!
//! With `d = x_b - x_a` the ends of the target lie at `s = (y - x_a) . d / |d|^2` on the contactor
//! line. The overlap is `[max(s_d, 0), min(s_c, 1)]` for a target from `y_c` to `y_d`. The target
//! has the opposite direction because it faces the contactor.

use std::sync::LazyLock;

use super::clip::ON_EDGE;
use super::segment::{ByCorners, PlacedPiece, PointVariation, SegmentPoint, TARGET, Want};
use crate::space::Rule;
use crate::tensor::Vector;

/// A target whose projection is smaller than this fraction of the contactor's length does not face
/// it.
const FACES: f64 = 1e-9;

/// The nearest coordinate on the contactor. A coordinate that equals an end up to rounding is set
/// to the end; otherwise rounding would choose the derivative.
fn clamped(s: f64) -> f64 {
    match s {
        _ if s < ON_EDGE => 0.0,
        _ if s > 1.0 - ON_EDGE => 1.0,
        _ => s,
    }
}

/// See [`super::intersection::overlap`].
pub(super) fn overlap<const D: usize>(
    contactor: &PlacedPiece<'_, D>,
    target: &PlacedPiece<'_, D>,
    degree: usize,
    want: Want,
    visit: &mut impl FnMut(&SegmentPoint<D>, &PointVariation<D>),
) {
    let [a, b, ..] = contactor.corners;
    let [c, d, ..] = target.corners;
    let along = b - a;
    let square = along.norm_squared();
    if square.is_nan() || square <= 0.0 {
        return;
    }
    let [first, last] = [place(c, a, &along, square), place(d, a, &along, square)];
    let seen = first.s - last.s;
    if seen.is_nan() || seen <= FACES {
        return;
    }
    let (low, high) = (clamped(last.s), clamped(first.s));
    let length = high - low;
    if length <= 0.0 {
        return;
    }
    // If ends of both lines coincide, the contactor's end is used; it contributes no derivative.
    let inside = |s: f64| s > 0.0 && s < 1.0;
    let by_low = if inside(low) { last.by_corners(TARGET + 1, &along, square) } else { none() };
    let by_high = if inside(high) { first.by_corners(TARGET, &along, square) } else { none() };
    let (by_first, by_last) = match want {
        Want::Points => (none(), none()),
        Want::Variations | Want::NormalVariations | Want::FixedPlaces => {
            (first.by_corners(TARGET, &along, square), last.by_corners(TARGET + 1, &along, square))
        }
    };
    let ends = |piece: &PlacedPiece<'_, D>| [piece.piece.corners[0].at[0], piece.piece.corners[1].at[0]];
    let [xi_a, xi_b] = ends(contactor);
    let [eta_c, eta_d] = ends(target);
    let span = last.s - first.s;
    let mut variation = PointVariation::default();
    for (point, weight) in rule(degree) {
        let s = low + length * point;
        let theta = (s - first.s) / span;
        let on = SegmentPoint {
            xi: [xi_a + s * (xi_b - xi_a), 0.0],
            eta: [eta_c + theta * (eta_d - eta_c), 0.0],
            weight: weight * length * (xi_b - xi_a),
        };
        if want != Want::Points {
            for i in [0, 1, TARGET, TARGET + 1] {
                let by_s = by_low[i] * (1.0 - point) + by_high[i] * *point;
                let by_theta = (by_s - by_first[i] - (by_last[i] - by_first[i]) * theta) / span;
                variation.xi[0][i] = by_s * (xi_b - xi_a);
                variation.eta[0][i] = by_theta * (eta_d - eta_c);
                variation.weight[i] = (by_high[i] - by_low[i]) * (weight * (xi_b - xi_a));
            }
        }
        visit(&on, &variation);
    }
}

/// Projection of an end of the target onto the contactor.
struct End<const D: usize> {
    /// Coordinate along the contactor line, 0 and 1 at its ends.
    s: f64,
    /// From the contactor's first end \[m\].
    offset: Vector<D>,
}

fn place<const D: usize>(y: &Vector<D>, a: &Vector<D>, along: &Vector<D>, square: f64) -> End<D> {
    let offset = y - a;
    End { s: offset.dot(along) / square, offset }
}

impl<const D: usize> End<D> {
    /// `ds/dz`, where the end is corner `own`.
    fn by_corners(&self, own: usize, along: &Vector<D>, square: f64) -> ByCorners<D> {
        let mut by = none();
        let by_end = along / square;
        let by_along = (self.offset - along * (2.0 * self.s)) / square;
        by[own] = by_end;
        by[1] = by_along;
        by[0] = -by_end - by_along;
        by
    }
}

fn none<const D: usize>() -> ByCorners<D> {
    [Vector::zeros(); super::segment::CORNERS]
}

/// Gauss points on `[0, 1]` with weights of sum 1, exact to `degree`.
pub(super) fn rule(degree: usize) -> &'static [(f64, f64)] {
    static RULES: LazyLock<Vec<Vec<(f64, f64)>>> = LazyLock::new(|| {
        let on_unit = |rule: Rule| {
            rule.points.iter().zip(rule.weights).map(|(x, w)| (0.5 + 0.5 * x[0], 0.5 * w)).collect()
        };
        (0..=MOST_DEGREE).map(|degree| on_unit(Rule::tensor(1, degree))).collect()
    });
    &RULES[degree.min(MOST_DEGREE)]
}

const MOST_DEGREE: usize = 7;
