//! The map from the reference domain of a piece to the plane, and back.

use super::clip::{ByFlat, Flat, cross, sub};
use super::split::{FacetPiece, MOST_CORNERS};

/// Newton's method on a convex quadrilateral needs one or two steps from the root in closed form. If
/// more steps than this are needed, the point has no inverse in the piece.
const MOST_STEPS: usize = 20;

/// Convergence tolerance of the inverse: residual relative to the size of the piece.
const FOUND: f64 = 4e-16;

/// A piece with its corners in the plane: `p(r) = c_0 + c_1 r_1 + c_2 r_2 + c_3 r_1 r_2`.
pub(super) struct Parametric<'a> {
    piece: &'a FacetPiece,
    coefficients: [Flat; 4],
    size: f64,
}

/// A point of a piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct ParametricPoint {
    /// Shape functions of the corners.
    shape: [f64; MOST_CORNERS],
    /// Their derivatives by `r_1`, `r_2`.
    slopes: [[f64; 2]; MOST_CORNERS],
    /// `dp/dr_1`, `dp/dr_2` \[m\].
    tangents: [Flat; 2],
    /// `det(dp/dr)` \[m^2\]; negative for a target, which is seen from below.
    pub determinant: f64,
}

/// Derivatives of a point of a piece.
#[derive(Debug, Default)]
pub(super) struct PieceVariation {
    /// Of the facet coordinates [1/m].
    pub facet: [ByFlat; 2],
    /// Of the determinant \[m\].
    pub determinant: ByFlat,
}

impl<'a> Parametric<'a> {
    /// The piece with its corners at `flat` \[m\].
    pub fn of(piece: &'a FacetPiece, flat: &[Flat]) -> Self {
        let combine = |weights: &[f64]| [0, 1].map(|k| flat.iter().zip(weights).map(|(p, w)| p[k] * w).sum());
        let coefficients = match flat.len() {
            3 => [flat[0], sub(flat[1], flat[0]), sub(flat[2], flat[0]), [0.0; 2]],
            _ => [
                combine(&[0.25, 0.25, 0.25, 0.25]),
                combine(&[-0.25, 0.25, 0.25, -0.25]),
                combine(&[-0.25, -0.25, 0.25, 0.25]),
                combine(&[0.25, -0.25, 0.25, -0.25]),
            ],
        };
        let size = coefficients[1..3].iter().flatten().fold(0.0_f64, |size, c| size.max(c.abs()));
        Self { piece, coefficients, size }
    }

    /// The point of the piece at the plane coordinates `place`; `None` if Newton's method finds no
    /// such point.
    pub fn inverse(&self, place: Flat) -> Option<ParametricPoint> {
        let [c0, c1, c2, c3] = self.coefficients;
        let affine = c3[0].abs().max(c3[1].abs()) <= FOUND * self.size;
        let mut r = if affine { [0.0; 2] } else { self.root(sub(place, c0)) };
        for _ in 0..MOST_STEPS {
            let tangents =
                [[c1[0] + c3[0] * r[1], c1[1] + c3[1] * r[1]], [c2[0] + c3[0] * r[0], c2[1] + c3[1] * r[0]]];
            let rest = [0, 1].map(|k| place[k] - c0[k] - c1[k] * r[0] - c2[k] * r[1] - c3[k] * r[0] * r[1]);
            let determinant = cross(tangents[0], tangents[1]);
            let step = [cross(rest, tangents[1]) / determinant, cross(tangents[0], rest) / determinant];
            if !step.iter().all(|step| step.is_finite()) {
                return None;
            }
            r = [r[0] + step[0], r[1] + step[1]];
            if affine || step[0].abs().max(step[1].abs()) <= FOUND.sqrt() {
                return Some(self.at(r));
            }
        }
        None
    }

