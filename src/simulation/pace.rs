//! The pace of a run whose accuracy is an input: is a step good enough, and what does the next one have to keep.

use serde::{Deserialize, Serialize};

use super::journal::Journal;
use super::options;
use crate::assembly::{Asked, ContactSystem, Energies, EnergyLedger, SavedLedger, Stuck};
use crate::case::{Accuracy, Case, PenetrationTolerance};
use crate::contact::friction::Regularization;
use crate::dynamics::{Dynamics, Stage, State};
use crate::error::Result;
use crate::model::{LoadKind, Model};
use crate::output::accuracy::{AccuracyRecord, Errors};
use crate::petsc::Vector;
use crate::solvers::SolveReport;
use crate::time::estimate::{FIELDS, extrapolation, weights};
use crate::time::{Budget, Judgement, Scheme, StepControl};

/// What watches the errors of a run; without `accuracy` in the case it is nothing, and costs nothing.
pub struct Pace {
    watch: Option<Box<Watch>>,
}

/// What the watch remembers from step to step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    time: Option<Budget>,
    energy: Option<Budget>,
    /// Largest displacement so far, root mean square \[m\].
    size: f64,
    /// Largest energy without a cause so far \[J\].
    drift: f64,
    /// Deepest penetration \[m\], fastest creep \[m/s\], largest elastic slip \[m\] so far.
    contact: [f64; 3],
    closed: u64,
    /// Steps that the last jump of the velocity still shows in.
    unsettled: u32,
    /// How much stiffer than their laws say the contacts are.
    stiffenings: Vec<f64>,
}

struct Watch {
    accuracy: Accuracy,
    scheme: Scheme,
    end: f64,
    step: f64,
    kinks: Vec<f64>,
    weight: f64,
    given: Vec<Option<Regularization>>,
    /// Smallest tolerance of a contact \[m\].
    penetration: Option<f64>,
    memory: Memory,
    past: Option<Past>,
    /// Estimated error, allowance and energies of the step that was judged last.
    judged: [f64; 2],
}

/// Displacements before the start of the step.
struct Past {
    u: [Vector; 2],
    instants: [f64; 2],
    known: usize,
    error: Vector,
    /// Whether a parabola through them told the last displacement better than the velocity at the start of its step.
    curved: bool,
}

/// Limits the penetration where the case asks for it. To be called before any equilibrium is sought.
pub fn limit_penetration<const D: usize>(system: &mut ContactSystem<D>, case: &Case) {
    let Some(asked) = case.accuracy.as_ref().and_then(|accuracy| accuracy.penetration) else { return };
    if matches!(case.time.scheme.value, crate::case::Scheme::Conserving) {
        return; // Its contact forces are differences of the penalty's energy.
    }
    system.limit_penetration(match asked {
        PenetrationTolerance::Length(length) => Asked::Length(length.si),
        PenetrationTolerance::Relative(part) => Asked::Relative(part.si),
    });
}

/// Whether the steps follow their errors.
fn adapts(case: &Case) -> bool {
    case.accuracy.as_ref().is_some_and(|accuracy| accuracy.time.is_some())
}

/// The steps of the case from an instant `start` on \[s\].
pub fn control<const D: usize>(case: &Case, model: &Model<D>, start: f64) -> StepControl {
    let time = &case.time;
    match adapts(case) {
        true => StepControl::adaptive([start, time.end.si], time.step(), &kinks(model), time.cuts.value),
        false => StepControl::new(start, time.end.si, time.step(), time.cuts.value),
    }
}

/// Instants at which loads or supports may jump, or their rates \[s\].
fn kinks<const D: usize>(model: &Model<D>) -> Vec<f64> {
    let supports = model.supports.iter().flat_map(|support| support.components.iter().flatten());
    let loads = model.loads.iter().flat_map(|load| match &load.kind {
        LoadKind::BodyForce(functions) | LoadKind::Traction(functions) => functions.as_slice(),
        LoadKind::Pressure(function) => std::slice::from_ref(function),
    });
    supports.chain(loads).flat_map(|function| function.kinks()).collect()
}

