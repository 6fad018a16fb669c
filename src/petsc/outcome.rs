//! Start and end of a linear solve: initial guess, reuse of the preconditioner, and convergence
//! reasons.

use petsc_sys as sys;
use std::fmt;

/// Why a linear solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// The residual fell below the relative tolerance.
    RelativeTolerance,
    /// The residual fell below the absolute tolerance.
    AbsoluteTolerance,
    /// The preconditioner was applied the requested number of times, as in a direct solve.
    Applied,
    /// The Krylov space holds the exact solution.
    Exact,
    /// The iteration limit was reached.
    Iterations,
    /// The residual diverged.
    Growth,
    /// The method broke down (division by zero).
    Breakdown,
    /// The matrix or the preconditioner is not positive definite, although the method requires it.
    Indefinite,
    /// A value is non-finite.
    NotANumber,
    /// The preconditioner could not be set up or applied, for example due to a zero pivot or lack
    /// of memory.
    PreconditionerFailed,
    /// Another PETSc reason, by its number.
    Other(i32),
}

impl Reason {
    pub(super) fn new(raw: sys::KSPConvergedReason) -> Self {
        match raw {
            sys::KSP_CONVERGED_RTOL | sys::KSP_CONVERGED_RTOL_NORMAL => Self::RelativeTolerance,
            sys::KSP_CONVERGED_ATOL | sys::KSP_CONVERGED_ATOL_NORMAL => Self::AbsoluteTolerance,
            sys::KSP_CONVERGED_ITS => Self::Applied,
            sys::KSP_CONVERGED_HAPPY_BREAKDOWN => Self::Exact,
            sys::KSP_DIVERGED_ITS => Self::Iterations,
            sys::KSP_DIVERGED_DTOL => Self::Growth,
            sys::KSP_DIVERGED_BREAKDOWN | sys::KSP_DIVERGED_BREAKDOWN_BICG => Self::Breakdown,
            sys::KSP_DIVERGED_INDEFINITE_PC | sys::KSP_DIVERGED_INDEFINITE_MAT => Self::Indefinite,
            sys::KSP_DIVERGED_NANORINF => Self::NotANumber,
            sys::KSP_DIVERGED_PC_FAILED => Self::PreconditionerFailed,
            other => Self::Other(other.0),
        }
    }

    /// Whether the solution is usable.
    pub fn converged(self) -> bool {
        match self {
            Self::RelativeTolerance | Self::AbsoluteTolerance | Self::Applied | Self::Exact => true,
            Self::Other(number) => number > 0,
            _ => false,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let words = match self {
            Self::RelativeTolerance => "relative tolerance reached",
            Self::AbsoluteTolerance => "absolute tolerance reached",
            Self::Applied => "preconditioner applied",
            Self::Exact => "exact solution found",
            Self::Iterations => "iteration limit reached",
            Self::Growth => "residual diverges",
            Self::Breakdown => "breakdown",
            Self::Indefinite => "matrix or preconditioner not positive definite",
            Self::NotANumber => "non-finite value",
            Self::PreconditionerFailed => "preconditioner failed",
            Self::Other(number) => return write!(f, "PETSc's reason {number}"),
        };
        f.write_str(words)
    }
}

/// Result of a linear solve, the same on every rank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearOutcome {
    /// Krylov iterations.
    pub iterations: usize,
    /// Reason for the end.
    pub reason: Reason,
    /// Residual norm computed by the method. With a left preconditioner it is not the true
    /// residual.
    pub residual: f64,
}

impl LinearOutcome {
    /// Whether the solution is usable.
    pub fn converged(&self) -> bool {
        self.reason.converged()
    }
}

/// Whether a preconditioner is kept when the matrix changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reuse {
    /// The old one is kept.
    Keep,
    /// A new one is built in the next solve after each change.
    Renew,
}

/// Initial guess of the iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialGuess {
    /// Zero.
    Zero,
    /// The values in the solution vector.
    Given,
}
