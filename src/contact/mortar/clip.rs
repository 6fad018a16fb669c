//! Overlap of two convex polygons in the plane. Every vertex has a known origin, so that it can be
//! differentiated.
//!
//! Sutherland-Hodgman algorithm: the target polygon is clipped by each edge of the contactor
//! polygon in turn. A vertex is a corner of either polygon or the crossing of two edges. Numerical
//! comparison decides which one, and the derivative follows from that.

use super::segment::{CORNERS, TARGET};

/// Coordinates of a point in the plane \[m\].
pub(super) type Flat = [f64; 2];

/// Derivatives of a scalar by the coordinates of all projected corners: `corner * 2 + component`.
pub(super) type ByFlat = [f64; 2 * CORNERS];

/// A vertex within this distance of an edge of the contactor, relative to the length of the edge, lies
/// on it, and moves with it: the crossing of nearly parallel edges is ill-conditioned. The overlap is
/// wrong by at most as much. With a ten times smaller value the derivatives of such crossings lose one
/// more digit.
pub(super) const ON_EDGE: f64 = 1e-11;

/// Maximum number of vertices in the overlap of two quadrilaterals, with a margin for ties.
pub(super) const MOST_VERTICES: usize = 12;

/// Origin of a vertex of the overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// A corner of the contactor's or of the target's piece, numbered as in [`ByFlat`].
    Corner(u8),
    /// The crossing of an edge of the contactor with one of the target, each by its two corners.
    Crossing { contactor: [u8; 2], target: [u8; 2] },
    /// A corner of the target on an edge of the contactor: it slides along the edge, and moves with it.
    OnEdge { contactor: [u8; 2], corner: u8 },
}

/// Position of a vertex relative to an edge of the contactor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    In,
    On,
    Out,
}

/// The edge from a vertex of the overlap to the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Edge {
    /// From this corner of the contactor to its next one.
    Contactor(u8),
    /// Between these corners of the target.
    Target([u8; 2]),
}

/// A vertex of the overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PolygonVertex {
    /// Coordinates of the vertex.
    pub place: Flat,
    origin: Origin,
    edge: Edge,
}

/// The overlap of two pieces in the plane, anticlockwise. It has no vertices if the pieces do not
/// overlap.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    vertices: [PolygonVertex; MOST_VERTICES],
    count: usize,
}

impl Polygon {
    /// The overlap of the contactor's `count` corners (anticlockwise) with the target's `others`
    /// corners (clockwise); see [`TARGET`].
    pub fn of(flat: &[Flat; CORNERS], count: usize, others: usize) -> Self {
        let mut polygon = Self::nothing();
        let seen = -area(&flat[TARGET..][..others]);
        if seen.is_nan() || seen <= 0.0 {
            return polygon;
        }
        for j in (0..others).rev() {
            let next = (j + others - 1) % others;
            let ends = [TARGET + j, TARGET + next].map(|corner| corner as u8);
            let origin = Origin::Corner(ends[0]);
            polygon.push(PolygonVertex { place: flat[TARGET + j], origin, edge: Edge::Target(ends) });
        }
        let mut other = Self::nothing();
        let (mut whole, mut kept) = (&mut polygon, &mut other);
        for i in 0..count {
            whole.clip(flat, i, count, kept);
            (whole, kept) = (kept, whole);
            if whole.count == 0 {
                break;
            }
        }
        *whole
    }

    fn nothing() -> Self {
        let vertex = PolygonVertex { place: [0.0; 2], origin: Origin::Corner(0), edge: Edge::Contactor(0) };
        Self { vertices: [vertex; MOST_VERTICES], count: 0 }
    }

    /// The vertices.
    pub fn vertices(&self) -> &[PolygonVertex] {
        &self.vertices[..self.count]
    }

    fn push(&mut self, vertex: PolygonVertex) {
        if let Some(free) = self.vertices.get_mut(self.count) {
            *free = vertex;
            self.count += 1;
        }
    }

