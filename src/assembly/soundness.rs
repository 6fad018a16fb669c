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

impl<const D: usize> ContactSystem<D> {
    /// The first unknown of this rank at which a force of the last residual is not finite or too
    /// large.
    pub(super) fn unsound_force(&self) -> Option<Error> {
        let forces = [
            ("internal force", &self.parts.internal),
            ("contact force", &self.parts.contact),
            ("load", &self.parts.external),
        ];
        let owned = self.local.index.owned * D;
        forces.iter().find_map(|(what, force)| {
            let dof = force.iter().take(owned).position(|value| !is_sound(*value))?;
            Some(self.unsound(what, dof, force[dof]))
        })
    }

    /// Returns why the state at the end of the step in `stage` cannot be accepted although it
    /// balances: a part of it is not finite or is too large. The same on all ranks. Collective.
    pub fn unsound_state(&self, stage: &Stage) -> Option<String> {
        let (u, v, a) = (stage.trial.u.owned(), stage.trial.v.owned(), stage.trial.a.owned());
        let fields = [("displacement", &u[..]), ("velocity", &v[..]), ("acceleration", &a[..])];
        let in_fields = fields.iter().find_map(|(what, field)| {
            let dof = field.iter().position(|value| !is_sound(*value))?;
            Some(self.unsound(what, dof, field[dof]))
        });
        let own = in_fields.or_else(|| self.unsound_force()).or_else(|| self.unsound_contact());
        agree(self.session.world(), own.map_or(Ok(()), Err)).err().map(|error| error.message)
    }

    /// Finds a contact with a point whose tractions are not finite or are too large.
    fn unsound_contact(&self) -> Option<Error> {
        let sound = |contact: &&super::contact::LocalContact<D>| {
            contact.state.current.iter().all(|point| {
                let all = point.friction_traction.iter().chain(point.slip_velocity.iter());
                all.chain([&point.normal_traction, &point.area]).all(|value| is_sound(*value))
            })
        };
        let contact = self.contacts.iter().find(|contact| !sound(contact))?;
        Some(Error::not_converged(format!(
            "contact '{}': a traction on rank {} is not finite or too large",
            contact.name,
            self.session.rank()
        )))
    }

    fn unsound(&self, what: &str, dof: usize, value: f64) -> Error {
        let node = dof / D;
        let component = dof % D;
        Error::not_converged(format!(
            "the {what} at node {}, {} {}, on rank {}, is not finite or too large: {} = {value:e}",
            self.local.input_node[node],
            spelled(&self.local.mesh.points[node]),
            self.units.of("m"),
            self.session.rank(),
            ["x", "y", "z"][component]
        ))
    }
}
