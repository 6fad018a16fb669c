//! Overlap of two plane pieces in space: a convex polygon in the plane of the contactor's piece,
//! divided into triangles.
//!
//! The plane has the normal of the contactor's piece at its centre, and both pieces are projected
//! onto it. A point in the plane is a function of the 16 coordinates of 8 projected corners. Let
//! `e_k` be the axes, `m` the normal and `h` the height of a corner above the plane. A corner that
//! moves by `dx` moves by `e_k . dx - h e_k . dm` in the plane, because the axes follow the normal.
//! A common motion of all corners in the plane changes nothing.

use std::sync::LazyLock;

use super::clip::{ByFlat, Flat, MOST_VERTICES, Polygon, PolygonVertex, cross, sub};
use super::line;
use super::parametric::{Parametric, PieceVariation};
use super::segment::{ByCorners, CORNERS, PlacedPiece, PointVariation, SegmentPoint, TARGET, Want};
use super::split::MOST_CORNERS;
use crate::space::{Rule, area_variation, facet_normal};
use crate::tensor::{Vector, tangential_projector};

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
    let mut motions =
        (want != Want::Points).then(|| Motions::of(&plane, [count, others], polygon.vertices()));
    let stays = want == Want::FixedPlaces;
    let mut variation = PointVariation::default();
    for (second, pair) in rest.windows(2).enumerate() {
        let triangle = Triangle { vertices: [root, &pair[0], &pair[1]] };
        let area = triangle.area();
        if area.is_nan() || area <= 0.0 {
            continue;
        }
        match &mut motions {
            Some(motions) if stays => motions.follow(),
            Some(motions) => motions.enter(&triangle, [0, second + 1, second + 2]),
            None => {}
        }
        for (barycentric, weight) in rule(degree) {
            let place = triangle.place(barycentric);
            let (Some(under), Some(over)) = (below.inverse(place), above.inverse(place)) else { continue };
            // A piece that is so warped that it folds in the plane has no inverse there.
            if under.determinant <= 0.0 || over.determinant >= 0.0 {
                continue;
            }
            let weight = weight * area * contactor.piece.scale / under.determinant;
            let on = SegmentPoint { xi: below.facet_point(&under), eta: above.facet_point(&over), weight };
            if let Some(motions) = &mut motions {
                if !stays {
                    motions.move_to(barycentric);
                }
                below.vary(&under, &motions.place, 0, &mut motions.below);
                above.vary(&over, &motions.place, TARGET, &mut motions.above);
                let by_determinant = motions.below.determinant.iter();
                let mut by_weight = [0.0; 2 * CORNERS];
                for (by, (a, d)) in by_weight.iter_mut().zip(motions.area.iter().zip(by_determinant)) {
                    *by = weight * (a / area - d / under.determinant);
                }
                for k in 0..2 {
                    motions.lift(&motions.below.facet[k], &mut variation.xi[k]);
                    motions.lift(&motions.above.facet[k], &mut variation.eta[k]);
                }
                motions.lift(&by_weight, &mut variation.weight);
            }
            visit(&on, &variation);
        }
    }
    let Some(motions) = motions.as_mut().filter(|_| stays) else { return };
    let corners = polygon.vertices();
    for start in 0..corners.len() {
        let ends = [start, (start + 1) % corners.len()];
        let [a, b] = ends.map(|end| corners[end].place);
        let side = sub(b, a);
        let outward = [side[1], -side[0]];
        let square = side[0] * side[0] + side[1] * side[1];
        if square == 0.0 {
            continue;
        }
        // The boundary moves linearly along an edge.
        for (along, weight) in line::rule(degree + 1) {
            let place = [0, 1].map(|k| a[k] + along * side[k]);
            let (Some(under), Some(over)) = (below.inverse(place), above.inverse(place)) else { continue };
            if under.determinant <= 0.0 || over.determinant >= 0.0 {
                continue;
            }
            motions.move_halfway(ends, *along, &outward, square);
            let scale = weight * contactor.piece.scale / under.determinant;
            let by_weight = motions.swept.map(|swept| swept * scale);
            motions.lift(&by_weight, &mut variation.weight);
            below.vary(&under, &motions.place, 0, &mut motions.below);
            above.vary(&over, &motions.place, TARGET, &mut motions.above);
            for k in 0..2 {
                motions.lift(&motions.below.facet[k], &mut variation.xi[k]);
                motions.lift(&motions.above.facet[k], &mut variation.eta[k]);
            }
            let [xi, eta] = [below.facet_point(&under), above.facet_point(&over)];
            visit(&SegmentPoint { xi, eta, weight: 0.0 }, &variation);
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
    /// `m`, multiplied by `size`, which is the area of the piece in units of its reference domain
    /// \[m^2\].
    vector_area: Vector<D>,
    size: f64,
    /// Derivatives of the positions by the piece's own coordinates at its centre \[m\].
    tangents: [Vector<D>; 2],
}

impl<const D: usize> Plane<D> {
    /// `None` if the contactor's piece has no area.
    fn of(contactor: &PlacedPiece<'_, D>, target: &PlacedPiece<'_, D>) -> Option<Self> {
        let count = contactor.piece.corners.len();
        let slopes = slopes_at_centre(count);
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
        Some(Self { axes, flat, heights, vector_area, size, tangents })
    }
}

/// Derivatives of the shape functions of a piece with this number of corners at its centre.
fn slopes_at_centre(corners: usize) -> &'static [[f64; 2]] {
    match corners {
        3 => &[[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]],
        _ => &[[-0.25, -0.25], [0.25, -0.25], [0.25, 0.25], [-0.25, 0.25]],
    }
}