    /// Solution of `c_1 r_1 + c_2 r_2 + c_3 r_1 r_2 = offset` in closed form, up to cancellation. Returns
    /// the centre if there is no solution.
    ///
    /// The product with `c_1 + c_3 r_2` eliminates `r_1`. Of the two roots the one is taken that
    /// belongs to the piece, where its determinant keeps its sign.
    fn root(&self, offset: Flat) -> [f64; 2] {
        let [_, c1, c2, c3] = self.coefficients;
        let square = cross(c2, c3);
        let at_centre = cross(c2, c1);
        let linear = at_centre - cross(offset, c3);
        let constant = -cross(offset, c1);
        let discriminant = linear * linear - 4.0 * square * constant;
        let second = -2.0 * constant / (linear + discriminant.sqrt().copysign(at_centre));
        let along = [c1[0] + c3[0] * second, c1[1] + c3[1] * second];
        let rest = [offset[0] - c2[0] * second, offset[1] - c2[1] * second];
        let first = (rest[0] * along[0] + rest[1] * along[1]) / (along[0] * along[0] + along[1] * along[1]);
        if first.is_finite() && second.is_finite() { [first, second] } else { [0.0; 2] }
    }

    fn at(&self, r: [f64; 2]) -> ParametricPoint {
        let [_, c1, c2, c3] = self.coefficients;
        let mut shape = [0.0; MOST_CORNERS];
        let mut slopes = [[0.0; 2]; MOST_CORNERS];
        if self.piece.corners.len() == 3 {
            shape[..3].copy_from_slice(&[1.0 - r[0] - r[1], r[0], r[1]]);
            slopes[..3].copy_from_slice(&[[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]);
        } else {
            for (i, [a, b]) in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].into_iter().enumerate() {
                shape[i] = 0.25 * (1.0 + a * r[0]) * (1.0 + b * r[1]);
                slopes[i] = [0.25 * a * (1.0 + b * r[1]), 0.25 * b * (1.0 + a * r[0])];
            }
        }
        let tangents =
            [[c1[0] + c3[0] * r[1], c1[1] + c3[1] * r[1]], [c2[0] + c3[0] * r[0], c2[1] + c3[1] * r[0]]];
        ParametricPoint { shape, slopes, tangents, determinant: cross(tangents[0], tangents[1]) }
    }

    /// Coordinates of a point in the reference domain of the facet.
    pub fn facet_point(&self, point: &ParametricPoint) -> [f64; 2] {
        [0, 1].map(|k| self.piece.corners.iter().zip(point.shape).map(|(corner, n)| corner.at[k] * n).sum())
    }

    /// Derivatives at a point whose plane coordinates vary by `by_place`. The corners of the piece
    /// begin at `first`.
    pub fn vary(
        &self,
        point: &ParametricPoint,
        by_place: &[ByFlat; 2],
        first: usize,
        variation: &mut PieceVariation,
    ) {
        let [u, v] = point.tangents;
        let bend = self.coefficients[3];
        // The facet coordinates and the determinant as functions of `r`.
        let mut by_r = [[0.0; 2]; 3];
        let corners = &self.piece.corners;
        for (corner, slopes) in corners.iter().zip(&point.slopes) {
            for (by_r, at) in by_r.iter_mut().zip(corner.at) {
                by_r.iter_mut().zip(slopes).for_each(|(by_r, slope)| *by_r += at * slope);
            }
        }
        by_r[2] = [cross(u, bend), cross(bend, v)];
        let [xi, eta] = &mut variation.facet;
        for (by, by_r) in [xi, eta, &mut variation.determinant].into_iter().zip(by_r) {
            // `dr` is the inverse of the map, applied to the motion of the place relative to the
            // piece.
            let by_motion = [
                (by_r[0] * v[1] - by_r[1] * u[1]) / point.determinant,
                (by_r[1] * u[0] - by_r[0] * v[0]) / point.determinant,
            ];
            for (by, (x, y)) in by.iter_mut().zip(by_place[0].iter().zip(&by_place[1])) {
                *by = by_motion[0] * x + by_motion[1] * y;
            }
            for (i, shape) in point.shape.iter().enumerate().take(corners.len()) {
                by[2 * (first + i)] -= by_motion[0] * shape;
                by[2 * (first + i) + 1] -= by_motion[1] * shape;
            }
        }
        for (i, slopes) in point.slopes.iter().enumerate().take(corners.len()) {
            // cross(dP s_1, v) + cross(u, dP s_2)
            variation.determinant[2 * (first + i)] += slopes[0] * v[1] - slopes[1] * u[1];
            variation.determinant[2 * (first + i) + 1] += slopes[1] * u[0] - slopes[0] * v[0];
        }
    }
}
