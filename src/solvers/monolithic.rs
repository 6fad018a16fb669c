//! Newton's method on the full, non-symmetric system (3.10), with the safeguards that contact
//! needs.
//!
//! Contact causes three difficulties, each with its remedy (theory, section 5.2):
//!
//! - Points open and close in turn. Tangents have the gaps linearised at the iterate before, see
//!   [`PressureLinearisation`](crate::dynamics::PressureLinearisation), and a line search minimises the residual.
//! - A whole interface reverses its slip in turn. The correction assumes stick there, see
//!   [`ContactMonitor::predicts`].
//! - The trial state has det F <= 0. The correction is halved.

mod follow;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::convergence::{IterationReport, Outcome, SolveReport, Trouble};
use super::descent::{Descent, Searched};
use super::forcing::Forcing;
use super::free_motion::FreeMotions;
use super::held::{Driven, HeldMotions};
use super::kept_tangent::{KeptTangent, KeptTangentState};
use super::linear::{Fallback, LinearSolver, LinearState, Solved};
use super::own::stored;
use crate::dynamics::{
    ContactMonitor, Dynamics, Equations, FloatingBodies, FrictionMode, MultigridHints, Residual, Sources,
    Stage,
};
use crate::error::{Error, Result};
use crate::petsc::Vector;
use crate::terms::Terms;

/// Convergence criteria of Newton's method, and its safeguards.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonSettings {
    /// Residual, relative to the largest force, at which the balance is met.
    pub tolerance: f64,
    /// Maximum number of corrections in one solve.
    pub max_iterations: u32,
    /// Bounds of the linear tolerances, the loosest first.
    pub linear: [f64; 2],
    /// Whether to search along a correction that does not reduce the residual.
    pub line_search: bool,
    /// Terms of the tangent.
    pub terms: Terms,
    /// Whether a tangent of an earlier step is reused while it still serves.
    pub keep_tangent: bool,
}

/// The monolithic strategy.
pub struct Monolithic {
    settings: NewtonSettings,
    /// Residual, relative to the largest force, at which the present solve ends.
    target: f64,
    forcing: Forcing,
    linear: LinearSolver,
    kept: KeptTangent,
    residual: Vector,
    rhs: Vector,
    correction: Vector,
    origin: Vector,
    free: FreeMotions,
    /// Forces that hold motions although something resists them.
    carried: HeldMotions,
    firmest: Option<Firmest>,
    /// Krylov iterations of the initial guess of the next solve, and those within preconditioners.
    ahead: [u32; 2],
}

/// The state of a solver that outlives a step. The settings, the fields of the last solve and its
/// free motions do not.
#[derive(Serialize, Deserialize)]
struct MonolithicState {
    forcing: Forcing,
    tangent: KeptTangentState,
    linear: LinearState,
}

/// The iterate with the fewest free motions, and among these the one nearest to balance, of those
/// that are not farther from balance than the first iterate: forces on a body in an iterate that
/// diverges say nothing about the scene.
struct Firmest {
    /// Number of free motions.
    free: usize,
    /// Norm of the residual \[N\].
    residual: f64,
    /// Norm of the residual of the first iterate \[N\].
    first: f64,
    /// The motion that was driven there.
    driven: Option<Driven>,
}

/// Position of the next iterate along a correction.
struct Point {
    length: f64,
    residual: Residual,
    /// Norm of the residual that decides on the length, see [`Monolithic::merit`] \[N\].
    merit: f64,
    /// Whether the shortest length that was tried is the best of a search. `None` if there was no
    /// search along the correction.
    searched: Option<bool>,
}

impl Monolithic {
    /// A full correction is accepted while the residual grows by less than this factor.
    const GROWTH: f64 = 10.0;
    /// Number of iterations without line search.
    const PATIENCE: u32 = 5;
    /// After that, each iteration must reduce the residual by this factor. Otherwise a line search
    /// follows.
    const REDUCTION: f64 = 3.0;
    /// A correction that is smaller than this part of the displacements is rounding. Observed noise
    /// is half of this value, so that the decision does not depend on the partition.
    const ROUNDING: f64 = 8.0 * f64::EPSILON;
    /// Relative size of a correction that also counts as rounding, if the residual no longer falls
    /// and is as small as rounding leaves it. Slender bodies bend by many times the rounding of
    /// their positions.
    const NEGLIGIBLE: f64 = 1e-12;
    /// Factor up to which the residual left by rounding is known.
    const ROUNDINGS: f64 = 16.0;
    /// Part of the largest force that may hold a motion that is not quite free. Friction carries
    /// this force later.
    const CARRIED: f64 = 0.1;
    /// Forces along a free motion up to this part of the tolerance count as zero. Even their sum
    /// does not prevent convergence.
    const NO_FORCE: f64 = 0.1;
    /// Tightest tolerance of a linear solve for a predicted residual, unless all tolerances are
    /// tighter.
    const PREDICTED: f64 = 1e-12;
    /// The shortest step along a correction is `2^-HALVINGS`.
    const HALVINGS: i32 = 9;

