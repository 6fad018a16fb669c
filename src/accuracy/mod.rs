//! Error control of a run with prescribed accuracy: whether a step is accurate enough, and what the
//! next step has to satisfy (theory, section 4.8).

mod oscillation;
mod past;
mod penetration;
mod recoil;
mod shortest;
mod sizes;
mod slip;
mod watch;

use serde_json::Value;

use crate::advice::precision::Precision;
use crate::assembly::{ContactSystem, NamedFields, StatePart, StoredState};
use crate::case::{Case, PenetrationTolerance};
use crate::dynamics::Stage;
use crate::error::Result;
use crate::model::Model;
use crate::observe::energy::Energies;
use crate::output::accuracy::AccuracyRecord;
use crate::petsc::Vector;
use crate::solvers::SolveReport;
use crate::time::StepControl;

pub use penetration::smallest_tolerance;

use past::StepHistory;
use penetration::Asked;
use watch::ErrorController;

/// The error control of a run. Without `accuracy` in the case it does nothing and costs nothing.
pub struct StepPacing {
    watch: Option<Box<ErrorController>>,
}

/// Enforces the penetration tolerance of the case, if there is one. Call it before any equilibrium
/// is computed.
///
/// # Errors
/// The tolerance is below the spacing of coordinates; the error is the same on all ranks.
pub fn limit_penetration<const D: usize>(
    system: &mut ContactSystem<D>,
    case: &Case,
    precision: &Precision,
) -> Result<()> {
    let Some(asked) = requested_penetration(case).filter(|_| !keeps_laws(case)) else { return Ok(()) };
    let Precision { farthest, spacing, unit, .. } = precision;
    if let Some(tolerance) = penetration::tolerance(system, asked).filter(|tolerance| tolerance < spacing) {
        let message = format!(
            "a penetration of {tolerance:.1e} {unit} is below the spacing of coordinates: coordinates of \
             {farthest:.1e} {unit} are known only to {spacing:.1e} {unit}"
        );
        let place = case.accuracy.as_ref().and_then(|accuracy| accuracy.penetration);
        let place = place.map_or_else(Default::default, |penetration| penetration.value().1);
        let cure = "request a larger accuracy.penetration, for example { relative: 1e-3 } of a facet";
        return Err(case.error(place, message).hint(cure));
    }
    penetration::limit(system, asked);
    Ok(())
}

/// Enforces the slip tolerance of the case in statics, if there is one. Call it before any equilibrium
/// is computed.
pub fn limit_slip<const D: usize>(system: &mut ContactSystem<D>, case: &Case) {
    let asked = case.accuracy.as_ref().and_then(|accuracy| accuracy.value.slip);
    if let Some(part) = asked.filter(|_| limits_slip(case)) {
        slip::augment(system, part.value);
    }
}

/// Whether Uzawa's method or a stiffer penalty has to meet a tolerance of contact.
pub fn corrects_contact<const D: usize>(system: &ContactSystem<D>) -> bool {
    system.limits_elastic_slip() || smallest_tolerance(system).is_some()
}

/// The penetration tolerance of the case.
fn requested_penetration(case: &Case) -> Option<Asked> {
    Some(match case.accuracy.as_ref()?.penetration? {
        PenetrationTolerance::Length(length) => Asked::Length(length.value),
        PenetrationTolerance::Relative(part) => Asked::Relative(part.value),
    })
}

/// Whether the contact laws stay unchanged. This holds under the conserving scheme, whose forces
/// are differences of the contact energy. The achieved penetration and slip are reported
/// nevertheless.
pub fn keeps_laws(case: &Case) -> bool {
    case.time.scheme.value.conserves()
}

/// Whether the step length follows the estimated errors.
fn adapts(case: &Case) -> bool {
    case.accuracy.as_ref().is_some_and(|accuracy| accuracy.time.is_some())
}

