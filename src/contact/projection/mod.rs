//! Closest point (2.3) on a facet of a deformable target, with its variations.
//!
//! Inside of the facet `(x - y) . a_k = 0` in all surface directions. Beyond an edge the same holds along the
//! edge alone, beyond a vertex in no direction: the *free directions* of the projection. The normal is the
//! facet's own at the projected point, and the gap `(x - y) . n`, also beyond an edge; one set of formulas serves.

mod newton;
mod polynomial;
mod second;
mod spin;
#[cfg(test)]
mod tests;

use newton::{LARGEST, minimise, solve};
use polynomial::{Polynomial, View};

use super::geometry::NodeVariation;
use crate::mesh::ElementKind;
use crate::space::{facet_normal, reference};
use crate::tensor::{Tensor, Vector};

/// A point this far (reference coordinates) outside of a facet still counts as on it.
const SLACK: f64 = 1e-12;

/// The part of a facet that carries a projection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The facet itself.
    Interior,
    /// In space, the edge from this corner to the next one.
    Edge(u8),
    /// This corner; in the plane the only alternative to the interior.
    Corner(u8),
}

/// Variation of the projection by one position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectionVariation<const D: usize> {
    /// `dg` \[-\].
    pub gap: Vector<D>,
    /// `dn` \[1/m\].
    pub normal: Tensor<D>,
    /// `dxi^k` \[1/m\].
    pub coordinates: [Vector<D>; 2],
}

/// A straight line in the reference domain along which a projection may move.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    start: [f64; 2],
    end: [f64; 2],
}

/// Where a point projects onto a facet.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection<const D: usize> {
    /// `theta`: reference coordinates on the facet, the second zero in the plane.
    pub coordinates: [f64; 2],
    /// `x_p` \[m\].
    pub point: Vector<D>,
    /// `g = (x - x_p) . n` \[m\].
    pub gap: f64,
    /// `|x - x_p|` \[m\]; larger than `|g|` beyond an edge.
    pub distance: f64,
    /// `n` of the facet at `x_p`, outward from its element.
    pub normal: Vector<D>,
    /// What of the facet is nearest.
    pub place: Place,
    free: [[f64; 2]; 2],
    frees: usize,
    kind: ElementKind,
    facet: View<D>,
}

/// Edges of the reference domain; in the plane its two ends, as lines without length.
fn border(kind: ElementKind) -> &'static [Line] {
    const fn line(start: [f64; 2], end: [f64; 2]) -> Line {
        Line { start, end }
    }
    const ENDS: [Line; 2] = [line([-1.0, 0.0], [-1.0, 0.0]), line([1.0, 0.0], [1.0, 0.0])];
    const TRIANGLE: [Line; 3] =
        [line([0.0, 0.0], [1.0, 0.0]), line([1.0, 0.0], [0.0, 1.0]), line([0.0, 1.0], [0.0, 0.0])];
    const SQUARE: [Line; 4] = [
        line([-1.0, -1.0], [1.0, -1.0]),
        line([1.0, -1.0], [1.0, 1.0]),
        line([1.0, 1.0], [-1.0, 1.0]),
        line([-1.0, 1.0], [-1.0, -1.0]),
    ];
    match (kind.dimension(), kind.corners()) {
        (1, _) => &ENDS,
        (_, 3) => &TRIANGLE,
        _ => &SQUARE,
    }
}

fn inside(kind: ElementKind, xi: &[f64; 2]) -> bool {
    match (kind.dimension(), kind.corners()) {
        (2, 3) => xi[0] >= -SLACK && xi[1] >= -SLACK && xi[0] + xi[1] <= 1.0 + SLACK,
        _ => xi.iter().all(|c| c.abs() <= 1.0 + SLACK),
    }
}

fn centre(kind: ElementKind) -> [f64; 2] {
    if kind.dimension() == 2 && kind.corners() == 3 { [1.0 / 3.0; 2] } else { [0.0; 2] }
}

