//! Executes a run from the case to its results, in the order of section 3 of the paper.

mod attempts;
mod begin;
mod check;
mod checkpoint;
mod current_solve;
mod earlier_run;
mod fields;
mod guard;
mod hints;
mod input;
mod itself;
mod journal;
mod magnitudes;
mod measure;
mod motion;
mod needs;
mod options;
mod pace;
mod parts;
mod place;
mod refusal;
mod remarks;
mod restart;
mod resume;
mod signals;
mod start;
mod tables;
mod unexplained;
mod unit_note;

use std::rc::Rc;

use crate::assembly::{ContactSystem, Motions, SystemOptions};
use crate::case::Case;
use crate::dynamics::{Dynamics, OverStep, Stage};
use crate::error::{Cause, Error, Result, agree};
use crate::model::{ContactModel, Model, Target, read_meshes};
use crate::observe::energy::EnergyLedger;
use crate::partition::{Couple, LocalMesh, Plan, Report, distribute};
use crate::petsc::Session;
use crate::solvers::{Outcome, SolveReport, Strategy, Trouble};
use crate::time::{Retry, Scheme, StepControl};

pub use begin::Begin;
pub use check::check;
pub use checkpoint::WALL_TIME_IS_OVER;
pub use input::{give_options, shared_text, take_back_options};
pub use journal::Journal;
pub use options::scheme;
pub use pace::{Memory, StepPacing};
pub use parts::parts;
pub use place::RunRequest;
pub use refusal::refuse;
pub use signals::Signals;

use checkpoint::{CheckpointPolicy, RunView};
use guard::RunGuard;
use magnitudes::MotionPrecision;
use restart::Saved;

/// Prefixes of PETSc's options for the linear solvers of the steps, the static start and the
/// initial acceleration.
pub const SOLVER_PREFIXES: [&str; 3] = ["", "start_", "mass_"];

/// Runs the case in `D` dimensions and writes the journal. Collective.
///
/// # Errors
/// The error is the same on all ranks. Results computed before it are kept.
pub fn run<const D: usize>(session: &Rc<Session>, case: &Case, place: &RunRequest) -> Result<()> {
    Ready::<D>::new(session, case, place)?.run(session, case, place)
}

/// A run that is ready to begin and has not written anything yet.
pub struct Ready<const D: usize> {
    keeper: CheckpointPolicy,
    model: Model<D>,
    saved: Option<Saved>,
    partition: Report,
    /// Remarks of rank 0 on the meshes.
    remarks: Vec<String>,
    system: ContactSystem<D>,
    stage: Stage,
    strategy: Box<dyn Strategy>,
}

impl<const D: usize> Ready<D> {
    /// Reads the input of the case and builds the system. Collective.
    ///
    /// # Errors
    /// The case, or a file that it names, is invalid. The error is the same on all ranks.
    pub fn new(session: &Rc<Session>, case: &Case, place: &RunRequest) -> Result<Self> {
        let keeper = CheckpointPolicy::new(session, case, place)?;
        let model = Model::<D>::new(case)?;
        let mut saved = Saved::find::<D>(session, case, place)?;
        let Share { local, partition, remarks } = share_out(session, case, &model)?; // METIS
        let scheme = options::scheme(&case.time);
        let linear = options::linear(case);
        let format = options::format(session, case, &local, &linear)?;
        let options = SystemOptions { inertia: scheme.has_inertia(), format };
        let mut system = ContactSystem::new(session, local, &model, options)?; // (2.1), (3.4)
        let precision = system.precision();
        magnitudes::require_precision(&precision)?;
        start::require_reach(&mut system, &model, case)?;
        pace::limit_penetration(&mut system, case, &precision)?;
        let stage = Stage::new(system.pattern_vector(), scheme.has_inertia())?;
        let strategy = options::strategy(case, &system, SOLVER_PREFIXES[0])?; // (3.10), or (3.6) and (3.7)
        if strategy.wants_rigid_body_modes() {
            system.set_rigid_body_modes()?;
        }
        saved.as_mut().map_or(Ok(()), |saved| saved.read(&system))?;
        Ok(Self { keeper, model, saved, partition, remarks, system, stage, strategy })
    }

    /// Executes the run and writes the journal. Collective.
    ///
    /// # Errors
    /// The error is the same on all ranks. Results computed before it are kept.
    pub fn run(self, session: &Rc<Session>, case: &Case, place: &RunRequest) -> Result<()> {
        let Self { mut keeper, model, saved, partition, remarks, mut system, mut stage, mut strategy } = self;
        let past = saved.as_ref().map(|saved| (saved.state.past.clone(), saved.state.time));
        let mut journal = Journal::open(session, case, &model, place, past)?;
        journal.remark(remarks);
        let outcome = journal.start_up(&system, &partition, &*strategy).and_then(|()| {
            let watch = match &saved {
                None => begin(&mut system, &mut stage, case, &model, &mut journal) // B_0
                    .map_err(|error| keeper.within_the_start(error))?,
                Some(saved) => saved.resume(&mut system, &mut stage, case, &model, &mut journal)?,
            };
            march(&mut system, &mut stage, &mut strategy, case, &mut journal, watch, &mut keeper)
        });
        let outcome = outcome.map_err(|error| keeper.offered(error));
        if let Err(error) = &outcome {
            session.meet(error);
        }
        journal.close(&outcome)?;
        outcome
    }
}

