//! What solvers and integrators see of the system: states, one stage of a step, residual and tangent.
//!
//! Time integration sees only `u`, `v`, `a` and two shifts (the derivatives of `v` and `a` with respect to
//! `u`); a solver sees a [`Stage`] and asks the [`Dynamics`] for its residual and its matrix. Neither knows
//! elements, contact or the mesh.

mod split;

pub use split::{ForceChange, Freeze, KnownFriction, Split};

use crate::case::Units;
use crate::error::{Error, Result};
use crate::petsc::{Matrix, Vector};
use crate::terms::Terms;

/// Displacement, velocity and acceleration of all nodes at one instant: `q`, `q'`, `q''` of the paper.
///
/// Ghosted vectors, node-major: entry `node * D + component`; m, m/s, m/s2.
pub struct State {
    /// Instant \[s\].
    pub time: f64,
    /// Displacement \[m\].
    pub u: Vector,
    /// Velocity \[m/s\].
    pub v: Vector,
    /// Acceleration \[m/s2\]; without entries where there is no inertia.
    pub a: Vector,
}

impl State {
    /// The undeformed state at rest, with the layout of `pattern`.
    ///
    /// # Errors
    /// When PETSc can not allocate.
    pub fn at_rest(pattern: &Vector) -> Result<Self> {
        Self::new(pattern, true)
    }

    fn new(pattern: &Vector, inertia: bool) -> Result<Self> {
        Ok(Self { time: 0.0, u: pattern.like()?, v: pattern.like()?, a: pattern.like_if(inertia)? })
    }

    /// Copies all three fields and the time. Collective.
    ///
    /// # Errors
    /// When PETSc refuses the copy.
    pub fn copy_from(&mut self, other: &Self) -> Result<()> {
        self.time = other.time;
        self.u.copy_from(&other.u)?;
        self.v.copy_from(&other.v)?;
        self.a.copy_from(&other.a)
    }
}

/// Derivatives of the rates with respect to the unknown `u` at the end of the step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shifts {
    /// `dv/du` \[1/s\].
    pub velocity: f64,
    /// `da/du` [1/s2].
    pub acceleration: f64,
}

/// Weights of the balance `M (mass.0 a_start + mass.1 a_end) + start_force r_start + r_end = 0`,
/// `r = Q - F_ext - F_n - F_T`; scaled so that the forces at the end carry 1 and the tangent needs no factor.
#[derive(Debug, Clone, Copy, PartialEq)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrictionMode {
    /// As the case says.
    AsGiven,
    /// Switched off: the frictionless start of the paper.
    Off,
}

/// How far contact is from what was asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shortfall {
    /// Penetration, or gap under pressure, over what is allowed: the largest of all points.
    pub ratio: f64,
    /// That penetration or gap \[m\].
    pub depth: f64,
}

/// Whether forces are taken over a step as a whole, such that their work is the change of energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OverStep {
    /// Forces are those of the trial state.
    #[default]
    No,
    /// The trial state is the middle of the step, which ends as far from it as it started.
    Middle,
    /// The trial state is the end of the step; forces and accelerations are still those of its middle.
    End,
}

/// One step on its way: where it starts, where it is, and how the rates follow from the displacement.
pub struct Stage {
    /// The accepted state at the start of the step.
    pub start: State,
    /// The iterate at the end of the step.
    pub trial: State,
    /// Step \[s\].
    pub dt: f64,
    /// `dv/du`, `da/du`.
    pub shifts: Shifts,
    /// Weights of inertia and forces.
    pub balance: Balance,
    /// Whether the inertia takes part.
    pub inertia: bool,
    /// Whether forces conserve over the step.
    pub over_step: OverStep,
    /// Friction as given or off.
    pub friction: FrictionMode,
    /// What a staggered solve holds at present.
    pub split: Split,
    /// Spring on every free unknown, relative to a typical diagonal entry, that is in the matrix and not in the
    /// residual: makes the matrix regular where nothing holds a body, without changing the equilibrium that is found.
    /// Above zero it also says that free motions are to be looked for.
    pub holding: f64,
    /// Resistance, over a typical diagonal entry, up to which a motion of a body counts as free and is held in a static solve; 0
    /// where only those that nothing resists are.
    pub yielding: f64,
    /// Residual over the largest force that is enough, whatever the strategy asks: 0 but for states on the way to another.
    pub enough: f64,
    /// Factor on loads and prescribed displacements, 1 but for the increments of a static start.
    pub load_factor: f64,
    /// `r = Q - F_ext - F_n - F_T` at the start \[N\].
    pub start_forces: Vector,
    /// `v` at the end if `u` did not change \[m/s\].
    pub velocity_base: Vector,
    /// `a` at the end if `u` did not change \[m/s2\]; without entries where there is no inertia.
    pub acceleration_base: Vector,
}

