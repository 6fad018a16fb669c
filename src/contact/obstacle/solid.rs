//! Volume, centroid and second moments of the solids that shapes describe (theory, section 1.13).

use std::f64::consts::PI;

use super::piece::Piece;
use crate::tensor::{Tensor, Vector, cross};

/// Volume and moments of a solid. In 2D, the area and its moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolidMoments<const D: usize> {
    /// Volume `V` \[m3\], in 2D the area \[m2\].
    pub volume: f64,
    /// Centroid `c` \[m\].
    pub centroid: Vector<D>,
    /// `S`, the integral of `(x - c) (x - c)^T` over the solid \[m5\], in 2D \[m4\].
    pub second: Tensor<D>,
}

impl<const D: usize> SolidMoments<D> {
    /// Tensor of inertia per density about the centroid, the integral of `|y|^2 1 - y y^T` with
    /// `y = x - c`. In 2D only the entry about z differs from zero.
    pub fn inertia(&self) -> Tensor<3> {
        let trace = self.second.trace();
        if D == 2 {
            return Tensor::<3>::from_diagonal(&Vector::<3>::new(0.0, 0.0, trace));
        }
        Tensor::<3>::from_fn(|i, j| if i == j { trace } else { 0.0 } - self.second[(i, j)])
    }

    /// From moments about a point `origin` \[m\]: the volume, the integral of `x - origin`, and that
    /// of its dyadic square.
    fn about(origin: Vector<D>, volume: f64, first: Vector<D>, square: Tensor<D>) -> Self {
        let arm = first / volume;
        Self { volume, centroid: origin + arm, second: square - first * arm.transpose() }
    }
}

/// Volume of the ball of this dimension and radius, and the integrals of `|y_i|` and `y_i^2` over it.
fn ball(dimension: usize, radius: f64) -> [f64; 3] {
    let r = radius;
    match dimension {
        0 => [1.0, 0.0, 0.0],
        1 => [2.0 * r, r.powi(2), 2.0 / 3.0 * r.powi(3)],
        2 => [PI * r.powi(2), 4.0 / 3.0 * r.powi(3), 0.25 * PI * r.powi(4)],
        _ => [4.0 / 3.0 * PI * r.powi(3), 0.5 * PI * r.powi(4), 4.0 / 15.0 * PI * r.powi(5)],
    }
}

/// All points at a distance of at most `radius` from a box with these half edge lengths \[m\], whose
/// axes are the columns of `rotation`. A half length may be zero: a ball and a capsule are such
/// solids.
///
/// The solid is divided by the coordinates that lie beyond the box. In the others a part extends
/// over the box, and its section is a ball that the box has cut apart.
pub(super) fn rounded_box<const D: usize>(
    centroid: Vector<D>,
    half: &Vector<D>,
    radius: f64,
    rotation: &Tensor<D>,
) -> SolidMoments<D> {
    let mut volume = 0.0;
    let mut square = Vector::<D>::zeros();
    for beyond in 0..1_usize << D {
        let is_beyond = |i: usize| beyond >> i & 1 == 1;
        let [section, mean, spread] = ball(beyond.count_ones() as usize, radius);
        let length: f64 = (0..D).filter(|&i| !is_beyond(i)).map(|i| 2.0 * half[i]).product();
        volume += length * section;
        for i in 0..D {
            let h = half[i];
            square[i] += length
                * if is_beyond(i) {
                    section * h * h + 2.0 * h * mean + spread
                } else {
                    section * h * h / 3.0
                };
        }
    }
    let second = rotation * Tensor::from_diagonal(&square) * rotation.transpose();
    SolidMoments { volume, centroid, second }
}

/// Solid of revolution about this unit axis, with the second moments along it and in every direction
/// across it \[m5\].
fn revolved<const D: usize>(
    centroid: Vector<D>,
    axis: &Vector<D>,
    volume: f64,
    along: f64,
    across: f64,
) -> SolidMoments<D> {
    let second = Tensor::identity() * across + axis * axis.transpose() * (along - across);
    SolidMoments { volume, centroid, second }
}

/// Ring of circular section with this unit axis.
pub(super) fn ring<const D: usize>(
    centroid: Vector<D>,
    axis: &Vector<D>,
    ring: f64,
    tube: f64,
) -> SolidMoments<D> {
    let volume = 2.0 * PI.powi(2) * ring * tube * tube;
    let along = 0.25 * volume * tube * tube;
    let across = volume * (0.5 * ring * ring + 0.375 * tube * tube);
    revolved(centroid, axis, volume, along, across)
}

/// Sums the moments of a solid over its surface by the divergence theorem.
///
/// With `y = x - origin` and the outward vector area `n dA`, the volume is the integral of `y . n /
/// D`, the first moment that of `y (y . n) / (D + 1)`, and the second that of `y y^T (y . n) / (D +
/// 2)`: a surface element and the origin span a cone. The origin is best near the solid.
#[derive(Debug)]
pub(super) struct SurfaceSums<const D: usize> {
    origin: Vector<D>,
    volume: f64,
    first: Vector<D>,
    square: Tensor<D>,
}

