//! Monitors the errors of a run from step to step.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::past::StepHistory;
use super::recoil;
use super::shortest::{MinimumStepWatch, Shortest};
use super::slip::{self, Stuck, stuck};
use super::{oscillation, penetration, sizes};
use crate::assembly::{ContactSystem, NamedFields, StatePart, StoredState, from_numbers, numbers_of};
use crate::case::{Accuracy, Case};
use crate::contact::friction::Regularization;
use crate::dynamics::{Stage, State};
use crate::error::Result;
use crate::observe::contact;
use crate::observe::energy::Energies;
use crate::output::accuracy::{AccuracyRecord, Errors};
use crate::reader::quantity::Number;
use crate::solvers::SolveReport;
use crate::time::saturation::{Passed, Section};
use crate::time::{Budget, Judgement, Scheme, StepControl};

/// State of the error control that is kept from step to step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Memory {
    time: Option<Budget>,
    energy: Option<Budget>,
    /// Largest displacement so far \[m\]: root mean square of the bodies, or that of a rigid body where
    /// it touches one.
    size: f64,
    /// Largest unexplained energy so far \[J\].
    drift: f64,
    /// Largest penetration \[m\], creep rate \[m/s\] and elastic slip \[m\] so far.
    contact: [f64; 3],
    /// Number of contact points that did more than touch at the end of the last accepted step. A
    /// point that only touches carries no force, and rounding decides the sign of its gap.
    pressing: u64,
    /// Number of steps for which the last jump of the velocity still affects the estimate.
    unsettled: u32,
    /// Instant of the last jump, after which modes lose their phase \[s\].
    since: f64,
    passed: Passed,
    /// Ratios of the present contact stiffnesses to those of their laws.
    stiffenings: Vec<f64>,
    /// Counts of steps of the minimum length.
    shortest: Shortest,
    /// Force on each contact at the end of the last accepted step \[N\].
    loads: Vec<f64>,
    /// Whether a body has landed or taken off.
    landed: bool,
}

/// The error control of a run.
pub(super) struct ErrorController {
    accuracy: Accuracy,
    scheme: Scheme,
    end: f64,
    step: f64,
    kinks: Vec<f64>,
    weight: f64,
    given: Vec<Option<Regularization>>,
    /// Smallest penetration tolerance of a contact \[m\].
    penetration: Option<f64>,
    /// Bodies whose contact surfaces have no mass.
    massless: Vec<String>,
    /// Response to an impulse on each contact, see [`oscillation::recoils`].
    recoils: Vec<f64>,
    /// Whether the contact has massless nodes, see [`oscillation::calm`].
    calm: Vec<bool>,
    memory: Memory,
    past: Option<StepHistory>,
    /// Estimated error and allowance of the step that was evaluated last \[m\].
    judged: [f64; 2],
    /// Whether a body lands or takes off in that step.
    lands: bool,
    /// Warning on that step.
    pub remark: Option<String>,
    /// The filter section used in the step that was evaluated last, unless the velocity jumped.
    section: Option<Section>,
}

impl ErrorController {
    /// Newton iterations up to which a step may grow, and above which it shrinks.
    const EFFORT: [u32; 2] = [7, 14];
    /// Error ratio that forces a step with an excessive penetration to be repeated.
    const REPEAT: f64 = 2.01;
    /// Safety factor. With several modes whose errors peak at different times, the sum of the
    /// estimates is smaller than the error by about this factor.
    const SAFETY: f64 = 1.85;
    /// Additional factor while a body that landed is in a contact that the steps do not resolve.
    /// The body carries the error made there along when it takes off. Measured over ten scenes
    /// (docs/validation/accuracy.md).
    const CARRIED: f64 = 2.4;
    /// Fraction of the allowance of other events that a landing may use. A body that strikes late
    /// penetrates too deep, and the oscillation that this excites opens and closes the contact for
    /// a long time.
    const LANDING: f64 = 0.2;

