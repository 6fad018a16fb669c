//! Newton's method on the full, non-symmetric system (3.10), with the safeguards that contact needs.
//!
//! Three things go wrong in contact and each has its answer (theory, section 5.2): points that open and
//! close in turn (line search for the smallest residual), a whole interface that reverses its slip in turn
//! (the correction assumes stick there, see
//! [`Dynamics::predicts`]), and trial states with det F <= 0 (the
//! correction is halved).

mod follow;

use super::convergence::{IterationReport, Outcome, SolveReport, Trouble};
use super::cycle::{Cycle, Search};
use super::descent::{Descent, Searched};
use super::forcing::Forcing;
use super::free_motion::FreeMotions;
use super::held::{Driven, HeldMotions};
use super::kept_tangent::KeptTangent;
use super::linear::{Fallback, LinearSolver, Solved};
use crate::dynamics::{Dynamics, FrictionMode, Residual, Stage};
use crate::error::Result;
use crate::petsc::Vector;
use crate::terms::Terms;

/// Residual over the largest force from which on pressures are not yet those of the solution: a deep first guess has a thousand times theirs,
/// and the geometric stiffness that they carry leads astray (Hertz's cylinder: 45 iterations with it, 24 without; a tenth of this
/// is the same).
const FAR: f64 = 0.1;

/// Those of the wanted `terms` that a tangent has at this residual.
fn terms_at(now: &Residual, terms: Terms) -> Terms {
    if now.norm > FAR * now.scale { terms - Terms::NORMAL_GEOMETRY } else { terms }
}

/// When Newton's method ends, and how it safeguards itself.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonSettings {
    /// Residual over the largest force at which the balance holds.
    pub tolerance: f64,
    /// Most corrections in one solve.
    pub max_iterations: u32,
    /// Bounds of the linear tolerances, firmest first.
    pub linear: [f64; 2],
    /// Search along a correction that does not reduce the residual.
    pub line_search: bool,
    /// Terms of the tangent.
    pub terms: Terms,
    /// A tangent of an earlier step serves where it does.
    pub keep_tangent: bool,
}

/// The monolithic strategy.
pub struct Monolithic {
    settings: NewtonSettings,
    /// Residual over the largest force at which the present solve ends.
    target: f64,
    forcing: Forcing,
    linear: LinearSolver,
    kept: KeptTangent,
    residual: Vector,
    rhs: Vector,
    correction: Vector,
    origin: Vector,
    free: FreeMotions,
    /// What carries motions that are held though something resists them.
    carried: HeldMotions,
    /// Number of free motions at the iterate that was held best, and the one that was driven there.
    firmest: (usize, Option<Driven>),
    /// Krylov iterations, and those within preconditioners, of the first guess of the next solve.
    ahead: [u32; 2],
}

/// Where along a correction the next iterate lies.
struct Point {
    length: f64,
    residual: Residual,
    /// The shortest length that was tried is the best of a search; `None` where the correction was not searched along.
    searched: Option<bool>,
}

impl Point {
    fn taken(length: f64, residual: Residual) -> Self {
        Self { length, residual, searched: None }
    }
}

impl Monolithic {
    /// A full correction is taken while the residual grows by less than this factor.
    const GROWTH: f64 = 10.0;
    /// Iterations without line search.
    const PATIENCE: u32 = 5;
    /// From then on each iteration shall reduce the residual by this factor, or the line is searched.
    const REDUCTION: f64 = 3.0;
    /// A correction that is smaller than this part of the displacements is rounding. Well above the noise that is
    /// seen, half of it, so that no partition is on the other side.
    const ROUNDING: f64 = 8.0 * f64::EPSILON;
    /// Where the residual no longer falls and is of the size that rounding leaves, a correction up to this part of the
    /// displacements is rounding, too: slender bodies bend by many times the rounding of their places.
    const NEGLIGIBLE: f64 = 1e-12;
    /// The residual that rounding leaves is known up to this factor.
    const ROUNDINGS: f64 = 16.0;
    /// Part of the largest force that may hold a motion that is not quite free: friction takes it over.
    const CARRIED: f64 = 0.1;
    /// Forces along a free motion up to this part of the tolerance are none: all of them together do not keep the balance
    /// from being met.
    const NO_FORCE: f64 = 0.1;
    /// Before the first iterate: worse than any.
    const NOT_HELD: (usize, Option<Driven>) = (usize::MAX, None);
    /// No linear solve for a predicted residual is tighter, unless all are.
    const PREDICTED: f64 = 1e-12;
    /// Shortest step along a correction is `2^-HALVINGS`.
    const HALVINGS: i32 = 9;

