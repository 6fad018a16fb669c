//! The two-stage scheme (3.6), (3.7) (theory, section 5.4).
//!
//! It alternates between normal contact under known friction and friction under known pressure,
//! until both agree. Each stage drops one coupling from the residual and, unless the case asks for the
//! complete matrix, every non-symmetric term from the matrix. Both stages can then use methods for
//! symmetric matrices.
//!
//! The scheme contracts by a factor proportional to the coefficient of friction, hence does not
//! converge if that is large. Oscillating overshoots still converge if the stages exchange only a
//! part of their change ([`Progress::relax`]). A step that does not contract even then has failed.

use serde_json::{Value, json};

use super::convergence::{IterationReport, Outcome, SolvePhase, SolveReport, Trouble};
use super::linear::{Fallback, LinearSolver};
use super::monolithic::{Monolithic, NewtonSettings, relative};
use super::progress::{Progress, Sweep};
use super::strategy::Strategy;
use crate::dynamics::{Dynamics, Freeze, KnownFriction, Residual, Sources, Split, Stage};
use crate::error::Result;
use crate::petsc::Vector;
use crate::terms::Terms;

/// Convergence criteria of the sweeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StaggeredSettings {
    /// Estimated error at which the stages agree: of the displacements, relative to the increment
    /// of the step, and of the friction forces, relative to the normal forces.
    ///
    /// The errors are estimated from the contraction. The full system must also balance to Newton's
    /// tolerance.
    pub tolerance: f64,
    /// Maximum number of sweeps over both stages.
    pub max_sweeps: u32,
    /// Which part of friction is known in stage I.
    pub known: KnownFriction,
    /// Matrix of both stages.
    pub matrix: StageMatrix,
}

/// Matrix of the stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StageMatrix {
    /// The symmetric terms of the derivative.
    Symmetric,
    /// The complete derivative of what the stage does not hold.
    Complete,
}

impl StageMatrix {
    /// Terms of stages I and II. What a stage holds has no derivative.
    fn terms(self) -> [Terms; 2] {
        match self {
            Self::Symmetric => [Terms::NORMAL_STAGE, Terms::FRICTION_STAGE],
            Self::Complete => [Terms::ALL; 2],
        }
    }
}

/// The staggered strategy.
pub struct Staggered {
    settings: StaggeredSettings,
    /// Residual of the full system, relative to the largest force, at which it balances. It is a
    /// fraction of Newton's own tolerance.
    balance: f64,
    normal: Monolithic,
    friction: Monolithic,
    /// Displacement found by stage I, which is the result.
    found: Vector,
    /// `u_II - u_I` of this sweep, and of the previous one.
    apart: Vector,
    apart_before: Vector,
    work: Vector,
}

impl Staggered {
    /// Residual, relative to the largest force, to which each stage is solved at least. The stages
    /// are compared, and cannot agree better than each is solved.
    const STAGE_TOLERANCE: f64 = 1e-10;
    /// Residual to which each stage is solved at least if the friction traction is held. Under a
    /// stiff stick law, the friction that belongs to a displacement has an error of some thirty
    /// times the residual of the displacement. The full system has to balance with this friction.
    const STAGE_TOLERANCE_TRACTION: f64 = 1e-12;
    /// Residual of the full system, relative to Newton's tolerance, at which a step may end.
    ///
    /// Newton's last correction leaves far less than requested. Sweeps do not, and their residual
    /// has the same sign in each step. If all points slip for 70 steps, the force error is 1.0e-6
    /// at 1 and 5.5e-7 at this value, for one hundredth more solves.
    const BALANCE: f64 = 0.3;
    /// Maximum number of corrections of a stage, whose matrix is not the complete derivative.
    const STAGE_ITERATIONS: u32 = 60;
    /// Stages that differ by this part of the displacements differ only by rounding.
    const ROUNDING: f64 = 8.0 * f64::EPSILON;
    /// Largest ratio of two residuals of one state that are both rounding.
    const NOISE: f64 = 4.0;

    /// Creates a solver for states with the layout of `pattern`. `newton` defines how each stage is
    /// solved, and `linear` creates the linear solver of a stage.
    ///
    /// # Errors
    /// If PETSc cannot allocate.
    pub fn new(
        settings: StaggeredSettings,
        newton: &NewtonSettings,
        mut linear: impl FnMut() -> Result<LinearSolver>,
        pattern: &Vector,
    ) -> Result<Self> {
        let tight = match settings.known {
            KnownFriction::Bound => Self::STAGE_TOLERANCE,
            KnownFriction::Traction => Self::STAGE_TOLERANCE_TRACTION,
        };
        let [of_normal, of_friction] = settings.matrix.terms();
        let mut stage = |terms| {
            let newton = NewtonSettings {
                tolerance: newton.tolerance.min(tight),
                max_iterations: newton.max_iterations.max(Self::STAGE_ITERATIONS),
                terms,
                // The stages alternate in using one matrix.
                keep_tangent: false,
                ..newton.clone()
            };
            Monolithic::new(newton, linear()?, pattern)
        };
        Ok(Self {
            settings,
            balance: settings.tolerance.min(Self::BALANCE * newton.tolerance),
            normal: stage(of_normal)?,
            friction: stage(of_friction)?,
            found: pattern.like()?,
            apart: pattern.like()?,
            apart_before: pattern.like()?,
            work: pattern.like()?,
        })
    }