/// Points and weights of Gauss's rule of five points on [0, 1], exact to degree nine.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_0, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_24),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_24),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

impl<const D: usize> SurfaceSums<D> {
    pub fn about(origin: Vector<D>) -> Self {
        Self { origin, volume: 0.0, first: Vector::zeros(), square: Tensor::zeros() }
    }

    /// Adds a point of the surface with its outward vector area.
    fn add(&mut self, x: &Vector<D>, area: &Vector<D>) {
        let y = x - self.origin;
        let cone = y.dot(area);
        let dimension = D as f64;
        self.volume += cone / dimension;
        self.first += y * (cone / (dimension + 1.0));
        self.square += y * y.transpose() * (cone / (dimension + 2.0));
    }

    /// The moments of the solid.
    pub fn finish(self) -> SolidMoments<D> {
        SolidMoments::about(self.origin, self.volume, self.first, self.square)
    }
}

/// Calls `add` with points of an outline and their outward vector areas in the plane, by Gauss's rule.
fn sample_outline(pieces: &[Piece], mut add: impl FnMut(&Vector<2>, &Vector<2>)) {
    /// Largest angle of a part of an arc \[rad\]. Five points integrate the functions of the angle,
    /// whose largest frequency is four, over it to 1e-15; over twice of it to 1e-13.
    const PART: f64 = 0.2;
    for piece in pieces {
        match *piece {
            Piece::Line { from, to } => {
                let way = to - from;
                let right = Vector::<2>::new(way[1], -way[0]);
                for (t, weight) in GAUSS {
                    add(&(from + way * t), &(right * weight));
                }
            }
            Piece::Arc { centre, radius, from, to } => {
                let parts = ((to - from) / PART).ceil().max(1.0);
                let step = (to - from) / parts;
                for part in 0..parts as u32 {
                    for (t, weight) in GAUSS {
                        let (sine, cosine) = (from + (f64::from(part) + t) * step).sin_cos();
                        let normal = Vector::<2>::new(cosine, sine);
                        add(&(centre + normal * radius), &(normal * (radius * step * weight)));
                    }
                }
            }
        }
    }
}

/// Mean of the starts of lines and the centres of arcs \[m\].
fn middle_of(pieces: &[Piece]) -> Vector<2> {
    let points = pieces.iter().map(|piece| match *piece {
        Piece::Line { from, .. } => from,
        Piece::Arc { centre, .. } => centre,
    });
    points.sum::<Vector<2>>() / pieces.len().max(1) as f64
}

/// Moments of the region of the plane within a closed outline.
pub(super) fn moments_of_section(pieces: &[Piece]) -> SolidMoments<2> {
    let mut sums = SurfaceSums::<2>::about(middle_of(pieces));
    sample_outline(pieces, |x, area| sums.add(x, area));
    sums.finish()
}

/// Moments of the solid of revolution whose section beside the axis has this outline. Its points are
/// the distance from the axis and the position along the unit vector `axis` from `point` \[m\]. The
/// outline is closed, or open between two points of the axis.
///
/// An element of the outline sweeps a ring. The sums are those of `SurfaceSums<3>` with the origin on
/// the axis.
pub(super) fn moments_of_revolution<const D: usize>(
    pieces: &[Piece],
    point: &Vector<D>,
    axis: &Vector<D>,
) -> SolidMoments<D> {
    let origin = middle_of(pieces)[1];
    let [mut volume, mut first, mut along, mut across] = [0.0; 4];
    sample_outline(pieces, |x, area| {
        let [r, z] = [x[0], x[1] - origin];
        let cone = 2.0 * PI * r * (r * area[0] + z * area[1]);
        volume += cone / 3.0;
        first += z * cone / 4.0;
        along += z * z * cone / 5.0;
        // Two directions across the axis share the square of the distance.
        across += 0.5 * r * r * cone / 5.0;
    });
    let height = first / volume;
    revolved(point + axis * (origin + height), axis, volume, along - first * height, across)
}

impl SurfaceSums<3> {
    /// Adds a patch over `u, v >= 0, u + v <= 1`: `at` gives its point and its derivatives by `u` and
    /// `v`, whose cross product is outward. Exact for points that are quadratic in `u` and `v`.
    pub fn add_patch(&mut self, at: impl Fn(f64, f64) -> (Vector<3>, [Vector<3>; 2])) {
        // A square that is folded to the triangle: one more degree in the first coordinate.
        for (u, first) in GAUSS {
            for (fraction, second) in GAUSS {
                let (x, [by_u, by_v]) = at(u, (1.0 - u) * fraction);
                self.add(&x, &(cross(&by_u, &by_v) * (first * second * (1.0 - u))));
            }
        }
    }
}

#[cfg(test)]
mod tests;