    /// The error control for the state at the start in `stage`; `kinks` are the instants at which
    /// loads or their rates may jump. Collective.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn new<const D: usize>(
        system: &mut ContactSystem<D>,
        stage: &Stage,
        case: &Case,
        accuracy: Accuracy,
        kinks: Vec<f64>,
    ) -> Result<Self> {
        let scheme = case.time.scheme.method();
        let budget = |part: Option<Number>| part.map(|part| Budget::new(part.value));
        let adapts = accuracy.time.is_some() && scheme.local_error().is_some();
        let past = super::kept(case, &stage.start.u)?;
        let pressing = contact::loads(system).iter().map(|load| load.pressing).sum();
        let mut watch = Self {
            accuracy,
            scheme,
            end: case.time.end.value,
            step: case.time.step(),
            kinks,
            weight: sizes::weight(system)?,
            given: slip::regularizations(system),
            penetration: super::requested_penetration(case)
                .and_then(|asked| penetration::tolerance(system, asked)),
            massless: system.bodies().redistributed()[0].clone(),
            memory: Memory {
                time: budget(accuracy.time.filter(|_| past.is_some())),
                energy: budget(accuracy.energy.filter(|_| scheme.has_inertia())),
                // Motions smaller than the penetration tolerance of the contacts are not resolved
                // further.
                size: penetration::smallest_tolerance(system).filter(|_| scheme.has_inertia()).unwrap_or(0.0),
                drift: 0.0,
                contact: [0.0; 3],
                pressing,
                unsettled: 2,
                since: 0.0,
                passed: Passed::default(),
                stiffenings: penetration::stiffenings(system),
                shortest: Shortest::default(),
                loads: recoil::loads(system),
                landed: false,
            },
            lands: false,
            recoils: if adapts { oscillation::recoils(system) } else { Vec::new() },
            calm: oscillation::calm(system),
            past,
            judged: [0.0; 2],
            remark: None,
            section: None,
        };
        watch.observe_size(system, &stage.start)?;
        Ok(watch)
    }

    /// Extrapolates the first guess from the last displacements if they belong to one smooth
    /// motion.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn predict(&self, stage: &mut Stage) -> Result<()> {
        self.past.as_ref().map_or(Ok(()), |past| past.predict(stage))
    }

    fn observe_size<const D: usize>(&mut self, system: &mut ContactSystem<D>, state: &State) -> Result<()> {
        let moved = sizes::mean_size(system, &state.u, self.weight)?;
        let about_to = self.step * sizes::mean_size(system, &state.v, self.weight)?;
        // Tools set the scale of the motion as the bodies do that they move.
        let carried = system.travel_of_tools(&state.u);
        self.memory.size = self.memory.size.max(moved).max(about_to).max(carried);
        let size = self.memory.size;
        if let Some(budget) = &mut self.memory.time {
            budget.observe(size);
        }
        Ok(())
    }

    /// Adjusts the stiffness of stick to the requested slip, or in statics the limit of the elastic slip.
    /// Returns whether a law changed. Collective.
    pub fn prepare<const D: usize>(&self, system: &mut ContactSystem<D>) -> bool {
        let asked =
            self.accuracy.slip.filter(|_| self.scheme != Scheme::Conserving && self.memory.size > 0.0);
        let Some(slip) = asked else { return false };
        if system.limits_elastic_slip() {
            system.limit_slip(slip.value, self.memory.size);
            return false;
        }
        slip::stiffen_stick(system, &self.given, slip.value * self.memory.size)
    }

    pub fn accepts<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &Stage,
        control: &mut StepControl,
        [before, now]: [&Energies; 2],
        report: &SolveReport,
    ) -> Result<bool> {
        self.observe_size(system, &stage.trial)?;
        let share = stage.dt / self.end;
        let left = 1.0 - stage.start.time / self.end;
        let jumps = report.contact.pressing != self.memory.pressing;
        let lenient = jumps || self.memory.unsettled > 0;
        let mut ratio = 0.0f64;
        let closes = report.contact.pressing > self.memory.pressing;
        let mut error = self.error(system, stage, jumps)?;
        if closes {
            let fresh = report.contact.pressing - self.memory.pressing;
            let flight = self.flight(system, stage)?;
            error = error.max(self.struck(
                fresh as f64 / oscillation::nodes(system) as f64,
                flight,
                [before, now],
            ));
        }
        let mut strikes = false;
        if jumps && self.past.is_some() {
            let loads = [&self.memory.loads[..], &recoil::loads(system)];
            let [calm, all] = recoil::thrown(&self.recoils, &self.calm, loads);
            error = error.max(calm * stage.dt * (self.end - stage.start.time));
            (strikes, self.lands) = (recoil::strikes(loads), all > 0.0);
        }
        if let Some(budget) = &self.memory.time {
            let fair = budget.share(share, left);
            let event = if lenient { budget.event().max(fair) } else { fair };
            let allowed = if strikes { Self::LANDING * event } else { event };
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
        // A shorter step alone does not reduce slip and penetration. What a larger stiffness can
        // not correct is reported at the end. Equal steps are accepted as they are, and an accepted
        // step keeps the laws that it was solved with.
        let repeats = matches!(control, StepControl::Adaptive(_));
        let loose = repeats && self.gives_way(system) && self.prepare(system);
        let deep = repeats && self.scheme.has_inertia() && penetration::mend(system);
        if loose || deep {
            ratio = ratio.max(Self::REPEAT);
        }
        let event = jumps && ratio > 0.1;
        let ease = match report.effort() {
            newton if newton <= Self::EFFORT[0] => f64::INFINITY,
            newton if newton <= Self::EFFORT[1] => 1.0,
            _ => 0.7,
        };
        let order = self.scheme.order();
        let short = control.is_shortest();
        let lands = std::mem::take(&mut self.lands);
        if !control.judge(&Judgement { ratio, order, event, ease }) {
            return Ok(false);
        }
        self.memory.landed |= lands;
        if short {
            self.memory.shortest.count(ratio);
            let plight = MinimumStepWatch {
                size: self.memory.size,
                stiffer: self.memory.stiffenings.iter().copied().fold(1.0, f64::max),
                rattles: oscillation::rattles(system),
                rubs: system.has_friction(),
                may_conserve: system.bodies().may_conserve(),
            };
            self.remark = self.memory.shortest.remark(&plight, system.bodies().units());
            self.memory.shortest.hopeless(&plight, stage, system.bodies().units()).map_or(Ok(()), Err)?;
        }
        if let Some(budget) = &mut self.memory.time {
            let [error, fair] = self.judged;
            // After a jump the estimate still contains the jump, which is already in the budget.
            budget.spend(if self.memory.unsettled > 0 && !jumps { error.min(fair) } else { error });
        }
        if let Some(budget) = &mut self.memory.energy {
            budget.spend(now.numerical.abs() - before.numerical.abs());
        }
        self.memory.drift = self.memory.drift.max(now.numerical.abs());
        self.memory.pressing = report.contact.pressing;
        let kink = self.kinks.iter().any(|kink| (kink - stage.trial.time).abs() < 1e-9 * self.end);
        self.memory.unsettled = if event || kink { 2 } else { self.memory.unsettled.saturating_sub(1) };
        if event || kink {
            self.memory.since = stage.trial.time;
            self.past.iter_mut().for_each(StepHistory::jump);
        }
        Ok(true)
    }

    /// Factor by which the error of the step exceeds that in flight, for a body that landed, is in
    /// contact and free to take off.
    ///
    /// A massless contact acts on the body as an impulse. Nodes with mass oscillate on the penalty:
    /// the estimate sees the whole error if the step resolves the oscillation, and misses it if the
    /// step is much longer.
    fn carried<const D: usize>(&self, system: &mut ContactSystem<D>, stage: &Stage) -> Result<f64> {
        let Memory { landed, loads, .. } = &self.memory;
        let [impulse, any] = recoil::held(&self.recoils, &self.calm, loads);
        if !any || !landed {
            return Ok(1.0);
        }
        let swing = if impulse { 0.0 } else { oscillation::swing(system)? };
        Ok(1.0 + (Self::CARRIED - 1.0) * recoil::unresolved(stage.dt, swing))
    }

    /// Whether sticking contact yields by more than the requested slip.
    fn gives_way<const D: usize>(&self, system: &ContactSystem<D>) -> bool {
        let Some(slip) = self.accuracy.slip.filter(|_| self.given.iter().any(Option::is_some)) else {
            return false;
        };
        let Stuck { creep, give } = stuck(system);
        (creep * self.end).max(give) > slip.value * self.memory.size
    }

    /// Distance over which the velocities of the step act until the end, limited to the largest
    /// displacement so far \[m\].
    fn flight<const D: usize>(&self, system: &mut ContactSystem<D>, stage: &Stage) -> Result<f64> {
        let [from, to] = [&stage.start.v, &stage.trial.v];
        let speed =
            sizes::mean_size(system, from, self.weight)?.max(sizes::mean_size(system, to, self.weight)?);
        Ok(self.memory.size.min(speed * (self.end - stage.start.time)))
    }

    /// Error of the motion due to an impact that lost energy \[m\]. The relative error of the
    /// velocities is half of that of the energy, and so is the error of `flight`, the distance over
    /// which they act.
    ///
    /// `fresh` is the fraction of the nodes that struck. The loss of their energy is not an error:
    /// on a stiff penalty they chatter until it is lost, whatever the step.
    fn struck(&self, fresh: f64, flight: f64, [before, now]: [&Energies; 2]) -> f64 {
        let sizes = [before.kinetic, now.kinetic, before.strain, now.strain];
        let all = sizes.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let lost = (now.numerical - before.numerical).abs() - fresh * before.kinetic;
        0.5 * lost.max(0.0) / all * flight
    }

    /// Estimated error of the step, root mean square \[m\]. It is unfiltered when the velocity
    /// jumps; otherwise the filter removes errors that were dissipated before.
    fn error<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &Stage,
        jumps: bool,
    ) -> Result<f64> {
        let safety = Self::SAFETY * self.carried(system, stage)?;
        let Some(past) = &mut self.past else { return Ok(0.0) };
        let rate = past.rate(self.scheme, stage, |field| sizes::clear_uncounted(system, field))?;
        let power = safety * stage.dt.powf(self.scheme.order() + 1.0);
        if jumps {
            self.section = None;
            return Ok(power * sizes::mean_size(system, rate, self.weight)?);
        }
        let span = (self.end - self.memory.since).max(stage.dt);
        // A contact that can chatter is one of the fast modes, and is fed by the energy that the
        // others lose.
        let section = if oscillation::rattles(system) {
            Section::WHOLE
        } else {
            Section::of(self.scheme, stage.dt, span)
        };
        self.section = Some(section);
        let rate = sizes::mean_size(system, past.smooth_rate(&section)?, self.weight)?;
        let passed = self.memory.passed.after(&section).part(&section);
        Ok(power * (rate / passed))
    }

    pub fn advance<const D: usize>(&mut self, system: &mut ContactSystem<D>, stage: &Stage) -> Result<()> {
        if let Some(past) = &mut self.past {
            if let Some(section) = self.section.take() {
                past.settle(&section)?;
                self.memory.passed = self.memory.passed.after(&section);
            }
            past.push(stage, self.memory.unsettled == 2)?;
            self.memory.loads = recoil::loads(system);
        }
        let Stuck { creep, give } = stuck(system);
        let told = || self.penetration.map_or(0.0, |_| penetration::depth(system));
        let depth = penetration::excess(system).map_or_else(told, |excess| excess.length);
        penetration::keep(system);
        self.memory.stiffenings = penetration::stiffenings(system);
        for (most, now) in self.memory.contact.iter_mut().zip([depth, creep, give]) {
            *most = most.max(now);
        }
        Ok(())
    }

    pub fn record(&self, repeated_steps: u64) -> AccuracyRecord {
        let number = |part: Option<Number>| part.map(|part| part.value);
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
        AccuracyRecord { asked, achieved, repeated_steps, mass_redistributed: self.massless.clone() }
    }
}

impl StatePart for ErrorController {
    fn numbers(&self) -> Result<Value> {
        numbers_of(&(&self.memory, self.past.as_ref().map(StepHistory::known)))
    }

    fn fields(&self) -> NamedFields {
        self.past.as_ref().map_or_else(Vec::new, StepHistory::fields)
    }

    fn restore_from(&mut self, numbers: &Value, fields: &StoredState) -> Result<()> {
        let (memory, known) = from_numbers(numbers)?;
        self.memory = memory;
        match (&mut self.past, known) {
            (Some(past), Some(known)) => past.resume(known, fields),
            _ => Ok(()),
        }
    }
}
