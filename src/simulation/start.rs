//! Computes the initial state: a static equilibrium without friction if the case requests it, then
//! velocities and the acceleration that balances the forces (theory, section 5.6, and theory,
//! section 4.3).

use super::hints::{self, TOO_LARGE};
use super::journal::Journal;
use super::{SOLVER_PREFIXES, options};
use crate::advice::crushed::crushed;
use crate::advice::reach::{self, Span};
use crate::assembly::{ContactSystem, TurnDirection, set_velocity};
use crate::case::{Case, Start};
use crate::dynamics::{Balance, Continuation, Equations, FrictionMode, RigidInstant, Shifts, Stage};
use crate::error::{Cause, Error, Result};
use crate::model::Model;
use crate::petsc::Vector;
use crate::solvers::{
    LinearChoice, LinearSolver, Monolithic, Outcome, Problem, SolveReport, Strategy, Trouble, first_guess,
};
use crate::terms::Terms;
use crate::time::{Integrate, Scheme};

/// Residual over the largest force at which an intermediate load increment of the static start is
/// accepted.
const PASSING: f64 = 1e-3;

/// Spring on free bodies in the static start, relative to a typical diagonal entry. It makes the
/// factorisation regular and supports bodies that nothing touches yet. It does not hold any body
/// (`solvers::FreeMotions`).
const HOLDING: f64 = 1e-7;

/// Number of unknowns up to which the start is factorised on one rank. The start is then bitwise
/// reproducible. This costs a few tenths of the time of the start.
const ON_ONE_RANK: usize = 30_000;

/// Resistance relative to a typical diagonal entry. Below it, motions are held in a start that
/// otherwise finds no equilibrium.
const YIELDING: f64 = 1e-3;
/// Residual below which a failed equilibrium does not need a smaller load. Instead, weakly resisted
/// motions are held.
const ALMOST: f64 = 1e-4;

/// Computes the initial state in `stage.start`. Collective.
///
/// # Errors
/// No equilibrium is found.
pub fn at_equilibrium<const D: usize>(
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
    case: &Case,
    model: &Model<D>,
    journal: &mut Journal<D>,
) -> Result<()> {
    if case.is_static() {
        require_supports(system)?;
        system.set_continuation(of_steps(system, case));
        return begin(system, stage, 0.0);
    }
    if let Some(Start::Equilibrium { friction, increments }) = case.start.as_ref().map(|start| &start.value) {
        let friction = if *friction { FrictionMode::AsGiven } else { FrictionMode::Off };
        press(system, stage, case, friction, *increments, journal)?;
    }
    set_velocity(system, stage, model)?;
    begin(system, stage, case.time.step())?;
    accelerate(system, stage, case)
}

/// The equations of the steps. In statics they have an auxiliary spring if supports alone do not
/// hold the bodies.
pub fn of_steps<const D: usize>(system: &ContactSystem<D>, case: &Case) -> Continuation {
    let spring = if case.is_static() && !system.bodies().holding().is_complete() { HOLDING } else { 0.0 };
    Continuation { spring, ..Continuation::default() }
}

/// Checks that in statics each piece of a body is held by supports or by contact.
///
/// # Errors
/// A piece is held by neither.
pub fn require_supports<const D: usize>(system: &ContactSystem<D>) -> Result<()> {
    let lost = system.bodies().holding().lost_bodies();
    if lost.is_empty() {
        return Ok(());
    }
    Err(Error::case(format!("in statics, no support or contact holds {}", lost.join("; ")))
        .hint(
            "hold each direction: a body by a displacement boundary, a foundation or a contact, a free rigid body \
             by `fixed`, `spring` or a contact; or use a dynamic scheme",
        ))
}

/// Checks that each contact can close within the time of the case. Collective.
///
/// # Errors
/// A contact can not close.
pub fn require_reach<const D: usize>(
    system: &mut ContactSystem<D>,
    model: &Model<D>,
    case: &Case,
) -> Result<()> {
    let from_equilibrium =
        matches!(case.start.as_ref().map(|start| &start.value), Some(Start::Equilibrium { .. }));
    reach::require_reach(
        system,
        model,
        &Span {
            end: case.time.end.value,
            step: case.time.step(),
            is_dynamic: !case.is_static(),
            from_equilibrium,
        },
    )
}