    /// Creates a solver for states with the layout of `pattern`.
    ///
    /// # Errors
    /// If PETSc cannot allocate.
    pub fn new(settings: NewtonSettings, linear: LinearSolver, pattern: &Vector) -> Result<Self> {
        Ok(Self {
            forcing: Forcing::new(settings.linear[0], settings.linear[1]),
            target: settings.tolerance,
            settings,
            linear,
            kept: KeptTangent::default(),
            residual: pattern.like()?,
            rhs: pattern.like()?,
            correction: pattern.like()?,
            origin: pattern.like()?,
            free: FreeMotions::default(),
            carried: HeldMotions::default(),
            firmest: None,
            ahead: [0; 2],
        })
    }

    /// The linear solver that is in use.
    pub fn linear(&self) -> &LinearSolver {
        &self.linear
    }

    /// Whether the last solve may end at this residual, relative to the largest force. A solve that
    /// ended above it ended at rounding.
    pub(super) fn ends_at(&self, residual: f64) -> bool {
        residual <= self.target
    }

    /// Returns the linear solvers that failed since the last call, and their replacements.
    pub fn take_fallbacks(&mut self) -> Vec<Fallback> {
        self.linear.take_fallbacks()
    }

    /// State that outlives a step.
    ///
    /// # Errors
    /// An internal error of the program.
    pub fn state(&self, system: &dyn Dynamics, sources: &mut Sources) -> Result<Value> {
        let state = MonolithicState {
            forcing: self.forcing.clone(),
            tangent: self.kept.state(system.matrix().pattern()),
            linear: self.linear.state(system, sources),
        };
        serde_json::to_value(state).map_err(|error| Error::internal(format!("state of a solver: {error}")))
    }

