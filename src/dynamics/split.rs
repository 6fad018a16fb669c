//! What the stages of a staggered solve cut and hold.

/// Which of the couplings between normal contact and friction a stage cuts, by holding what the other stage finds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Split {
    /// None: the balance itself, (3.5).
    #[default]
    Monolithic,
    /// Stage I (3.6): normal contact is sought, friction is known as far as `KnownFriction` says.
    NormalStage(KnownFriction),
    /// Stage II (3.7): friction is sought under known normal tractions in a known zone.
    FrictionStage,
}

/// What stage I knows of friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum KnownFriction {
    /// The bound; the friction traction follows the slip up to it.
    #[default]
    Bound,
    /// The friction traction itself.
    Traction,
}

/// Tractions that a stage is to hold from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Freeze {
    /// Bound and friction traction at the end of the last step.
    LastStep,
    /// Normal tractions at the last residual, and the friction bound that belongs to them.
    NormalTractions,
    /// Friction tractions at the last residual.
    FrictionTractions,
    /// Bound and friction traction, this part of the way from what was held before to what is held now.
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