impl Stage {
    /// A stage at rest with the layout of `pattern`; an integrator fills it.
    ///
    /// # Errors
    /// When PETSc can not allocate.
    pub fn at_rest(pattern: &Vector) -> Result<Self> {
        Self::new(pattern, true)
    }

    /// The same; without `inertia` it has no accelerations and can take no other scheme than the static one.
    ///
    /// # Errors
    /// When PETSc can not allocate.
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

    /// Sets `v` and `a` of the trial state from its `u`. Prescribed rows are the system's to overwrite.
    ///
    /// # Errors
    /// When PETSc refuses.
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

/// Size of the residual on the free unknowns, and what it is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// 2-norm over the free unknowns \[N\]; not finite where the trial state was rejected.
    pub norm: f64,
    /// Largest 2-norm among internal, contact, external and inertia forces \[N\].
    pub scale: f64,
}

/// The contact points of an iterate, counted once each.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ContactCounts {
    /// Closed points.
    pub closed: u64,
    /// Closed points that do more than touch: whether the gap of any other is positive or negative, rounding decides.
    pub pressing: u64,
    /// Closed points that stick.
    pub stick: u64,
    /// Closed points that slip.
    pub slip: u64,
    /// Points whose status differs from the iterate before.
    pub changed: u64,
    /// Points whose slip direction reversed.
    pub flipped: u64,
}

/// A motion without strain that supports leave: of a body as a rigid one, or of pieces that hinge on each other.
pub struct RigidMotion {
    /// Number of the group of pieces that moves.
    pub group: usize,
    /// The motion: zero on others and at prescribed unknowns, 2-norm 1.
    pub field: Vector,
    /// How each piece of the group moves.
    pub parts: Vec<MovingPart>,
}

/// How a piece of a body takes part in a [`RigidMotion`].
pub struct MovingPart {
    /// What messages call it, `'block'`.
    pub name: String,
    /// Number of its nodes.
    pub nodes: f64,
    /// Sum of the squares by which its nodes move when it turns by 1, the mean over the axes \[m2\].
    pub spread: f64,
    /// How far the centre of its nodes moves, x, y, z.
    pub shift: [f64; 3],
    /// How far it turns about that, about x, y, z \[1/m\].
    pub spin: [f64; 3],
}

/// A set of prescribed changes that goes to the right side: `rhs -= K_fd change`.
pub struct Lift<'a> {
    /// Change of the prescribed unknowns, zero on the free ones \[m\].
    pub change: &'a Vector,
    /// Right side that takes it \[N\].
    pub rhs: &'a mut Vector,
}

/// The equations of motion `M a + Q(u) - F_ext(t) - F_n(u) - F_T(u, v) = 0` (3.9).
pub trait Dynamics {
    /// Sets `u`, `v`, `a` of the prescribed unknowns at the trial state's time, times the load factor, and
    /// refreshes the ghosts of `u` and `v`. Collective.
    ///
    /// # Errors
    /// When PETSc refuses; a prescribed value that is not finite is told by the next residual.
    fn prescribe(&mut self, stage: &mut Stage) -> Result<()>;

    /// Residual of the balance at the trial state, zero in prescribed rows \[N\]. Collective.
    ///
    /// A rejected trial (det F <= 0) is no error: its norm is not finite and [`Dynamics::fault`] tells why.
    ///
    /// # Errors
    /// When PETSc refuses, or a prescribed value is not finite on some rank.
    fn residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual>;

    /// Whether the next correction is better computed from [`Dynamics::predicted_residual`].
    fn predicts(&self) -> bool;