/// Where a projection was found, and the directions in which it is free to move.
struct Found {
    coordinates: [f64; 2],
    free: [[f64; 2]; 2],
    frees: usize,
    place: Place,
}

impl Found {
    fn corner(coordinates: [f64; 2], corner: usize) -> Self {
        Self { coordinates, free: [[0.0; 2]; 2], frees: 0, place: Place::Corner(corner as u8) }
    }
}

/// The nearest point on one line of the border, and how far it is.
fn on_border<const D: usize>(facet: &Polynomial<D>, index: usize) -> (f64, Found) {
    let line = &border(facet.kind)[index];
    let direction = [0.5 * (line.end[0] - line.start[0]), 0.5 * (line.end[1] - line.start[1])];
    let length = direction[0].hypot(direction[1]);
    let start = facet.distance(&line.start);
    if length == 0.0 {
        return (start, Found::corner(line.start, index));
    }
    let end = facet.distance(&line.end);
    let fixed = if start <= end {
        (start, Found::corner(line.start, index))
    } else {
        (end, Found::corner(line.end, (index + 1) % facet.kind.corners()))
    };
    let middle = [line.start[0] + direction[0], line.start[1] + direction[1]];
    let along = if facet.has_straight_edges() {
        let view = facet.at(&middle);
        let tangent = view.along(&direction);
        view.offset.dot(&tangent) / tangent.norm_squared()
    } else {
        let Some(xi) = minimise(facet, middle, &[direction]) else {
            return fixed;
        };
        ((xi[0] - middle[0]) * direction[0] + (xi[1] - middle[1]) * direction[1]) / (length * length)
    };
    // An edge without length has no parameter.
    if !(-1.0..=1.0).contains(&along) {
        return fixed;
    }
    let xi = [middle[0] + along * direction[0], middle[1] + along * direction[1]];
    let distance = facet.distance(&xi);
    if distance > fixed.0 {
        return fixed;
    }
    let place = Place::Edge(index as u8);
    (distance, Found { coordinates: xi, free: [direction, [0.0; 2]], frees: 1, place })
}

impl<const D: usize> Projection<D> {
    /// Projects `x` \[m\] onto the facet with nodes at `nodes` \[m\] in the order of `kind`; the nearest point found.
    ///
    /// Exact for line2 and tri3. A facet without area gives a zero normal and the gap 0.
    pub fn of(x: &Vector<D>, kind: ElementKind, nodes: &[Vector<D>]) -> Self {
        let facet = Polynomial::seen_from(x, kind, nodes);
        let directions = [[1.0, 0.0], [0.0, 1.0]];
        let interior = minimise(&facet, centre(kind), &directions[..D - 1]).filter(|xi| inside(kind, xi));
        let over =
            |coordinates| Found { coordinates, free: directions, frees: D - 1, place: Place::Interior };
        let found = interior.map(over).unwrap_or_else(|| {
            let candidates = (0..border(kind).len()).map(|line| on_border(&facet, line));
            let nearest = candidates.min_by(|(a, _), (b, _)| a.total_cmp(b));
            nearest.map_or_else(|| over(centre(kind)), |(_, found)| found)
        });
        Self::assembled(facet.at(&found.coordinates), kind, found, x)
    }

    fn assembled(facet: View<D>, kind: ElementKind, found: Found, x: &Vector<D>) -> Self {
        let area = facet_normal(&facet.tangents);
        let size = area.norm();
        let normal = if size > 0.0 { area / size } else { Vector::zeros() };
        Self {
            coordinates: found.coordinates,
            point: x - facet.offset,
            gap: facet.offset.dot(&normal),
            distance: facet.offset.norm(),
            normal,
            place: found.place,
            free: found.free,
            frees: found.frees,
            kind,
            facet,
        }
    }

    /// Whether the point lies over the facet, rather than beyond an edge or a vertex.
    pub fn is_interior(&self) -> bool {
        self.place == Place::Interior
    }

