//! The journal across restarts: what it stores in a checkpoint, and how it resumes.

use std::time::UNIX_EPOCH;

use super::earlier_run::EarlierRun;
use super::field_output::FieldOutput;
use super::journal::Journal;
use crate::error::{Result, agree};
use crate::output::record::InputRecord;
use crate::output::table::Marks;
use crate::time::StepControl;

impl<const D: usize> Journal<D> {
    /// Number of finished steps.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// The files that the run read; on rank 0 only.
    pub fn inputs(&self) -> &[InputRecord] {
        &self.record.inputs
    }

    /// What was computed so far. The tables are on the disk when this returns. Collective.
    ///
    /// # Errors
    /// The disk can not be written; the error is the same on all ranks.
    pub fn past(&mut self) -> Result<EarlierRun> {
        let own = self.tables.as_ref().map_or_else(|| Ok(Marks::default()), |tables| tables.marks_of_steps());
        let tables = agree(self.session.world(), own)?;
        self.measure();
        let start = self.record.start.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        Ok(EarlierRun {
            totals: self.before_step.unwrap_or(self.record.totals),
            penetrations: self.record.penetrations.clone(),
            seconds: self.record.wall_seconds,
            phases: self.record.phases.clone(),
            start_phases: self.record.start_phases.clone(),
            held: self.record.held.clone(),
            start,
            tables,
            field_steps: self.fields.as_ref().map_or(0, FieldOutput::steps),
        })
    }

    /// Resumes the journal at the first step after a checkpoint; `remark` names the checkpoint.
    /// Collective.
    ///
    /// # Errors
    /// The record can not be written.
    pub fn resume(&mut self, control: &StepControl, remark: &str) -> Result<()> {
        self.step = self.record.totals.steps;
        let s = self.record.units.of("s");
        self.console.note(&format!("{remark}, step {}, t = {:.6e} {s}", self.step, control.time()));
        self.console.begin(control.time(), self.end);
        self.write_record(control.time())
    }
}