/// Derivatives of the vertices of an overlap, of one of its triangles and of one of its points.
struct Motions<'a, const D: usize> {
    plane: &'a Plane<D>,
    /// Numbers of corners of both pieces.
    corners: [usize; 2],
    /// Derivatives of the angles between the plane and its axes by the corners of the contactor's
    /// piece: `e_k . dm/dx` \[1/m\].
    turns: [[Vector<D>; 2]; MOST_CORNERS],
    /// Of the coordinates of every vertex.
    vertices: [[ByFlat; 2]; MOST_VERTICES],
    /// The vertices of the present triangle.
    triangle: [usize; 3],
    /// Of its area \[m\].
    area: ByFlat,
    /// Of the coordinates of the present point.
    place: [ByFlat; 2],
    /// Of the area per coordinate along an edge \[m\].
    swept: ByFlat,
    /// Of the present point on both pieces.
    below: PieceVariation,
    above: PieceVariation,
}

impl<'a, const D: usize> Motions<'a, D> {
    fn of(plane: &'a Plane<D>, corners: [usize; 2], overlap: &[PolygonVertex]) -> Self {
        let normal = plane.vector_area / plane.size;
        let projector = tangential_projector(&normal) / plane.size;
        let mut turns = [[Vector::zeros(); 2]; MOST_CORNERS];
        for (turns, slope) in turns.iter_mut().zip(slopes_at_centre(corners[0])) {
            let turn = projector * area_variation(&plane.tangents, slope);
            *turns = plane.axes.map(|axis| turn.tr_mul(&axis));
        }
        let mut vertices = [[[0.0; 2 * CORNERS]; 2]; MOST_VERTICES];
        vertices.iter_mut().zip(overlap).for_each(|(by, vertex)| vertex.vary(&plane.flat, by));
        Self {
            plane,
            corners,
            turns,
            vertices,
            triangle: [0; 3],
            area: [0.0; 2 * CORNERS],
            place: [[0.0; 2 * CORNERS]; 2],
            swept: [0.0; 2 * CORNERS],
            below: PieceVariation::default(),
            above: PieceVariation::default(),
        }
    }

    /// Computes the derivatives of a triangle with these vertices.
    fn enter(&mut self, triangle: &Triangle<'_>, vertices: [usize; 3]) {
        self.triangle = vertices;
        self.area.fill(0.0);
        for (i, vertex) in vertices.into_iter().enumerate() {
            // The opposite side, rotated: d(area) = (side x dv) / 2.
            let side = sub(triangle.vertices[(i + 2) % 3].place, triangle.vertices[(i + 1) % 3].place);
            let [x, y] = &self.vertices[vertex];
            for (area, (x, y)) in self.area.iter_mut().zip(x.iter().zip(y)) {
                *area += 0.5 * (side[0] * y - side[1] * x);
            }
        }
    }

    /// Computes the derivatives of the coordinates of a point of the triangle.
    fn move_to(&mut self, barycentric: &[f64; 3]) {
        let [a, b, c] = self.triangle.map(|vertex| &self.vertices[vertex]);
        for k in 0..2 {
            for i in 0..2 * CORNERS {
                self.place[k][i] =
                    barycentric[0] * a[k][i] + barycentric[1] * b[k][i] + barycentric[2] * c[k][i];
            }
        }
    }

    /// Lets the present point follow the centre of the contactor's piece.
    fn follow(&mut self) {
        self.place = [[0.0; 2 * CORNERS]; 2];
        let count = self.corners[0];
        for corner in 0..count {
            (0..2).for_each(|k| self.place[k][2 * corner + k] = 1.0 / count as f64);
        }
    }

    /// Computes what the edge between two vertices sweeps relative to the centre of the contactor's piece,
    /// and lets the present point follow half of its motion across the edge. `outward` is the edge, rotated
    /// outward, and `square` its square.
    fn move_halfway(&mut self, ends: [usize; 2], along: f64, outward: &Flat, square: f64) {
        self.follow();
        let [first, last] = ends.map(|end| &self.vertices[end]);
        for (i, swept) in self.swept.iter_mut().enumerate() {
            let [x, y] = [0, 1].map(|k| first[k][i] + along * (last[k][i] - first[k][i]) - self.place[k][i]);
            *swept = x * outward[0] + y * outward[1];
            (0..2).for_each(|k| self.place[k][i] += 0.5 * outward[k] * *swept / square);
        }
    }

    /// Derivatives by the positions of the corners, from those by their coordinates in the plane.
    fn lift(&self, by_flat: &ByFlat, by: &mut ByCorners<D>) {
        let [count, others] = self.corners;
        let [first, second] = self.plane.axes;
        let mut by_turn = [0.0; 2];
        for corner in (0..count).chain(TARGET..TARGET + others) {
            let [x, y] = [by_flat[2 * corner], by_flat[2 * corner + 1]];
            by[corner] = first * x + second * y;
            by_turn[0] += x * self.plane.heights[corner];
            by_turn[1] += y * self.plane.heights[corner];
        }
        for (by, turns) in by.iter_mut().zip(&self.turns).take(count) {
            *by -= turns[0] * by_turn[0] + turns[1] * by_turn[1];
        }
    }
}

/// A triangle of the fan around the first vertex of the overlap.
struct Triangle<'a> {
    vertices: [&'a PolygonVertex; 3],
}

impl Triangle<'_> {
    fn area(&self) -> f64 {
        let [a, b, c] = self.vertices.map(|vertex| vertex.place);
        0.5 * cross(sub(b, a), sub(c, a))
    }

    fn place(&self, barycentric: &[f64; 3]) -> Flat {
        [0, 1].map(|k| (0..3).map(|i| barycentric[i] * self.vertices[i].place[k]).sum())
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