    /// Solves stage I and evaluates the full balance there, which gives the pressure and the bound
    /// that stage II holds fixed.
    fn find_contact(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: &mut dyn FnMut(&IterationReport),
    ) -> Result<(Outcome, Residual)> {
        system.set_split(Split::NormalStage(self.settings.known));
        let mut rows =
            |row: &IterationReport| watch(&IterationReport { phase: SolvePhase::NormalStage, ..*row });
        let outcome = self.normal.solve(system, stage, &mut rows)?;
        system.set_split(Split::Monolithic);
        let balance = self.normal.evaluate(system, stage)?;
        system.freeze(Freeze::NormalTractions);
        self.found.copy_from(&stage.trial.u)?;
        Ok((outcome, balance))
    }

    /// Solves stage II and evaluates the differences between both stages.
    fn find_friction(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: &mut dyn FnMut(&IterationReport),
    ) -> Result<(Outcome, Sweep)> {
        system.set_split(Split::FrictionStage);
        let mut rows =
            |row: &IterationReport| watch(&IterationReport { phase: SolvePhase::FrictionStage, ..*row });
        let outcome = self.friction.solve(system, stage, &mut rows)?;
        system.set_split(Split::Monolithic);
        let forces = system.force_change();
        system.freeze(Freeze::FrictionTractions);
        std::mem::swap(&mut self.apart, &mut self.apart_before);
        self.apart.waxpy(-1.0, &self.found, &stage.trial.u)?;
        let distance = self.apart.norm()?;
        self.work.waxpy(-1.0, &stage.start.u, &self.found)?;
        let rounding = Self::ROUNDING * (system.extent() + self.found.norm()?);
        let increment = self.work.norm()?;
        let sweep = Sweep {
            distance,
            relative_distance: if distance <= rounding { 0.0 } else { distance / increment },
            friction: if forces.friction == 0.0 { 0.0 } else { forces.friction / forces.normal },
            residual: 0.0,
            product: self.apart.dot(&self.apart_before)?,
        };
        Ok((outcome, sweep))
    }

    /// Whether both stages agree, and their result balances as well as a monolithic step does.
    ///
    /// Sweeps that contract by `q` leave an error of `|u - u_I| <= |u_I - u_II| / (1 - q)`, and a
    /// friction error in the same proportion. The error has the same sign in each step and
    /// accumulates. If all points slip, the last force would miss by a thousand times the tolerance
    /// without the balance criterion.
    ///
    /// In three cases no sweep can improve the result: the stages differ only by rounding, friction
    /// no longer changes less, or stage I ended at a `residual` above its tolerance. Such a
    /// residual is rounding: bodies in free flight, or a body that has left the surface it slid on,
    /// have no other forces.
    fn agrees(&self, sweep: &Sweep, residual: f64, progress: &Progress) -> bool {
        let open = sweep.relative_distance.max(sweep.friction) * progress.amplification();
        let exhausted = sweep.relative_distance == 0.0 || progress.stagnates();
        let balance = if exhausted { self.settings.tolerance } else { self.balance };
        let rounding = if self.normal.ends_at(residual) { 0.0 } else { Self::NOISE * residual };
        open <= self.settings.tolerance && sweep.residual <= balance.max(rounding)
    }

    /// Whether no sweep brings the stages closer, while the full system balances, either as well as
    /// requested or to rounding level as Newton's method measures it. For a slender body, rounding
    /// leaves a distance between the stages that is far above the rounding of its positions.
    fn stands_at_rounding(
        &self,
        sweep: &Sweep,
        balance: Residual,
        progress: &Progress,
        system: &dyn Dynamics,
        stage: &Stage,
    ) -> Result<bool> {
        if progress.stagnates() && sweep.residual <= self.balance {
            return Ok(true);
        }
        Ok(progress.pauses() && Monolithic::is_rounding(balance, system, stage)?)
    }