    /// A solver for states with the layout of `pattern`.
    ///
    /// # Errors
    /// When PETSc can not allocate.
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
            firmest: Self::NOT_HELD,
            ahead: [0; 2],
        })
    }

    /// The linear solver in use.
    pub fn linear(&self) -> &LinearSolver {
        &self.linear
    }

    /// Whether the last solve may end at this residual over the largest force: one that ended above it ended at rounding.
    pub(super) fn ends_at(&self, residual: f64) -> bool {
        residual <= self.target
    }

    /// Linear solvers that failed since the last call, and what took over.
    pub fn take_fallbacks(&mut self) -> Vec<Fallback> {
        self.linear.take_fallbacks()
    }

    /// Corrects `stage.trial` until the balance holds. Collective.
    ///
    /// # Errors
    /// When PETSc refuses; a solve that does not converge is an [`Outcome`].
    pub fn solve(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: impl FnMut(&IterationReport),
    ) -> Result<Outcome> {
        (self.free, self.firmest) = (FreeMotions::default(), Self::NOT_HELD);
        Ok(match (self.iterate(system, stage, watch)?, &self.firmest.1) {
            (Outcome::Failed(report, reason), Some(driven)) => {
                let report = SolveReport { driven: true, ..report };
                Outcome::Failed(report, format!("{reason}; {}", driven.tell()))
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
        self.target = self.settings.tolerance.max(stage.enough);
        self.forcing.restart();
        system.rewind();
        let mut now = self.evaluate(system, stage)?;
        let mut row = IterationReport { krylov, ..IterationReport::first(relative(now), system.observe()?) };
        let mut at_rounding = false;
        let mut cycle = Cycle::of(stage.split);
        let mut descent = Descent::default();
        let mut lost = None;
        loop {
            if stage.friction == FrictionMode::AsGiven {
                self.linear.heed(row.contact);
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
                let yields = stage.yielding > 0.0 && self.free.held() > 0;
                report.held = match yields {
                    true => std::mem::take(&mut self.carried),
                    false => self.free.needed(&self.residual, now.scale, false)?,
                };
                let most = if yields { Self::CARRIED } else { self.target };
                if report.held.force <= most {
                    return Ok(Outcome::Converged(report));
                }
                let reason = report.held.tell();
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
            let slow = [row.iteration >= Self::PATIENCE, system.is_cycling()];
            let points = [row.contact.closed, row.contact.pressing];
            let keeps = slow == [false; 2] && self.keeps_tangent(system, stage, now, points);
            let solved = match self.correct(system, stage, now, points, keeps)? {
                Ok(solved) => solved,
                Err((trouble, reason)) => {
                    report.trouble = trouble;
                    return Ok(Outcome::Failed(report, reason.to_owned()));
                }
            };
            self.origin.copy_from(&stage.trial.u)?;
            let search = cycle.search(now.norm, slow, self.settings.line_search);
            let point = self.advance(system, stage, now, search)?;
            let before = std::mem::replace(&mut now, point.residual);
            let searched = point.searched.map(|shortest| Searched {
                norms: [before.norm, now.norm],
                relative: [relative(before), relative(now)],
                shortest,
            });
            lost = descent.is_lost(searched).then(|| {
                format!(
                    "no length of correction {} brings the balance closer: residual {:.1e} before, {:.1e} at best",
                    row.iteration + 1,
                    relative(before),
                    relative(now)
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
            at_rounding = self.at_rounding(&row, system)?;
            // The effect of a correction on a residual at rounding says nothing about its tangent.
            if keeps && !at_rounding {
                let target = self.target * now.scale;
                self.kept.used([before.norm / target, now.norm / target]);
            }
            report.newton += 1;
            report.krylov += solved.iterations;
            report.inner += solved.inner;
        }
    }

    /// Residual at `stage.trial.u`, after rates and prescribed values were brought up to date.
    pub(super) fn evaluate(&mut self, system: &mut dyn Dynamics, stage: &mut Stage) -> Result<Residual> {
        stage.update_rates()?;
        system.prescribe(stage)?;
        let now = system.residual(stage, &mut self.residual)?;
        if stage.yielding == 0.0 || self.free.held() == 0 {
            return Ok(now);
        }
        // What is held is held by a force of its own.
        self.carried = self.free.needed(&self.residual, now.scale, true)?;
        self.free.clear_force(&mut self.residual)?;
        Ok(Residual { norm: self.residual.norm()?, ..now })
    }

    /// Whether the next correction goes by the tangent at hand.
    fn keeps_tangent(&self, system: &dyn Dynamics, stage: &Stage, now: Residual, points: [u64; 2]) -> bool {
        let excess = now.norm / (self.target * now.scale);
        let fit = self.settings.keep_tangent && stage.inertia && !system.predicts();
        fit && self.kept.serves(stage.shifts, system.matrix().pattern(), points, excess)
    }

    /// The correction at the current residual, by Newton's method or with a kept tangent; or the reason why there is no correction.
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
        system.jacobian(stage, terms_at(&now, self.settings.terms), None)?;
        if !system.matrix().norm_frobenius()?.is_finite() {
            return Ok(Err((Trouble::Numbers, "a stiffness is not finite")));
        }
        self.kept.made(stage.shifts, system.matrix().pattern(), points);
        match system.predicts() {
            true => system.predicted_residual(stage, &mut self.rhs).map(drop)?,
            false => self.rhs.copy_from(&self.residual)?,
        }
        self.rhs.scale(-1.0)?;
        let allowed = if stage.yielding > 0.0 { Self::CARRIED } else { Self::NO_FORCE * self.target };
        self.release(system, stage, allowed * now.scale)?;
        let asked = self.forcing.next(now.norm, self.target * now.scale);
        // Stick continued beyond the bound is far out of balance: the solve is to err by no more than it would else.
        let tolerance = match system.predicts() {
            true => (asked * now.norm / self.rhs.norm()?).max(Self::PREDICTED).min(asked),
            false => asked,
        };
        Ok(self.solve_held(system, stage, tolerance)?.ok_or(UNSOLVED))
    }

    /// The correction for the right side at hand, without what is held.
    fn solve_held(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &Stage,
        tolerance: f64,
    ) -> Result<Option<Solved>> {
        let linear = &mut self.linear;
        let mut solved =
            linear.solve_system(system, stage, false, &self.rhs, &mut self.correction, tolerance)?;
        if let (Some(total), true) = (&mut solved, stage.yielding > 0.0) {
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

    /// Finds the free motions of a static equilibrium at the assembled matrix, and takes forces along them that are no
    /// larger than `allowed` \[N\] out of the right side.
    fn release(&mut self, system: &dyn Dynamics, stage: &Stage, allowed: f64) -> Result<()> {
        if stage.holding == 0.0 {
            return Ok(());
        }
        self.free = FreeMotions::find(system, stage, &self.rhs, allowed)?;
        if self.free.free <= self.firmest.0 && allowed.is_finite() {
            self.firmest = (self.free.free, self.free.driven.clone());
        }
        self.free.clear_force(&mut self.rhs)
    }

    /// Takes the correction whole, or the part of it that the safeguards allow.
    fn advance(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        before: Residual,
        search: Search,
    ) -> Result<Point> {
        let whole = self.stride(system, stage)?;
        let full = self.at(system, stage, whole)?;
        let good = full.norm.is_finite() && full.norm < Self::GROWTH * before.norm;
        let fast = full.norm * Self::REDUCTION <= before.norm && search != Search::Always;
        if good && (fast || self.converged(full) || whole < 1.0 || search == Search::Never) {
            return Ok(Point::taken(whole, full));
        }
        // Between opposite slip branches lies stick, which the next correction assumes; a shorter step would stay
        // on the flat branch and creep.
        if full.norm.is_finite() && search != Search::Always && system.reverses() {
            return Ok(Point::taken(whole, full));
        }
        let mut best = Point::taken(whole, full);
        for halving in 1..=Self::HALVINGS {
            let length = whole * 0.5f64.powi(halving);
            let residual = self.at(system, stage, length)?;
            let better = !best.residual.norm.is_finite() || residual.norm < best.residual.norm;
            if residual.norm.is_finite() && better {
                let shortest = halving == Self::HALVINGS;
                best = Point { length, residual, searched: Some(shortest) };
            }
            let enough = best.residual.norm.is_finite() && best.residual.norm < Self::GROWTH * before.norm;
            if enough && search == Search::Never {
                return Ok(Point::taken(best.length, best.residual));
            }
        }
        let residual = self.at(system, stage, best.length)?;
        let searched = (search != Search::Never).then_some(best.searched == Some(true));
        Ok(Point { length: best.length, residual, searched })
    }

    /// The part of the correction that is taken at most: all of it, unless it carries a body that nothing holds, where
    /// the residual knows nothing of the target until it is touched.
    fn stride(&self, system: &dyn Dynamics, stage: &Stage) -> Result<f64> {
        if stage.holding == 0.0 {
            return Ok(1.0);
        }
        let limit = system.stride();
        let motion = self.correction.max_norm()?;
        Ok(if motion > limit { limit / motion } else { 1.0 })
    }

    /// Residual at the origin plus a part of the correction.
    fn at(&mut self, system: &mut dyn Dynamics, stage: &mut Stage, length: f64) -> Result<Residual> {
        stage.trial.u.waxpy(length, &self.correction, &self.origin)?;
        self.evaluate(system, stage)
    }

    /// The balance holds, and not by the error of a linear solve, which another number of ranks would not make.
    fn settled(&self, now: Residual, iteration: u32) -> bool {
        let decides = self.forcing.decides() || !self.linear.preset().iterative;
        self.converged(now) && (iteration == 0 || now.norm == 0.0 || decides)
    }

    fn converged(&self, now: Residual) -> bool {
        now.norm <= self.target * now.scale
    }

    /// The last correction was lost in the rounding of the displacements: no iterate can be better. A body in free
    /// flight ends here, since its forces are nothing but rounding.
    fn at_rounding(&self, row: &IterationReport, system: &dyn Dynamics) -> Result<bool> {
        let size = system.extent() + self.origin.norm()?;
        // The whole correction, also where a part of it was taken: noise has no direction worth a search.
        Ok(row.increment <= Self::ROUNDING * size * row.line_search)
    }

    /// The residual, which no longer falls, is of the size that the rounding of the displacements leaves, and the last correction
    /// is hardly more. What is compared does not become smaller as the load does, so a shorter step changes nothing.
    fn stands_at_rounding(
        &self,
        row: &IterationReport,
        now: Residual,
        system: &dyn Dynamics,
        stage: &Stage,
    ) -> Result<bool> {
        let size = system.extent() + self.origin.norm()?;
        let is_small = row.increment <= Self::NEGLIGIBLE * size * row.line_search;
        Ok(is_small && Self::is_rounding(now, system, stage)?)
    }

    /// Whether a residual is no larger than what rounding may leave at the trial state, by the matrix made last.
    pub(super) fn is_rounding(now: Residual, system: &dyn Dynamics, stage: &Stage) -> Result<bool> {
        Ok(now.norm <= Self::ROUNDINGS * system.rounding(stage)?)
    }

    /// Why the iteration ran out, with figures and the points that do not settle.
    fn slow(&self, report: &SolveReport, system: &dyn Dynamics) -> String {
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

/// Residual over the largest force; 0 where there is no force at all.
pub(super) fn relative(now: Residual) -> f64 {
    if now.norm == 0.0 { 0.0 } else { now.norm / now.scale }
}

/// Why a trial state was rejected.
fn rejected(system: &mut dyn Dynamics) -> String {
    system.fault().map_or_else(|| "the residual is not a number".to_owned(), |fault| fault.message)
}
