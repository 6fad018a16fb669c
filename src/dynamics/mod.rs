//! The interface of the system to solvers and integrators: states, the step in progress, and what
//! a solver may ask of the equations.
//!
//! Time integration uses only `u`, `v`, `a` and two shifts, the derivatives of `v` and `a` with
//! respect to `u`. A solver works on a [`Stage`]. It obtains residual and matrix from
//! [`Equations`], and each further need has an interface of its own, which does nothing by default:
//!
//! | Interface | Who uses it |
//! |---|---|
//! | [`ContactMonitor`] | Newton's method: counts of contact points and its safeguards |
//! | [`PressureLinearisation`] | Newton's method: tangents of nearly incompressible bodies and of contact |
//! | [`Staging`] | the staggered strategy: what a stage holds fixed |
//! | [`Augmentation`] | the augmented Lagrangian: multipliers and requested penetration |
//! | [`FloatingBodies`] | statics: motions that no support resists |
//! | [`MultigridHints`] | preconditioners that know of bodies and contact |
//! | [`Resumption`] | a restart: assembling kept matrices again |
//!
//! None of them depends on elements, contact or the mesh. [`Dynamics`] is a system with all of them.

mod augmentation;
mod equations;
mod floating;
mod monitor;
mod multigrid;
mod pressure;
mod source;
mod split;

pub use augmentation::{Augmentation, Shortfall};
pub use equations::{Continuation, Equations, FrictionMode, Lift, Residual};
pub use floating::{FloatingBodies, MovingPart, RigidMotion};
pub use monitor::{ContactCounts, ContactMonitor};
pub use multigrid::{BodyNodes, MultigridHints, Sides};
pub use pressure::PressureLinearisation;
pub use source::{ChangedLaw, ContactSource, MatrixSource, Resumption, SearchSource, Sources, StageSettings};
pub use split::{ForceChange, Freeze, KnownFriction, Split, Staging};

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::petsc::Vector;

/// Displacement, velocity and acceleration of all nodes at one instant: `q`, `q'`, `q''` of the
/// paper.
///
/// Ghosted vectors, node-major: entry `node * D + component`; m, m/s, m/s2.
pub struct State {
    /// Time \[s\].
    pub time: f64,
    /// Displacement \[m\].
    pub u: Vector,
    /// Velocity \[m/s\].
    pub v: Vector,
    /// Acceleration \[m/s2\]. The vector has no entries in systems without inertia.
    pub a: Vector,
}

impl State {
    /// Creates the undeformed state at rest, with the layout of `pattern`.
    ///
    /// # Errors
    /// If PETSc cannot allocate.
    pub fn at_rest(pattern: &Vector) -> Result<Self> {
        Self::new(pattern, true)
    }

    fn new(pattern: &Vector, inertia: bool) -> Result<Self> {
        Ok(Self { time: 0.0, u: pattern.like()?, v: pattern.like()?, a: pattern.like_if(inertia)? })
    }

    /// Copies all three fields and the time. Collective.
    ///
    /// # Errors
    /// If the PETSc copy fails.
    pub fn copy_from(&mut self, other: &Self) -> Result<()> {
        self.time = other.time;
        self.u.copy_from(&other.u)?;
        self.v.copy_from(&other.v)?;
        self.a.copy_from(&other.a)
    }
}

/// Derivatives of the rates with respect to the unknown `u` at the end of the step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Shifts {
    /// `dv/du` \[1/s\].
    pub velocity: f64,
    /// `da/du` [1/s2].
    pub acceleration: f64,
}

/// Weights of the balance `M (mass.0 a_start + mass.1 a_end) + start_force r_start + r_end = 0`,
/// with `r = Q - F_ext - F_n - F_T`.
///
/// The balance is scaled so that the forces at the end have weight 1. The tangent then needs no
/// factor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Balance {
    /// Weights of the inertia at the start and the end of the step.
    pub mass: [f64; 2],
    /// Weight of the forces at the start of the step.
    pub start_force: f64,
}

impl Balance {
    /// Balance at the end of the step: Newmark, backward Euler, statics.
    pub const AT_THE_END: Self = Self { mass: [0.0, 1.0], start_force: 0.0 };
}