    /// Explains why the sweeps end without agreement, if they do.
    fn no_agreement(&self, number: u32, sweep: &Sweep, progress: &Progress) -> Option<String> {
        if number < self.settings.max_sweeps && !progress.stagnates() {
            return None;
        }
        let why = if progress.stagnates() { "stagnated" } else { "reached its sweep limit" };
        let contraction = progress.contraction().map_or(String::new(), |c| format!(", contraction {c:.2}"));
        Some(format!(
            "the staggered scheme {why} after {number} sweeps: the stages differ by {:.1e} of the increment \
             and friction changes by {:.1e} of the normal force (tolerance {:.1e}), residual {:.1e} \
             (tolerance {:.1e}){contraction}",
            sweep.relative_distance, sweep.friction, self.settings.tolerance, sweep.residual, self.balance
        ))
    }

    fn sweeps(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: &mut dyn FnMut(&IterationReport),
    ) -> Result<Outcome> {
        let (mut report, mut progress) = (SolveReport::default(), Progress::default());
        system.freeze(Freeze::LastStep);
        for number in 1.. {
            let (outcome, balance) = self.find_contact(system, stage, watch)?;
            if let Some(failed) = failure(&mut report, outcome, "stage I") {
                return Ok(failed);
            }
            let of_stage = report.residual;
            let (outcome, sweep) = self.find_friction(system, stage, watch)?;
            if let Some(failed) = failure(&mut report, outcome, "stage II") {
                return Ok(failed);
            }
            let sweep = Sweep { residual: relative(balance), ..sweep };
            progress.record(&sweep);
            stage.trial.u.copy_from(&self.found)?;
            report.residual = sweep.residual;
            watch(&IterationReport {
                phase: SolvePhase::Sweep,
                iteration: number,
                increment: sweep.distance,
                contraction: progress.contraction(),
                ..IterationReport::first(sweep.residual, report.contact)
            });
            if self.agrees(&sweep, of_stage, &progress)
                || self.stands_at_rounding(&sweep, balance, &progress, &*system, &*stage)?
            {
                break;
            }
            if let Some(reason) = self.no_agreement(number, &sweep, &progress) {
                report.trouble = Trouble::Sweeps;
                return Ok(Outcome::Failed(report, reason));
            }
            if let Some(part) = progress.relax(&sweep, self.settings.max_sweeps, self.balance) {
                system.freeze(Freeze::Part(part));
            }
        }
        // The following steps read forces, tractions and statuses from the last evaluation.
        report.residual = relative(self.normal.evaluate(system, stage)?);
        system.rewind();
        report.contact = system.observe()?;
        Ok(Outcome::Converged(report))
    }
}

/// Adds the work of a stage. Returns the outcome of the step if the stage failed.
fn failure(report: &mut SolveReport, outcome: Outcome, name: &str) -> Option<Outcome> {
    let (Outcome::Converged(of_stage) | Outcome::Failed(of_stage, _)) = &outcome;
    report.add_work(of_stage);
    report.single = report.single.max(Some(of_stage.effort()));
    report.contact = of_stage.contact;
    report.residual = of_stage.residual;
    (report.driven, report.trouble) = (of_stage.driven, of_stage.trouble);
    match outcome {
        Outcome::Converged(_) => None,
        Outcome::Failed(_, reason) => Some(Outcome::Failed(report.clone(), format!("{name}: {reason}"))),
    }
}

impl Strategy for Staggered {
    fn solve(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: &mut dyn FnMut(&IterationReport),
    ) -> Result<Outcome> {
        let outcome = self.sweeps(system, stage, watch);
        system.set_split(Split::Monolithic);
        outcome
    }

    fn follow_prescribed(&mut self, system: &mut dyn Dynamics, stage: &mut Stage) -> Result<bool> {
        system.freeze(Freeze::LastStep);
        system.set_split(Split::NormalStage(self.settings.known));
        let moved = self.normal.follow_prescribed(system, stage);
        system.set_split(Split::Monolithic);
        moved
    }

    fn state(&self, system: &dyn Dynamics, sources: &mut Sources) -> Result<Value> {
        let normal = self.normal.state(system, sources)?;
        Ok(json!([normal, self.friction.state(system, sources)?]))
    }

    fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn Dynamics) -> Result<()> {
        self.normal.resume(&state[0], sources, system)?;
        self.friction.resume(&state[1], sources, system)
    }

    fn describe(&self) -> String {
        format!("staggered, each stage by {}", self.normal.linear().describe())
    }

    fn wants_rigid_body_modes(&self) -> bool {
        self.normal.linear().wants_rigid_body_modes()
    }

    fn factorises_together(&self) -> bool {
        self.normal.linear().factorises_together()
    }

    fn take_fallbacks(&mut self) -> Vec<Fallback> {
        let mut fallbacks = self.normal.take_fallbacks();
        fallbacks.extend(self.friction.take_fallbacks());
        fallbacks
    }
}
