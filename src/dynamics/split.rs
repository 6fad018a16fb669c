//! The quantities that the stages of a staggered solve hold fixed.

use serde::{Deserialize, Serialize};

use super::Equations;

/// Which coupling between normal contact and friction a stage cuts, by holding fixed what the other
/// stage solves for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Split {
    /// No coupling is cut: the balance itself, (3.5).
    #[default]
    Monolithic,
    /// Stage I (3.6): normal contact is solved for. `KnownFriction` defines which part of friction
    /// is known.
    NormalStage(KnownFriction),
    /// Stage II (3.7): friction is solved for, with known normal tractions in a known zone.
    FrictionStage,
}

/// Which part of friction is known in stage I.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum KnownFriction {
    /// The friction bound. The friction traction follows the slip up to it.
    #[default]
    Bound,
    /// The friction traction itself.
    Traction,
}

/// Tractions that a stage holds fixed from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Freeze {
    /// Bound and friction traction at the end of the last step.
    LastStep,
    /// Normal tractions at the last residual, and the friction bound that follows from them.
    NormalTractions,
    /// Friction tractions at the last residual.
    FrictionTractions,
    /// Bound and friction traction, moved by this fraction from the previously frozen values to the
    /// current ones.
    Part(f64),
}

/// Forces of the contact points, 2-norms over all points \[N\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ForceChange {
    /// How much the friction forces differ from the frozen ones.
    pub friction: f64,
    /// Size of the normal forces.
    pub normal: f64,
}

/// What the stages of a staggered solve hold fixed. By default nothing can be held, as in a system
/// without contact.
pub trait Staging: Equations {
    /// Sets which quantities are held fixed from now on.
    fn set_split(&mut self, _split: Split) {}

    /// Stores tractions that the stages of a [`Split`] hold fixed.
    fn freeze(&mut self, _what: Freeze) {}

    /// Compares the friction forces of the last residual with the frozen ones. Collective.
    fn force_change(&self) -> ForceChange {
        ForceChange::default()
    }
}
