//! Record of a run up to the checkpoint from which it is resumed.

use std::time::{Duration, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::output::record::{HoldingRecord, PenetrationRecord, PhaseTime, Record, Totals};
use crate::output::table::Marks;

/// What was computed before a checkpoint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct EarlierRun {
    /// Counts and sums.
    pub totals: Totals,
    /// Largest penetrations of the contacts.
    pub penetrations: Vec<PenetrationRecord>,
    /// Wall time \[s\].
    pub seconds: f64,
    /// Wall time by phase.
    pub phases: Vec<(String, PhaseTime)>,
    /// Wall time of the start, by phase.
    pub start_phases: Vec<(String, PhaseTime)>,
    /// Motions that were projected out in statics.
    pub held: Option<HoldingRecord>,
    /// When the first run began \[s since 1970\].
    pub start: u64,
    /// Marks of the tables; empty for a branch, which writes tables of its own.
    pub(super) tables: Marks,
    /// Number of steps that `fields.pvd` lists.
    pub(super) field_steps: u64,
}

impl EarlierRun {
    /// Marks of the tables to continue; `None` for a branch.
    pub fn tables(&self) -> Option<&Marks> {
        (!self.tables.0.is_empty()).then_some(&self.tables)
    }

    /// Number of steps whose fields are in the folder of the resumed run.
    pub fn field_steps(&self) -> u64 {
        self.field_steps
    }

    /// Continues in a folder of its own. The tables begin with the next step.
    pub fn branch(&mut self) {
        self.tables = Marks::default();
        self.field_steps = 0;
    }

    /// Copies the totals of the earlier run into the record of the resumed run.
    pub fn copy_to(&self, record: &mut Record) {
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

    /// Adds the seconds and calls of the earlier run.
    pub fn add_to(&self, seconds: &mut f64, phases: &mut [(String, PhaseTime)]) {
        *seconds += self.seconds;
        for (name, phase) in phases {
            if let Some((_, before)) = self.phases.iter().find(|(before, _)| before == name) {
                phase.seconds += before.seconds;
                phase.count += before.count;
            }
        }
    }
}
