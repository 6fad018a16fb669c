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

/// A corner within this distance of an edge, relative to the length of the edge, lies on it: the
/// crossing of nearly parallel edges is ill-conditioned. The overlap is wrong by at most as much.
/// With a ten times smaller value the derivatives of such crossings lose one more digit.
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
    fn clip(&self, flat: &[Flat; CORNERS], i: usize, count: usize, kept: &mut Self) {
        let next = (i + 1) % count;
        let along = sub(flat[next], flat[i]);
        let length = dot(along, along).sqrt();
        let side = |vertex: &PolygonVertex| cross(along, sub(vertex.place, flat[i])) / length;
        let tolerance = ON_EDGE * length;
        let ends = [i, next].map(|corner| corner as u8);
        kept.count = 0;
        for k in 0..self.count {
            let this = &self.vertices[k];
            let that = &self.vertices[(k + 1) % self.count];
            let (here, there) = (side(this), side(that));
            let (inside, goes_in) = (here >= -tolerance, there >= -tolerance);
            let crossing = |edge| {
                let origin = match this.edge {
                    Edge::Target(target) => Origin::Crossing { contactor: ends, target },
                    // Two edges of the contactor meet in their common corner.
                    Edge::Contactor(other) if (usize::from(other) + 1) % count == i => {
                        Origin::Corner(ends[0])
                    }
                    Edge::Contactor(_) => Origin::Corner(ends[1]),
                };
                let place = match origin {
                    Origin::Corner(corner) => flat[usize::from(corner)],
                    Origin::Crossing { .. } => {
                        let part = here / (here - there);
                        [0, 1].map(|c| this.place[c] + part * (that.place[c] - this.place[c]))
                    }
                };
                PolygonVertex { place, origin, edge }
            };
            match (inside, goes_in) {
                (true, true) => kept.push(*this),
                // A vertex on the edge, where the polygon turns onto the edge.
                (true, false) if here <= tolerance => {
                    kept.push(PolygonVertex { edge: Edge::Contactor(ends[0]), ..*this })
                }
                (true, false) => {
                    kept.push(*this);
                    kept.push(crossing(Edge::Contactor(ends[0])));
                }
                (false, true) if there > tolerance => kept.push(crossing(this.edge)),
                (false, _) => {}
            }
        }
        if kept.count < 3 {
            kept.count = 0;
        }
    }
}

impl PolygonVertex {
    /// Adds the derivatives of both coordinates to `by`.
    pub fn vary(&self, flat: &[Flat; CORNERS], by: &mut [ByFlat; 2]) {
        match self.origin {
            Origin::Corner(corner) => (0..2).for_each(|c| by[c][2 * usize::from(corner) + c] = 1.0),
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