/// Whether forces are evaluated over the whole step, so that their work equals the change of
/// energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum OverStep {
    /// Forces are evaluated at the trial state.
    #[default]
    No,
    /// The trial state is the midpoint of the step. The step ends as far from it as it started.
    Middle,
    /// The trial state is the end of the step. Forces and accelerations are still those of the
    /// midpoint.
    End,
}

/// Instant of a step at which rigid bodies with prescribed motion are placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum RigidInstant {
    /// The trial time.
    #[default]
    End,
    /// The start of the step: their motion enters the first guess like prescribed displacements.
    Start,
}

/// A step in progress: its start, its current iterate, and how the rates follow from the
/// displacement.
pub struct Stage {
    /// The accepted state at the start of the step.
    pub start: State,
    /// The iterate at the end of the step.
    pub trial: State,
    /// Length of the step \[s\].
    pub dt: f64,
    /// Derivatives of the rates, `dv/du` and `da/du`.
    pub shifts: Shifts,
    /// Weights of inertia and forces.
    pub balance: Balance,
    /// Whether inertia is included.
    pub inertia: bool,
    /// Whether forces conserve energy over the step.
    pub over_step: OverStep,
    /// Where rigid bodies with prescribed motion are.
    pub rigid_at: RigidInstant,
    /// `r = Q - F_ext - F_n - F_T` at the start \[N\].
    pub start_forces: Vector,
    /// `v` at the end if `u` does not change \[m/s\].
    pub velocity_base: Vector,
    /// `a` at the end if `u` does not change \[m/s2\]. The vector has no entries in systems without
    /// inertia.
    pub acceleration_base: Vector,
}

impl Stage {
    /// Creates a stage at rest with the layout of `pattern`. An integrator fills it.
    ///
    /// # Errors
    /// If PETSc cannot allocate.
    pub fn at_rest(pattern: &Vector) -> Result<Self> {
        Self::new(pattern, true)
    }

    /// Creates a stage at rest with the layout of `pattern`, with or without `inertia`. Without
    /// inertia it has no accelerations, and only the static scheme can use it.
    ///
    /// # Errors
    /// If PETSc cannot allocate.
    pub fn new(pattern: &Vector, inertia: bool) -> Result<Self> {
        Ok(Self {
            start: State::new(pattern, inertia)?,
            trial: State::new(pattern, inertia)?,
            dt: 0.0,
            shifts: Shifts::default(),
            balance: Balance::AT_THE_END,
            inertia: false,
            over_step: OverStep::No,
            rigid_at: RigidInstant::End,
            start_forces: pattern.like()?,
            velocity_base: pattern.like()?,
            acceleration_base: pattern.like_if(inertia)?,
        })
    }

    /// Sets `v` and `a` of the trial state from its `u`. The system has to overwrite the prescribed
    /// rows.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn update_rates(&mut self) -> Result<()> {
        let Self { start, trial, shifts, velocity_base, acceleration_base, .. } = self;
        let (u, start_u) = (trial.u.owned(), start.u.owned());
        let (v_base, a_base) = (velocity_base.owned(), acceleration_base.owned());
        let (mut v, mut a) = (trial.v.owned_mut(), trial.a.owned_mut());
        for i in 0..u.len() {
            let change = u[i] - start_u[i];
            v[i] = v_base[i] + shifts.velocity * change;
        }
        for i in 0..a.len() {
            a[i] = a_base[i] + shifts.acceleration * (u[i] - start_u[i]);
        }
        Ok(())
    }

    /// Time from the start of the step to the trial state \[s\].
    pub fn elapsed(&self) -> f64 {
        self.trial.time - self.start.time
    }

    /// Makes the trial state the start of the next step.
    pub fn accept(&mut self) {
        std::mem::swap(&mut self.start, &mut self.trial);
    }
}

/// A system that every strategy and every linear solver can solve.
pub trait Dynamics:
    ContactMonitor + PressureLinearisation + Staging + Augmentation + FloatingBodies + MultigridHints
{
}

impl<S> Dynamics for S where
    S: ContactMonitor + PressureLinearisation + Staging + Augmentation + FloatingBodies + MultigridHints
{
}
