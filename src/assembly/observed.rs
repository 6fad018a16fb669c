//! What observers may read of a system, see [`crate::observe`].

use super::contact::LocalContact;
use super::system::ContactSystem;
use crate::petsc::Values;

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
}