/// A rank's part of the meshes.
struct Share<const D: usize> {
    local: LocalMesh<D>,
    partition: Report,
    /// Remarks on the meshes, on rank 0.
    remarks: Vec<String>,
}

/// Reads the meshes on rank 0 and distributes them. Facets that may touch are placed on the same
/// rank. Collective.
fn share_out<const D: usize>(session: &Rc<Session>, case: &Case, model: &Model<D>) -> Result<Share<D>> {
    let world = session.world();
    let read = if session.rank() == 0 { read_meshes(case).map(Some) } else { Ok(None) };
    let (mesh, remarks) = agree(world, read)?.unzip();
    let plan = agree(world, Plan::for_contact(mesh.as_ref(), &couples(model)))?;
    let (local, partition) = distribute(world, mesh, &plan)?;
    Ok(Share { local, partition, remarks: remarks.unwrap_or_default() })
}

/// Pairs of surfaces of the model that may touch each other.
fn couples<const D: usize>(model: &Model<D>) -> Vec<Couple<'_>> {
    let couple = |contact| match contact {
        &ContactModel { ref contactor, target: Target::Surface { ref set, .. }, .. } => {
            Some(Couple { contactor, target: set, travel: 0.0 })
        }
        _ => None,
    };
    model.contacts.iter().filter_map(couple).collect()
}

/// Counters and monitors that are updated in every step.
pub struct RunMonitors {
    /// The step control.
    control: StepControl,
    /// The energies.
    ledger: EnergyLedger,
    /// The monitor of unexplained energy and impact.
    guard: RunGuard,
    /// The control of the step length by estimated errors.
    pace: StepPacing,
}

/// Computes the state at the start, writes its rows and creates the monitors.
fn begin<const D: usize>(
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
    case: &Case,
    model: &Model<D>,
    journal: &mut Journal<D>,
) -> Result<RunMonitors> {
    start::at_equilibrium(system, stage, case, model, journal)?;
    let farthest = system.farthest_motion(stage, Motions::All);
    MotionPrecision::new(system.precision()).accept(farthest, "at the start")?;
    let control = pace::control(case, model, 0.0);
    let pace = StepPacing::new(system, stage, case, model)?;
    let ledger = EnergyLedger::begin(system, stage, system.pattern_vector().like()?)?;
    journal.begin(system, stage, &ledger, &control)?;
    let guard = RunGuard::new(case, model, options::scheme(&case.time), ledger.now());
    Ok(RunMonitors { control, ledger, guard, pace })
}

/// Advances from configuration to configuration until the end.
fn march<const D: usize>(
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
    strategy: &mut Box<dyn Strategy>,
    case: &Case,
    journal: &mut Journal<D>,
    mut watch: RunMonitors,
    keeper: &mut CheckpointPolicy,
) -> Result<()> {
    let scheme = options::scheme(&case.time);
    let mut precision = MotionPrecision::new(system.precision());
    while !watch.control.finished() {
        let RunMonitors { control, ledger, guard, pace } = &mut watch;
        if guard.motion.foresees(control.dt()) && control.can_cut() {
            journal.shortened();
            control.fail();
            continue;
        }
        pace.prepare(system);
        let attempt = Attempt { scheme, control, pace };
        let before = *ledger.now();
        let saved = ledger.save();
        journal.try_step();
        let outcome = match attempt.solve(system, stage, &mut **strategy, journal) {
            Err(error) if error.cause == Cause::Stopped => {
                let view = RunView { system, stage, strategy, watch: &mut watch, journal };
                return Err(keeper.within_a_step(view, case)?);
            }
            outcome => attempt.finish(system, stage, ledger, outcome?)?,
        };
        journal.tried();
        journal.fallbacks(&strategy.take_fallbacks());
        match outcome {
            Outcome::Converged(report) => {
                let energies = *ledger.now();
                let slides = system.slides(stage);
                if let Some(reason) =
                    control.can_cut().then(|| guard.motion.objection(&slides, case.units)).flatten()
                {
                    ledger.restore(saved);
                    journal.failed(&report, &reason, control);
                    control.fail();
                    continue;
                }
                if !pace.accepts(system, stage, control, [&before, &energies], &report)? {
                    ledger.restore(saved);
                    journal.repeated(&report, control);
                    continue;
                }
                let farthest = system.farthest_motion(stage, Motions::All);
                precision.accept(farthest, &at_time(system, stage)).map(|remark| {
                    remark.iter().for_each(|text| journal.warn(&format!("warning: {text}")));
                    journal.known(precision.at(farthest));
                })?;
                pace.advance(system, stage, control, journal)?;
                journal.record(system, stage, ledger, &energies, &report)?;
                guard.impact(system, stage).iter().for_each(|text| journal.warn(text));
                guard.record(system, stage, journal.step(), ledger)?;
                guard.motion.accept(&slides, journal.step(), stage.dt);
                journal.at_the_end(guard.warnings(scheme, !case.contact.is_empty(), case.units));
                guard.energy(ledger, stage.trial.time, case.units)?;
                system.accept(stage)?; // B_N -> B_N+1
                control.succeed();
                let view = RunView { system, stage, strategy, watch: &mut watch, journal };
                keeper.step_done(view, case)?;
            }
            Outcome::Failed(report, reason) => {
                ledger.restore(saved);
                journal.failed(&report, &reason, control);
                if control.fail() == Retry::GiveUp {
                    // If rounding dominates the prescribed motion, this is why the step does not
                    // converge.
                    let prescribed = system.farthest_motion(stage, Motions::Prescribed);
                    precision.accept(prescribed, &at_time(system, stage))?;
                    let error = give_up(system, &reason, stage, control);
                    return Err(hints::with_hint(error, &report, system, stage, case)?);
                }
            }
        }
    }
    Ok(())
}

