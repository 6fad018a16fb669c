//! What a run has done before a checkpoint from which it continues.

use std::time::{Duration, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::output::record::{Holding, PenetrationRecord, PhaseTime, Record, Totals};
use crate::output::table::Marks;

/// What was done before a checkpoint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct EarlierRun {
    /// Sums.
    pub totals: Totals,
    /// How deep the contacts went.
    pub penetrations: Vec<PenetrationRecord>,
    /// Wall time \[s\].
    pub seconds: f64,
    /// Wall time by phase.
    pub phases: Vec<(String, PhaseTime)>,
    /// That of the start.
    pub start_phases: Vec<(String, PhaseTime)>,
    /// What held bodies.
    pub held: Option<Holding>,
    /// When the first run began [s since 1970].
    pub start: u64,
    /// The tables; none for a branch, which has tables of its own.
    pub(super) tables: Marks,
    /// Steps that `fields.pvd` names.
    pub(super) field_steps: u64,
}

impl EarlierRun {
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
