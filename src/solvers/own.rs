//! Preconditioners that the program implements, with their own matrices.

use std::rc::Rc;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::dynamics::{ContactCounts, MatrixSource, MultigridHints, Sources, Stage};
use crate::error::{Error, Result};
use crate::petsc::{Matrix, Reuse, Session, Vector};

/// Objects from which such a preconditioner creates its matrices and options.
pub struct Origin<'a> {
    /// The session.
    pub session: &'a Rc<Session>,
    /// A matrix with the pattern.
    pub like: &'a Matrix,
    /// A vector with the layout.
    pub pattern: &'a Vector,
}

/// A preconditioner that needs more from the system than its matrix.
pub trait CustomPreconditioner {
    /// Whether its matrices have the pattern of `matrix`.
    fn fits(&self, matrix: &Matrix) -> bool;

    /// Receives the current state of the contact points.
    fn note_contacts(&mut self, _contact: &ContactCounts) {}

    /// Assembles its matrices at the trial state, at least those that it needs to renew regardless
    /// of `reuse`. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn assemble(&mut self, system: &mut dyn MultigridHints, stage: &Stage, reuse: Reuse) -> Result<()>;

    /// Prepares to precondition `matrix`, which has this `source`. Factors of an earlier matrix may be kept.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn prepare(&mut self, matrix: &Matrix, source: Option<&Rc<MatrixSource>>, reuse: Reuse) -> Result<()>;

    /// Computes an approximation `z` of `matrix^-1 r`. Collective.
    ///
    /// On failure `z` is not finite. This ends the outer method, so that the next preset replaces
    /// this one.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<()>;

    /// Returns the inner iterations since the last call.
    fn take_iterations(&mut self) -> u32 {
        0
    }

    /// Receives whether the last solve was poor compared with the best so far.
    fn learn(&mut self, _poor: bool) {}

    /// State that outlives a solve.
    fn state(&self, sources: &mut Sources) -> Value;

    /// Restores the state of a new preconditioner. Collective.
    ///
    /// # Errors
    /// The state is not one of this preconditioner, or a PETSc call fails.
    fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn MultigridHints) -> Result<()>;
}

/// Reads the stored state of a solver.
pub(super) fn stored<T: DeserializeOwned>(state: &Value) -> Result<T> {
    T::deserialize(state)
        .map_err(|error| Error::file(format!("a checkpoint with another state of the solver ({error})")))
}

/// The source of a matrix with this number.
pub(super) fn source_of(sources: &Sources, number: usize) -> Result<&Rc<MatrixSource>> {
    sources.matrices.get(number).ok_or_else(|| Error::file("a checkpoint without the source of a matrix"))
}
