//! Contacts that cannot close, because their surfaces start further apart than the bodies can move.

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, facets_of};
use crate::collective::Collective;
use crate::error::{Error, Result};
use crate::mesh::{Bounds, Facet};
use crate::model::{self, Model};

/// Maximum number of instants at which prescribed motions are evaluated.
const INSTANTS: f64 = 1.0e4;

/// Safety factor on the effect of motions and loads. A light body that is hit can move faster than
/// the body that hits it, and a load can act on a growing area.
const GENEROUS: f64 = 10.0;

/// Time of the motion, and the effects that act in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// End of the motion \[s\].
    pub end: f64,
    /// Largest step \[s\].
    pub step: f64,
    /// Whether inertia is included.
    pub is_dynamic: bool,
    /// Whether the motion starts from a static equilibrium.
    pub from_equilibrium: bool,
}

/// Bound on the motion of a body.
#[derive(Clone, Copy)]
struct Way {
    /// Motion by prescribed displacements \[m\].
    travel: f64,
    /// Motion by its velocity and by loads \[m\].
    flight: f64,
}

/// Rejects a contact whose surfaces start further apart than the bodies can move within the
/// time. Collective.
///
/// Bodies can move as far as their own size, because an elastic body that is held would have to
/// double its length. In addition they can move ten times `|u| + (|v| + |v_0|) T + a T^2 / 2`.
/// This uses the largest prescribed displacement and velocity, the largest displacement of a rigid
/// body, the largest initial velocity, and all loads on the lightest body. There is no bound on the effect of a load in statics, or
/// of a load that varies in time other than by a table. Surfaces with completely prescribed
/// motion move exactly as prescribed.
///
/// Only magnitudes count, not directions, because a load that pulls a body away may still close
/// a contact:
///
/// - A held body swings back by the amount it was pulled, and further while the load varies.
/// - A free body rotates about its centre of mass under an eccentric load.
/// - A third body or an obstacle can throw it back.
/// - A partner that is hit harder may follow it.
///
/// Only the centres of mass of two free bodies that touch nothing but each other move in the
/// direction of their loads. Such cases are so few that a false error would cost more than the
/// message saves.
///
/// # Errors
/// If a contact cannot close. The error names the contact, its gap and the available motion,
/// the same on all ranks.
pub fn require_reach<const D: usize>(
    system: &mut ContactSystem<D>,
    model: &Model<D>,
    span: &Span,
) -> Result<()> {
    let mut motion = None;
    for (at, contact) in model.contacts.iter().enumerate() {
        let gap = system.overclosures()[at].smallest_gap;
        let sizes = sizes(system, contact);
        let held = is_prescribed(system, contact)?;
        if gap <= if held { 0.0 } else { sizes } {
            continue;
        }
        let gap = if gap < f64::MAX { gap } else { between(system, contact)? };
        let Way { travel, flight } = match motion {
            Some(way) => way,
            None => *motion.insert(way(system, model, span)),
        };
        let reach = match held {
            true => 2.0 * (D as f64).sqrt() * travel,
            false => sizes + GENEROUS * (travel + flight),
        };
        if gap > reach {
            let (m, s) = (system.bodies().units().of("m"), system.bodies().units().of("s"));
            let message = format!(
                "contact '{}' can not close: its surfaces are initially {gap:.3e} {m} apart, and within \
                     {} {s} the bodies move by at most {reach:.3e} {m}",
                contact.name, span.end
            );
            return Err(Error::case(message).hint(&format!(
                "check that all lengths are in {m}, move the bodies closer, or remove the contact"
            )));
        }
    }
    Ok(())
}

/// Distance between the boxes around the two surfaces of a contact between bodies \[m\].
fn between<const D: usize>(system: &ContactSystem<D>, contact: &model::ContactModel<D>) -> Result<f64> {
    let Some(set) = contact.target.set() else { return Ok(0.0) };
    let [one, other] = [contact.contactor.as_str(), set]
        .map(|set| facets_of(system.bodies().local(), set).map(|facets| bounds(system, facets)));
    let (one, other) = (one?, other?);
    let apart = |k: usize| (one.low[k] - other.high[k]).max(other.low[k] - one.high[k]).max(0.0);
    Ok((0..D).map(|k| apart(k).powi(2)).sum::<f64>().sqrt())
}

/// The box around facets of all ranks. Collective.
fn bounds<const D: usize>(system: &ContactSystem<D>, facets: &[Facet]) -> Bounds<D> {
    let mesh = &system.bodies().local().mesh;
    let of_facet = |&facet: &Facet| {
        let mut nodes = Vec::new();
        mesh.facet_nodes(facet, &mut nodes);
        Bounds::of_facet(mesh.facet_kind(facet), nodes.iter().map(|&node| mesh.points[node as usize]))
    };
    joined(system, facets.iter().map(of_facet).fold(Bounds::EMPTY, |all, one| all.join(&one)))
}

/// The box around the boxes of all ranks. Collective.
fn joined<const D: usize>(system: &ContactSystem<D>, own: Bounds<D>) -> Bounds<D> {
    let (mut low, mut high) = ([0.0; D], [0.0; D]);
    let world = system.session().world();
    world.reduce_all(&own.low[..], &mut low[..], SystemOperation::min());
    world.reduce_all(&own.high[..], &mut high[..], SystemOperation::max());
    Bounds { low, high }
}

