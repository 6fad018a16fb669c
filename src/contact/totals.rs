//! Energies of a contact.

/// Energies of a contact on this rank \[J\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactEnergy {
    /// Energy stored by the normal law and by elastic stick.
    pub stored: f64,
    /// Frictional heat of the step that ends in the current state.
    pub heat_of_step: f64,
    /// Heat of damping in that step.
    pub damping_of_step: f64,
}