impl Pace {
    /// Of the state at the start in `stage`. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn new<const D: usize>(
        system: &mut ContactSystem<D>,
        stage: &Stage,
        case: &Case,
        model: &Model<D>,
    ) -> Result<Self> {
        let Some(accuracy) = case.accuracy.as_ref().map(|accuracy| accuracy.value) else {
            return Ok(Self { watch: None });
        };
        let scheme = options::scheme(&case.time);
        let budget = |part: Option<crate::case::quantity::Number>| part.map(|part| Budget::new(part.si));
        let past = match adapts(case) && scheme.local_error().is_some() {
            true => Some(Past {
                u: [stage.start.u.like()?, stage.start.u.like()?],
                instants: [0.0; 2],
                known: 0,
                error: stage.start.u.like()?,
                curved: false,
            }),
            false => None,
        };
        let closed = system.contact_summaries().iter().map(|contact| contact.zone.points as u64).sum();
        let mut watch = Watch {
            accuracy,
            scheme,
            end: case.time.end.si,
            step: case.time.step(),
            kinks: kinks(model),
            weight: system.weight()?,
            given: system.regularizations(),
            penetration: system.smallest_tolerance(),
            memory: Memory {
                time: budget(accuracy.time.filter(|_| past.is_some())),
                energy: budget(accuracy.energy.filter(|_| scheme.has_inertia())),
                size: 0.0,
                drift: 0.0,
                contact: [0.0; 3],
                closed,
                unsettled: 2,
                stiffenings: system.stiffenings(),
            },
            past,
            judged: [0.0; 2],
        };
        watch.observe_size(system, &stage.start)?;
        Ok(Self { watch: Some(Box::new(watch)) })
    }

    /// Puts to the contacts what the next step has to keep. Collective.
    pub fn prepare<const D: usize>(&self, system: &mut ContactSystem<D>) {
        if let Some(watch) = &self.watch {
            watch.prepare(system);
        }
    }

    /// Moves the first guess to where the last displacements point, where they are of one smooth motion.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn predict(&self, stage: &mut Stage) -> Result<()> {
        let Some(past) = self.watch.as_ref().and_then(|watch| watch.past.as_ref()) else { return Ok(()) };
        if past.known < 2 || !past.curved {
            return Ok(());
        }
        past.extrapolate(&stage.start, stage.trial.time, &mut stage.trial.u)
    }

    /// What the ledger has to go back to where the next step is repeated.
    pub fn save(&self, ledger: &EnergyLedger, control: &StepControl) -> Option<SavedLedger> {
        let repeats = self.watch.is_some() && matches!(control, StepControl::Adaptive(_));
        repeats.then(|| ledger.save())
    }

    /// Whether the step in `stage`, which is solved, is good enough; `control` offers the next one, or the same anew.
    /// Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn accepts<const D: usize>(
        &mut self,
        (system, stage): (&mut ContactSystem<D>, &Stage),
        control: &mut StepControl,
        energies: [&Energies; 2],
        report: &SolveReport,
    ) -> Result<bool> {
        match &mut self.watch {
            Some(watch) => watch.accepts(system, stage, control, energies, report),
            None => Ok(true),
        }
    }

    /// The step is accepted; tells the journal what was achieved so far. To be called before the trial state becomes
    /// the start of the next step. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn advance<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &Stage,
        control: &StepControl,
        journal: &mut Journal<D>,
    ) -> Result<()> {
        let Some(watch) = &mut self.watch else { return Ok(()) };
        watch.advance(system, stage)?;
        journal.accuracy(watch.record(control.rejected()));
        Ok(())
    }

    /// What has to be kept for a run to go on, beside the control; the estimate begins anew.
    pub fn memory(&self) -> Option<&Memory> {
        self.watch.as_ref().map(|watch| &watch.memory)
    }

    /// Goes on with what was kept; the points of the contacts remember their last accepted step.
    pub fn recall<const D: usize>(&mut self, system: &mut ContactSystem<D>, memory: &Memory) {
        if let Some(watch) = &mut self.watch {
            system.recall_stiffenings(&memory.stiffenings);
            watch.memory = memory.clone();
        }
    }

    /// Lets the estimate begin anew, as in a run that goes on from here.
    pub fn forget<const D: usize>(&mut self, system: &mut ContactSystem<D>) {
        let Some(watch) = &mut self.watch else { return };
        system.note_gaps();
        watch.memory.unsettled = 2;
        if let Some(past) = &mut watch.past {
            (past.known, past.curved) = (0, false);
        }
    }
}

