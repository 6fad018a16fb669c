//! Result of a linear solve, and whether it is accepted.

use crate::error::Result;
use crate::petsc::{Matrix, Reuse, Vector};

/// Result of the preset on one rung.
pub(super) struct LinearAttempt {
    pub iterations: u32,
    pub residual: f64,
    /// Requested residual, from the user's option if there is one.
    pub tolerance: f64,
    /// PETSc's reason why it ended.
    pub reason: String,
    /// Whether the preconditioner was that of an earlier matrix.
    pub reuse: Reuse,
}

impl LinearAttempt {
    /// Factor by which the true residual may miss the tolerance before the solve counts as failed.
    const SLACK: f64 = 10.0;
    /// Smallest true residual that is required. A factorisation cannot do better on a stiff
    /// contact.
    const ROUNDING: f64 = 1e-9;

    /// Whether the solve is accepted.
    pub fn is_good(&self) -> bool {
        self.residual <= Self::SLACK * self.tolerance.max(Self::ROUNDING)
    }

    /// Returns the result unchanged if it is good, otherwise with the tolerance that rounding
    /// leaves a factorisation. Collective.
    ///
    /// The tolerance comes from products of the largest entries with the solution, which is large
    /// where another body gives way. `size` is the norm of the right side.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn at_rounding(self, matrix: &Matrix, x: &Vector, work: &mut Vector, size: f64) -> Result<Self> {
        if self.is_good() || !self.residual.is_finite() {
            return Ok(self);
        }
        matrix.diagonal(work)?;
        let rounding = f64::EPSILON * work.max_norm()? * x.norm()? / size;
        Ok(Self { tolerance: self.tolerance.max(rounding), ..self })
    }
}
