//! What a point looks at to find its facet, and which of what it saw counts.
//!
//! A projection counts only where it is nearest on the *surface*: one that is clipped at an edge to a neighbour onto
//! which the point is nearer says nothing. So a point beside a sharp edge is open although it lies below the facet
//! around the corner, a point in the wedge over a vertex belongs to both facets there, and one beyond the end to none.

use rstar::RTree;
use rstar::primitives::{GeomWithData, Rectangle};

use super::projection::{Place, Projection};
use super::search::SearchLimits;
use super::shield::Shield;
use super::target::TargetSurface;
use crate::tensor::Vector;

/// Of tied facets those count whose gap is at least this part of the largest: in the wedge of a concave edge the facet
/// of the last iterate is kept until the neighbour is clearly the one that the point sank into.
pub(super) const FACE_ON: f64 = 0.9;

/// A facet is turned to the contactor where the cosine of their normals is below minus this: what is perpendicular is not,
/// whichever way it is rounded.
const AGAINST: f64 = 1e-6;

/// The box of a facet in the tree.
pub(super) type Leaf<const D: usize> = GeomWithData<Rectangle<[f64; D]>, u32>;

/// What was looked at for one point.
#[derive(Debug, Clone, Default)]
pub(super) struct Looks<const D: usize> {
    nodes: Vec<Vector<D>>,
    seen: Vec<Seen>,
    /// Facets whose boxes are near but whose shields are not near enough yet, with their least distances.
    spared: Vec<(f64, u32)>,
}

/// A facet on which a point was projected.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    pub facet: u32,
    pub distance: f64,
    pub gap: f64,
    pub place: Place,
    /// Turned to the contactor, not too deep, not off the end.
    pub eligible: bool,
}

/// A point in search of a facet.
pub(super) struct Probe<'a, const D: usize> {
    pub x: Vector<D>,
    pub outward: Vector<D>,
    pub nodes: &'a [u32],
    /// Facet of the last iterate.
    pub previous: Option<u32>,
    /// Differences of distances that are none \[m\].
    pub tie: f64,
    /// Distance from which on the last iterate does not count \[m\].
    pub far: f64,
}

/// What a point may see.
pub(super) struct Around<'a, const D: usize> {
    pub probe: &'a Probe<'a, D>,
    pub target: &'a TargetSurface<D>,
    pub u: &'a [f64],
    pub limits: &'a SearchLimits,
}

/// Where facets are at least.
pub(super) struct Near<'a, const D: usize> {
    pub tree: &'a RTree<Leaf<D>>,
    pub motion: f64,
    pub shields: &'a [Shield<D>],
}

impl<const D: usize> Looks<D> {
    pub fn forget(&mut self) {
        self.seen.clear();
        self.spared.clear();
    }

    /// Distance of the nearest facet that counts where that is no further than the facet of the last iterate, as nearly
    /// always: only what may be as near is looked at. `None` where it has to be searched for.
    pub fn follow(&mut self, near: &Near<'_, D>, around: &Around<'_, D>) -> Option<f64> {
        let (probe, reach) = (around.probe, around.limits.reach);
        let previous = probe.previous?;
        let known = self.look_at(previous, around, f64::INFINITY);
        if known > reach {
            return None;
        }
        let radius = known + near.motion + probe.tie;
        let mut possible = known;
        for leaf in near.tree.locate_within_distance(probe.x.into(), radius * radius) {
            if leaf.data != previous {
                possible = self.consider(leaf.data, near, around, possible);
            }
        }
        self.settle(around).filter(|best| *best <= known)
    }

    /// Looks at facets from the nearest box on, until what is left is further away than the best of what was seen.
    pub fn search(&mut self, near: &Near<'_, D>, around: &Around<'_, D>) -> Option<f64> {
        let (probe, reach) = (around.probe, around.limits.reach);
        self.forget();
        // Which facet counts is dear to ask where many are seen: it is asked where one may, and again as more are seen.
        let (mut possible, mut asked) = (reach, 0);
        for (leaf, squared) in near.tree.nearest_neighbor_iter_with_distance_2(probe.x.into()) {
            let left = squared.sqrt() - near.motion - probe.tie;
            if left > reach {
                break;
            }
            if left > possible && 2 * self.count() > 3 * asked {
                if left > self.settle(around).unwrap_or(reach) {
                    break;
                }
                asked = self.count();
            }
            possible = self.consider(leaf.data, near, around, possible);
        }
        self.settle(around)
    }