impl Past {
    /// The parabola through the last two displacements and that of `start`, at the instant `at` \[s\].
    fn extrapolate(&self, start: &State, at: f64, out: &mut Vector) -> Result<()> {
        let [far, near, last] = extrapolation([self.instants[1], self.instants[0], start.time], at);
        out.copy_from(&start.u)?;
        out.scale(last)?;
        out.axpy(near, &self.u[0])?;
        out.axpy(far, &self.u[1])
    }

    /// Takes the displacement at the start of a step that is accepted, and notes which guess would have been better.
    fn push(&mut self, stage: &Stage, restart: bool) -> Result<()> {
        if self.known == 2 {
            self.error.waxpy(-1.0, &stage.start.u, &stage.trial.u)?;
            self.error.axpy(-stage.dt, &stage.start.v)?;
            let straight = self.error.norm()?;
            let mut error = self.error.like()?;
            self.extrapolate(&stage.start, stage.trial.time, &mut error)?;
            error.axpy(-1.0, &stage.trial.u)?;
            self.curved = error.norm()? < straight;
        }
        self.u.swap(0, 1);
        self.u[0].copy_from(&stage.start.u)?;
        self.instants = [stage.start.time, self.instants[0]];
        self.known = if restart { 0 } else { (self.known + 1).min(2) };
        Ok(())
    }
}

impl Watch {
    /// Newton iterations up to which a step may grow, and from which it shrinks.
    const EFFORT: [u32; 2] = [7, 14];
    /// A penetration beyond what is asked by any part has the step repeated.
    const REPEAT: f64 = 2.01;
    /// The estimates of several modes, whose errors come and go in turn, add up to less than the error: by about this.
    const SAFETY: f64 = 1.5;

    fn observe_size<const D: usize>(&mut self, system: &mut ContactSystem<D>, state: &State) -> Result<()> {
        let moved = system.mean_size(&state.u, self.weight)?;
        let about_to = self.step * system.mean_size(&state.v, self.weight)?;
        self.memory.size = self.memory.size.max(moved).max(about_to);
        let size = self.memory.size;
        if let Some(budget) = &mut self.memory.time {
            budget.observe(size);
        }
        Ok(())
    }

    fn prepare<const D: usize>(&self, system: &mut ContactSystem<D>) {
        let Some(slip) = self.accuracy.slip.filter(|_| self.memory.size > 0.0) else { return };
        let allowed = slip.si * self.memory.size;
        system.stiffen_stick(&self.given, allowed / self.end, allowed);
    }

