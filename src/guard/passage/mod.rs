//! Detection of missed contact.
//!
//! A body can pass through its target between the ends of a step. An obstacle can also be smaller
//! than the spacing of the contactor's points.

mod bodies;
mod moving;
mod obstacle;

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact};
use crate::collective::Collective;
use crate::dynamics::Stage;
use crate::error::Result;
use crate::mesh::spelled;
use bodies::BodyCheck;
use moving::{BodyPoint, StepEnds};
use obstacle::{ObstacleCheck, describe_between};

/// Factor on the expected motion above which surfaces did not pass through a target. The balance
/// that was found is then a different one.
const RUNAWAY: f64 = 20.0;

/// Coordinates that differ by less than this fraction of the size of all bodies are equal. It is
/// well above rounding, which depends on the partition. Half and twice the value choose the same
/// point in the test.
const EQUAL: f64 = 1e-9;

/// Findings for a contact on this rank.
#[derive(Default)]
struct Missed<const D: usize> {
    /// Centres of the facets around small obstacles.
    between: Vec<BodyPoint<D>>,
    /// Points that passed through the target.
    through: Vec<BodyPoint<D>>,
}

/// Detects missed contact over one kind of target.
trait MissedContactCheck<const D: usize> {
    /// Whether a point of this rank can touch its obstacle, or is deep in its target.
    fn is_near(&self) -> bool;

    /// Returns the points of this rank at which contact was missed in a step in which the surfaces moved
    /// by `motion` \[m\]. `is_near` is [`MissedContactCheck::is_near`] of any rank. Collective.
    ///
    /// # Errors
    /// If a message is damaged, the same on all ranks.
    fn missed(&self, motion: f64, is_near: bool) -> Result<Missed<D>>;
}

/// The check of a contact over the kind of its target, from one end of the step to the other.
fn check<'a, const D: usize>(
    system: &'a ContactSystem<D>,
    contact: &'a LocalContact<D>,
    ends: StepEnds<'a>,
) -> Box<dyn MissedContactCheck<D> + 'a> {
    match contact.target().obstacle() {
        Some(obstacle) => {
            Box::new(ObstacleCheck { contact, obstacle, ends, bodies: &system.bodies().local().mesh.body })
        }
        None => Box::new(BodyCheck { system, contact, ends }),
    }
}

/// Returns why the step of `stage` cannot be accepted although it balances, or `None`.
/// Collective.
///
/// Either a surface passed through a target and is open on the other side, or an obstacle is
/// between the points of a contactor. Facets along the path are gathered only if something
/// moved further than the search limit allows.
///
/// # Errors
/// If a message is damaged, the same on all ranks.
pub fn missed_contact<const D: usize>(
    system: &mut ContactSystem<D>,
    stage: &Stage,
) -> Result<Option<String>> {
    if system.contacts().is_empty() {
        return Ok(None);
    }
    let (start, end) = (stage.start.u.local(), stage.trial.u.local());
    let ends = StepEnds { start: &start, end: &end };
    let motions = system.contacts().iter().flat_map(|contact| {
        let [contactor, target] = shifts(system, contact, ends);
        let is_near = check(system, contact, ends).is_near();
        [contactor, target, f64::from(u8::from(is_near))]
    });
    let mut motions: Vec<f64> = motions.collect();
    let own = motions.clone();
    system.session().world().reduce_all(&own[..], &mut motions[..], SystemOperation::max());
    let contacts = system.contacts().iter().zip(motions.chunks_exact(3));
    let missed = contacts.map(|(contact, of_contact)| {
        check(system, contact, ends).missed(of_contact[0] + of_contact[1], of_contact[2] > 0.0)
    });
    let missed: Vec<Missed<D>> = missed.collect::<Result<_>>()?;
    let own: Vec<[u64; 2]> = missed
        .iter()
        .map(|missed| [&missed.between, &missed.through].map(|points| points.len() as u64))
        .collect();
    let mut all = vec![[0; 2]; own.len()];
    let world = system.session().world();
    world.reduce_all(own.as_flattened(), all.as_flattened_mut(), SystemOperation::sum());
    let m = system.bodies().units().of("m");
    if let Some(number) = all.iter().position(|[between, _]| *between > 0) {
        let place = first_place(system, &missed[number].between);
        return Ok(Some(describe_between(&system.contacts()[number], all[number][0], &place, &m)));
    }
    if let Some(number) = all.iter().position(|[_, through]| *through > 0) {
        let contact = &system.contacts()[number];
        let motion = &motions[3 * number..][..2];
        let by_rigid_target = if contact.target().has_facets() { 0.0 } else { motion[1] };
        let motion = motion[0] + motion[1];
        let expected = stage.inertia.then(|| by_rigid_target + expected_motion(system, stage));
        let place = first_place(system, &missed[number].through);
        return Ok(Some(describe_through(&contact.name, motion, expected, &place, &m)));
    }
    Ok(None)
}