/// Computes the static equilibrium at t = 0. Loads and prescribed displacements grow in equal
/// increments.
fn press<const D: usize>(
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
    case: &Case,
    friction: FrictionMode,
    increments: u32,
    journal: &mut Journal<D>,
) -> Result<()> {
    let problem = options::problem(case, system, false);
    let terms = options::terms(case, system);
    let linear =
        LinearSolver::new(system.pattern_vector(), SOLVER_PREFIXES[1], &LinearChoice::Auto, &problem)?;
    let linear = if problem.unknowns <= ON_ONE_RANK { linear.on_one_rank()? } else { linear };
    if linear.wants_rigid_body_modes() {
        system.set_rigid_body_modes()?;
    }
    let newton = Monolithic::new(
        options::start_newton(case, terms, system.bodies().unknowns()),
        linear,
        system.pattern_vector(),
    )?;
    let mut strategy = options::augmented(system, Box::new(newton));
    let spring = if system.bodies().holding().is_complete() { 0.0 } else { HOLDING };
    let mut continuation = Continuation { friction, damped: false, spring, ..Continuation::default() };
    let free = (!system.bodies().holding().is_complete()).then(|| system.bodies().holding().free_bodies());
    let mut level = Levels::new(increments.max(1));
    let mut course = Course::new(system)?;
    while let Some(factor) = level.next() {
        let increment = Continuation { load_factor: factor, ..continuation };
        let outcome = match spring == 0.0 && course.goes_on_to(factor) {
            true => {
                let outcome = approach(system, stage, increment, strategy.as_mut(), Some(&course), journal)?;
                match outcome {
                    Outcome::Converged(_) => outcome,
                    Outcome::Failed(..) => {
                        approach(system, stage, increment, strategy.as_mut(), None, journal)?
                    }
                }
            }
            false => approach(system, stage, increment, strategy.as_mut(), None, journal)?,
        };
        match outcome {
            Outcome::Converged(report) => {
                journal.pressed(&report, factor, free.as_deref());
                course.reach(factor, stage)?;
                system.accept(stage)?;
                level.succeed();
            }
            // On a compliant target a body may have no equilibrium nearby without the friction that
            // will hold it. All forces except those along weakly resisted motions are then in
            // balance.
            Outcome::Failed(report, _)
                if may_yield(&continuation)
                    && !report.driven
                    && (report.residual < ALMOST || !level.can_cut()) =>
            {
                continuation.free_resistance = YIELDING;
                level.begin_anew();
            }
            Outcome::Failed(..) if level.cut() => {}
            Outcome::Failed(report, reason) => {
                let reason = match report.trouble {
                    Trouble::Balance => hints::with_place(reason, &report, system, stage)?,
                    _ => reason,
                };
                let cause = match hints::hinge(system, stage)? {
                    None if report.trouble == Trouble::Balance => hints::lifted(system, stage)?,
                    hinge => hinge,
                };
                return Err(no_equilibrium(system, journal.model(), &report, &reason, factor, cause));
            }
        }
    }
    system.set_continuation(Continuation::default());
    Ok(())
}

/// Whether bodies that only a weak resistance holds can be held in place, and are not held yet.
fn may_yield(start: &Continuation) -> bool {
    start.spring > 0.0 && start.free_resistance == 0.0 && start.friction == FrictionMode::Off
}