    fn accepts<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &Stage,
        control: &mut StepControl,
        [before, now]: [&Energies; 2],
        report: &SolveReport,
    ) -> Result<bool> {
        self.observe_size(system, &stage.trial)?;
        let (share, left) = (stage.dt / self.end, 1.0 - stage.start.time / self.end);
        let jumps = report.contact.closed != self.memory.closed;
        let lenient = jumps || self.memory.unsettled > 0;
        let mut ratio = 0.0f64;
        let error = self.error(system, stage)?;
        if let Some(budget) = &self.memory.time {
            let fair = budget.share(share, left);
            let allowed = if lenient { budget.event().max(fair) } else { fair };
            ratio = ratio.max(error / allowed);
            self.judged = [error, fair];
        }
        if let Some(budget) = &mut self.memory.energy {
            budget.observe(now.total().abs().max(now.external_work.abs()).max(now.friction_dissipated));
            let fair = budget.share(share, left);
            let allowed = if lenient { budget.event().max(fair) } else { fair };
            let gained = now.numerical.abs() - before.numerical.abs();
            ratio = ratio.max(gained / allowed);
        }
        if self.scheme.has_inertia() && system.shortfall().is_some_and(|left| left.ratio > 1.0) {
            system.keep_penetration(false);
            ratio = ratio.max(Self::REPEAT);
        }
        let event = jumps && ratio > 0.1;
        let ease = match report.newton {
            newton if newton <= Self::EFFORT[0] => f64::INFINITY,
            newton if newton <= Self::EFFORT[1] => 1.0,
            _ => 0.7,
        };
        let order = self.scheme.order();
        let accepted = control.judge(&Judgement { ratio, order, event, ease });
        if !accepted {
            return Ok(false);
        }
        if let Some(budget) = &mut self.memory.time {
            let [error, fair] = self.judged;
            // Behind a jump the estimate still sees the jump, which was paid for.
            budget.spend(if self.memory.unsettled > 0 && !jumps { error.min(fair) } else { error });
        }
        if let Some(budget) = &mut self.memory.energy {
            budget.spend(now.numerical.abs() - before.numerical.abs());
        }
        self.memory.drift = self.memory.drift.max(now.numerical.abs());
        self.memory.closed = report.contact.closed;
        let kink = self.kinks.iter().any(|kink| (kink - stage.trial.time).abs() < 1e-9 * self.end);
        self.memory.unsettled = if event || kink { 2 } else { self.memory.unsettled.saturating_sub(1) };
        if let Some(past) = self.past.as_mut().filter(|_| event || kink) {
            past.known = 0;
        }
        Ok(true)
    }

    /// Estimated error of the step, root mean square \[m\].
    fn error<const D: usize>(&mut self, system: &mut ContactSystem<D>, stage: &Stage) -> Result<f64> {
        let (Some(past), Some(constants)) = (&mut self.past, self.scheme.local_error()) else {
            return Ok(0.0);
        };
        let instants = [past.instants[1], past.instants[0], stage.start.time, stage.trial.time];
        let weights = weights(constants, &instants, past.known);
        let [near, far] = &past.u;
        let fields: [&Vector; FIELDS] =
            [far, near, &stage.start.u, &stage.trial.u, &stage.start.v, &stage.start.a];
        past.error.set(0.0);
        for (weight, field) in weights.iter().zip(fields).filter(|(weight, _)| **weight != 0.0) {
            past.error.axpy(*weight, field)?;
        }
        system.clear_prescribed(&mut past.error);
        Ok(Self::SAFETY * system.mean_size(&past.error, self.weight)?)
    }

    fn advance<const D: usize>(&mut self, system: &mut ContactSystem<D>, stage: &Stage) -> Result<()> {
        if let Some(past) = &mut self.past {
            past.push(stage, self.memory.unsettled == 2)?;
        }
        let Stuck { creep, give } = system.stuck();
        let depth = system.shortfall().map_or(0.0, |left| left.depth);
        system.keep_penetration(true);
        self.memory.stiffenings = system.stiffenings();
        for (most, now) in self.memory.contact.iter_mut().zip([depth, creep, give]) {
            *most = most.max(now);
        }
        Ok(())
    }

    fn record(&self, repeated_steps: u64) -> AccuracyRecord {
        let number = |part: Option<crate::case::quantity::Number>| part.map(|part| part.si);
        let Memory { time, energy, size, drift, contact: [depth, creep, give], .. } = &self.memory;
        let rubs = self.given.iter().any(Option::is_some);
        let asked = Errors {
            penetration: self.penetration,
            slip: number(self.accuracy.slip).filter(|_| rubs),
            time: number(self.accuracy.time).filter(|_| time.is_some()),
            energy: number(self.accuracy.energy).filter(|_| energy.is_some()),
        };
        let over = |value: f64, scale: f64| if value == 0.0 { 0.0 } else { value / scale };
        let achieved = Errors {
            penetration: asked.penetration.map(|_| *depth),
            slip: asked.slip.map(|_| over((creep * self.end).max(*give), *size)),
            time: time.as_ref().map(Budget::achieved),
            energy: energy.as_ref().map(|budget| over(*drift, budget.scale())),
        };
        AccuracyRecord { asked, achieved, repeated_steps }
    }
}
