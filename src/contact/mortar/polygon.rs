//! Overlap of two plane pieces in space: a convex polygon in the plane of the contactor's piece,
//! divided into triangles.
//!
//! The plane has the normal of the contactor's piece at its centre, and both pieces are projected
//! onto it. A point in the plane is a function of the 16 coordinates of 8 projected corners. Let
//! `e_k` be the axes, `m` the normal and `h` the height of a corner above the plane. A corner that
//! moves by `dx` moves by `e_k . dx - h e_k . dm` in the plane, because the axes follow the normal.
//! A common motion of all corners in the plane changes nothing.

use std::sync::LazyLock;

use super::clip::{ByFlat, Flat, Polygon, PolygonVertex, cross, sub};
use super::parametric::Parametric;
use super::segment::{ByCorners, CORNERS, PlacedPiece, PointVariation, SegmentPoint, TARGET, Want};
use super::split::MOST_CORNERS;
use crate::space::{Rule, area_variation, facet_normal};
use crate::tensor::{Tensor, Vector, tangential_projector};

/// See [`super::intersection::overlap`].
pub(super) fn overlap<const D: usize>(
    contactor: &PlacedPiece<'_, D>,
    target: &PlacedPiece<'_, D>,
    degree: usize,
    want: Want,
    visit: &mut impl FnMut(&SegmentPoint<D>, &PointVariation<D>),
) {
    let Some(plane) = Plane::of(contactor, target) else { return };
    let (count, others) = (contactor.piece.corners.len(), target.piece.corners.len());
    let polygon = Polygon::of(&plane.flat, count, others);
    let Some((root, rest)) = polygon.vertices().split_first() else { return };
    let below = Parametric::of(contactor.piece, &plane.flat[..count]);
    let above = Parametric::of(target.piece, &plane.flat[TARGET..][..others]);
    let mut variation = PointVariation::default();
    for pair in rest.windows(2) {
        let triangle = Triangle { vertices: [root, &pair[0], &pair[1]] };
        let area = triangle.area();
        if area.is_nan() || area <= 0.0 {
            continue;
        }
        let motion = (want == Want::Variations).then(|| triangle.variation(&plane.flat));
        for (barycentric, weight) in rule(degree) {
            let place = triangle.place(barycentric);
            let (Some(under), Some(over)) = (below.inverse(place), above.inverse(place)) else { continue };
            // A piece that is so warped that it folds in the plane has no inverse there.
            if under.determinant <= 0.0 || over.determinant >= 0.0 {
                continue;
            }
            let weight = weight * area * contactor.piece.scale / under.determinant;
            let on = SegmentPoint { xi: below.facet_point(&under), eta: above.facet_point(&over), weight };
            if let Some(motion) = &motion {
                let by_place = motion.place(barycentric);
                let by_under = below.variation(&under, &by_place, 0);
                let by_over = above.variation(&over, &by_place, TARGET);
                let by_determinant = below.determinant_variation(&under, &by_under, 0);
                let mut by_weight = [0.0; 2 * CORNERS];
                for (i, by) in by_weight.iter_mut().enumerate() {
                    *by = weight * (motion.area[i] / area - by_determinant[i] / under.determinant);
                }
                let by_xi = below.facet_variation(&under, &by_under);
                let by_eta = above.facet_variation(&over, &by_over);
                variation.xi = by_xi.map(|by| plane.lift(&by, count, others));
                variation.eta = by_eta.map(|by| plane.lift(&by, count, others));
                variation.weight = plane.lift(&by_weight, count, others);
            }
            visit(&on, &variation);
        }
    }
}

/// The plane of a contactor's piece, with both pieces projected onto it.
struct Plane<const D: usize> {
    axes: [Vector<D>; 2],
    /// Coordinates of all corners \[m\].
    flat: [Flat; CORNERS],
    /// Their heights above the plane \[m\].
    heights: [f64; CORNERS],
    /// `dm/dx` by the corners of the contactor's piece \[1/m\].
    turn: [Tensor<D>; MOST_CORNERS],
}

