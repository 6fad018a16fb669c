//! Applies the stages of the two-stage scheme (3.6), (3.7) to the contacts: which quantities each
//! stage holds fixed.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::LocalContact;
use super::interface::{Interface, RemoteForce};
use crate::collective::Collective;
use crate::contact::damping::ActiveDamping;
use crate::contact::evaluation::ContactFields;
use crate::contact::state::{self, Hold, Keep};
use crate::dynamics::{ForceChange, Freeze, FrictionMode, KnownFriction, Sides, Split};
use crate::petsc::{Matrix, Vector};
use crate::tensor::Vector as Point;

/// The matrix into which terms are assembled.
pub enum MatrixTarget<'a> {
    /// The system's own matrix.
    Own,
    /// Another matrix with the same pattern.
    Other(&'a mut Matrix),
    /// Another matrix with the same pattern, with springs in place of contact that are at most as
    /// stiff as the elements beneath it.
    Joined(&'a mut Matrix),
}

/// Part of the damping of contacts that acts.
pub fn active_damping(damped: bool) -> ActiveDamping {
    if damped { ActiveDamping::Whole } else { ActiveDamping::Off }
}

/// Quantities that the contact law holds fixed in this stage.
pub fn hold(friction: FrictionMode, split: Split) -> Hold {
    match (friction, split) {
        (FrictionMode::Off, _) => Hold::Frictionless,
        (FrictionMode::AsGiven, Split::Monolithic) => Hold::Nothing,
        (FrictionMode::AsGiven, Split::NormalStage(KnownFriction::Bound)) => Hold::Bound,
        (FrictionMode::AsGiven, Split::NormalStage(KnownFriction::Traction)) => Hold::FrictionTraction,
        (FrictionMode::AsGiven, Split::FrictionStage) => Hold::BoundAndPressure,
    }
}

/// Stores tractions of all points that the stages hold fixed.
pub fn freeze<const D: usize>(contacts: &mut [LocalContact<D>], what: Freeze) {
    let keep = match what {
        Freeze::LastStep => Keep::LastStep,
        Freeze::NormalTractions => Keep::Pressure,
        Freeze::FrictionTractions => Keep::Friction,
        Freeze::Part(part) => Keep::Part(part),
    };
    contacts.iter_mut().for_each(|contact| contact.state.freeze(keep));
}

/// Compares the friction forces with the frozen ones, over all ranks. Collective.
pub fn force_change<const D: usize>(
    world: &impl CommunicatorCollectives,
    contacts: &[LocalContact<D>],
) -> ForceChange {
    let mut own = state::SquaredForceChange::default();
    contacts.iter().for_each(|contact| own += contact.force_change());
    let mut total = [0.0f64; 2];
    world.reduce_all(&[own.friction, own.normal], &mut total, SystemOperation::sum());
    ForceChange { friction: total[0].sqrt(), normal: total[1].sqrt() }
}

/// Computes mean normals of the closed points at each owned node, normalised to unit length, into
/// `out`. Collective.
pub fn contact_normals<const D: usize>(
    world: &impl CommunicatorCollectives,
    contacts: &[LocalContact<D>],
    interface: Option<&mut Interface<D>>,
    out: &mut Vector,
) {
    let mut normals = out.owned_mut();
    normals.fill(0.0);
    if let Some(interface) = interface {
        let add = |_: &ContactFields, own: &mut [f64], mut remote: RemoteForce| {
            contacts.iter().for_each(|contact| contact.add_normals(own, remote.reborrow()));
        };
        interface.add_forces(world, &mut normals, add, || ());
    }
    for normal in normals.chunks_exact_mut(D) {
        let sum = Point::<D>::from_column_slice(normal);
        let unit = sum.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Point::zeros);
        normal.copy_from_slice(unit.as_slice());
    }
}

/// Marks the owned nodes of these sides that closed points couple. Collective.
pub fn contact_nodes<const D: usize>(
    world: &impl CommunicatorCollectives,
    contacts: &[LocalContact<D>],
    interface: Option<&mut Interface<D>>,
    sides: Sides,
    owned: usize,
) -> Vec<bool> {
    let mut marks = vec![0.0; owned * D];
    if let Some(interface) = interface {
        let add = |_: &ContactFields, own: &mut [f64], mut remote: RemoteForce| {
            contacts.iter().for_each(|contact| contact.add_marks(sides, own, remote.reborrow()));
        };
        interface.add_forces(world, &mut marks, add, || ());
    }
    marks.chunks_exact(D).map(|node| node[0] > 0.0).collect()
}