    /// Stores the part on the inner side of the contactor's edge from corner `i` in `kept`.
    ///
    /// An edge of the target on that edge is replaced by it. Facets of the target that share such an
    /// edge then divide the contactor without a gap, and so do the derivatives of their parts.
    fn clip(&self, flat: &[Flat; CORNERS], i: usize, count: usize, kept: &mut Self) {
        let next = (i + 1) % count;
        let along = sub(flat[next], flat[i]);
        let length = dot(along, along).sqrt();
        let tolerance = ON_EDGE * length;
        let ends = [i, next].map(|corner| corner as u8);
        let distance = |k: usize| cross(along, sub(self.vertices[k].place, flat[i])) / length;
        let side = |distance: f64| match distance {
            _ if distance > tolerance => Side::In,
            _ if distance >= -tolerance => Side::On,
            _ => Side::Out,
        };
        kept.count = 0;
        let mut before = if self.count == 0 { Side::Out } else { side(distance(self.count - 1)) };
        for k in 0..self.count {
            let this = &self.vertices[k];
            let that = (k + 1) % self.count;
            let (here, there) = (distance(k), distance(that));
            let crossing = |edge| {
                let between = || {
                    let part = here / (here - there);
                    let that = &self.vertices[that];
                    [0, 1].map(|c| this.place[c] + part * (that.place[c] - this.place[c]))
                };
                let corner = |corner: u8| (flat[usize::from(corner)], Origin::Corner(corner));
                let (place, origin) = match this.edge {
                    Edge::Target(target) => (between(), Origin::Crossing { contactor: ends, target }),
                    // Two adjacent edges of the contactor meet in their common corner.
                    Edge::Contactor(other) if (usize::from(other) + 1) % count == i => corner(ends[0]),
                    Edge::Contactor(other) if usize::from(other) == next => corner(ends[1]),
                    // Opposite edges meet outside the contactor. The edge between them cuts this vertex off.
                    Edge::Contactor(_) => (between(), Origin::Corner(ends[1])),
                };
                PolygonVertex { place, origin, edge }
            };
            let now = side(here);
            match (now, side(there)) {
                (Side::In, Side::Out) => {
                    kept.push(*this);
                    kept.push(crossing(Edge::Contactor(ends[0])));
                }
                (Side::In, _) => kept.push(*this),
                (Side::On, Side::In) => kept.push(this.on_edge(flat, ends, this.edge)),
                (Side::On, _) if before == Side::In => {
                    kept.push(this.on_edge(flat, ends, Edge::Contactor(ends[0])));
                }
                (Side::Out, Side::In) => kept.push(crossing(this.edge)),
                (Side::On | Side::Out, _) => {}
            }
            before = now;
        }
        if kept.count < 3 {
            kept.count = 0;
        }
    }
}

impl PolygonVertex {
    /// A vertex on the contactor's edge between the corners `ends`, followed by `edge`. If it also lies
    /// on an adjacent edge of the contactor, at an angle of 3e-6 or more, it is the common corner.
    fn on_edge(&self, flat: &[Flat; CORNERS], ends: [u8; 2], edge: Edge) -> Self {
        let place = |corner: u8| flat[usize::from(corner)];
        match self.origin {
            Origin::Corner(corner) if usize::from(corner) >= TARGET => {
                Self { origin: Origin::OnEdge { contactor: ends, corner }, edge, ..*self }
            }
            Origin::Crossing { contactor, .. } | Origin::OnEdge { contactor, .. } => {
                let along = sub(place(ends[1]), place(ends[0]));
                let is_at = |corner: &u8| {
                    let apart = sub(self.place, place(*corner));
                    dot(apart, apart) <= ON_EDGE * dot(along, along)
                };
                let common = contactor.into_iter().find(|corner| ends.contains(corner) && is_at(corner));
                let at_corner = |corner| Self { place: place(corner), origin: Origin::Corner(corner), edge };
                common.map_or(Self { edge, ..*self }, at_corner)
            }
            Origin::Corner(_) => Self { edge, ..*self },
        }
    }

    /// Adds the derivatives of both coordinates to `by`.
    pub fn vary(&self, flat: &[Flat; CORNERS], by: &mut [ByFlat; 2]) {
        match self.origin {
            Origin::Corner(corner) => (0..2).for_each(|c| by[c][2 * usize::from(corner) + c] = 1.0),
            Origin::OnEdge { contactor, corner } => {
                let ends = contactor.map(usize::from);
                let corner = usize::from(corner);
                let u = sub(flat[ends[1]], flat[ends[0]]);
                let square = dot(u, u);
                let part = dot(sub(self.place, flat[ends[0]]), u) / square;
                let across = [-u[1], u[0]];
                for (c, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    by[c][2 * corner + k] += u[c] * u[k] / square;
                    let with_edge = across[c] * across[k] / square;
                    by[c][2 * ends[0] + k] += with_edge * (1.0 - part);
                    by[c][2 * ends[1] + k] += with_edge * part;
                }
            }
            Origin::Crossing { contactor, target } => {
                let [contactor, target] = [contactor, target].map(|ends| ends.map(usize::from));
                // The crossing stays on both lines: u x dX = u x dP and v x dX = v x dQ for the
                // points P, Q of the two edges there.
                let u = sub(flat[contactor[1]], flat[contactor[0]]);
                let v = sub(flat[target[1]], flat[target[0]]);
                let sine = cross(u, v);
                for (edge, direction, other) in [(contactor, u, v), (target, v, u)] {
                    let sign = if edge == contactor { 1.0 } else { -1.0 };
                    let part = dot(sub(self.place, flat[edge[0]]), direction) / dot(direction, direction);
                    for (corner, share) in [(edge[0], 1.0 - part), (edge[1], part)] {
                        // dX = other * (direction x dP) / sine, direction x dP = d_0 dP_1 - d_1
                        // dP_0.
                        for c in 0..2 {
                            let factor = sign * share * other[c] / sine;
                            by[c][2 * corner] -= factor * direction[1];
                            by[c][2 * corner + 1] += factor * direction[0];
                        }
                    }
                }
            }
        }
    }
}

