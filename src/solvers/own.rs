//! Preconditioners that the program makes itself, with matrices of their own.

use std::rc::Rc;

use crate::dynamics::{ContactCounts, Dynamics, Stage};
use crate::error::Result;
use crate::petsc::{Matrix, Reuse, Session, Vector};

/// Where matrices and options of such a preconditioner come from.
pub struct Origin<'a> {
    /// The session.
    pub session: &'a Rc<Session>,
    /// A matrix of the pattern.
    pub like: &'a Matrix,
    /// A vector of the layout.
    pub pattern: &'a Vector,
}

/// A preconditioner that asks the system for more than its matrix.
pub trait CustomPreconditioner {
    /// Whether its matrices have the pattern of `matrix`.
    fn fits(&self, matrix: &Matrix) -> bool;

    /// Hears what the contact points do.
    fn heed(&mut self, _contact: &ContactCounts) {}

    /// Assembles its matrices at the trial state, at least those that it wants new whatever `reuse` says. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn assemble(&mut self, system: &mut dyn Dynamics, stage: &Stage, reuse: Reuse) -> Result<()>;

    /// Prepares to precondition `matrix`, with factors of an earlier one where they are kept. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn prepare(&mut self, matrix: &Matrix, reuse: Reuse) -> Result<()>;

    /// Computes an approximation `z` of `matrix^-1 r`. On failure `z` is not finite, which ends the outer method, so that the next
    /// preset takes over. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<()>;

    /// Inner iterations since the last call.
    fn take_iterations(&mut self) -> u32 {
        0
    }

    /// Hears whether the last solve was poor beside the best so far.
    fn learn(&mut self, _poor: bool) {}
}
