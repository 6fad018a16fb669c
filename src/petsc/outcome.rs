//! How a linear solve begins and ends, in words.

use petsc_sys as sys;
use std::fmt;

/// Why a linear solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// The residual fell below the relative tolerance.
    RelativeTolerance,
    /// The residual fell below the absolute tolerance.
    AbsoluteTolerance,
    /// The preconditioner was applied the number of times asked for, as in a direct solve.
    Applied,
    /// The Krylov space holds the exact solution.
    Exact,
    /// The iterations ran out.
    Iterations,
    /// The residual grew beyond bounds.
    Growth,
    /// The method divided by zero.
    Breakdown,
    /// The matrix or the preconditioner is not positive definite, as the method needs.
    Indefinite,
    /// A value is not a number.
    NotANumber,
    /// The preconditioner could not be set up or applied, as with a zero pivot or lack of memory.
    PreconditionerFailed,
    /// Another of PETSc's reasons, by its number.
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

    /// Whether the solution may be used.
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
            Self::Iterations => "out of iterations",
            Self::Growth => "residual grows",
            Self::Breakdown => "breakdown",
            Self::Indefinite => "matrix or preconditioner not positive definite",
            Self::NotANumber => "not a number",
            Self::PreconditionerFailed => "preconditioner failed",
            Self::Other(number) => return write!(f, "PETSc's reason {number}"),
        };
        f.write_str(words)
    }
}

/// What became of a linear solve; the same on every rank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Krylov iterations.
    pub iterations: usize,
    /// Why it ended.
    pub reason: Reason,
    /// Residual norm as the method sees it; with a preconditioner on the left not the true one.
    pub residual: f64,
}

impl Outcome {
    /// Whether the solution may be used.
    pub fn converged(&self) -> bool {
        self.reason.converged()
    }
}

/// Whether a preconditioner is kept when the matrix changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reuse {
    /// The old one serves.
    Keep,
    /// A new one is built in the next solve after each change.
    Renew,
}

/// Where the iteration starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialGuess {
    /// From zero.
    Zero,
    /// From what the solution vector holds.
    Given,
}
