//! Identifies the solve that is running.

/// The solve to which iterations belong.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CurrentSolve {
    /// Instant at the end of the step \[s\].
    pub time: f64,
    /// Length of the step \[s\].
    pub dt: f64,
    /// Number of the attempt at the step, from 1.
    pub attempt: u64,
    /// Whether the solve belongs to the static start.
    pub starting: bool,
}
