//! The augmented Lagrangian: multipliers that bring contact to a requested penetration.

use super::Equations;

/// By how much contact misses the requested tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shortfall {
    /// Largest ratio, over all points, of penetration (or of the gap under pressure) to its
    /// tolerance.
    pub ratio: f64,
    /// The penetration or gap at that point \[m\].
    pub depth: f64,
}

/// Correction of contact towards a requested penetration. By default none is requested.
pub trait Augmentation: Equations {
    /// Resets the multipliers that are sought to those of the last accepted step.
    fn reset_multipliers(&mut self) {}

    /// Returns how far contact points of the last residual are from touching exactly. `None` if no
    /// tolerance was requested. Collective.
    fn shortfall(&self) -> Option<Shortfall> {
        None
    }

    /// Brings contacts that are not in motion closer to the requested tolerance, by multipliers or
    /// by a stiffer penalty. Collective.
    fn improve(&mut self) {}
}
