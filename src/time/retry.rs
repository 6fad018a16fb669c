//! What follows a failed attempt at a step.

/// What to do after a failed attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retry {
    /// Try the smaller step that the control now offers.
    Cut,
    /// The step can not be cut further.
    GiveUp,
}