/// Computes the equilibrium at one increment of the loads. The first guess is extrapolated
/// from the last two equilibria, or comes from one linear solve with the prescribed displacements.
fn approach<const D: usize>(
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
    increment: Continuation,
    strategy: &mut dyn Strategy,
    course: Option<&Course>,
    journal: &mut Journal<D>,
) -> Result<Outcome> {
    Scheme::Static.prepare(stage, 1.0, 0.0)?;
    let friction = increment.friction == FrictionMode::AsGiven;
    let factor = increment.load_factor;
    if !friction {
        stage.shifts = Shifts::default();
    }
    // Friction depends on the path, and the rounding along a free motion is only visible in a tight
    // balance.
    let passes = factor < 1.0 && !friction && increment.spring == 0.0;
    let tolerance = if passes { PASSING } else { 0.0 };
    system.set_continuation(Continuation { tolerance, ..increment });
    journal.start_attempt(factor);
    system.begin_attempt();
    let moved = match course {
        Some(course) => course.extrapolate(factor, stage).map(|()| true)?,
        None => first_guess(strategy, system, stage, RigidInstant::Start)?,
    };
    let outcome = match moved {
        true => strategy.solve(system, stage, &mut |row| journal.iteration(row))?,
        false => {
            let sound = system.matrix().norm_frobenius()?.is_finite();
            let trouble = if sound { Trouble::Linear } else { Trouble::Numbers };
            let report = SolveReport { trouble, ..SolveReport::default() };
            Outcome::Failed(report, "the linear solver failed to follow the prescribed displacement".into())
        }
    };
    journal.fallbacks(&strategy.take_fallbacks());
    Ok(outcome)
}

/// The last two equilibria of the start, from which the next one is extrapolated linearly.
struct Course {
    /// Displacements of the older equilibrium.
    before: Vector,
    /// Load factors of both equilibria, the older first.
    factors: [f64; 2],
    /// Number of equilibria found.
    found: u32,
}

impl Course {
    fn new<const D: usize>(system: &ContactSystem<D>) -> Result<Self> {
        Ok(Self { before: system.pattern_vector().like()?, factors: [0.0; 2], found: 0 })
    }

    /// Whether the load factor can be extrapolated: the distance is at most twice that between the
    /// two known equilibria.
    fn goes_on_to(&self, factor: f64) -> bool {
        self.found > 0 && factor - self.factors[1] <= 2.0 * (self.factors[1] - self.factors[0])
    }

    /// Stores the equilibrium of `stage.trial` before it is accepted.
    fn reach(&mut self, factor: f64, stage: &Stage) -> Result<()> {
        self.before.copy_from(&stage.start.u)?;
        self.factors = [self.factors[1], factor];
        self.found += 1;
        Ok(())
    }

    /// Extrapolates the trial state, which is the last equilibrium, to `factor`.
    fn extrapolate(&self, factor: f64, stage: &mut Stage) -> Result<()> {
        let ratio = (factor - self.factors[1]) / (self.factors[1] - self.factors[0]);
        let last = &stage.start.u;
        stage.trial.u.copy_from(last)?;
        stage.trial.u.axpy(ratio, last)?;
        stage.trial.u.axpy(-ratio, &self.before)
    }
}

/// Sequence of load factors from 0 to 1. If a level fails, the increment is halved.
struct Levels {
    reached: f64,
    step: f64,
    /// The first and the smallest increment.
    limits: [f64; 2],
}

impl Levels {
    fn new(increments: u32) -> Self {
        let step = 1.0 / f64::from(increments);
        Self { reached: 0.0, step, limits: [step, step / 64.0] }
    }

    fn next(&self) -> Option<f64> {
        let next = self.reached + self.step;
        match self.reached < 1.0 {
            true if next > 1.0 - 1e-9 => Some(1.0),
            true => Some(next),
            false => None,
        }
    }

    fn succeed(&mut self) {
        self.reached = self.next().unwrap_or(1.0);
    }

    fn can_cut(&self) -> bool {
        self.step >= 2.0 * self.limits[1]
    }

    fn cut(&mut self) -> bool {
        let can = self.can_cut();
        self.step *= 0.5;
        can
    }

    /// Continues from the level reached, with increments as large as the first.
    fn begin_anew(&mut self) {
        self.step = self.limits[0];
    }
}

fn no_equilibrium<const D: usize>(
    system: &mut ContactSystem<D>,
    model: &Model<D>,
    report: &SolveReport,
    reason: &str,
    factor: f64,
    cause: Option<String>,
) -> Error {
    let free = if report.driven { system.bodies().holding().free_bodies() } else { Vec::new() };
    let place = format!("static start at {:.0} % of the loads", 100.0 * factor);
    let fault = system.fault();
    let beyond = report.trouble == Trouble::Numbers || fault.is_some();
    let error = fault.unwrap_or_else(|| Error::not_converged(reason.to_owned())).within(&place);
    // Increments have been halved six times at this point.
    let mut cure = match (crushed(system, model), report.trouble) {
        (Some(crushed), _) => crushed,
        (None, _) if beyond && error.cause != Cause::Guard => TOO_LARGE.to_owned(),
        (None, Trouble::Multipliers) => "allow more there, or use more increments".to_owned(),
        (None, _) => cause.unwrap_or_else(|| "use more increments, or start: { rest: {} }".to_owned()),
    };
    if !free.is_empty() {
        cure += &format!(
            "; no support holds {}: without friction its loads must also balance along every free direction",
            free.join(", ")
        );
    }
    error.hint(&cure)
}

