//! The decision after a failed attempt at a step.

/// What to do after a failed attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retry {
    /// Try the smaller step that the control now provides.
    Cut,
    /// The step cannot be cut further.
    GiveUp,
}
