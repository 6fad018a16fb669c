//! Executes a run from the case to its results, in the order of section 3 of the paper.

mod attempts;
mod begin;
mod check;
mod checkpoint;
mod current_solve;
mod derived;
mod earlier_run;
mod field_output;
mod fields;
mod hints;
mod input;
mod journal;
mod measure;
mod needs;
mod options;
mod parts;
mod place;
mod refusal;
mod remarks;
mod restart;
mod resume;
mod run_state;
mod signals;
mod start;
mod tables;
mod unit_note;

use std::rc::Rc;

use mpi::traits::{Communicator, Root};

use crate::accuracy::{self, StepPacing};
use crate::advice::precision::{self, MotionPrecision, Motions, Precision, farthest_motion};
use crate::assembly::{ContactSystem, SystemOptions, unsound_state};
use crate::case::Case;
use crate::dynamics::{Equations, OverStep, RigidInstant, Stage};
use crate::error::{Cause, Error, Result, agree};
use crate::guard::{RunGuard, missed_contact, slides};
use crate::model::{ContactModel, Model, read_meshes};
use crate::observe::energy::EnergyLedger;
use crate::partition::{Couple, LocalMesh, Plan, Report, distribute};
use crate::petsc::Session;
use crate::solvers::{Outcome, SolveReport, Strategy, Trouble, first_guess};
use crate::time::{Integrate, Retry, Scheme, StepControl};

pub use begin::Begin;
pub use check::check;
pub use checkpoint::WALL_TIME_IS_OVER;
pub use input::{remove_options, set_options, shared_text};
pub use journal::Journal;
pub use options::scheme;
pub use parts::parts;
pub use place::RunRequest;
pub use refusal::refuse;
pub use signals::Signals;

use checkpoint::CheckpointPolicy;
use restart::Saved;
use run_state::{RunState, solver_settings};

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
        input::share_surfaces(session, case)?;
        let keeper = CheckpointPolicy::new(session, case, place)?;
        let mut model = Model::<D>::new(case)?;
        derived::require_columns(case, &model, None)?;
        agree(session.world(), field_output::require_format(case))?;
        let mut saved = Saved::find::<D>(session, case, place)?;
        let Share { local, partition, remarks } = share_out(session, case, &mut model)?; // METIS
        let scheme = options::scheme(&case.time);
        let linear = options::linear(case);
        let format = options::format(session, case, &local, &linear)?;
        let options = SystemOptions { inertia: scheme.has_inertia(), format };
        let mut system = ContactSystem::new(session, local, &model, options)?; // (2.1), (3.4)
        let precision = Precision::of(&system);
        precision::require(&precision)?;
        derived::require_derived(&system, case, &model)?;
        start::require_reach(&mut system, &model, case)?;
        accuracy::limit_penetration(&mut system, case, &precision)?;
        accuracy::limit_slip(&mut system, case);
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
        let Self { mut keeper, model, saved, partition, remarks, system, stage, strategy } = self;
        let past = saved.as_ref().map(|saved| (saved.state.past.clone(), saved.state.time));
        let mut journal = Journal::open(session, case, &model, place, past)?;
        journal.remark(remarks);
        let outcome = journal.start_up(&system, &partition, &*strategy).and_then(|()| {
            let run = match &saved {
                None => begin(system, stage, strategy, case, &model, &mut journal) // B_0
                    .map_err(|error| keeper.within_the_start(error))?,
                Some(saved) => saved.resume(system, stage, strategy, case, &model, &mut journal)?,
            };
            march(run, case, &mut journal, &mut keeper)
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
/// rank. The model then knows the walls between the surfaces of its contacts. Collective.
fn share_out<const D: usize>(session: &Rc<Session>, case: &Case, model: &mut Model<D>) -> Result<Share<D>> {
    let world = session.world();
    let read = if session.rank() == 0 { read_meshes(case).map(Some) } else { Ok(None) };
    let (mut mesh, mut remarks) = agree(world, read)?.unzip();
    let unknown = || vec![f64::INFINITY; model.contacts.len()];
    let mut walls = mesh.as_ref().map_or_else(unknown, |mesh| model.walls(mesh));
    world.process_at_rank(0).broadcast_into(&mut walls[..]);
    model.contacts.iter_mut().zip(walls).for_each(|(contact, wall)| contact.wall = wall);
    let mut plan = agree(world, Plan::for_contact(mesh.as_ref(), &couples(model)))?;
    plan.partitioner = case.partition.value;
    let ties = mesh.as_mut().map_or(Ok(Vec::new()), |mesh| model.add_ties(case, mesh));
    remarks.iter_mut().zip([agree(world, ties)?]).for_each(|(all, more)| all.extend(more));
    if let Some(mesh) = &mut mesh {
        model.add_patches(mesh);
        plan.loose_nodes = model.add_pose_nodes(mesh);
    }
    let (local, partition) = distribute(world, mesh, &plan)?;
    Ok(Share { local, partition, remarks: remarks.unwrap_or_default() })
}

/// Pairs of surfaces of the model that may touch each other.
fn couples<const D: usize>(model: &Model<D>) -> Vec<Couple<'_>> {
    let tied = model.ties.iter().map(|tie| Couple {
        contactor: &tie.contactor,
        target: &tie.target,
        travel: 0.0,
        load: false,
    });
    model.contacts.iter().filter_map(couple_of).chain(tied).collect()
}

fn couple_of<const D: usize>(contact: &ContactModel<D>) -> Option<Couple<'_>> {
    let target = contact.target.set()?;
    Some(Couple { contactor: &contact.contactor, target, travel: 0.0, load: true })
}

