//! The journal over restarts: what it tells a checkpoint, and how it goes on.

use std::time::{Duration, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::journal::Journal;
use crate::error::{Result, agree};
use crate::output::fields::FieldWriter;
use crate::output::record::{Holding, Input, Penetration, Phase, Record, Totals};
use crate::output::table::Marks;
use crate::time::StepControl;

/// What was done before a checkpoint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Past {
    /// Sums.
    pub totals: Totals,
    /// How deep the contacts went.
    pub penetrations: Vec<Penetration>,
    /// Wall time \[s\].
    pub seconds: f64,
    /// Wall time by phase.
    pub phases: Vec<(String, Phase)>,
    /// That of the start.
    pub start_phases: Vec<(String, Phase)>,
    /// What held bodies.
    pub held: Option<Holding>,
    /// When the first run began [s since 1970].
    pub start: u64,
    /// The tables; none for a branch, which has tables of its own.
    tables: Marks,
    /// Steps that `fields.pvd` names.
    field_steps: u64,
}

impl Past {
    /// The tables to go on in, which a branch has not.
    pub fn tables(&self) -> Option<&Marks> {
        (!self.tables.0.is_empty()).then_some(&self.tables)
    }

    /// Steps whose fields are in the folder to go on in.
    pub fn field_steps(&self) -> u64 {
        self.field_steps
    }

    /// Goes on in a folder of its own: the tables begin with the next step.
    pub fn branch(&mut self) {
        self.tables = Marks::default();
        self.field_steps = 0;
    }

    /// Puts what was done before into the record of a run that goes on.
    pub fn recall(&self, record: &mut Record) {
        record.totals = Totals { restarts: self.totals.restarts + 1, ..self.totals };
        record.start_phases.clone_from(&self.start_phases);
        record.held.clone_from(&self.held);
        record.start = UNIX_EPOCH + Duration::from_secs(self.start);
        for known in &mut record.penetrations {
            if let Some(before) = self.penetrations.iter().find(|before| before.contact == known.contact) {
                (known.deepest, known.between, known.force) = (before.deepest, before.between, before.force);
            }
        }
    }

    /// Adds the seconds and calls of before.
    pub fn add_to(&self, seconds: &mut f64, phases: &mut [(String, Phase)]) {
        *seconds += self.seconds;
        for (name, phase) in phases {
            if let Some((_, before)) = self.phases.iter().find(|(before, _)| before == name) {
                phase.seconds += before.seconds;
                phase.count += before.count;
            }
        }
    }
}

impl<const D: usize> Journal<D> {
    /// Steps that are done.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// The files that the run read; on rank 0 only.
    pub fn inputs(&self) -> &[Input] {
        &self.record.inputs
    }

    /// What is done so far; the tables are on the disk then. Collective.
    ///
    /// # Errors
    /// When the disk refuses, the same on all ranks.
    pub fn past(&mut self) -> Result<Past> {
        let own = self.tables.as_ref().map_or_else(|| Ok(Marks::default()), |tables| tables.marks_of_steps());
        let tables = agree(self.session.world(), own)?;
        self.measure();
        let start = self.record.start.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        Ok(Past {
            totals: self.record.totals,
            penetrations: self.record.penetrations.clone(),
            seconds: self.record.wall_seconds,
            phases: self.record.phases.clone(),
            start_phases: self.record.start_phases.clone(),
            held: self.record.held.clone(),
            start,
            tables,
            field_steps: self.fields.as_ref().map_or(0, FieldWriter::steps),
        })
    }

    /// The first step after a checkpoint comes next; `remark` says which. Collective.
    ///
    /// # Errors
    /// When the record can not be written.
    pub fn go_on(&mut self, control: &StepControl, remark: &str) -> Result<()> {
        self.step = self.record.totals.steps;
        let s = self.record.units.of("s");
        self.console.note(&format!("{remark}, step {}, t = {:.6e} {s}", self.step, control.time()));
        self.console.begin(control.time(), self.end);
        self.write_record(control.time())
    }
}
