//! Which solve is at work.

/// Which solve the iterations belong to.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CurrentSolve {
    /// Instant at its end \[s\].
    pub time: f64,
    /// Length of the step \[s\].
    pub dt: f64,
    /// Which attempt at the step, from 1.
    pub attempt: u64,
    /// Whether it belongs to the static start.
    pub starting: bool,
}
