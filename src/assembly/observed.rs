//! What observers may read of a system, see [`crate::observe`].

use super::contact::LocalContact;
use super::stages::{active_damping, hold};
use super::system::ContactSystem;
use crate::contact::damping::ActiveDamping;
use crate::contact::evaluation::ContactRequest;
use crate::contact::mortar::resultant::ContactResultant;
use crate::contact::state::Hold;
use crate::dynamics::{OverStep, Stage};
use crate::petsc::Values;

/// Resultants of a contact on this rank.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactResultants<const D: usize> {
    /// Of pressure, friction and damping.
    pub whole: ContactResultant<D>,
    /// Of the pressure, with its damping.
    pub normal: ContactResultant<D>,
}

impl<const D: usize> ContactSystem<D> {
    /// The contacts with their points on this rank.
    pub fn contacts(&self) -> &[LocalContact<D>] {
        &self.contacts
    }

    /// Whether bodies are damped or there are dashpots.
    pub fn is_damped(&self) -> bool {
        self.bodies.is_damped() || self.bodies.elastic.is_damped()
    }

    /// Damping forces on the owned unknowns at the last residual \[N\]; empty without damping.
    pub fn damping_forces(&self) -> Values<'_> {
        self.damping.owned()
    }

    /// Loads on the owned unknowns at the last residual \[N\].
    pub fn external_forces(&self) -> &[f64] {
        &self.parts.external
    }

    /// Names of the loads, in the order of [`Self::each_load`].
    pub fn load_names(&self) -> impl Iterator<Item = &str> {
        self.external.names()
    }

    /// Calls `receive` with the number of each load and its force on the owned unknowns \[N\] at
    /// the trial state of `stage`, with the load factor of the last evaluation.
    pub fn each_load(&self, stage: &Stage, receive: impl FnMut(usize, &[f64])) {
        let u = stage.trial.u.local();
        let at = Self::moment(stage, self.factor, &u);
        self.external.each(&at, &self.bodies.solids, self.parts.external.len(), receive);
    }

    /// Resultants of each contact at the last evaluation of the forces. Forces that act over a step
    /// act at the positions in its middle.
    pub fn contact_resultants(&self, stage: &Stage) -> Vec<ContactResultants<D>> {
        let Some(interface) = &self.interface else {
            return vec![ContactResultants::default(); self.contacts.len()];
        };
        let fields = interface.fields();
        let request = ContactRequest {
            hold: hold(self.continuation.friction, self.split),
            over_step: stage.over_step != OverStep::No,
            step: stage.dt,
            damping: active_damping(self.continuation.damped),
            ..ContactRequest::default()
        };
        let of = |contact: &LocalContact<D>| {
            let whole = contact.pair.resultant(&fields, &request, &contact.state);
            let law = contact.law();
            let normal = if law.friction.is_none() && law.damping.tangential.is_none() {
                whole
            } else {
                let damping = match request.damping {
                    ActiveDamping::Off => ActiveDamping::Off,
                    ActiveDamping::Whole | ActiveDamping::Normal => ActiveDamping::Normal,
                };
                let request = ContactRequest { hold: Hold::Frictionless, damping, ..request };
                contact.pair.resultant(&fields, &request, &contact.state)
            };
            ContactResultants { whole, normal }
        };
        self.contacts.iter().map(of).collect()
    }
}
