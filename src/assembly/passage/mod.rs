//! Whether a contact was missed: a body went through its target between the ends of a step, or what it met is smaller than
//! the spacing of its contact points.

mod moving;
mod vertices;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::{Contact, Pair};
use super::meeting::Meeting;
use super::segments::SegmentMeeting;
use super::system::ContactSystem;
use super::targets::{Evaluated, Surfaces};
use crate::contact::obstacle::Obstacle;
use crate::contact::passage::{Path, lies_between, normal_of};
use crate::contact::surface::SurfaceFacet;
use crate::dynamics::Stage;
use crate::error::Result;
use crate::mesh::{Bounds, BoundsTree};
use crate::tensor::Vector as Point;
use moving::{Ends, Moving, around, nodes_of, parts, paths};
use vertices::Sunk;

/// Surfaces that move by this many times the expected motion did not pass through a target: the balance that was found is another one.
const RUNAWAY: f64 = 20.0;

/// What was found on this rank, to be summed over all: facets around small obstacles, points that went through, of each
/// contact; and the vertices that sank in between points.
struct Found<const D: usize> {
    between: Vec<u64>,
    through: Vec<u64>,
    sunk: Vec<Sunk<D>>,
    /// Facets of the target of each contact, none of rigid ones.
    targets: Vec<Moving<D>>,
}

