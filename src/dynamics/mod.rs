//! The interface of the system to solvers and integrators: states, the stage of a step, residual
//! and tangent.
//!
//! Time integration uses only `u`, `v`, `a` and two shifts, the derivatives of `v` and `a` with
//! respect to `u`. A solver works on a [`Stage`] and obtains its residual and its matrix from
//! [`Dynamics`]. Neither depends on elements, contact or the mesh.

mod source;
mod split;

use std::rc::Rc;

use serde::{Deserialize, Serialize};

pub use source::{ChangedLaw, ContactSource, MatrixSource, SearchSource, Sources, StageSettings};
pub use split::{ForceChange, Freeze, KnownFriction, Split};

use crate::case::Units;
use crate::error::{Error, Result};
use crate::petsc::{Matrix, Vector};
use crate::terms::Terms;

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

/// How the friction law enters a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FrictionMode {
    /// As defined in the case.
    AsGiven,
    /// Switched off, for the frictionless start of the paper.
    Off,
}

/// By how much contact misses the requested tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shortfall {
    /// Largest ratio, over all points, of penetration (or of the gap under pressure) to its
    /// tolerance.
    pub ratio: f64,
    /// The penetration or gap at that point \[m\].
    pub depth: f64,
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
    /// Whether friction acts as given or is switched off.
    pub friction: FrictionMode,
    /// Which quantities a staggered solve currently holds fixed.
    pub split: Split,
    /// Stiffness of a spring on every free unknown, relative to a typical diagonal entry.
    ///
    /// The spring is in the matrix but not in the residual. It makes the matrix regular where
    /// nothing holds a body, and it does not change the equilibrium. A value above zero also
    /// enables the search for free motions.
    pub holding: f64,
    /// Resistance, relative to a typical diagonal entry, up to which a motion of a body counts as
    /// free. A static solve holds such motions. With 0, only motions without any resistance count
    /// as free.
    pub yielding: f64,
    /// Residual, relative to the largest force, at which the solve may stop, whatever the strategy
    /// requires. It is 0 except for states that are only intermediate.
    pub enough: f64,
    /// Factor on loads and prescribed displacements. It is 1 except in the increments of a static
    /// start.
    pub load_factor: f64,
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
            friction: FrictionMode::AsGiven,
            split: Split::Monolithic,
            holding: 0.0,
            yielding: 0.0,
            enough: 0.0,
            load_factor: 1.0,
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

    /// Makes the trial state the start of the next step.
    pub fn accept(&mut self) {
        std::mem::swap(&mut self.start, &mut self.trial);
    }
}

/// Norm of the residual on the free unknowns, and the force scale that it is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// 2-norm over the free unknowns \[N\]. It is not finite if the trial state was rejected.
    pub norm: f64,
    /// Largest 2-norm of the internal, contact, external and inertia forces \[N\].
    pub scale: f64,
}

/// Numbers of contact points of an iterate. Each point is counted once.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ContactCounts {
    /// Closed points.
    pub closed: u64,
    /// Closed points with more than a touching contact. At other closed points, rounding decides
    /// the sign of the gap.
    pub pressing: u64,
    /// Closed points that stick.
    pub stick: u64,
    /// Closed points that slip.
    pub slip: u64,
    /// Points whose status differs from the previous iterate.
    pub changed: u64,
    /// Points whose slip direction reversed.
    pub flipped: u64,
}

/// A strain-free motion that the supports allow: a rigid motion of a body, or a motion of pieces
/// that are hinged to each other.
pub struct RigidMotion {
    /// Index of the group of pieces that moves.
    pub group: usize,
    /// The motion, with 2-norm 1. It is zero on other groups and at prescribed unknowns.
    pub field: Vector,
    /// How each piece of the group moves.
    pub parts: Vec<MovingPart>,
}

/// Contribution of a piece of a body to a [`RigidMotion`].
pub struct MovingPart {
    /// Name in messages, `'block'`.
    pub name: String,
    /// Number of its nodes.
    pub nodes: f64,
    /// Sum of the squared displacements of its nodes under a unit rotation, averaged over the axes
    /// \[m2\].
    pub spread: f64,
    /// Translation of the centre of its nodes, x, y, z.
    pub shift: [f64; 3],
    /// Rotation about that centre, about x, y, z \[1/m\].
    pub spin: [f64; 3],
}

/// A set of prescribed changes that is moved to the right side: `rhs -= K_fd change`.
pub struct Lift<'a> {
    /// Change of the prescribed unknowns, zero on the free ones \[m\].
    pub change: &'a Vector,
    /// Right side that is modified \[N\].
    pub rhs: &'a mut Vector,
}

/// The equations of motion `M a + Q(u) - F_ext(t) - F_n(u) - F_T(u, v) = 0` (3.9).
pub trait Dynamics {
    /// Sets `u`, `v`, `a` of the prescribed unknowns at the trial state's time, times the load
    /// factor, and refreshes the ghosts of `u` and `v`. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails. The next residual reports a prescribed value that is not finite.
    fn prescribe(&mut self, stage: &mut Stage) -> Result<()>;