    /// Looks at a facet unless its shield is further than what is possible: then it is kept for when that proves wrong.
    fn consider(&mut self, facet: u32, near: &Near<'_, D>, around: &Around<'_, D>, possible: f64) -> f64 {
        let least = near.shields[facet as usize].distance(&around.probe.x) - around.probe.tie;
        if least > possible {
            self.spared.push((least, facet));
            return possible;
        }
        self.look_at(facet, around, possible)
    }

    /// Of the facets at distance `best` that count the one that the point has.
    pub fn choose(&self, best: f64, around: &Around<'_, D>) -> Option<u32> {
        let (probe, target) = (around.probe, around.target);
        let tied = || {
            let near = self.seen.iter().filter(|seen| seen.distance <= best + probe.tie);
            near.filter(|seen| counts(seen, &self.seen, target, probe.tie))
        };
        let deepest = tied().map(|seen| seen.gap.abs()).fold(0.0, f64::max);
        let face_on = tied().filter(|seen| seen.gap.abs() >= FACE_ON * deepest - probe.tie);
        // Of a point that may touch the facet of the last iterate before all others, then the lowest name.
        let is_near = best <= probe.far;
        let order = |facet: &u32| (is_near && probe.previous != Some(*facet), target.identity(*facet));
        face_on.map(|seen| seen.facet).min_by_key(order)
    }

    fn count(&self) -> usize {
        self.seen.len() + self.spared.len()
    }

    /// Projects on a facet; how near the best one may be, knowing that it was `possible` before.
    fn look_at(&mut self, facet: u32, around: &Around<'_, D>, possible: f64) -> f64 {
        around.target.current(facet, around.u, &mut self.nodes);
        let seen = look(around.probe, around.target, facet, &self.nodes, around.limits);
        if seen.distance > around.limits.reach {
            return possible;
        }
        self.seen.push(seen);
        if seen.eligible { possible.min(seen.distance) } else { possible }
    }

    /// Distance of the nearest facet that counts, after a look at all spared ones that may be as near: they include those
    /// around the edge or corner that it was met at.
    fn settle(&mut self, around: &Around<'_, D>) -> Option<f64> {
        loop {
            let best = nearest(&mut self.seen, around.target, around.probe.tie);
            let near = best.unwrap_or(around.limits.reach);
            let before = self.spared.len();
            while let Some(at) = self.spared.iter().position(|(least, _)| *least <= near) {
                let (_, facet) = self.spared.swap_remove(at);
                self.look_at(facet, around, near);
            }
            if self.spared.len() == before {
                return best;
            }
        }
    }
}

pub(super) fn share_a_node(these: &[u32], those: &[u32]) -> bool {
    these.iter().any(|node| those.contains(node))
}

pub(super) fn look<const D: usize>(
    probe: &Probe<'_, D>,
    target: &TargetSurface<D>,
    facet: u32,
    nodes: &[Vector<D>],
    limits: &SearchLimits,
) -> Seen {
    let projection = Projection::of(&probe.x, target.kind(facet), nodes);
    let eligible = projection.normal.dot(&probe.outward) < -AGAINST * probe.outward.norm()
        && projection.gap >= -limits.depth
        && (projection.gap < 0.0 || projection.distance <= limits.ahead)
        && !target.is_off_end(facet, &projection)
        && !share_a_node(probe.nodes, target.nodes(facet));
    Seen { facet, distance: projection.distance, gap: projection.gap, place: projection.place, eligible }
}

/// Distance of the nearest facet that counts; sorts those `seen` by distance.
pub(super) fn nearest<const D: usize>(seen: &mut [Seen], target: &TargetSurface<D>, tie: f64) -> Option<f64> {
    seen.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    seen.iter().find(|this| counts(this, seen, target, tie)).map(|this| this.distance)
}

/// Whether a facet may be chosen, as far as the facets `seen` tell.
pub(super) fn counts<const D: usize>(
    this: &Seen,
    seen: &[Seen],
    target: &TargetSurface<D>,
    tie: f64,
) -> bool {
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
