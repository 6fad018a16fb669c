//! Which target facets are near: candidates for the pattern of the matrix, and the facet of each point.
//!
//! A projection counts only where it is nearest on the *surface*: one that is clipped at an edge to a neighbour onto
//! which the point is nearer says nothing. So a point beside a sharp edge is open although it lies below the facet
//! around the corner, a point in the wedge over a vertex belongs to both facets there, and one beyond the end to none.

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::evaluation::at;
use super::pairing::{PairChanges, Pairing};
use super::projection::{Place, Projection};
use super::surface::{ContactSurface, SurfaceFacet};
use super::target::TargetSurface;
use crate::mesh::{Bounds, ElementKind, stretch};
use crate::space::{facet_normal, facet_tangents};
use crate::tensor::Vector;

/// Distances that differ by less than this part of the size of the contactor facet are equal.
const TIE: f64 = 1e-9;
/// Of tied facets those count whose gap is at least this part of the largest: in the wedge of a concave edge the facet
/// of the last iterate is kept until the neighbour is clearly the one that the point sank into.
const FACE_ON: f64 = 0.9;

/// How far a search looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchLimits {
    /// Points further than this from every facet have none \[m\].
    pub reach: f64,
    /// Points deeper than this below a facet are not its own, but come from the other side: half the thickness of the
    /// target \[m\].
    pub depth: f64,
}

/// The two sides of a contact.
#[derive(Debug, Clone, Copy)]
pub struct Sides<'a, const D: usize> {
    /// With the points.
    pub contactor: &'a ContactSurface<D>,
    /// With the facets.
    pub target: &'a TargetSurface<D>,
}

type Leaf<const D: usize> = GeomWithData<Rectangle<[f64; D]>, u32>;

/// A tree of the boxes of the target's facets where they were when it was built, and how far they moved since.
#[derive(Debug, Clone)]
pub struct Search<const D: usize> {
    limits: SearchLimits,
    tree: RTree<Leaf<D>>,
    /// Positions of the facets' nodes, facet by facet, in the tree.
    built_at: Vec<Vector<D>>,
    /// No point of a facet is further from its box than this.
    motion: f64,
    /// Motion at which the tree is built anew.
    margin: f64,
    nodes: Vec<Vector<D>>,
    seen: Vec<Seen>,
}

/// A facet on which a point was projected.
#[derive(Debug, Clone, Copy)]
struct Seen {
    facet: u32,
    distance: f64,
    gap: f64,
    place: Place,
    /// Turned to the contactor, not too deep, not off the end.
    eligible: bool,
}

/// A point in search of a facet.
struct Probe<'a, const D: usize> {
    x: Vector<D>,
    outward: Vector<D>,
    nodes: &'a [u32],
    previous: Option<u32>,
    tie: f64,
}

impl<const D: usize> Search<D> {
    /// A search among the facets of `target` at the displacements `u`.
    pub fn new(target: &TargetSurface<D>, limits: SearchLimits, u: &[f64]) -> Self {
        let mut search = Self {
            limits,
            tree: RTree::new(),
            built_at: Vec::new(),
            motion: f64::INFINITY,
            margin: 0.0,
            nodes: Vec::new(),
            seen: Vec::new(),
        };
        search.follow(target, u);
        search
    }

    /// From now on looks no further than `reach` \[m\].
    pub fn shorten(&mut self, reach: f64) {
        self.limits.reach = self.limits.reach.min(reach);
    }