/// Computes the state at the start, writes its rows and creates the monitors.
fn begin<const D: usize>(
    mut system: ContactSystem<D>,
    mut stage: Stage,
    strategy: Box<dyn Strategy>,
    case: &Case,
    model: &Model<D>,
    journal: &mut Journal<D>,
) -> Result<RunState<D>> {
    start::at_equilibrium(&mut system, &mut stage, case, model, journal)?;
    let farthest = farthest_motion(&system, &stage, Motions::All);
    MotionPrecision::new(Precision::of(&system)).accept(farthest, "at the start")?;
    let control = accuracy::control(case, model, 0.0);
    let pace = StepPacing::new(&mut system, &stage, case, model)?;
    let reactions = system.pattern_vector().like()?;
    let ledger = EnergyLedger::begin(&mut system, &mut stage, reactions)?;
    journal.begin(&system, &stage, &ledger, &control)?;
    let guard = RunGuard::new(case, model, options::scheme(&case.time), ledger.now());
    let precision = MotionPrecision::new(Precision::of(&system));
    let settings = solver_settings(case, &*strategy, system.session())?;
    Ok(RunState { system, stage, strategy, control, ledger, guard, pace, precision, settings })
}

/// Advances from configuration to configuration until the end.
fn march<const D: usize>(
    mut run: RunState<D>,
    case: &Case,
    journal: &mut Journal<D>,
    keeper: &mut CheckpointPolicy,
) -> Result<()> {
    let scheme = options::scheme(&case.time);
    keeper.begin(&run)?;
    journal.begin_step();
    while !run.control.finished() {
        let RunState { system, stage, strategy, control, ledger, guard, pace, precision, .. } = &mut run;
        if guard.motion.foresees(control.dt()) && control.can_cut() {
            journal.shortened();
            control.fail();
            continue;
        }
        pace.prepare(system);
        let attempt = Attempt { scheme, control, pace };
        let before = *ledger.now();
        let saved = ledger.save();
        let outcome = match attempt.solve(system, stage, &mut **strategy, journal) {
            Err(error) if error.cause == Cause::Stopped => {
                return Err(keeper.within_a_step(&run, journal, case)?);
            }
            outcome => attempt.finish(system, stage, ledger, outcome?)?,
        };
        journal.fallbacks(&strategy.take_fallbacks());
        match outcome {
            Outcome::Converged(report) => {
                let energies = *ledger.now();
                let slides = slides(system, stage);
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
                let farthest = farthest_motion(system, stage, Motions::All);
                precision.accept(farthest, &at_time(system, stage)).map(|remark| {
                    remark.iter().for_each(|text| journal.warn(&format!("warning: {text}")));
                    journal.known(precision.at(farthest));
                })?;
                if let Some(progress) = pace.advance(system, stage, control)? {
                    progress.warning.iter().for_each(|text| journal.warn(text));
                    journal.accuracy(progress.record);
                }
                journal.record(system, stage, ledger, &energies, &report)?;
                guard.impact(system, stage).iter().for_each(|text| journal.warn(text));
                let gain = guard.record(system, stage, journal.step(), scheme, ledger)?;
                gain.iter().for_each(|text| journal.warn(text));
                guard.motion.accept(&slides, journal.step(), stage.dt);
                journal.at_the_end(guard.warnings(scheme, !case.contact.is_empty(), case.units));
                guard.energy(ledger, stage.trial.time, case.units).inspect_err(|_| {
                    // The error says what the warning of unexplained energy would say.
                    journal.at_the_end(guard.motion.warning(case.units).into_iter().collect());
                })?;
                system.accept(stage)?; // B_N -> B_N+1
                control.succeed();
                journal.end_step();
                keeper.step_done(&run, journal, case)?;
                journal.begin_step();
            }
            Outcome::Failed(report, reason) => {
                ledger.restore(saved);
                journal.failed(&report, &reason, control);
                if control.fail() == Retry::GiveUp {
                    let reason = match report.trouble {
                        // A stage holds tractions fixed: what it does not balance is not the force on
                        // a node.
                        Trouble::Balance if options::staggered(case).is_some() => reason,
                        Trouble::Balance | Trouble::Sweeps => {
                            hints::with_place(reason, &report, system, stage)?
                        }
                        _ => reason,
                    };
                    // If rounding dominates the prescribed motion, this is why the step does not
                    // converge.
                    let prescribed = farthest_motion(system, stage, Motions::Prescribed);
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
    /// step, or in statics with moving tools from a guess for the tools at the end of the step.
    fn solve<const D: usize>(
        &self,
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
        strategy: &mut dyn Strategy,
        journal: &mut Journal<D>,
    ) -> Result<Outcome> {
        self.scheme.prepare(stage, self.control.dt(), self.control.end_of_step())?;
        system.begin_attempt();
        journal.attempt(stage);
        let moved = match self.scheme.has_inertia() {
            true => {
                self.scheme.extrapolate(stage)?;
                self.pace.predict(stage)?;
                true
            }
            false => first_guess(strategy, system, stage, RigidInstant::Start)?,
        };
        let mut spent = SolveReport::default();
        if moved {
            match strategy.solve(system, stage, &mut |row| journal.iteration(row))? {
                Outcome::Failed(report, _) => spent = report,
                converged => return Ok(converged),
            }
        }
        system.begin_attempt();
        stage.trial.u.copy_from(&stage.start.u)?;
        if system.has_moving_tools()
            && !self.scheme.has_inertia()
            && !first_guess(strategy, system, stage, RigidInstant::End)?
        {
            stage.trial.u.copy_from(&stage.start.u)?;
        }
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
        if let Some(reason) = unsound_state(system, stage) {
            return Ok(failed(report, Trouble::Numbers, reason));
        }
        if let Some(reason) = missed_contact(system, stage)? {
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