impl<const D: usize> ContactSystem<D> {
    /// Why the step of `stage` can not be accepted although it balances: a point went through a target and is open on
    /// the other side, or a target lies between the points of a contactor. What things may have met on their way is gathered
    /// only where something moved further than a point may unseen, or a point has no facet any more. Collective.
    ///
    /// # Errors
    /// The same on all ranks, when a message is damaged.
    pub fn missed_contact(&mut self, stage: &Stage) -> Result<Option<String>> {
        if self.contacts.is_empty() {
            return Ok(None);
        }
        let (start, end) = (stage.start.u.local(), stage.trial.u.local());
        let ends = Ends { start: &start, end: &end };
        let motions = self.contacts.iter().flat_map(|contact| {
            let [contactor, target, lost] = self.shifts(contact, ends);
            [contactor, target, lost, f64::from(u8::from(has_a_point_at_its_obstacle(contact, ends)))]
        });
        let mut motions: Vec<f64> = motions.collect();
        let own = motions.clone();
        self.session.world().all_reduce_into(&own[..], &mut motions[..], SystemOperation::max());
        let found = self.find(ends, &motions)?;
        let counts = found.between.iter().chain(&found.through).copied();
        let own: Vec<u64> = counts.chain([found.sunk.len() as u64]).collect();
        let mut all = own.clone();
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::sum());
        let (between, through) = all.split_at(self.contacts.len());
        if let Some((contact, facets)) = self.contacts.iter().zip(between).find(|(_, facets)| **facets > 0) {
            return Ok(Some(tell_between(contact, *facets, &self.units.of("m"))));
        }
        let points = self.contacts.iter().zip(through).zip(motions.chunks_exact(4));
        if let Some(((contact, _), motion)) = points.into_iter().find(|((_, points), _)| **points > 0) {
            let motion = motion[0] + motion[1];
            let expected = stage.inertia.then(|| self.expected_motion(stage));
            return Ok(Some(tell_through(&contact.name, motion, expected, &self.units.of("m"))));
        }
        let any = through.last().is_some_and(|vertices| *vertices > 0);
        Ok(if any { self.tell_sunk(&self.without_contact(&found.sunk, &found.targets, ends)) } else { None })
    }

    /// How far the speed and the acceleration at the start take any node in the step, at most, and supports those that they
    /// move \[m\]. Collective.
    fn expected_motion(&self, stage: &Stage) -> f64 {
        let largest = |field: &[f64]| field.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let (u, u_start) = (stage.trial.u.owned(), stage.start.u.owned());
        let held = self.supports.dofs.constrained.iter();
        let moved = u.iter().zip(u_start.iter()).zip(held).filter(|(_, held)| **held);
        let prescribed = moved.map(|((end, start), _)| (end - start).abs()).fold(0.0_f64, f64::max);
        let own = [largest(&stage.start.v.owned()), largest(&stage.start.a.owned()), prescribed];
        let mut all = [0.0; 3];
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::max());
        all[0] * stage.dt + 0.5 * all[1] * stage.dt.powi(2) + all[2]
    }

    /// Looks for all of it; `motions` as [`shifts`](Self::shifts) and whether a point may meet the obstacle, of all ranks. Collective.
    fn find(&mut self, ends: Ends<'_>, motions: &[f64]) -> Result<Found<D>> {
        let meetings: Vec<&Meeting<D>> = self.contacts.iter().filter_map(Contact::meeting).collect();
        let known =
            self.interface.as_mut().map(|interface| Moving::known(&self.session, interface, &meetings, ends));
        let mut known = known.into_iter().flatten();
        let mut found =
            Found { between: Vec::new(), through: Vec::new(), sunk: Vec::new(), targets: Vec::new() };
        for (number, (contact, motion)) in self.contacts.iter().zip(motions.chunks_exact(4)).enumerate() {
            let [motion, lost, met] = [motion[0] + motion[1], motion[2], motion[3]];
            let (between, through, target) = match &contact.pair {
                Pair::Rigid { contact: rigid, .. } => {
                    let passes = |path: &Path<D>| motion > 0.0 && path.passes_obstacle(&rigid.obstacle);
                    let through = paths(contact, ends).filter(|(path, _)| passes(path)).count();
                    (
                        between_points(contact, &rigid.obstacle, ends, met > 0.0),
                        through as u64,
                        Moving::default(),
                    )
                }
                Pair::Deformable(meeting) => {
                    let near = known.next().unwrap_or_default();
                    let far = motion > meeting.stride() || lost > 0.0;
                    let moving = match far {
                        true => {
                            let [contactor, target] = meeting.surfaces();
                            let local = &self.local;
                            let surfaces = Surfaces { local, contactor, evaluated: Evaluated::Mine, target };
                            Moving::gathered(&self.session, &surfaces, ends, motion + meeting.depth())?
                        }
                        false => near,
                    };
                    found.sunk.extend(self.sunk(number, meeting, &moving, (ends, far)));
                    (0, if far { passages(meeting, contact, ends, &moving) } else { 0 }, moving)
                }
                Pair::Segments(meeting) => {
                    let far = motion > meeting.stride();
                    (0, if far { self.swept(meeting, ends, motion)? } else { 0 }, Moving::default())
                }
            };
            found.between.push(between);
            found.through.push(through);
            found.targets.push(target);
        }
        Ok(found)
    }

    /// Places of either surface of a contact by segments that went through the other one, while the surfaces moved by `motion` \[m\].
    /// Collective.
    fn swept(&self, meeting: &SegmentMeeting<D>, ends: Ends<'_>, motion: f64) -> Result<u64> {
        let depth = meeting.depth();
        let surfaces = meeting.surfaces(&self.local);
        let target = Moving::gathered(&self.session, &surfaces, ends, motion + depth)?;
        let contactor = Moving::local(&self.local, surfaces.contactor, ends);
        let spacing = EDGE * meeting.facet();
        Ok(crossings(&contactor, &target, depth, spacing) + crossings(&target, &contactor, depth, spacing))
    }

    /// How far own nodes of contactor and target move in the step, at most \[m\]; 1 where a point has lost its facet.
    fn shifts(&self, contact: &Contact<D>, ends: Ends<'_>) -> [f64; 3] {
        let of_node = |node: u32| {
            let dofs = node as usize * D..node as usize * D + D;
            dofs.map(|dof| (ends.end[dof] - ends.start[dof]).powi(2)).sum::<f64>()
        };
        let surface = contact.surface();
        let contactor = surface.facets().iter().flat_map(|facet| surface.facet_nodes(facet));
        let contactor = contactor.map(|&node| of_node(node)).fold(0.0, f64::max);
        let (mut target, mut lost, mut nodes) = (0.0_f64, false, Vec::new());
        for &facet in contact.target_facets() {
            self.local.mesh.facet_nodes(facet, &mut nodes);
            target = nodes.iter().map(|&node| of_node(node)).fold(target, f64::max);
        }
        if let Some(meeting) = contact.meeting() {
            let knew = contact.state.history.iter().map(|history| history.normal != Point::<D>::zeros());
            lost = knew.enumerate().any(|(point, knew)| knew && meeting.pairing.facet(point).is_none());
        }
        [contactor.sqrt(), target.sqrt(), f64::from(u8::from(lost))]
    }
}