    /// Follows the target to the displacements `u`; the tree is built anew once its facets have moved by half their
    /// mean size. False, and nothing done, where `u` is no displacement: such an iterate is not searched.
    fn follow(&mut self, target: &TargetSurface<D>, u: &[f64]) -> bool {
        if !u.iter().all(|u| u.is_finite()) {
            return false;
        }
        let facets = 0..target.len() as u32;
        let widest = facets.clone().map(|facet| stretch(target.kind(facet))).fold(1.0, f64::max);
        let now = facets.clone().flat_map(|facet| {
            target.reference_points(facet).iter().zip(target.nodes(facet)).map(|(x, &node)| x + at(u, node))
        });
        let furthest = now.zip(&self.built_at).map(|(x, old)| (x - old).norm_squared()).fold(0.0, f64::max);
        self.motion = widest * furthest.sqrt();
        let known = self.built_at.len() == facets.clone().map(|f| target.nodes(f).len()).sum::<usize>();
        if known && self.motion <= self.margin {
            return true;
        }
        let mut size = 0.0;
        self.built_at.clear();
        let mut leaves: Vec<Leaf<D>> = Vec::with_capacity(target.len());
        for facet in facets {
            target.current(facet, u, &mut self.nodes);
            self.built_at.extend_from_slice(&self.nodes);
            let bounds = bounds(target.kind(facet), &self.nodes);
            size += (Vector::from(bounds.high) - Vector::from(bounds.low)).norm();
            leaves.push(GeomWithData::new(Rectangle::from_corners(bounds.low, bounds.high), facet));
        }
        self.margin = 0.5 * size / target.len().max(1) as f64;
        self.motion = 0.0;
        self.tree = RTree::bulk_load(leaves);
        true
    }

    /// All couples (contactor facet, target facet) whose boxes, each wider by `radius` \[m\], meet at the displacements
    /// `u`; in ascending order, without couples that share a node.
    pub fn candidates(&mut self, sides: Sides<'_, D>, u: &[f64], radius: f64) -> Vec<(u32, u32)> {
        let mut couples = Vec::new();
        if !self.follow(sides.target, u) {
            return couples;
        }
        let mut points = Vec::new();
        for (index, facet) in sides.contactor.facets().iter().enumerate() {
            let nodes = sides.contactor.facet_nodes(facet);
            points.clear();
            points.extend(current_points(sides.contactor, facet, u));
            let near = bounds(facet.kind, &points).inflate(2.0 * radius);
            let wide = near.inflate(self.motion);
            let wide = AABB::from_corners(wide.low, wide.high);
            for leaf in self.tree.locate_in_envelope_intersecting(wide) {
                let target = leaf.data;
                sides.target.current(target, u, &mut self.nodes);
                let meet = bounds(sides.target.kind(target), &self.nodes).meets(&near);
                if meet && !share_a_node(nodes, sides.target.nodes(target)) {
                    couples.push((index as u32, target));
                }
            }
        }
        couples.sort_unstable();
        couples
    }

    /// Pairs every contactor point with a target facet at the displacements `u`, which it keeps until the next call.
    /// Call it once an iterate.
    ///
    /// The choice depends on positions and global names alone: it is the same on any number of ranks, as long as each
    /// knows all target facets within reach of its points. A `u` with a NaN changes nothing.
    pub fn pair(&mut self, sides: Sides<'_, D>, u: &[f64], pairing: &mut Pairing) -> PairChanges {
        let mut changes = PairChanges::default();
        if !self.follow(sides.target, u) {
            return changes;
        }
        let mut points = Vec::new();
        for facet in sides.contactor.facets() {
            points.clear();
            points.extend(current_points(sides.contactor, facet, u));
            let reference = sides.contactor.reference_points(facet);
            let size = reference.iter().map(|x| (x - reference[0]).norm()).fold(0.0, f64::max);
            for (q, point) in facet.points.clone().enumerate() {
                if pairing.is_frozen(point) {
                    changes.frozen += 1;
                    continue;
                }
                let at = sides.contactor.facet_point(facet, q);
                let probe = Probe {
                    x: at.position(&points),
                    outward: facet_normal(&facet_tangents(&points, at.gradient)),
                    nodes: sides.contactor.facet_nodes(facet),
                    previous: pairing.facet(point),
                    tie: TIE * size,
                };
                let found = self.find(&probe, sides.target, u);
                changes.changed += usize::from(pairing.take(point, found));
                changes.frozen += usize::from(pairing.is_frozen(point));
            }
        }
        changes
    }

