//! Which target facets are near: candidates for the pattern of the matrix, and the facet of each point.
//!
//! A tree of boxes says who may be near; `looks` says who is.

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::evaluation::at;
use super::looks::{Around, Leaf, Looks, Near, Probe, look, share_a_node};
use super::pairing::{PairChanges, Pairing};
use super::shield::Shield;
use super::surface::{ContactSurface, SurfaceFacet};
use super::target::TargetSurface;
use crate::mesh::{Bounds, ElementKind, stretch};
use crate::space::{facet_normal, facet_tangents};
use crate::tensor::Vector;

/// Distances that differ by less than this part of the size of the contactor facet are equal.
const TIE: f64 = 1e-9;

/// Of the same size: points further away than this are told their facet by where they are alone, not by where they were, so
/// that iterates far from balance leave no trace.
const FAR: f64 = 0.1;

/// Of the same size: a point that went to and fro keeps its facet up to here beyond its end.
const BESIDE: f64 = 0.1;

/// How far a search looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchLimits {
    /// Points further than this from every facet have none \[m\].
    pub reach: f64,
    /// The same for points in front of their facet, however deep others lie: what iterates far from balance left behind does
    /// not decide whether they have one \[m\].
    pub ahead: f64,
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
    /// Around each facet where it is now.
    shields: Vec<Shield<D>>,
    looks: Looks<D>,
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
            shields: Vec::new(),
            looks: Looks::default(),
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
        self.raise_shields(sides.target, u);
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
                    far: FAR * size,
                };
                if pairing.is_settled(point) && self.stands(&probe, BESIDE * size, sides.target, u) {
                    changes.frozen += 1;
                    continue;
                }
                let found = self.find(&probe, sides.target, u);
                changes.changed += usize::from(pairing.take(point, found));
                changes.frozen += usize::from(pairing.is_frozen(point));
            }
        }
        changes
    }

    /// Whether a point lies over the facet of the last iterate, or beyond its end by no more than `beside` \[m\].
    fn stands(&mut self, probe: &Probe<'_, D>, beside: f64, target: &TargetSurface<D>, u: &[f64]) -> bool {
        let Some(facet) = probe.previous else { return false };
        target.current(facet, u, &mut self.nodes);
        let seen = look(probe, target, facet, &self.nodes, &self.limits);
        seen.distance * seen.distance <= seen.gap * seen.gap + beside * beside
    }

    /// Puts a shield around each facet at the displacements `u`.
    fn raise_shields(&mut self, target: &TargetSurface<D>, u: &[f64]) {
        self.shields.clear();
        for facet in 0..target.len() as u32 {
            target.current(facet, u, &mut self.nodes);
            let kind = target.kind(facet);
            self.shields.push(Shield::around(&self.nodes, kind.corners(), stretch(kind)));
        }
    }

    /// The facet that counts for a point, of all within reach.
    fn find(&mut self, probe: &Probe<'_, D>, target: &TargetSurface<D>, u: &[f64]) -> Option<u32> {
        let around = Around { probe, target, u, limits: &self.limits };
        let looks = &mut self.looks;
        looks.forget();
        let near = Near { tree: &self.tree, motion: self.motion, shields: &self.shields };
        let best = match looks.follow(&near, &around) {
            Some(best) => best,
            None => looks.search(&near, &around)?,
        };
        looks.choose(best, &around)
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

#[cfg(test)]
#[path = "search_tests.rs"]
mod tests;