    /// How far the point lies beyond the facet, along it, in its longest tangents `y_,k` \[-\]; rounding where it lies
    /// over the facet.
    pub fn overhang(&self) -> f64 {
        let along = (self.facet.offset - self.normal * self.gap).norm();
        let longest = self.facet.tangents.iter().map(Vector::norm).fold(f64::MIN_POSITIVE, f64::max);
        along / longest
    }

    /// Variation by the position of the projected point `x`.
    pub fn by_contactor(&self) -> ProjectionVariation<D> {
        self.variation(1.0, [0.0; 2])
    }

    /// Variations by the nodes of the facet in their order, as the point kernel wants them.
    pub fn by_target_nodes(&self) -> impl Iterator<Item = NodeVariation<D>> + '_ {
        let (dim, count) = (D - 1, self.kind.nodes());
        let mut shape = [0.0; LARGEST];
        let mut gradient = [0.0; 2 * LARGEST];
        let element = reference(self.kind);
        element.shape(&self.coordinates[..dim], &mut shape[..count]);
        element.gradient(&self.coordinates[..dim], &mut gradient[..count * dim]);
        (0..count).map(move |node| {
            let along = |k| if k < dim { gradient[node * dim + k] } else { 0.0 };
            self.by_target_node(shape[node], std::array::from_fn(along))
        })
    }

    /// Variation by a node with the shape function `M_b` and its gradient at the projected point.
    fn by_target_node(&self, shape: f64, gradient: [f64; 2]) -> NodeVariation<D> {
        let variation = self.variation(-shape, gradient);
        NodeVariation {
            coefficient: -shape,
            coefficient_gradient: gradient.map(|m| -m),
            gap: variation.gap,
            normal: variation.normal,
            area: Vector::zeros(),
            coordinates: variation.coordinates,
            spin: self.spin(gradient),
        }
    }

    /// Variation by a position that moves `x - y` by `coefficient` and the tangents `a_k` by `gradient[k]`.
    fn variation(&self, coefficient: f64, gradient: [f64; 2]) -> ProjectionVariation<D> {
        let (facet, offset) = (&self.facet, self.facet.offset);
        let free = &self.free[..self.frees];
        let hessian = facet.hessian(free, 1.0);
        let mut coordinates = [Vector::zeros(); 2];
        for component in 0..D {
            let mut right = [0.0; 2];
            for (r, d) in right.iter_mut().zip(free) {
                let turn = gradient[0] * d[0] + gradient[1] * d[1];
                *r = coefficient * facet.along(d)[component] + turn * offset[component];
            }
            let moved = solve(&hessian, right, free.len()).unwrap_or([0.0; 2]);
            for (s, d) in moved.iter().zip(free) {
                coordinates[0][component] += s * d[0];
                coordinates[1][component] += s * d[1];
            }
        }
        let normal = self.normal_variation(gradient, &coordinates);
        ProjectionVariation {
            gap: self.normal * coefficient + normal.transpose() * offset,
            normal,
            coordinates,
        }
    }

    /// `dn = -m^kl a_k (n . da_l + h_lm dxi^m)`.
    fn normal_variation(&self, gradient: [f64; 2], coordinates: &[Vector<D>; 2]) -> Tensor<D> {
        let facet = &self.facet;
        let axes = [[1.0, 0.0], [0.0, 1.0]];
        let metric = facet.hessian(&axes[..D - 1], 0.0);
        let mut normal = Tensor::zeros();
        // Turn of each tangent out of the facet: a row vector that acts on the moved position.
        let turn: [Vector<D>; 2] = std::array::from_fn(|l| {
            let bend = |m: usize| self.normal.dot(&facet.second[l][m]);
            self.normal * gradient[l] + coordinates[0] * bend(0) + coordinates[1] * bend(1)
        });
        for k in 0..D - 1 {
            let unit = if k == 0 { [1.0, 0.0] } else { [0.0, 1.0] };
            let raised = solve(&metric, unit, D - 1).unwrap_or([0.0; 2]);
            for l in 0..D - 1 {
                normal -= facet.tangents[k] * turn[l].transpose() * raised[l];
            }
        }
        normal
    }
}
