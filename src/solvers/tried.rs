//! What became of a linear solve, and whether it counts.

use crate::error::Result;
use crate::petsc::{Matrix, Vector};

/// What became of the preset on one rung.
pub(super) struct LinearAttempt {
    pub iterations: u32,
    pub residual: f64,
    /// Residual that was asked for: the user's option where there is one.
    pub tolerance: f64,
    /// PETSc's word on how it ended.
    pub reason: String,
}

impl LinearAttempt {
    /// The true residual may miss the tolerance by this factor before the solve counts as failed.
    const SLACK: f64 = 10.0;
    /// No true residual is asked to be smaller: a factorisation can not do better on a stiff contact.
    const ROUNDING: f64 = 1e-9;

    /// Whether the solve counts.
    pub fn is_good(&self) -> bool {
        self.residual <= Self::SLACK * self.tolerance.max(Self::ROUNDING)
    }

    /// As it is, or where it is not good, with the tolerance that rounding leaves a factorisation: products of the largest
    /// entries with a solution that is large where another body gives way. `size` is the norm of the right side. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn at_rounding(self, matrix: &Matrix, x: &Vector, work: &mut Vector, size: f64) -> Result<Self> {
        if self.is_good() || !self.residual.is_finite() {
            return Ok(self);
        }
        matrix.diagonal(work)?;
        let rounding = f64::EPSILON * work.max_norm()? * x.norm()? / size;
        Ok(Self { tolerance: self.tolerance.max(rounding), ..self })
    }
}