    /// Looks at facets from the nearest box on, until what is left is further away than the best of what was seen.
    fn find(&mut self, probe: &Probe<'_, D>, target: &TargetSurface<D>, u: &[f64]) -> Option<u32> {
        self.seen.clear();
        // Which facet counts is dear to ask where many are seen: it is asked where one may, and again as more are seen.
        let (mut possible, mut asked) = (self.limits.reach, 0);
        for (leaf, squared) in self.tree.nearest_neighbor_iter_with_distance_2(probe.x.into()) {
            let left = squared.sqrt() - self.motion - probe.tie;
            if left > self.limits.reach {
                break;
            }
            if left > possible && 2 * self.seen.len() > 3 * asked {
                if left > nearest(&mut self.seen, target, probe.tie).unwrap_or(self.limits.reach) {
                    break;
                }
                asked = self.seen.len();
            }
            target.current(leaf.data, u, &mut self.nodes);
            let seen = look(probe, target, leaf.data, &self.nodes, &self.limits);
            if seen.distance > self.limits.reach {
                continue;
            }
            if seen.eligible {
                possible = possible.min(seen.distance);
            }
            self.seen.push(seen);
        }
        let best = nearest(&mut self.seen, target, probe.tie)?;
        let tied = || {
            let near = self.seen.iter().filter(|seen| seen.distance <= best + probe.tie);
            near.filter(|seen| counts(seen, &self.seen, target, probe.tie))
        };
        let deepest = tied().map(|seen| seen.gap.abs()).fold(0.0, f64::max);
        let face_on = tied().filter(|seen| seen.gap.abs() >= FACE_ON * deepest - probe.tie);
        // The facet of the last iterate before all others, then the lowest name.
        let order = |facet: &u32| (probe.previous != Some(*facet), target.identity(*facet));
        face_on.map(|seen| seen.facet).min_by_key(order)
    }
}

fn current_points<'a, const D: usize>(
    surface: &'a ContactSurface<D>,
    facet: &SurfaceFacet,
    u: &'a [f64],
) -> impl Iterator<Item = Vector<D>> + 'a {
    let nodes = surface.reference_points(facet).iter().zip(surface.facet_nodes(facet));
    nodes.map(|(reference, &node)| reference + at(u, node))
}

/// A box around a facet with nodes at `points` \[m\].
fn bounds<const D: usize>(kind: ElementKind, points: &[Vector<D>]) -> Bounds<D> {
    Bounds::of_facet(kind, points.iter().map(|&point| point.into()))
}

fn share_a_node(these: &[u32], those: &[u32]) -> bool {
    these.iter().any(|node| those.contains(node))
}

fn look<const D: usize>(
    probe: &Probe<'_, D>,
    target: &TargetSurface<D>,
    facet: u32,
    nodes: &[Vector<D>],
    limits: &SearchLimits,
) -> Seen {
    let projection = Projection::of(&probe.x, target.kind(facet), nodes);
    let eligible = projection.normal.dot(&probe.outward) < 0.0
        && projection.gap >= -limits.depth
        && !target.is_off_end(facet, &projection)
        && !share_a_node(probe.nodes, target.nodes(facet));
    Seen { facet, distance: projection.distance, gap: projection.gap, place: projection.place, eligible }
}

/// Distance of the nearest facet that counts; sorts those `seen` by distance.
fn nearest<const D: usize>(seen: &mut [Seen], target: &TargetSurface<D>, tie: f64) -> Option<f64> {
    seen.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    seen.iter().find(|this| counts(this, seen, target, tie)).map(|this| this.distance)
}

/// Whether a facet may be chosen, as far as the facets `seen` tell.
fn counts<const D: usize>(this: &Seen, seen: &[Seen], target: &TargetSurface<D>, tie: f64) -> bool {
    if !this.eligible || this.place == Place::Interior {
        return this.eligible;
    }
    let meets = |other: &&Seen| {
        let mut border = target.border_nodes(this.facet, this.place);
        border.all(|node| target.nodes(other.facet).contains(&node))
    };
    // Who of those around the edge or corner lies most face-on to the point tells whether it is outside.
    let mut face_on = this;
    for other in seen.iter().filter(meets) {
        if other.distance < this.distance - tie {
            return false;
        }
        if other.gap.abs() > face_on.gap.abs() {
            face_on = other;
        }
    }
    let outside = |seen: &Seen| seen.gap > 0.0;
    outside(this) == outside(face_on) || this.gap.abs().max(face_on.gap.abs()) <= tie
}

#[cfg(test)]
#[path = "search_tests.rs"]
mod tests;
