//! Detection of missed contact.
//!
//! A body can pass through its target between the ends of a step. An obstacle can also be smaller
//! than the spacing of the contactor's points.

mod moving;

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact};
use crate::collective::Collective;
use crate::contact::history::History;
use crate::contact::obstacle::{Core, Shape};
use crate::contact::passage::{Path, lies_between, normal_of};
use crate::dynamics::Stage;
use crate::error::Result;
use crate::mesh::{Bounds, BoundsTree, spelled};
use crate::tensor::Vector as Point;
use moving::{BodyPoint, Moving, StepEnds, around, nodes_of, parts, points_of, reference_of};

/// Factor on the expected motion above which surfaces did not pass through a target. The balance
/// that was found is then a different one.
const RUNAWAY: f64 = 20.0;

/// Coordinates that differ by less than this fraction of the size of all bodies are equal. It is
/// well above rounding, which depends on the partition. Half and twice the value choose the same
/// point in the test.
const EQUAL: f64 = 1e-9;

/// Findings for each contact on this rank.
struct Found<const D: usize> {
    /// Centres of the facets around small obstacles.
    between: Vec<Vec<BodyPoint<D>>>,
    /// Points that passed through the target.
    through: Vec<Vec<BodyPoint<D>>>,
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
        let near = if contact.is_deformable() {
            is_deep(contact)
        } else {
            has_a_point_at_its_obstacle(contact, ends)
        };
        [contactor, target, f64::from(u8::from(near))]
    });
    let mut motions: Vec<f64> = motions.collect();
    let own = motions.clone();
    system.session().world().reduce_all(&own[..], &mut motions[..], SystemOperation::max());
    let found = find(system, ends, &motions)?;
    let counts = found.between.iter().chain(&found.through).map(|points| points.len() as u64);
    let own: Vec<u64> = counts.collect();
    let mut all = own.clone();
    system.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::sum());
    let (between, through) = all.split_at(system.contacts().len());
    let m = system.bodies().units().of("m");
    if let Some(number) = between.iter().position(|facets| *facets > 0) {
        let place = first_place(system, &found.between[number]);
        return Ok(Some(tell_between(&system.contacts()[number], between[number], &place, &m)));
    }
    if let Some(number) = through.iter().position(|points| *points > 0) {
        let contact = &system.contacts()[number];
        let motion = &motions[3 * number..][..2];
        let by_target = if contact.is_deformable() { 0.0 } else { motion[1] };
        let motion = motion[0] + motion[1];
        let expected = stage.inertia.then(|| by_target + expected_motion(system, stage));
        let place = first_place(system, &found.through[number]);
        return Ok(Some(tell_through(&contact.name, motion, expected, &place, &m)));
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

/// Checks all contacts. Collective.
///
/// For each contact, `motions` contains those of [`shifts`], and whether a point
/// may touch the obstacle or is deep in a body. All values are maxima over all ranks.
fn find<const D: usize>(system: &ContactSystem<D>, ends: StepEnds<'_>, motions: &[f64]) -> Result<Found<D>> {
    let mut found = Found { between: Vec::new(), through: Vec::new() };
    let bodies = &system.bodies().local().mesh.body;
    for (contact, motion) in system.contacts().iter().zip(motions.chunks_exact(3)) {
        let [motion, met] = [motion[0] + motion[1], motion[2]];
        let (between, through) = match contact.obstacle() {
            Some(obstacle) => {
                let through = match motion > 0.0 {
                    true => passing(contact, obstacle, ends, bodies),
                    false => Vec::new(),
                };
                (between_points(contact, obstacle, ends, bodies, met > 0.0), through)
            }
            None => {
                // Points deeper than half the depth have less weight. A point that gets there
                // in one long step may not be pushed back. A point that starts the step there
                // may get deeper.
                let depth = contact.pair.depth();
                let mut through = Vec::new();
                if motion > contact.pair.stride() {
                    through.extend(swept(system, contact, ends, motion, 0.5 * depth)?);
                }
                if met > 0.0 {
                    through.extend(swept(system, contact, ends, motion, depth)?);
                }
                (Vec::new(), through)
            }
        };
        found.between.push(between);
        found.through.push(through);
    }
    Ok(found)
}

/// Points of either surface that went deeper than `depth` behind the other one, while
/// the surfaces moved by `motion` \[m\]. Collective.
fn swept<const D: usize>(
    system: &ContactSystem<D>,
    contact: &LocalContact<D>,
    ends: StepEnds<'_>,
    motion: f64,
    depth: f64,
) -> Result<Vec<BodyPoint<D>>> {
    let surfaces = contact.pair.surfaces(system.bodies().local());
    let target = Moving::gathered(system.session(), &surfaces, ends, motion + depth)?;
    let contactor = Moving::local(system.bodies().local(), surfaces.contactor, ends);
    let spacing = EDGE * contact.pair.facet();
    let limits = [depth, 0.5 * contact.pair.depth()];
    let mut found = crossings(&contactor, &target, limits, spacing);
    found.extend(crossings(&target, &contactor, limits, spacing));
    Ok(found)
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

/// Spacing of the points on edges whose paths are tested, relative to the size of a facet. Two
/// edges that cross each other are detected by such a point.
const EDGE: f64 = 0.25;

/// Nodes of the facets `a`, and points on their edges, that passed through a facet of `b` and end
/// more than `depth` \[m\] behind it. A point that went around an edge of `b` and ends at most
/// `seen` \[m\] from the next facet, such as one ahead of a block that slides over it, did not.
fn crossings<const D: usize>(
    a: &Moving<D>,
    b: &Moving<D>,
    [depth, seen]: [f64; 2],
    spacing: f64,
) -> Vec<BodyPoint<D>> {
    let simplices = b.simplices();
    let boxes: Vec<Bounds<D>> = simplices.iter().map(|corners| around(corners)).collect();
    let tree = BoundsTree::new(&boxes);
    let crosses = |path: &Path<D>| {
        let near: Vec<_> = tree.meeting(&around(&[*path]).inflate(depth)).collect();
        let corners = |simplex: &u32| &simplices[*simplex as usize];
        let around_edge =
            |crossed: &u32| near.iter().any(|other| path.goes_around(corners(crossed), corners(other), seen));
        near.iter().any(|simplex| path.crosses(corners(simplex), depth) && !around_edge(simplex))
    };
    let crossing = a.vertices(spacing).into_iter().filter(|vertex| crosses(&vertex.path));
    crossing.map(|vertex| vertex.point).collect()
}

/// Explains why a step with points beyond their target is rejected. The surfaces move by `motion`
/// \[m\] in the step. Speeds and accelerations at its start predict at most `expected`, if known.
/// `place` is that of one of the points.
fn tell_through(contact: &str, motion: f64, expected: Option<f64>, place: &str, m: &str) -> String {
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

/// Explains that an obstacle lies between the points of some `facets`, one of them at `place`.
fn tell_between<const D: usize>(contact: &LocalContact<D>, facets: u64, place: &str, m: &str) -> String {
    let radius = contact.obstacle().and_then(Shape::core).map_or(0.0, |core| core.radius);
    format!(
        "contact '{}': the obstacle (radius {radius:.3e} {m}) lies between the contact points of {facets} \
         facets (size about {:.3e} {m}), one of them {place}, and none of the points touches it: use \
         contactor facets smaller than the radius",
        contact.name, contact.facet_size
    )
}

/// Whether a vertex of this rank was so deep in its target at the start of the step that points
/// around it have lost weight.
fn is_deep<const D: usize>(contact: &LocalContact<D>) -> bool {
    let gap = |(vertex, history): (usize, &History<D>)| history.gap + contact.state.adjusted(vertex);
    contact.state.history.iter().enumerate().map(gap).any(|gap| gap < -0.5 * contact.pair.depth())
}

/// Depth, relative to the length of a facet, from which a round obstacle that no point can touch
/// counts as sunk in.
const SHALLOW: f64 = 0.02;

/// Whether a point of this rank is above a round obstacle, so that it would touch before the facet
/// is one radius deep.
fn has_a_point_at_its_obstacle<const D: usize>(contact: &LocalContact<D>, ends: StepEnds<'_>) -> bool {
    let Some(obstacle) = contact.obstacle() else { return false };
    // If a facet is no longer than the thickness of the obstacle, its points nearly touch the
    // obstacle.
    let core = obstacle.core().filter(|core| core.radius < 4.0 * contact.facet_size);
    let Some(core) = core else { return true };
    let surface = contact.surface();
    surface.facets().iter().any(|facet| {
        let nodes = nodes_of(contact, facet, ends);
        if obstacle.gap(&nodes[0].end) > 2.0 * contact.facet_size {
            return false;
        }
        let outward = normal_of(&std::array::from_fn(|k| nodes[k].end));
        let Some(outward) = outward.try_normalize(0.0) else { return false };
        points_of(obstacle, facet.kind, contact.plane(), &nodes).any(|point| {
            let away = core.offset(&point.end);
            let height = away.dot(&outward);
            height.abs() <= core.radius + contact.facet_size && (away - outward * height).norm() < core.radius
        })
    })
}

/// Points of this rank's facets that passed through an obstacle. `bodies` has the body of each
/// element.
fn passing<const D: usize>(
    contact: &LocalContact<D>,
    obstacle: &dyn Shape<D>,
    ends: StepEnds<'_>,
    bodies: &[u16],
) -> Vec<BodyPoint<D>> {
    let surface = contact.surface();
    let mut found = Vec::new();
    for facet in surface.facets() {
        let nodes = nodes_of(contact, facet, ends);
        let paths = points_of(obstacle, facet.kind, contact.plane(), &nodes);
        let places = reference_of(obstacle, facet.kind, contact.plane(), surface.reference_points(facet));
        let body = usize::from(bodies[facet.facet.element as usize]);
        let passes = paths.zip(places).filter(|(path, _)| path.passes_obstacle(obstacle));
        found.extend(passes.map(|(_, reference)| BodyPoint { reference, body }));
    }
    found
}

/// Centres of the facets of this rank that contain a small round obstacle but have no point that touches
/// it.
///
/// If a point of the contact can touch the obstacle (`met`), the obstacle must be half of its
/// radius deep. Otherwise a shallow depth is sufficient. `bodies` has the body of each element.
fn between_points<const D: usize>(
    contact: &LocalContact<D>,
    obstacle: &dyn Shape<D>,
    ends: StepEnds<'_>,
    bodies: &[u16],
    met: bool,
) -> Vec<BodyPoint<D>> {
    let Some(Core { radius, .. }) = obstacle.core() else { return Vec::new() };
    let surface = contact.surface();
    let mut found = Vec::new();
    for facet in surface.facets() {
        let corners = nodes_of(contact, facet, ends);
        if points_of(obstacle, facet.kind, contact.plane(), &corners)
            .any(|point| obstacle.gap(&point.end) <= 0.0)
        {
            continue;
        }
        let around = around(&corners);
        let size = (Point::<D>::from(around.high) - Point::from(around.low)).norm();
        // A facet no longer than the thickness of the obstacle always has a point in it before
        // reaching this depth.
        let deep = if met { 0.5 * radius } else { (SHALLOW * size).min(0.5 * radius) };
        if radius >= 2.0 * size || obstacle.gap(&corners[0].end) > size - deep {
            continue;
        }
        let mut lies = false;
        parts(facet.kind, |part| {
            lies |= lies_between(&std::array::from_fn(|k| corners[part[k]]), obstacle, deep)
        });
        if lies {
            let nodes = &surface.reference_points(facet)[..facet.kind.corners()];
            let reference = nodes.iter().sum::<Point<D>>() / nodes.len() as f64;
            found.push(BodyPoint { reference, body: usize::from(bodies[facet.facet.element as usize]) });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::tell_through;

    /// Points that pass through their target are reported as such, except when the iterate has
    /// blown up, which is reported instead.
    #[test]
    fn a_balance_that_is_far_off_is_no_passage() {
        let tell = |motion, expected| tell_through("hit", motion, expected, "at [1, 0] m of 'block'", "m");
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