/// Points that pass through facets of the target, which are gathered as far as anything moves.
fn passages<const D: usize>(
    meeting: &Meeting<D>,
    contact: &Contact<D>,
    ends: Ends<'_>,
    moving: &Moving<D>,
) -> u64 {
    let (simplices, depth) = (moving.simplices(), meeting.depth());
    let boxes: Vec<Bounds<D>> = simplices.iter().map(|corners| around(corners)).collect();
    let tree = BoundsTree::new(&boxes);
    let passes = |path: &Path<D>| {
        tree.meeting(&around(&[*path]).inflate(depth))
            .any(|simplex| path.passes_simplex(&simplices[simplex as usize], depth))
    };
    paths(contact, ends).filter(|(path, closed)| !closed && passes(path)).count() as u64
}

/// Distance of places on edges that are followed through facets, over the size of a facet: edges that cross each other meet one.
const EDGE: f64 = 0.25;

/// Nodes of the facets `a`, and places on their edges, that went through a facet of `b` and end more than `depth` \[m\] behind it.
fn crossings<const D: usize>(a: &Moving<D>, b: &Moving<D>, depth: f64, spacing: f64) -> u64 {
    let simplices = b.simplices();
    let boxes: Vec<Bounds<D>> = simplices.iter().map(|corners| around(corners)).collect();
    let tree = BoundsTree::new(&boxes);
    let crosses = |path: &Path<D>| {
        let mut near = tree.meeting(&around(&[*path]).inflate(depth));
        near.any(|simplex| path.crosses(&simplices[simplex as usize], depth))
    };
    a.vertices(spacing).iter().filter(|vertex| crosses(&vertex.path)).count() as u64
}

/// Why a step with points beyond their target is rejected. The surfaces move by `motion` \[m\] in the step; speeds and accelerations at
/// its start predict `expected` at most, if that is known.
fn tell_through(contact: &str, motion: f64, expected: Option<f64>, m: &str) -> String {
    match expected.filter(|expected| *expected > 0.0 && motion > RUNAWAY * expected) {
        Some(expected) => format!(
            "the balance that was found is far off: the surfaces of contact '{contact}' would move by {motion:.3e} {m} within one step, \
             in which speeds and accelerations at its start take them by {expected:.1e} {m} at most"
        ),
        None => format!(
            "contact '{contact}': a surface would go through the target within one step, in which the surfaces move by {motion:.3e} {m}"
        ),
    }
}

fn tell_between<const D: usize>(contact: &Contact<D>, facets: u64, m: &str) -> String {
    let radius = match &contact.pair {
        Pair::Rigid { contact, .. } => contact.obstacle.outer_radius().unwrap_or(0.0),
        Pair::Deformable(_) | Pair::Segments(_) => 0.0,
    };
    format!(
        "contact '{}': the obstacle, of radius {radius:.3e} {m}, lies between the points of {facets} facets of about {:.3e} {m}, none of which \
         touches it: mesh the contactor finer than the radius, or take quadrature: gauss",
        contact.name, contact.facet_size
    )
}