    /// Restores the state. Collective.
    ///
    /// # Errors
    /// The state is not one of this solver, or a PETSc call fails.
    pub fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn Dynamics) -> Result<()> {
        let MonolithicState { forcing, tangent, linear } = stored(state)?;
        self.forcing = forcing;
        self.linear.resume(&linear, sources, system)?;
        self.kept.resume(tangent, system.matrix().pattern());
        Ok(())
    }

    /// Corrects `stage.trial` until the balance is met. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails. A solve that does not converge is an [`Outcome`].
    pub fn solve(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: impl FnMut(&IterationReport),
    ) -> Result<Outcome> {
        (self.free, self.firmest) = (FreeMotions::default(), None);
        // The pressure is linearised at the state from which a linear solve made the initial guess, if any.
        let outcome = self.iterate(system, stage, watch)?;
        system.linearise_pressure(None);
        let driven = self.firmest.as_ref().and_then(|firmest| firmest.driven.as_ref());
        Ok(match (outcome, driven) {
            (Outcome::Failed(report, reason), Some(driven)) => {
                let report = SolveReport { driven: true, ..report };
                Outcome::Failed(report, format!("{reason}; {}", driven.describe()))
            }
            (outcome, _) => outcome,
        })
    }

    fn iterate(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        mut watch: impl FnMut(&IterationReport),
    ) -> Result<Outcome> {
        let [krylov, inner] = std::mem::take(&mut self.ahead);
        let mut report = SolveReport { krylov, inner, ..SolveReport::default() };
        self.target = self.settings.tolerance.max(system.continuation().tolerance);
        self.forcing.restart();
        system.rewind();
        let mut now = self.evaluate(system, stage)?;
        let mut merit = now.norm;
        let mut row = IterationReport { krylov, ..IterationReport::first(relative(now), system.observe()?) };
        let mut at_rounding = false;
        let mut descent = Descent::default();
        let mut lost = None;
        loop {
            if system.continuation().friction == FrictionMode::AsGiven {
                self.linear.note_contacts(row.contact);
            }
            watch(&row);
            report.residual = row.residual;
            report.contact = row.contact;
            if !now.norm.is_finite() {
                report.trouble = Trouble::Numbers;
                return Ok(Outcome::Failed(report, rejected(system)));
            }
            let stands = row.iteration > 0
                && !at_rounding
                && descent.has_stopped(now.norm)
                && self.stands_at_rounding(&row, now, system, stage)?;
            if self.settled(now, row.iteration) || at_rounding || stands {
                let yields = system.continuation().free_resistance > 0.0 && self.free.held() > 0;
                report.held = match yields {
                    true => std::mem::take(&mut self.carried),
                    false => self.free.needed(&self.residual, now.scale, false)?,
                };
                let most = if yields { Self::CARRIED } else { self.target };
                if report.held.force <= most {
                    return Ok(Outcome::Converged(report));
                }
                let reason = report.held.describe();
                return Ok(Outcome::Failed(report, reason));
            }
            if let Some(reason) = lost {
                return Ok(Outcome::Failed(report, reason));
            }
            descent.reach(now.norm);
            if row.iteration == self.settings.max_iterations {
                let reason = self.slow(&report, system);
                return Ok(Outcome::Failed(report, reason));
            }
            let slow = row.iteration >= Self::PATIENCE;
            let points = [row.contact.closed, row.contact.pressing];
            let keeps = !slow && self.keeps_tangent(system, stage, now, points);
            let predicted = system.predicts();
            let solved = match self.correct(system, stage, now, points, keeps)? {
                Ok(solved) => solved,
                Err((trouble, reason)) => {
                    report.trouble = trouble;
                    return Ok(Outcome::Failed(report, reason.to_owned()));
                }
            };
            self.origin.copy_from(&stage.trial.u)?;
            system.linearise_pressure(Some(&stage.trial.u));
            let point = self.advance(system, stage, merit, slow && self.settings.line_search)?;
            let before = std::mem::replace(&mut now, point.residual);
            // Merits of two iterates are linearised at different states. A true residual that falls is
            // a descent in any case.
            let merits = [std::mem::replace(&mut merit, point.merit), point.merit];
            let norms = if now.norm < before.norm { [before.norm, now.norm] } else { merits };
            let judged = [(norms[0], before.scale), (norms[1], now.scale)]
                .map(|(norm, scale)| relative(Residual { norm, scale }));
            let searched = point.searched.map(|shortest| Searched { norms, relative: judged, shortest });
            lost = descent.is_lost(searched).then(|| {
                format!(
                    "the line search failed in correction {}: residual {:.1e} before, {:.1e} at best",
                    row.iteration + 1,
                    judged[0],
                    judged[1]
                )
            });
            row = IterationReport {
                iteration: row.iteration + 1,
                residual: relative(now),
                increment: point.length * self.correction.norm()?,
                krylov: solved.iterations,
                contact: system.observe()?,
                line_search: point.length,
                ..row
            };
            // What balances predicted branches need not balance the actual ones.
            at_rounding = !predicted && self.at_rounding(&row, system)?;
            // At rounding level, the effect of a correction on the residual says nothing about its
            // tangent.
            if keeps && !at_rounding {
                let target = self.target * now.scale;
                self.kept.used([before.norm / target, now.norm / target]);
            }
            report.newton += 1;
            report.krylov += solved.iterations;
            report.inner += solved.inner;
        }
    }

    /// Computes the residual at `stage.trial.u`, after an update of rates and prescribed values.
    pub(super) fn evaluate(&mut self, system: &mut dyn Equations, stage: &mut Stage) -> Result<Residual> {
        stage.update_rates()?;
        system.prescribe(stage)?;
        let now = system.residual(stage, &mut self.residual)?;
        if system.continuation().free_resistance == 0.0 || self.free.held() == 0 {
            return Ok(now);
        }
        // Held motions are held by a separate force.
        self.carried = self.free.needed(&self.residual, now.scale, true)?;
        self.free.clear_force(&mut self.residual)?;
        Ok(Residual { norm: self.residual.norm()?, ..now })
    }

    /// Whether the next correction reuses the current tangent.
    fn keeps_tangent(
        &self,
        system: &dyn ContactMonitor,
        stage: &Stage,
        now: Residual,
        points: [u64; 2],
    ) -> bool {
        let excess = now.norm / (self.target * now.scale);
        let fit = self.settings.keep_tangent && stage.inertia && !system.predicts();
        fit && self.kept.serves(stage.shifts, system.matrix().pattern(), points, excess)
    }

    /// Computes the correction at the current residual, by Newton's method or with a kept tangent.
    /// Otherwise returns the reason why there is no correction.
    fn correct(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &Stage,
        now: Residual,
        points: [u64; 2],
        keeps: bool,
    ) -> Result<std::result::Result<Solved, (Trouble, &'static str)>> {
        const UNSOLVED: (Trouble, &str) = (Trouble::Linear, "no linear solver reached its tolerance");
        if keeps {
            self.rhs.copy_from(&self.residual)?;
            self.rhs.scale(-1.0)?;
            let tolerance = self.forcing.next_kept(now.norm, self.target * now.scale);
            let solved =
                self.linear.solve_system(system, stage, true, &self.rhs, &mut self.correction, tolerance)?;
            return Ok(solved.ok_or(UNSOLVED));
        }
        system.jacobian(stage, self.settings.terms, None)?;
        if !system.matrix().norm_frobenius()?.is_finite() {
            return Ok(Err((Trouble::Numbers, "the tangent matrix is not finite")));
        }
        // The matrix of a prediction is that of other points than the present ones, so it is not kept.
        match system.predicts() {
            true => {
                self.kept.discard();
                system.predicted_residual(stage, &mut self.rhs).map(drop)?;
            }
            false => {
                self.kept.made(stage.shifts, system.matrix().pattern(), points);
                self.rhs.copy_from(&self.residual)?;
            }
        }
        self.rhs.scale(-1.0)?;
        let allowed = if system.continuation().free_resistance > 0.0 {
            Self::CARRIED
        } else {
            Self::NO_FORCE * self.target
        };
        self.release(system, stage, allowed * now.scale)?;
        let asked = self.forcing.next(now.norm, self.target * now.scale);
        // A residual with stick assumed beyond the bound, or with the law of a closed point at an open
        // gap, is far out of balance. The linear error must be no larger than for the true residual.
        let tolerance = match system.predicts() {
            true => (asked * now.norm / self.rhs.norm()?).max(Self::PREDICTED).min(asked),
            false => asked,
        };
        Ok(self.solve_held(system, stage, tolerance)?.ok_or(UNSOLVED))
    }

    /// Solves for the correction with the current right side, without the held motions.
    fn solve_held(
        &mut self,
        system: &mut dyn MultigridHints,
        stage: &Stage,
        tolerance: f64,
    ) -> Result<Option<Solved>> {
        let linear = &mut self.linear;
        let mut solved =
            linear.solve_system(system, stage, false, &self.rhs, &mut self.correction, tolerance)?;
        if let (Some(total), true) = (&mut solved, system.continuation().free_resistance > 0.0) {
            self.free.answer(|weight, answer| {
                let own = linear.solve_system(system, stage, true, weight, answer, tolerance)?;
                total.iterations += own.as_ref().map_or(0, |own| own.iterations);
                total.inner += own.as_ref().map_or(0, |own| own.inner);
                Ok(own.is_some())
            })?;
        }
        self.free.clear_motion(&mut self.correction)?;
        Ok(solved)
    }

    /// Finds the free motions of a static equilibrium at the assembled matrix. Removes forces along
    /// them that are at most `allowed` \[N\] from the right side.
    fn release(&mut self, system: &dyn FloatingBodies, stage: &Stage, allowed: f64) -> Result<()> {
        if system.continuation().spring == 0.0 {
            return Ok(());
        }
        self.free = FreeMotions::find(system, stage, &self.rhs, allowed)?;
        let free = self.free.free;
        let residual = self.rhs.norm()?;
        let first = self.firmest.as_ref().map_or(residual, |best| best.first);
        let firmer = |best: &Firmest| {
            residual <= best.first && (free < best.free || (free == best.free && residual <= best.residual))
        };
        if allowed.is_finite() && self.firmest.as_ref().is_none_or(firmer) {
            self.firmest = Some(Firmest { free, residual, first, driven: self.free.driven.clone() });
        }
        self.free.clear_force(&mut self.rhs)
    }

    /// Takes the full correction, or the part of it that the safeguards allow. `before` is the merit of the
    /// iterate. A correction that does not reduce it is searched along if `searches`.
    fn advance(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        before: f64,
        searches: bool,
    ) -> Result<Point> {
        let whole = self.stride(system)?;
        let full = self.at(system, stage, whole)?;
        let is_fast = |merit: f64| merit * Self::REDUCTION <= before;
        let merit = if is_fast(full.norm) { full.norm } else { self.merit(system, stage, full)? };
        let all = Point { length: whole, residual: full, merit, searched: None };
        let good = merit < Self::GROWTH * before;
        if good && (is_fast(merit) || self.converged(full) || whole < 1.0 || !searches) {
            return Ok(all);
        }
        let mut best = all;
        for halving in 1..=Self::HALVINGS {
            let length = whole * 0.5f64.powi(halving);
            let residual = self.at(system, stage, length)?;
            let merit = self.merit(system, stage, residual)?;
            if merit.is_finite() && (!best.merit.is_finite() || merit < best.merit) {
                let shortest = halving == Self::HALVINGS;
                best = Point { length, residual, merit, searched: Some(shortest) };
            }
            let enough = best.merit.is_finite() && best.merit < Self::GROWTH * before;
            if enough && !searches {
                return Ok(Point { searched: None, ..best });
            }
        }
        let residual = self.at(system, stage, best.length)?;
        let searched = searches.then_some(best.searched == Some(true));
        Ok(Point { residual, searched, ..best })
    }

    /// Norm by which a correction is judged \[N\].
    ///
    /// The volume that a correction leaves wrong is of second order, and the bulk modulus multiplies its
    /// force. The next correction removes it, so that it does not count: the merit is the norm with the
    /// pressure linearised at the iterate before, if that is smaller (theory, section 5.1).
    fn merit(&self, system: &mut dyn Dynamics, stage: &Stage, residual: Residual) -> Result<f64> {
        if !residual.norm.is_finite() {
            return Ok(residual.norm);
        }
        let linearised = system.linearised_norm(stage, &self.residual)?;
        Ok(linearised.map_or(residual.norm, |norm| norm.min(residual.norm)))
    }

    /// Largest part of the correction that may be taken. It is 1, except for a correction that
    /// carries a body that nothing holds. The residual does not depend on the target before the
    /// body touches it.
    fn stride(&self, system: &dyn ContactMonitor) -> Result<f64> {
        if system.continuation().spring == 0.0 {
            return Ok(1.0);
        }
        let limit = system.stride();
        let motion = self.correction.max_norm()?;
        Ok(if motion > limit { limit / motion } else { 1.0 })
    }

    /// Computes the residual at the origin plus a part of the correction.
    fn at(&mut self, system: &mut dyn Equations, stage: &mut Stage, length: f64) -> Result<Residual> {
        stage.trial.u.waxpy(length, &self.correction, &self.origin)?;
        self.evaluate(system, stage)
    }

    /// Whether the balance is met independently of the error of a linear solve, which would depend
    /// on the number of ranks.
    fn settled(&self, now: Residual, iteration: u32) -> bool {
        let decides = self.forcing.decides() || !self.linear.preset().iterative;
        self.converged(now) && (iteration == 0 || now.norm == 0.0 || decides)
    }

    fn converged(&self, now: Residual) -> bool {
        now.norm <= self.target * now.scale
    }

    /// Whether the last correction was below the rounding of the displacements, so that no iterate
    /// can be better. A body in free flight ends here, because its forces are only rounding.
    fn at_rounding(&self, row: &IterationReport, system: &dyn Equations) -> Result<bool> {
        let size = system.extent() + self.origin.norm()?;
        // The full correction counts, even if only a part was taken. A search along noise is
        // useless.
        Ok(row.increment <= Self::ROUNDING * size * row.line_search)
    }

    /// Whether the residual stopped falling at the level that rounding of the displacements leaves,
    /// with a last correction hardly larger than that. This level does not decrease with the load,
    /// so a shorter step changes nothing.
    fn stands_at_rounding(
        &self,
        row: &IterationReport,
        now: Residual,
        system: &dyn Equations,
        stage: &Stage,
    ) -> Result<bool> {
        let size = system.extent() + self.origin.norm()?;
        let is_small = row.increment <= Self::NEGLIGIBLE * size * row.line_search;
        Ok(is_small && Self::is_rounding(now, system, stage)?)
    }

    /// Whether a residual is no larger than what rounding may leave at the trial state, estimated
    /// with the last assembled matrix.
    pub(super) fn is_rounding(now: Residual, system: &dyn Equations, stage: &Stage) -> Result<bool> {
        Ok(now.norm <= Self::ROUNDINGS * system.rounding(stage)?)
    }

    /// Explains why the iteration limit was reached, with values and the points that do not settle.
    fn slow(&self, report: &SolveReport, system: &dyn ContactMonitor) -> String {
        let restless = system.restless_points();
        format!(
            "residual {:.1e} > {:.1e} after {} iterations{}{restless}",
            report.residual,
            self.target,
            report.newton,
            if restless.is_empty() { "" } else { "; " }
        )
    }
}

/// Residual, relative to the largest force; 0 if there is no force at all.
pub(super) fn relative(now: Residual) -> f64 {
    if now.norm == 0.0 { 0.0 } else { now.norm / now.scale }
}

/// Explains why a trial state was rejected.
fn rejected(system: &mut dyn Equations) -> String {
    system.fault().map_or_else(|| "the residual is not finite".to_owned(), |fault| fault.message)
}