/// Diagonals of the boxes around the bodies of a contact \[m\]. Collective.
fn sizes<const D: usize>(system: &ContactSystem<D>, contact: &model::ContactModel<D>) -> f64 {
    let mesh = &system.bodies().local().mesh;
    let size = |body: usize| {
        let elements = (0..mesh.element_count()).filter(|&element| usize::from(mesh.body[element]) == body);
        let nodes = elements.flat_map(|element| mesh.element_nodes(element));
        let around = joined(system, Bounds::of(nodes.map(|&node| mesh.points[node as usize])));
        (0..D).map(|k| (around.high[k] - around.low[k]).powi(2)).sum::<f64>().sqrt()
    };
    contact.all_bodies().into_iter().map(size).sum()
}

/// Whether the motion of the contactor, and of the target as well, is completely prescribed.
/// Collective.
fn is_prescribed<const D: usize>(
    system: &ContactSystem<D>,
    contact: &model::ContactModel<D>,
) -> Result<bool> {
    let mut free = 0u64;
    let mut nodes = Vec::new();
    for set in contact.sets() {
        for &facet in facets_of(system.bodies().local(), set)? {
            system.bodies().local().mesh.facet_nodes(facet, &mut nodes);
            let dofs = nodes.iter().flat_map(|&node| node as usize * D..(node as usize + 1) * D);
            free += dofs.filter(|&dof| !system.bodies().held().axes()[dof]).count() as u64;
        }
    }
    let mut all = 0;
    system.session().world().reduce_all(&free, &mut all, SystemOperation::sum());
    Ok(all == 0)
}

/// Bounds the motion of a body by prescribed motions, initial velocities and loads. Collective.
fn way<const D: usize>(system: &mut ContactSystem<D>, model: &Model<D>, span: &Span) -> Way {
    let kinks = model.kinks().into_iter().filter(|time| (0.0..=span.end).contains(time));
    let kinks: Vec<f64> = kinks.chain([0.0, span.end]).collect();
    let steps = (span.end / span.step * (1.0 - 1e-12)).clamp(1.0, INSTANTS).ceil();
    let even = (0..=steps as u32).map(|k| span.end * f64::from(k) / steps);
    let instants: Vec<f64> = even.chain(kinks.iter().copied()).collect();
    let [travel, speed] = system.bodies().supports().largest(&system.bodies().local().mesh.points, &instants);
    let travel = travel.max(travel_of_rigid(model, &instants));
    let speed = speed + speed_at_start(system, model);
    let part = load(system, model, &kinks);
    let lightest = system.bodies().masses().into_iter().fold(f64::INFINITY, f64::min);
    let world = system.session().world();
    let mut most = [0.0; 2];
    let mut load = 0.0;
    world.reduce_all(&[travel, speed][..], &mut most[..], SystemOperation::max());
    world.reduce_all(&part, &mut load, SystemOperation::sum());
    let [travel, speed] = most;
    let flight = match (load > 0.0, span.is_dynamic) {
        (true, true) if !span.from_equilibrium => speed * span.end + 0.5 * load / lightest * span.end.powi(2),
        (true, _) => f64::INFINITY,
        (false, true) => speed * span.end,
        (false, false) => 0.0,
    };
    Way { travel, flight }
}

/// Largest component of the displacement of any rigid body at `instants` \[m\]. There is no bound
/// on the motion of the surface of a body that rotates or is free.
fn travel_of_rigid<const D: usize>(model: &Model<D>, instants: &[f64]) -> f64 {
    let mut most = 0.0_f64;
    for body in &model.rigid {
        let Some(motion) = body.prescribed().filter(|motion| !motion.rotates()) else {
            return f64::INFINITY;
        };
        let values = motion
            .translation
            .iter()
            .flat_map(|function| instants.iter().map(move |&time| function.value([0.0; 3], time).abs()));
        most = values.fold(most, f64::max);
    }
    most
}

/// Sum of the loads on this rank's nodes, as the largest value at `instants` \[N\].
fn load<const D: usize>(system: &mut ContactSystem<D>, model: &Model<D>, instants: &[f64]) -> f64 {
    if !model.loads.iter().all(|load| load.kind.is_linear_between_kinks()) {
        return f64::INFINITY;
    }
    let mut force = vec![0.0; system.bodies().local().index.owned * D];
    let at = |time: &f64| {
        force.fill(0.0);
        system.add_undeformed_loads(*time, &mut force);
        force.iter().map(|entry| entry.abs()).sum()
    };
    instants.iter().map(at).fold(0.0, f64::max)
}

/// Largest initial velocity of this rank's bodies \[m/s\].
fn speed_at_start<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> f64 {
    let mesh = &system.bodies().local().mesh;
    let of_element = |element: usize| {
        let functions = &model.bodies[usize::from(mesh.body[element])].initial_velocity;
        let at = |&node: &u32| {
            let point = crate::tensor::in_space(&mesh.points[node as usize]);
            functions.iter().map(|function| function.value(point, 0.0).powi(2)).sum::<f64>().sqrt()
        };
        mesh.element_nodes(element).iter().map(at).fold(0.0, f64::max)
    };
    (0..mesh.element_count()).map(of_element).fold(0.0, f64::max)
}