/// A round obstacle none of the points can meet has sunk in from this part of a facet's length on.
const SHALLOW: f64 = 0.02;

/// Whether a point of this rank lies over a round obstacle, so that it would touch before the facet is a radius deep.
fn has_a_point_at_its_obstacle<const D: usize>(contact: &Contact<D>, ends: Ends<'_>) -> bool {
    let Pair::Rigid { contact: rigid, .. } = &contact.pair else { return false };
    // The points of a facet that is no longer than the obstacle is thick all but touch it.
    let radius = rigid.obstacle.outer_radius().filter(|radius| *radius < 4.0 * contact.facet_size);
    let Some(radius) = radius else { return true };
    let (surface, obstacle) = (contact.surface(), &rigid.obstacle);
    let first = |facet: &SurfaceFacet| nodes_of(surface, facet, ends)[0].end;
    let is_near = |facet: &&SurfaceFacet| obstacle.gap(&first(facet)) <= 2.0 * contact.facet_size;
    surface.facets().iter().filter(is_near).any(|facet| {
        let nodes: Vec<Point<D>> = nodes_of(surface, facet, ends).iter().map(|node| node.end).collect();
        let outward = normal_of(&std::array::from_fn(|k| nodes[k]));
        let Some(outward) = outward.try_normalize(0.0) else { return false };
        facet.points.clone().enumerate().any(|(q, _)| {
            let place = surface.facet_point(facet, q).position(&nodes);
            let Some(away) = obstacle.offset(&place) else { return false };
            let height = away.dot(&outward);
            height.abs() <= radius + contact.facet_size && (away - outward * height).norm() < radius
        })
    })
}

/// Facets of this rank without a closed point in which a small round obstacle lies: half of its radius deep, or at all where no
/// point of the contact is `met` by it however deep.
fn between_points<const D: usize>(
    contact: &Contact<D>,
    obstacle: &Obstacle<D>,
    ends: Ends<'_>,
    met: bool,
) -> u64 {
    let Some(radius) = obstacle.outer_radius() else { return 0 };
    let (surface, mut count) = (contact.surface(), 0);
    for facet in surface.facets().iter().filter(|facet| facet.mine) {
        if contact.state.current[facet.points.clone()].iter().any(|point| point.is_closed()) {
            continue;
        }
        let corners = nodes_of(surface, facet, ends);
        let around = around(&corners);
        let size = (Point::<D>::from(around.high) - Point::from(around.low)).norm();
        // A facet that is not longer than the obstacle is thick always has a point in it before it lies so deep.
        let deep = if met { 0.5 * radius } else { (SHALLOW * size).min(0.5 * radius) };
        if radius >= 2.0 * size || obstacle.gap(&corners[0].end) > size - deep {
            continue;
        }
        let mut lies = false;
        parts(facet.kind, |part| {
            lies |= lies_between(&std::array::from_fn(|k| corners[part[k]]), obstacle, deep)
        });
        count += u64::from(lies);
    }
    count
}

#[cfg(test)]
mod tests {
    use super::tell_through;

    /// Points that pass through their target are reported as such, except when the iterate has blown up, which is reported instead.
    #[test]
    fn a_balance_that_is_far_off_is_no_passage() {
        let through = tell_through("hit", 1.5, Some(1.4), "m");
        assert!(
            through.contains("would go through the target") && through.contains("1.500e0 m"),
            "{through}"
        );
        let off = tell_through("hit", 1.03, Some(1e-3), "m");
        assert!(off.contains("far off") && off.contains("1.030e0 m") && off.contains("1.0e-3 m"), "{off}");
        assert!(!off.contains("go through"), "{off}");
        for unknown in [None, Some(0.0)] {
            assert!(tell_through("hit", 1.03, unknown, "m").contains("go through"));
        }
    }
}