impl<const D: usize> Plane<D> {
    /// `None` if the contactor's piece has no area.
    fn of(contactor: &PlacedPiece<'_, D>, target: &PlacedPiece<'_, D>) -> Option<Self> {
        let count = contactor.piece.corners.len();
        let slopes: &[[f64; 2]] = match count {
            3 => &[[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]],
            _ => &[[-0.25, -0.25], [0.25, -0.25], [0.25, 0.25], [-0.25, 0.25]],
        };
        let corners = &contactor.corners[..count];
        let tangents = [0, 1].map(|k| corners.iter().zip(slopes).map(|(x, s)| x * s[k]).sum::<Vector<D>>());
        let vector_area = facet_normal(&tangents);
        let size = vector_area.norm();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let normal = vector_area / size;
        let first = tangents[0] / tangents[0].norm();
        let axes = [first, facet_normal(&[normal, first])];
        let projector = tangential_projector(&normal) / size;
        let mut turn = [Tensor::zeros(); MOST_CORNERS];
        for (turn, slope) in turn.iter_mut().zip(slopes) {
            *turn = projector * area_variation(&tangents, slope);
        }
        let origin = corners.iter().sum::<Vector<D>>() / count as f64;
        let mut flat = [[0.0; 2]; CORNERS];
        let mut heights = [0.0; CORNERS];
        let others = target.corners.iter().take(target.piece.corners.len());
        let placed = corners.iter().enumerate().chain((TARGET..).zip(others));
        for (corner, x) in placed {
            let offset = x - origin;
            flat[corner] = [axes[0].dot(&offset), axes[1].dot(&offset)];
            heights[corner] = normal.dot(&offset);
        }
        Some(Self { axes, flat, heights, turn })
    }

    /// Derivatives by the positions of the corners, from those by their coordinates in the plane.
    fn lift(&self, by_flat: &ByFlat, count: usize, others: usize) -> ByCorners<D> {
        let mut by = [Vector::zeros(); CORNERS];
        let mut by_normal = Vector::zeros();
        for corner in (0..count).chain(TARGET..TARGET + others) {
            let along = self.axes[0] * by_flat[2 * corner] + self.axes[1] * by_flat[2 * corner + 1];
            by_normal -= along * self.heights[corner];
            by[corner] = along;
        }
        for (by, turn) in by.iter_mut().zip(&self.turn).take(count) {
            *by += turn.transpose() * by_normal;
        }
        by
    }
}

/// A triangle of the fan around the first vertex of the overlap.
struct Triangle<'a> {
    vertices: [&'a PolygonVertex; 3],
}

/// Variation of a triangle.
struct TriangleVariation {
    /// Derivatives of the coordinates of its vertices.
    vertices: [[ByFlat; 2]; 3],
    /// Derivatives of its area \[m\].
    area: ByFlat,
}

impl Triangle<'_> {
    fn area(&self) -> f64 {
        let [a, b, c] = self.vertices.map(|vertex| vertex.place);
        0.5 * cross(sub(b, a), sub(c, a))
    }

    fn place(&self, barycentric: &[f64; 3]) -> Flat {
        [0, 1].map(|k| (0..3).map(|i| barycentric[i] * self.vertices[i].place[k]).sum())
    }

    fn variation(&self, flat: &[Flat; CORNERS]) -> TriangleVariation {
        let vertices = self.vertices.map(|vertex| vertex.variation(flat));
        let mut area = [0.0; 2 * CORNERS];
        for i in 0..3 {
            // The opposite side, rotated: d(area) = (side x dv) / 2.
            let side = sub(self.vertices[(i + 2) % 3].place, self.vertices[(i + 1) % 3].place);
            for (area, (x, y)) in area.iter_mut().zip(vertices[i][0].iter().zip(&vertices[i][1])) {
                *area += 0.5 * (side[0] * y - side[1] * x);
            }
        }
        TriangleVariation { vertices, area }
    }
}

impl TriangleVariation {
    fn place(&self, barycentric: &[f64; 3]) -> [ByFlat; 2] {
        let mut by = [[0.0; 2 * CORNERS]; 2];
        for (vertex, share) in self.vertices.iter().zip(barycentric) {
            for (by, vertex) in by.iter_mut().zip(vertex) {
                by.iter_mut().zip(vertex).for_each(|(by, v)| *by += share * v);
            }
        }
        by
    }
}

/// A point in barycentric coordinates with its weight.
type Barycentric = ([f64; 3], f64);

/// Points of a triangle with weights of sum 1, exact to `degree`.
fn rule(degree: usize) -> &'static [Barycentric] {
    static RULES: LazyLock<Vec<Vec<Barycentric>>> = LazyLock::new(|| {
        let barycentric = |rule: Rule| {
            let points = rule.points.iter().zip(rule.weights);
            points.map(|(x, w)| ([1.0 - x[0] - x[1], x[0], x[1]], 2.0 * w)).collect()
        };
        (0..=MOST_DEGREE).map(|degree| barycentric(Rule::simplex(2, degree))).collect()
    });
    &RULES[degree.min(MOST_DEGREE)]
}

const MOST_DEGREE: usize = 7;