/// Area of a polygon, > 0 anticlockwise.
pub(super) fn area(corners: &[Flat]) -> f64 {
    let Some(&origin) = corners.first() else { return 0.0 };
    0.5 * corners.windows(2).map(|pair| cross(sub(pair[0], origin), sub(pair[1], origin))).sum::<f64>()
}

/// `a x b`.
pub(super) fn cross(a: Flat, b: Flat) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// `a - b`.
pub(super) fn sub(a: Flat, b: Flat) -> Flat {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Flat, b: Flat) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::scatter;

    /// Area of the overlap by Sutherland-Hodgman clipping of coordinates alone.
    fn plain(contactor: &[Flat], target: &[Flat]) -> f64 {
        let mut polygon: Vec<Flat> = target.iter().rev().copied().collect();
        for (i, a) in contactor.iter().enumerate() {
            let along = sub(contactor[(i + 1) % contactor.len()], *a);
            let side = |x: Flat| cross(along, sub(x, *a));
            let mut kept = Vec::new();
            for (k, this) in polygon.iter().enumerate() {
                let that = polygon[(k + 1) % polygon.len()];
                let (here, there) = (side(*this), side(that));
                if here >= 0.0 {
                    kept.push(*this);
                }
                if (here >= 0.0) != (there >= 0.0) {
                    let part = here / (here - there);
                    kept.push([0, 1].map(|c| this[c] + part * (that[c] - this[c])));
                }
            }
            polygon = kept;
        }
        area(&polygon)
    }

    fn is_convex(corners: &[Flat], sign: f64) -> bool {
        let count = corners.len();
        (0..count).all(|i| {
            let [a, b, c] = [i, i + 1, i + 2].map(|k| corners[k % count]);
            sign * cross(sub(b, a), sub(c, b)) > 1e-3
        })
    }

    /// Overlaps of tapered quadrilaterals with targets up to ten times as large, in random positions and on
    /// a grid, where edges and corners coincide: area and, off the grid, its derivative. Opposite edges
    /// of a contactor meet within a large target.
    #[test]
    fn overlaps_have_the_area_of_plain_clipping() {
        let unit = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let (mut tried, mut overlapping) = (0, 0);
        for seed in 0..6000 {
            let noise = scatter(34, seed);
            let size = [1.0, 3.0, 10.0][seed as usize % 3];
            let mut flat = [[0.0; 2]; CORNERS];
            for (corner, [x, y]) in unit.into_iter().enumerate() {
                let [dx, dy] = [noise[2 * corner], noise[2 * corner + 1]];
                flat[corner] = [x + 0.6 * dx, y + 0.6 * dy];
                let [dx, dy] = [noise[8 + 2 * corner], noise[9 + 2 * corner]];
                // The target is clockwise.
                flat[TARGET + 3 - corner] =
                    [size * (x + 0.4 * dx) + noise[16], size * (y + 0.4 * dy) + noise[17]];
            }
            let on_grid = seed % 4 == 0;
            if on_grid {
                flat.as_flattened_mut().iter_mut().for_each(|x| *x = (*x * 2.0).round() / 2.0);
            }
            if !is_convex(&flat[..4], 1.0) || !is_convex(&flat[TARGET..], -1.0) {
                continue;
            }
            tried += 1;
            let polygon = Polygon::of(&flat, 4, 4);
            let vertices = polygon.vertices();
            let places: Vec<Flat> = vertices.iter().map(|vertex| vertex.place).collect();
            let exact = plain(&flat[..4], &flat[TARGET..]);
            assert!((area(&places) - exact).abs() < 1e-9, "{seed}: {} {exact}", area(&places));
            if on_grid || exact == 0.0 {
                continue;
            }
            overlapping += 1;
            let count = places.len();
            let mut found = 0.0;
            for (k, vertex) in vertices.iter().enumerate() {
                let mut by = [[0.0; 2 * CORNERS]; 2];
                vertex.vary(&flat, &mut by);
                let [x, y] = by.map(|by| by.iter().zip(&noise[18..]).map(|(by, d)| by * d).sum::<f64>());
                let side = sub(places[(k + 1) % count], places[(k + count - 1) % count]);
                found += 0.5 * (side[1] * x - side[0] * y);
            }
            let at = |step: f64| {
                let mut moved = flat;
                moved.as_flattened_mut().iter_mut().zip(&noise[18..]).for_each(|(x, d)| *x += step * d);
                plain(&moved[..4], &moved[TARGET..])
            };
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((found - slope).abs() < 1e-5, "{seed}: {found} {slope}");
        }
        assert!(tried > 1000 && overlapping > 500, "{tried} {overlapping}");
    }
}
