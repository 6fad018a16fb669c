//! The part of the journal that records solves: which solve is running, its iterations and its
//! outcome.

use super::current_solve::CurrentSolve;
use super::journal::Journal;
use super::tables::Tables;
use crate::dynamics::Stage;
use crate::output::console::Attempt;
use crate::output::iterations::IterationRow;
use crate::output::record::{HoldingRecord, Resultant};
use crate::solvers::{Driven, Fallback, HeldMotions, IterationReport, SolveReport};
use crate::time::StepControl;

impl<const D: usize> Journal<D> {
    /// A load level of the static start begins.
    pub fn start_attempt(&mut self, factor: f64) {
        self.now = CurrentSolve { time: 0.0, dt: 0.0, attempt: 1, starting: true };
        self.console.start_header(factor);
    }

    /// Records that a load level of the static start was reached. If supports alone do not hold the
    /// bodies, `free` names the bodies and the directions in which they are free to move.
    pub fn pressed(&mut self, report: &SolveReport, factor: f64, free: Option<&[String]>) {
        self.count(report);
        let Some(free) = free.filter(|_| factor == 1.0) else { return };
        let note = match report.newton {
            0 => "the bodies are in equilibrium in their initial position: no motion was restrained, and no \
                  force was needed"
                .to_owned(),
            _ => report.held.note(),
        };
        self.report_held(&report.held, note, free);
    }

    /// Records a finished static step. The motions that were projected out are reported the first
    /// time; afterwards only the largest force is recorded.
    pub(super) fn stepped(&mut self, report: &SolveReport, free: impl FnOnce() -> Vec<String>) {
        match &self.record.held {
            _ if report.held.motions == 0 => {}
            Some(known) if known.force >= report.held.force => {}
            Some(_) => self.record_held(&report.held, report.held.note(), &free()),
            None => self.report_held(&report.held, report.held.note(), &free()),
        }
    }

    fn report_held(&mut self, held: &HeldMotions, note: String, free: &[String]) {
        self.console.note(&note);
        self.record_held(held, note, free);
    }

    fn record_held(&mut self, held: &HeldMotions, note: String, free: &[String]) {
        let HeldMotions { motions, force, by, .. } = held.clone();
        let resultant = |by: Driven| Resultant { against: by.words, size: by.force, unit: by.unit };
        let step = if self.now.starting { 0 } else { self.step };
        let free = free.to_vec();
        self.record.held = Some(HoldingRecord { step, free, motions, force, by: by.map(resultant), note });
    }

    /// Begins the next step. What its attempts write and count is not part of a checkpoint until
    /// the step has ended.
    pub fn begin_step(&mut self) {
        self.before_step = Some(self.record.totals);
        if let Some(tables) = &mut self.tables {
            tables.begin_step();
        }
    }

    /// Ends an accepted step.
    pub fn end_step(&mut self) {
        self.before_step = None;
        self.tables.iter_mut().for_each(Tables::end_step);
    }

    /// Starts a solve of the next step.
    pub fn attempt(&mut self, stage: &Stage) {
        let step = self.step + 1;
        let time = stage.trial.time;
        let dt = stage.dt;
        let attempt = self.now.attempt + 1;
        self.now = CurrentSolve { time, dt, attempt, starting: false };
        self.console.newton_header(&Attempt { step, time, dt, attempt });
    }

    /// Records one Newton iteration. Rank 0 writes it. If the table can not be written, the error
    /// is reported at the end of the step.
    pub fn iteration(&mut self, report: &IterationReport) {
        let finite = |value: f64| value.is_finite().then_some(value);
        let row = IterationRow {
            step: if self.now.starting { 0 } else { self.step + 1 },
            time: self.now.time,
            dt: self.now.dt,
            attempt: self.now.attempt,
            stage: if self.now.starting { "start" } else { report.phase.name() },
            iteration: u64::from(report.iteration),
            residual: finite(report.residual),
            increment: finite(report.increment),
            krylov_iterations: u64::from(report.krylov),
            points: report.contact.closed,
            changed: report.contact.changed,
            line_search: finite(report.line_search),
            contraction: report.contraction.and_then(finite),
        };
        self.console.newton_row(&row);
        if let Some(tables) = &mut self.tables {
            tables.iteration(&row);
        }
    }

    /// Records a failed attempt.
    pub fn failed(&mut self, report: &SolveReport, reason: &str, control: &StepControl) {
        self.count(report);
        self.record.totals.cut_steps += 1;
        let note = format!(
            "step {} of {:.3e} {} failed: {reason}",
            self.step + 1,
            control.dt(),
            self.record.units.of("s")
        );
        self.console.note(&note);
        self.record.warn(note);
    }

    /// Records that a step was halved before it was tried, because surfaces would move too far in
    /// it. This counts as a cut.
    pub fn shortened(&mut self) {
        self.record.totals.cut_steps += 1;
    }

    /// Records a step that was solved but is repeated because its errors are too large.
    pub fn repeated(&mut self, report: &SolveReport, control: &StepControl) {
        self.count(report);
        let s = self.record.units.of("s");
        self.console.note(&format!("step {} is repeated with {:.3e} {s}", self.step + 1, control.dt()));
    }

    /// Records that linear solvers failed in the last solve and stronger ones replaced them.
    pub fn fallbacks(&mut self, fallbacks: &[Fallback]) {
        self.record.totals.linear_fallbacks += fallbacks.len() as u64;
        for Fallback { from, to, why } in fallbacks {
            let note = format!("linear solver {from} failed ({why}); {to} took over");
            self.console.note(&note);
            self.record.warn(note);
        }
    }

    /// Adds the iterations of a solve to the totals.
    pub(super) fn count(&mut self, report: &SolveReport) {
        self.record.totals.newton_iterations += u64::from(report.newton);
        self.record.totals.krylov_iterations += u64::from(report.krylov);
        self.record.totals.inner_krylov_iterations += u64::from(report.inner);
    }
}