    /// The residual with stick assumed where the slip direction flipped: the right side of the next correction,
    /// whose matrix [`Dynamics::jacobian`] always is. To be called after [`Dynamics::residual`] at the same state: only
    /// the contact forces are computed anew. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn predicted_residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual>;

    /// Assembles the derivative of the residual, restricted to `terms`, into [`Dynamics::matrix`]. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn jacobian(&mut self, stage: &Stage, terms: Terms, lift: Option<Lift>) -> Result<()>;

    /// Assembles the same into a matrix of the system's pattern that is not the system's own, as that of a
    /// preconditioner, with the symmetry that its terms have. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn jacobian_into(&mut self, stage: &Stage, terms: Terms, matrix: &mut Matrix) -> Result<()>;

    /// Assembles [`Terms::BODIES`] with springs where contact is closed into a matrix of the system's pattern: of the
    /// stiffness of `K_CN` and `K_T`, yet no stiffer than the elements beneath them, and softer at points without
    /// friction. Symmetric. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn joined_bodies_into(&mut self, stage: &Stage, matrix: &mut Matrix) -> Result<()>;

    /// The units of all numbers, for messages.
    fn units(&self) -> Units;

    /// The assembled matrix \[N/m\].
    fn matrix(&self) -> &Matrix;

    /// Whether the matrix of these terms is symmetric for this case.
    fn is_symmetric(&self, stage: &Stage, terms: Terms) -> bool;

    /// Compares the contact points with the iterate before and arms the safeguards. Collective.
    ///
    /// # Errors
    /// When a rank failed.
    fn observe(&mut self) -> Result<ContactCounts>;

    /// Keeps tractions for the stages of a [`Split`] to hold.
    fn freeze(&mut self, what: Freeze);

    /// How the friction forces of the last residual differ from those frozen. Collective.
    fn force_change(&self) -> ForceChange;

    /// Unit normals at the owned nodes in contact at the last residual, zero elsewhere. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn contact_normals(&mut self, out: &mut Vector) -> Result<()>;

    /// The owned nodes of facets in contact at the last residual, both sides of deformable ones. Collective.
    fn contact_nodes(&mut self) -> Vec<bool>;

    /// The owned nodes of bodies that no support holds in some direction.
    fn floating_nodes(&self) -> Vec<bool>;

    /// The rigid motions of bodies that supports leave at the trial places, contact left aside; orthonormal. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn rigid_motions(&self, stage: &Stage) -> Result<Vec<RigidMotion>>;

    /// `M n` of a motion `n`, or `n` where there is no mass, zero in prescribed rows. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn weigh_motion(&self, motion: &Vector, out: &mut Vector) -> Result<()>;

    /// A typical diagonal entry of the stiffness \[N/m\], which [`Stage::holding`] counts in.
    fn unit(&self) -> f64;

    /// Whether a slip direction reversed between the last iterate and the last residual. Collective.
    fn reverses(&self) -> bool;

    /// Whether the contact points returned to the statuses of two iterates before.
    fn is_cycling(&self) -> bool;

    /// Longest motion of a node in one correction of bodies that contact alone holds \[m\]: one that nothing holds yet
    /// would pass through its target in a single stride.
    fn stride(&self) -> f64;

    /// Forgets the iterates since the start of the step.
    fn rewind(&mut self);

    /// Why the last residual was not finite, the same on all ranks. Collective.
    fn fault(&mut self) -> Option<Error>;

    /// The contact points that changed last, as a phrase for a message; empty if no point changed.
    fn restless_points(&self) -> String;

    /// Takes the multipliers that are sought as the last accepted step left them.
    fn recall_multipliers(&mut self);

    /// How far contact points of the last residual are from touching exactly; `None` where no tolerance was asked for.
    /// Collective.
    fn shortfall(&self) -> Option<Shortfall>;

    /// Brings contact that is not in motion closer to what was asked, by multipliers or by a stiffer penalty. Collective.
    fn improve(&mut self);

    /// Size of the residual that the rounding of displacements and places leaves at the trial state \[N\], by the matrix that was
    /// assembled last. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn rounding(&self, stage: &Stage) -> Result<f64>;

    /// Extent of all bodies, or their largest coordinate far from the origin \[m\]: what rounding is measured against.
    fn extent(&self) -> f64;
}