    /// Computes the residual of the balance at the trial state, zero in prescribed rows \[N\].
    /// Collective.
    ///
    /// A rejected trial state (det F <= 0) is not an error. Its norm is not finite, and
    /// [`Dynamics::fault`] returns the reason.
    ///
    /// # Errors
    /// If a PETSc call fails, or a prescribed value is not finite on some rank.
    fn residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual>;

    /// Whether [`Dynamics::predicted_residual`] is the better right side for the next correction.
    fn predicts(&self) -> bool;

    /// Computes the residual with stick assumed where the slip direction flipped. Collective.
    ///
    /// It is the right side of the next correction, and [`Dynamics::jacobian`] always assembles the
    /// matching matrix. Call it after [`Dynamics::residual`] at the same state, because it
    /// recomputes only the contact forces.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn predicted_residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual>;

    /// Assembles the derivative of the residual, restricted to `terms`, into [`Dynamics::matrix`].
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

    /// Assembles [`Terms::BODIES`] with springs at closed contact points into a matrix with the
    /// system's pattern. Symmetric. Collective.
    ///
    /// The springs have the stiffness of `K_CN` and `K_T`, but are at most as stiff as the elements
    /// beneath them. They are softer at points without friction.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn joined_bodies_into(&mut self, stage: &Stage, matrix: &mut Matrix) -> Result<()>;

    /// Units of all numbers, for messages.
    fn units(&self) -> Units;

    /// The assembled matrix \[N/m\].
    fn matrix(&self) -> &Matrix;

    /// Source of [`Dynamics::matrix`]. It is `None` before the first assembly with its pattern.
    fn matrix_source(&self) -> Option<Rc<MatrixSource>>;

    /// Source of a matrix of these `terms` at the trial state.
    fn source_at(&self, stage: &Stage, terms: Terms) -> Rc<MatrixSource>;

    /// Assembles [`Dynamics::matrix`] again from its source, and returns the stage at which it was
    /// assembled. The contact points have the state that they had there. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn assemble_again(&mut self, source: &Rc<MatrixSource>) -> Result<Stage>;

    /// Whether the matrix of `terms` is symmetric for this case.
    fn is_symmetric(&self, stage: &Stage, terms: Terms) -> bool;

    /// Compares the contact points with the previous iterate and activates the safeguards.
    /// Collective.
    ///
    /// # Errors
    /// If another rank failed.
    fn observe(&mut self) -> Result<ContactCounts>;

    /// Stores tractions that the stages of a [`Split`] hold fixed.
    fn freeze(&mut self, what: Freeze);

    /// Compares the friction forces of the last residual with the frozen ones. Collective.
    fn force_change(&self) -> ForceChange;

    /// Computes unit normals at the owned nodes in contact at the last residual, zero elsewhere.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn contact_normals(&mut self, out: &mut Vector) -> Result<()>;

    /// Marks the owned nodes of facets in contact at the last residual, on both sides of deformable
    /// contacts. Collective.
    fn contact_nodes(&mut self) -> Vec<bool>;

    /// Marks the owned nodes of bodies that no support holds in some direction.
    fn floating_nodes(&self) -> Vec<bool>;

    /// Returns the rigid motions of bodies that supports allow at the trial positions, ignoring
    /// contact. They are orthonormal. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn rigid_motions(&self, stage: &Stage) -> Result<Vec<RigidMotion>>;

    /// Computes `M n` of a motion `n`, or `n` in systems without mass. Prescribed rows are zero.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn weigh_motion(&self, motion: &Vector, out: &mut Vector) -> Result<()>;

    /// A typical diagonal entry of the stiffness \[N/m\]. It is the unit of [`Stage::holding`].
    fn unit(&self) -> f64;

    /// Whether a slip direction reversed between the last iterate and the last residual.
    /// Collective.
    fn reverses(&self) -> bool;

    /// Whether the contact points returned to their statuses of two iterates ago.
    fn is_cycling(&self) -> bool;

    /// Largest motion of a node in one correction of bodies that only contact holds \[m\].
    ///
    /// Without this limit, a body that nothing holds yet would pass through its target in a single
    /// correction.
    fn stride(&self) -> f64;

    /// Discards the iterates since the start of the step.
    fn rewind(&mut self);

    /// Returns why the last residual was not finite, with the same result on all ranks. Collective.
    fn fault(&mut self) -> Option<Error>;

    /// Describes the contact points that changed last, as a phrase for a message. Empty if no point
    /// changed.
    fn restless_points(&self) -> String;

    /// Resets the multipliers that are sought to those of the last accepted step.
    fn recall_multipliers(&mut self);

    /// Returns how far contact points of the last residual are from touching exactly. `None` if no
    /// tolerance was requested. Collective.
    fn shortfall(&self) -> Option<Shortfall>;

    /// Brings contacts that are not in motion closer to the requested tolerance, by multipliers or
    /// by a stiffer penalty. Collective.
    fn improve(&mut self);

    /// Estimates the norm of the residual that rounding of displacements and positions causes at
    /// the trial state \[N\]. The estimate uses the matrix that was assembled last. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn rounding(&self, stage: &Stage) -> Result<f64>;

    /// Extent of all bodies, or their largest coordinate if they are far from the origin \[m\]. It
    /// is the length scale of rounding errors.
    fn extent(&self) -> f64;
}