/// Evaluates prescribed values, contact and forces of the initial state. The first step is `step`
/// \[s\] long; 0 in statics.
fn begin<const D: usize>(system: &mut ContactSystem<D>, stage: &mut Stage, step: f64) -> Result<()> {
    stage.dt = 0.0;
    stage.shifts = Shifts::default();
    stage.balance = Balance::AT_THE_END;
    // Gyroscopic moments are among the forces at the start.
    stage.inertia = system.bodies().is_dynamic();
    stage.trial.copy_from(&stage.start)?;
    stage.trial.time = 0.0;
    // Statics begins undeformed and without loads. A load that acts from the first step on grows
    // from zero within that step, so that its work is counted.
    let steps = *system.continuation();
    let load_factor = if system.bodies().is_dynamic() { 1.0 } else { 0.0 };
    system.set_continuation(Continuation { load_factor, ..steps });
    system.set_start_factor(load_factor);
    system.prescribe(stage)?;
    // The rotations of rigid bodies are those of the trial state.
    system.turn_rigid(stage, TurnDirection::Forwards);
    // A return map knows only the slip in its history. Bodies that slide at the start, deformable
    // and rigid ones, are therefore assumed to have slid for one step before.
    stage.start.time = -step;
    stage.start.u.axpy(-step, &stage.start.v)?;
    stage.start.u.update_ghosts()?;
    system.turn_rigid(stage, TurnDirection::Backwards);
    let mut residual = system.pattern_vector().like()?;
    let mut state = system.residual(stage, &mut residual)?;
    if system.know_gaps() {
        state = system.residual(stage, &mut residual)?;
    }
    if !state.norm.is_finite() {
        let fault = system.fault();
        return Err(fault.unwrap_or_else(|| Error::not_converged("the forces at the start are not finite")));
    }
    system.set_continuation(steps);
    system.remember_start(stage)?;
    system.turn_rigid(stage, TurnDirection::Forwards);
    stage.start.copy_from(&stage.trial)
}

/// Solves `M_ff a_f = -(Q - F_ext - F_n - F_T)_f - M_fd a_d`.
fn accelerate<const D: usize>(system: &mut ContactSystem<D>, stage: &mut Stage, case: &Case) -> Result<()> {
    if !system.bodies().is_dynamic() {
        return Ok(());
    }
    stage.inertia = true;
    stage.shifts = Shifts { velocity: 0.0, acceleration: 1.0 };
    stage.trial.copy_from(&stage.start)?;
    let mut rhs = system.pattern_vector().like()?;
    let mut change = system.pattern_vector().like()?;
    system.residual(stage, &mut rhs)?;
    rhs.scale(-1.0)?;
    system.bodies().rest_massless(&mut rhs);
    system.jacobian(stage, Terms::MASS, None)?;
    let problem = Problem {
        symmetric: true,
        contact: false,
        joins_bodies: false,
        ..options::problem(case, system, true)
    };
    let choice = LinearChoice::Named("cg_jacobi");
    let mut linear = LinearSolver::new(system.pattern_vector(), SOLVER_PREFIXES[2], &choice, &problem)?;
    let tolerance = case.solver.krylov.tolerance.value.min(1e-10);
    if linear.solve(system.matrix(), &rhs, &mut change, tolerance)?.is_none() {
        return Err(Error::not_converged(
            "initial acceleration: the linear solver failed for the mass matrix",
        ));
    }
    stage.start.a.axpy(1.0, &change)?;
    stage.start.a.update_ghosts()?;
    // The reactions at the start are computed from the trial state.
    stage.trial.copy_from(&stage.start)
}
