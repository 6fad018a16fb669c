//! The balance of forces, its residual and its derivative.

use serde::{Deserialize, Serialize};

use super::Stage;
use crate::case::Units;
use crate::error::{Error, Result};
use crate::petsc::{Matrix, Vector};
use crate::terms::Terms;

/// Norm of the residual on the free unknowns, and the force scale that it is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// 2-norm over the free unknowns \[N\]. It is not finite if the trial state was rejected.
    pub norm: f64,
    /// Largest 2-norm of the internal, contact, external and inertia forces \[N\].
    pub scale: f64,
}

/// How the friction law enters a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum FrictionMode {
    /// As defined in the case.
    #[default]
    AsGiven,
    /// Switched off, for the frictionless start of the paper.
    Off,
}

/// How the equations that are solved differ from those of the scene.
///
/// A static start approaches the scene by continuation: the load grows in increments, friction may
/// be off, and springs hold bodies that nothing touches yet. The default is the scene itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Continuation {
    /// Factor on loads and prescribed displacements.
    pub load_factor: f64,
    /// Load factor of the state at the start of the step.
    pub start_factor: f64,
    /// Whether friction acts as given or is switched off.
    pub friction: FrictionMode,
    /// Whether the damping of bodies acts.
    pub damped: bool,
    /// Stiffness of a spring on every free unknown, relative to a typical diagonal entry.
    ///
    /// The spring is in the matrix but not in the residual. It makes the matrix regular where
    /// nothing holds a body, and it does not change the equilibrium. A value above zero also
    /// enables the search for free motions.
    pub spring: f64,
    /// Resistance, relative to a typical diagonal entry, up to which a motion of a body counts as
    /// free. A static solve holds such motions. With 0, only motions without any resistance count
    /// as free.
    pub free_resistance: f64,
    /// Residual, relative to the largest force, at which the solve may stop, whatever the strategy
    /// requires. It is 0 except for states that are only intermediate.
    pub tolerance: f64,
}

impl Default for Continuation {
    fn default() -> Self {
        Self {
            load_factor: 1.0,
            start_factor: 1.0,
            friction: FrictionMode::AsGiven,
            damped: true,
            spring: 0.0,
            free_resistance: 0.0,
            tolerance: 0.0,
        }
    }
}

/// A set of prescribed changes that is moved to the right side: `rhs -= K_fd change`.
pub struct Lift<'a> {
    /// Change of the prescribed unknowns, zero on the free ones \[m\].
    pub change: &'a Vector,
    /// Right side that is modified \[N\].
    pub rhs: &'a mut Vector,
}

/// The equations of motion `M a + Q(u) - F_ext(t) - F_n(u) - F_T(u, v) = 0` (3.9).
pub trait Equations {
    /// Sets `u`, `v`, `a` of the prescribed unknowns at the trial state's time, times the load factor of [`Equations::continuation`], and refreshes the ghosts of `u` and `v`. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails. The next residual reports a prescribed value that is not finite.
    fn prescribe(&mut self, stage: &mut Stage) -> Result<()>;

    /// Computes the residual of the balance at the trial state, zero in prescribed rows \[N\].
    /// Collective.
    ///
    /// A rejected trial state (det F <= 0) is not an error. Its norm is not finite, and
    /// [`Equations::fault`] returns the reason.
    ///
    /// # Errors
    /// If a PETSc call fails, or a prescribed value is not finite on some rank.
    fn residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual>;

    /// Assembles the derivative of the residual, restricted to `terms`, into [`Equations::matrix`].
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn jacobian(&mut self, stage: &Stage, terms: Terms, lift: Option<Lift>) -> Result<()>;

    /// Assembles the derivative of the residual, restricted to `terms`, into another matrix with
    /// the system's pattern. Collective.
    ///
    /// The matrix can be that of a preconditioner. Its symmetry is the symmetry of its terms.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn jacobian_into(&mut self, stage: &Stage, terms: Terms, matrix: &mut Matrix) -> Result<()>;

    /// The assembled matrix \[N/m\].
    fn matrix(&self) -> &Matrix;

    /// Returns why the last residual was not finite, with the same result on all ranks. Collective.
    fn fault(&mut self) -> Option<Error>;

    /// Estimates the norm of the residual that rounding of displacements and positions causes at
    /// the trial state \[N\]. The estimate uses the matrix that was assembled last. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn rounding(&self, stage: &Stage) -> Result<f64>;

    /// How the equations differ from those of the scene at present.
    fn continuation(&self) -> &Continuation;

    /// Units of all numbers, for messages.
    fn units(&self) -> Units;

    /// Extent of all bodies, or their largest coordinate if they are far from the origin \[m\]. It
    /// is the length scale of rounding errors.
    fn extent(&self) -> f64;
}
