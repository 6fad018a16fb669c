//! What an iteration did, and how a solve ended.

use crate::dynamics::ContactCounts;

/// One Newton iteration, a row of `iterations.csv` and of the table at `-v`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationReport {
    /// Number of corrections applied so far; 0 is the first guess.
    pub iteration: u32,
    /// Residual over the largest force.
    pub residual: f64,
    /// 2-norm of the correction that led here [m]; 0 for the first guess.
    pub increment: f64,
    /// Krylov iterations of that correction.
    pub krylov: u32,
    /// Contact points of this iterate.
    pub contact: ContactCounts,
    /// Length of the step along the correction, 1 where it was taken whole.
    pub line_search: f64,
}

/// Totals of one solve.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SolveReport {
    /// Newton corrections.
    pub newton: u32,
    /// Krylov iterations.
    pub krylov: u32,
    /// Residual over the largest force at the end.
    pub residual: f64,
    /// Contact points at the end.
    pub contact: ContactCounts,
}

/// How a solve ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The balance holds to the tolerance.
    Converged(SolveReport),
    /// It does not; the step may be cut. The sentence carries figures and thresholds.
    Failed(SolveReport, String),
}