/// The step control of the case from the instant `start` \[s\].
pub fn control<const D: usize>(case: &Case, model: &Model<D>, start: f64) -> StepControl {
    let time = &case.time;
    match adapts(case) {
        true => StepControl::adaptive([start, time.end.value], time.step(), &model.kinks(), time.cuts.value),
        false => StepControl::new(start, time.end.value, time.step(), time.cuts.value),
    }
}

/// Whether the requested slip, instead of the law of the case, determines the stiffness of stick.
/// It is enforced by the return map.
pub fn limits_slip(case: &Case) -> bool {
    case.accuracy.as_ref().is_some_and(|accuracy| accuracy.value.slip.is_some()) && !keeps_laws(case)
}

/// History of earlier steps for the estimate of the error in time, with the layout of `pattern`. It
/// is `None` if the case does not request an accuracy in time.
///
/// # Errors
/// PETSc can not allocate.
pub fn kept(case: &Case, pattern: &Vector) -> Result<Option<StepHistory>> {
    let estimates = adapts(case) && case.time.scheme.method().local_error().is_some();
    if estimates { StepHistory::new(pattern).map(Some) } else { Ok(None) }
}

impl StepPacing {
    /// The error control for the state at the start in `stage`. Collective.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn new<const D: usize>(
        system: &mut ContactSystem<D>,
        stage: &Stage,
        case: &Case,
        model: &Model<D>,
    ) -> Result<Self> {
        let Some(accuracy) = case.accuracy.as_ref().map(|accuracy| accuracy.value) else {
            return Ok(Self { watch: None });
        };
        let watch = ErrorController::new(system, stage, case, accuracy, model.kinks())?;
        Ok(Self { watch: Some(Box::new(watch)) })
    }

    /// Sets the contact parameters that the next step has to satisfy. Collective.
    pub fn prepare<const D: usize>(&self, system: &mut ContactSystem<D>) {
        if let Some(watch) = &self.watch {
            watch.prepare(system);
        }
    }

    /// Extrapolates the first guess from the last displacements if they belong to one smooth
    /// motion.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn predict(&self, stage: &mut Stage) -> Result<()> {
        match &self.watch {
            Some(watch) => watch.predict(stage),
            None => Ok(()),
        }
    }

    /// Whether the solved step in `stage` is accurate enough. `control` then offers the next step,
    /// or otherwise the same step again. Collective.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn accepts<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &Stage,
        control: &mut StepControl,
        energies: [&Energies; 2],
        report: &SolveReport,
    ) -> Result<bool> {
        match &mut self.watch {
            Some(watch) => watch.accepts(system, stage, control, energies, report),
            None => Ok(true),
        }
    }

    /// Records an accepted step. Call it before the trial state becomes the start of the next step.
    /// Returns the accuracy achieved so far, and a warning if there is one. Collective.
    ///
    /// # Errors
    /// PETSc reports an error.
    pub fn advance<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &Stage,
        control: &StepControl,
    ) -> Result<Option<AccuracyProgress>> {
        let Some(watch) = &mut self.watch else { return Ok(None) };
        watch.advance(system, stage)?;
        let warning = watch.remark.take();
        Ok(Some(AccuracyProgress { record: watch.record(control.rejected()), warning }))
    }
}

/// The accuracy of a run up to an accepted step.
pub struct AccuracyProgress {
    /// Requested and achieved errors.
    pub record: AccuracyRecord,
    /// A warning on the step.
    pub warning: Option<String>,
}

impl StatePart for StepPacing {
    fn numbers(&self) -> Result<Value> {
        self.watch.as_ref().map_or(Ok(Value::Null), |watch| watch.numbers())
    }

    fn fields(&self) -> NamedFields {
        self.watch.as_ref().map_or_else(Vec::new, |watch| watch.fields())
    }

    fn restore_from(&mut self, numbers: &Value, fields: &StoredState) -> Result<()> {
        self.watch.as_mut().map_or(Ok(()), |watch| watch.restore_from(numbers, fields))
    }
}