/// One attempt at a step of the length that the control offers.
struct Attempt<'a> {
    scheme: Scheme,
    control: &'a StepControl,
    pace: &'a StepPacing,
}

impl Attempt<'_> {
    /// Solves from the extrapolated state. If this fails, solves from the state at the start of the
    /// step.
    fn solve<const D: usize>(
        &self,
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
        strategy: &mut dyn Strategy,
        journal: &mut Journal<D>,
    ) -> Result<Outcome> {
        self.scheme.prepare(stage, self.control.dt(), self.control.end_of_step())?;
        journal.attempt(stage);
        let moved = match self.scheme.has_inertia() {
            true => {
                self.scheme.extrapolate(stage)?;
                system.doubt_first_slip(self.pace.predict(stage)?);
                true
            }
            false => strategy.follow_prescribed(system, stage)?,
        };
        let mut spent = SolveReport::default();
        if moved {
            match strategy.solve(system, stage, &mut |row| journal.iteration(row))? {
                Outcome::Failed(report, _) => spent = report,
                converged => return Ok(converged),
            }
        }
        stage.trial.u.copy_from(&stage.start.u)?;
        system.doubt_first_slip(false);
        journal.attempt(stage);
        let outcome = strategy.solve(system, stage, &mut |row| journal.iteration(row))?;
        Ok(outcome.after(&spent))
    }

    /// Extrapolates to the end of the step if the scheme balances forces at its middle. Then
    /// evaluates the forces at the end and updates the ledger. A state that is not valid at the end
    /// of the step counts as a failed attempt.
    fn finish<const D: usize>(
        &self,
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
        ledger: &mut EnergyLedger,
        outcome: Outcome,
    ) -> Result<Outcome> {
        let Outcome::Converged(report) = outcome else { return Ok(outcome) };
        let goes_on = self.scheme.finish(stage, self.control.end_of_step())?;
        if stage.over_step == OverStep::End {
            system.settle_end(stage)?;
        } else if goes_on {
            system.prescribe(stage)?;
            let mut residual = system.pattern_vector().like()?;
            if !system.residual(stage, &mut residual)?.norm.is_finite() {
                let why =
                    system.fault().map_or_else(|| "a force is not finite".to_owned(), |fault| fault.message);
                return Ok(failed(report, Trouble::Numbers, format!("at the end of the step: {why}")));
            }
        }
        if let Some(reason) = system.unsound_state(stage) {
            return Ok(failed(report, Trouble::Numbers, reason));
        }
        if let Some(reason) = system.missed_contact(stage)? {
            return Ok(failed(report, Trouble::Motion, reason));
        }
        let energies = ledger.advance(system, stage)?;
        Ok(match energies.is_finite() {
            true => Outcome::Converged(report),
            false => {
                failed(report, Trouble::Numbers, "an energy at the end of the step is not finite".to_owned())
            }
        })
    }
}

/// Names the instant at the end of the step.
fn at_time<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> String {
    format!("t = {:.6e} {}", stage.trial.time, system.units().of("s"))
}

/// The outcome of a step that was solved but can not be accepted.
fn failed(report: SolveReport, trouble: Trouble, reason: String) -> Outcome {
    Outcome::Failed(SolveReport { trouble, ..report }, reason)
}

/// Creates the error that ends a run whose step can not be cut further.
fn give_up<const D: usize>(
    system: &mut ContactSystem<D>,
    reason: &str,
    stage: &Stage,
    control: &StepControl,
) -> Error {
    let s = system.units().of("s");
    let place = format!("t = {:.6e} {s}, step cut to {:.3e} {s}", stage.start.time, control.dt());
    system.fault().unwrap_or_else(|| Error::not_converged(reason.to_owned())).within(&place)
}