/// Names the position before the deformation and the body of one of the `points` of all ranks: the
/// one with the smallest coordinates, x first. It is the same on all ranks. At least one rank has a
/// point. Collective.
fn first_place<const D: usize>(system: &ContactSystem<D>, points: &[BodyPoint<D>]) -> String {
    let world = system.session().world();
    let bodies = system.bodies();
    let equal = (EQUAL * bodies.size()).max(bodies.known_length());
    let mut points = points.to_vec();
    let mut place = [0.0; D];
    for k in 0..D {
        let own = points.iter().map(|point| point.reference[k]).fold(f64::INFINITY, f64::min);
        let mut least = 0.0;
        world.reduce_all(&own, &mut least, SystemOperation::min());
        points.retain(|point| point.reference[k] <= least + equal);
        place[k] = if least.abs() < equal { 0.0 } else { least };
    }
    let own = points.iter().map(|point| point.body as u64).min().unwrap_or(u64::MAX);
    let mut body = 0;
    world.reduce_all(&own, &mut body, SystemOperation::min());
    let m = bodies.units().of("m");
    let of_body = bodies.body_names().nth(body as usize).map(|name| format!(" of '{name}'"));
    format!("at {} {m}{}", spelled(&place), of_body.unwrap_or_default())
}

/// Largest motion \[m\] that speed and acceleration at the start predict for any node in the
/// step, plus the motion of supports. Collective.
fn expected_motion<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> f64 {
    let largest = |field: &[f64]| field.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let (u, u_start) = (stage.trial.u.owned(), stage.start.u.owned());
    let mut moved: Vec<f64> = u.iter().zip(u_start.iter()).map(|(end, start)| end - start).collect();
    system.bodies().held().keep(&mut moved);
    let prescribed = largest(&moved);
    let own = [largest(&stage.start.v.owned()), largest(&stage.start.a.owned()), prescribed];
    let mut all = [0.0; 3];
    system.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::max());
    all[0] * stage.dt + 0.5 * all[1] * stage.dt.powi(2) + all[2]
}

/// Largest motions of own nodes of contactor and target in the step \[m\]. For a rigid target it is
/// its motion at the nodes of the contactor.
fn shifts<const D: usize>(
    system: &ContactSystem<D>,
    contact: &LocalContact<D>,
    ends: StepEnds<'_>,
) -> [f64; 2] {
    let of_node = |node: u32| {
        let dofs = node as usize * D..node as usize * D + D;
        dofs.map(|dof| (ends.end[dof] - ends.start[dof]).powi(2)).sum::<f64>()
    };
    let surface = contact.surface();
    let contactor = surface.facets().iter().flat_map(|facet| surface.facet_nodes(facet));
    let contactor = contactor.map(|&node| of_node(node)).fold(0.0, f64::max);
    let mut target = carried(contact, ends);
    let mut nodes = Vec::new();
    for &facet in contact.pair.target_facets() {
        system.bodies().local().mesh.facet_nodes(facet, &mut nodes);
        target = nodes.iter().map(|&node| of_node(node)).fold(target, f64::max);
    }
    [contactor.sqrt(), target.sqrt()]
}

/// Largest motion of a rigid target at own nodes of the contactor \[m\], squared.
fn carried<const D: usize>(contact: &LocalContact<D>, ends: StepEnds<'_>) -> f64 {
    if !contact.target().is_moving() {
        return 0.0;
    }
    let surface = contact.surface();
    let nodes = surface
        .facets()
        .iter()
        .flat_map(|facet| surface.reference_points(facet).iter().zip(surface.facet_nodes(facet)));
    let carried = nodes
        .map(|(reference, &node)| contact.target().carries(&ends.path(reference, node).start).norm_squared());
    carried.fold(0.0, f64::max)
}

/// Explains why a step with points beyond their target is rejected. The surfaces move by `motion`
/// \[m\] in the step. Speeds and accelerations at its start predict at most `expected`, if known.
/// `place` is that of one of the points.
fn describe_through(contact: &str, motion: f64, expected: Option<f64>, place: &str, m: &str) -> String {
    match expected.filter(|expected| *expected > 0.0 && motion > RUNAWAY * expected) {
        Some(expected) => format!(
            "the computed equilibrium is implausible: the surfaces of contact '{contact}' would move by \
             {motion:.3e} {m} within one step, but velocities and accelerations at its start predict at \
             most {expected:.1e} {m}"
        ),
        None => format!(
            "contact '{contact}': missed contact: a surface would pass through the target within one step \
             {place}; the surfaces move by {motion:.3e} {m}"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::describe_through;

    /// Points that pass through their target are reported as such, except when the iterate has
    /// blown up, which is reported instead.
    #[test]
    fn a_balance_that_is_far_off_is_no_passage() {
        let tell =
            |motion, expected| describe_through("hit", motion, expected, "at [1, 0] m of 'block'", "m");
        let through = tell(1.5, Some(1.4));
        let words = "would pass through the target within one step at [1, 0] m of 'block'";
        assert!(through.contains(words) && through.contains("1.500e0 m"), "{through}");
        let off = tell(1.03, Some(1e-3));
        assert!(
            off.contains("implausible") && off.contains("1.030e0 m") && off.contains("1.0e-3 m"),
            "{off}"
        );
        assert!(!off.contains("pass through"), "{off}");
        for unknown in [None, Some(0.0)] {
            assert!(tell(1.03, unknown).contains("pass through"));
        }
    }
}
