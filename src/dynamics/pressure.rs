//! What Newton's method needs of pressures, in nearly incompressible bodies and in contact.

use super::{Equations, Stage};
use crate::error::Result;
use crate::petsc::Vector;

/// Linearising the pressures of nearly incompressible bodies and the gaps of contact (theory, section 5.1).
/// The defaults are those of a system without them.
pub trait PressureLinearisation: Equations {
    /// From now on, [`Equations::jacobian`] and [`linearised_norm`](Self::linearised_norm) take the pressure
    /// of bodies linearised at these displacements, whose ghosts are up to date, and [`Equations::jacobian`]
    /// takes the gaps of contact linearised at its last call. With `None` both take pressures and gaps of
    /// the trial state again.
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
