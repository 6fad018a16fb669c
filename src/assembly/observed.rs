//! What observers may read of a system, see [`crate::observe`].

use super::contact::LocalContact;
use super::system::ContactSystem;

impl<const D: usize> ContactSystem<D> {
    /// The contacts with their points on this rank.
    pub fn contacts(&self) -> &[LocalContact<D>] {
        &self.contacts
    }

    /// Loads on the owned unknowns at the last residual \[N\].
    pub fn external_forces(&self) -> &[f64] {
        &self.parts.external
    }
}
