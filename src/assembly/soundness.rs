//! Checks whether computed values are finite and not too large, and locates those that are not.
//! Such a state must not be accepted as a balance or be written to a file.

use super::system::ContactSystem;
use crate::dynamics::Stage;
use crate::error::{Error, agree};
use crate::mesh::spelled;

/// Whether a value and its square can be compared and summed.
fn is_sound(value: f64) -> bool {
    (value * value).is_finite()
}

/// The first unknown of this rank at which a force of the last residual is not finite or too
/// large.
pub(super) fn unsound_force<const D: usize>(system: &ContactSystem<D>) -> Option<Error> {
    let forces = [
        ("internal force", &system.parts.internal),
        ("contact force", &system.parts.contact),
        ("load", &system.parts.external),
        ("force of a foundation or spring", &system.parts.springs),
    ];
    let owned = system.bodies.local.index.owned * D;
    forces.iter().find_map(|(what, force)| {
        let dof = force.iter().take(owned).position(|value| !is_sound(*value))?;
        Some(unsound(system, what, dof, force[dof]))
    })
}

/// Returns why the state at the end of the step in `stage` cannot be accepted although it
/// balances: a part of it is not finite or is too large. The same on all ranks. Collective.
pub fn unsound_state<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Option<String> {
    let u = stage.trial.u.owned();
    let v = stage.trial.v.owned();
    let a = stage.trial.a.owned();
    let fields = [("displacement", &u[..]), ("velocity", &v[..]), ("acceleration", &a[..])];
    let in_fields = fields.iter().find_map(|(what, field)| {
        let dof = field.iter().position(|value| !is_sound(*value))?;
        Some(unsound(system, what, dof, field[dof]))
    });
    let own = in_fields.or_else(|| unsound_force(system)).or_else(|| unsound_contact(system));
    agree(system.bodies.session.world(), own.map_or(Ok(()), Err)).err().map(|error| error.message)
}

/// Finds a contact with a point whose tractions are not finite or are too large.
fn unsound_contact<const D: usize>(system: &ContactSystem<D>) -> Option<Error> {
    let sound = |contact: &&super::contact::LocalContact<D>| {
        contact.state.current.iter().all(|point| {
            let all = point.friction_traction.iter().chain(point.slip_velocity.iter());
            all.chain([&point.normal_traction, &point.area]).all(|value| is_sound(*value))
        })
    };
    let contact = system.contacts.iter().find(|contact| !sound(contact))?;
    Some(Error::not_converged(format!(
        "contact '{}': a traction on rank {} is not finite or too large",
        contact.name,
        system.bodies.session.rank()
    )))
}

fn unsound<const D: usize>(system: &ContactSystem<D>, what: &str, dof: usize, value: f64) -> Error {
    let node = dof / D;
    let component = dof % D;
    Error::not_converged(format!(
        "the {what} at node {}, {} {}, on rank {}, is not finite or too large: {} = {value:e}",
        system.bodies.local.input_node[node],
        spelled(&system.bodies.local.mesh.points[node]),
        system.bodies.units.of("m"),
        system.bodies.session.rank(),
        ["x", "y", "z"][component]
    ))
}
