//! What Newton's method needs of the pressure of nearly incompressible bodies.

use super::{Equations, Stage};
use crate::error::Result;
use crate::petsc::Vector;

/// Linearising the pressure of nearly incompressible bodies (theory, section 5.1). The defaults are those of
/// a system without such bodies.
pub trait PressureLinearisation: Equations {
    /// From now on, [`Equations::jacobian`] and [`linearised_norm`](Self::linearised_norm) take the pressure
    /// linearised at these displacements, whose ghosts are up to date. With `None` the tangent is the
    /// derivative of the residual again.
    fn linearise_pressure(&mut self, _at: Option<&Vector>) {}

    /// Norm of the residual of the trial state with the linearised pressure \[N\]; `None` if no pressure is
    /// linearised. `residual` is that of [`Equations::residual`]. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn linearised_norm(&mut self, _stage: &Stage, _residual: &Vector) -> Result<Option<f64>> {
        Ok(None)
    }
}
