//! The pace of a run whose accuracy is an input: is a step good enough, and what does the next one have to
//! keep (theory, section 4.8).

mod past;
mod recoil;
mod shortest;
mod watch;

use super::journal::Journal;
use super::options;
use crate::assembly::{Asked, ContactSystem, Energies, Precision};
use crate::case::{Case, PenetrationTolerance};
use crate::dynamics::Stage;
use crate::error::Result;
use crate::model::Model;
use crate::petsc::Vector;
use crate::solvers::SolveReport;
use crate::time::StepControl;

pub use watch::Memory;

use past::StepHistory;
use watch::ErrorController;

/// What watches the errors of a run; without `accuracy` in the case it is nothing, and costs nothing.
pub struct StepPacing {
    watch: Option<Box<ErrorController>>,
}

/// Limits the penetration where the case asks for it. To be called before any equilibrium is sought.
///
/// # Errors
/// The tolerance is below the spacing of coordinates, the same on all ranks.
pub fn limit_penetration<const D: usize>(
    system: &mut ContactSystem<D>,
    case: &Case,
    precision: &Precision,
) -> Result<()> {
    let Some(asked) = penetration(case).filter(|_| !keeps_laws(case)) else { return Ok(()) };
    let Precision { farthest, spacing, unit, .. } = precision;
    if let Some(tolerance) = system.tolerance(asked).filter(|tolerance| tolerance < spacing) {
        let message = format!(
            "a penetration of {tolerance:.1e} {unit} is below the spacing of coordinates: those of {farthest:.1e} {unit} are known to \
             {spacing:.1e} {unit} only"
        );
        let place = case.accuracy.as_ref().and_then(|accuracy| accuracy.penetration);
        let place = place.map_or_else(Default::default, |penetration| penetration.value().1);
        let cure = "ask for a larger accuracy.penetration, as { relative: 1e-3 } of a facet";
        return Err(case.error(place, message).hint(cure));
    }
    system.limit_penetration(asked);
    Ok(())
}

/// The penetration that the case asks for.
fn penetration(case: &Case) -> Option<Asked> {
    Some(match case.accuracy.as_ref()?.penetration? {
        PenetrationTolerance::Length(length) => Asked::Length(length.value),
        PenetrationTolerance::Relative(part) => Asked::Relative(part.value),
    })
}

/// Whether the laws of contact stay as they are: under the conserving scheme, whose forces are differences of their energy. What is
/// asked of penetration and slip is told all the same.
pub fn keeps_laws(case: &Case) -> bool {
    case.time.scheme.value == crate::case::Scheme::Conserving
}

/// Whether the steps follow their errors.
fn adapts(case: &Case) -> bool {
    case.accuracy.as_ref().is_some_and(|accuracy| accuracy.time.is_some())
}

/// The steps of the case from an instant `start` on \[s\].
pub fn control<const D: usize>(case: &Case, model: &Model<D>, start: f64) -> StepControl {
    let time = &case.time;
    match adapts(case) {
        true => StepControl::adaptive([start, time.end.value], time.step(), &model.kinks(), time.cuts.value),
        false => StepControl::new(start, time.end.value, time.step(), time.cuts.value),
    }
}

/// Whether stick follows the slip that is asked for, by the return map, and not the case's own law.
pub fn limits_slip(case: &Case) -> bool {
    case.accuracy.as_ref().is_some_and(|accuracy| accuracy.value.slip.is_some()) && !keeps_laws(case)
}

/// What the estimate of the error in time keeps of earlier steps, with the layout of `pattern`; nothing where the case asks
/// for no such accuracy.
///
/// # Errors
/// When PETSc can not allocate.
pub fn kept(case: &Case, pattern: &Vector) -> Result<Option<StepHistory>> {
    let estimates = adapts(case) && options::scheme(&case.time).local_error().is_some();
    if estimates { StepHistory::new(pattern).map(Some) } else { Ok(None) }
}

impl StepPacing {
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
        let watch = ErrorController::new(system, stage, case, accuracy, model.kinks())?;
        Ok(Self { watch: Some(Box::new(watch)) })
    }

    /// Puts to the contacts what the next step has to keep. Collective.
    pub fn prepare<const D: usize>(&self, system: &mut ContactSystem<D>) {
        if let Some(watch) = &self.watch {
            watch.prepare(system);
        }
    }

    /// Moves the first guess to where the last displacements point, where they are of one smooth motion; whether it did.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn predict(&self, stage: &mut Stage) -> Result<bool> {
        match &self.watch {
            Some(watch) => watch.predict(stage),
            None => Ok(false),
        }
    }

    /// Whether the step in `stage`, which is solved, is good enough; `control` offers the next one, or the same anew.
    /// Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
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
        watch.remark.take().iter().for_each(|text| journal.warn(text));
        journal.accuracy(watch.record(control.rejected()));
        Ok(())
    }

    /// What has to be kept for a run to go on, beside the control; the estimate begins anew.
    pub fn memory(&self) -> Option<&Memory> {
        self.watch.as_ref().map(|watch| watch.memory())
    }

    /// Goes on with what was kept; the points of the contacts remember their last accepted step.
    pub fn recall<const D: usize>(&mut self, system: &mut ContactSystem<D>, memory: &Memory) {
        if let Some(watch) = &mut self.watch {
            watch.recall(system, memory);
        }
    }

    /// Lets the estimate begin anew, as in a run that goes on from here.
    pub fn forget<const D: usize>(&mut self, system: &mut ContactSystem<D>) {
        if let Some(watch) = &mut self.watch {
            watch.forget(system);
        }
    }
}
