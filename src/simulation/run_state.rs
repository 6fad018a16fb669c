//! The state of a run: what a checkpoint stores, and what a restart restores.
//!
//! A step computes the same bits from a restored state as from the one that was stored. Data fall
//! into three groups:
//!
//! - Stored: fields, histories, counters, and all numbers on which decisions depend.
//! - Made again from stored [`Sources`]: matrices, preconditioners, the pattern of the matrix, and
//!   the facets near each contact. The same operations on the same numbers give the same bits.
//! - Without effect on later steps: iterates, buffers, and caches of values that are compared with
//!   their arguments before use.
//!
//! A new part of the state implements [`StatePart`] and is listed with the others below [`PARTS`].

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::accuracy::StepPacing;
use crate::advice::precision::MotionPrecision;
use crate::assembly::{
    ContactSystem, NamedFields, StatePart, StoredSources, StoredState, SystemState, from_numbers, named,
    numbers_of, state_tables,
};
use crate::case::Case;
use crate::checkpoint::StoredTable;
use crate::dynamics::{Sources, Stage};
use crate::error::{Error, Result};
use crate::guard::RunGuard;
use crate::observe::energy::EnergyLedger;
use crate::petsc::Session;
use crate::solvers::Strategy;
use crate::time::StepControl;

/// Bodies, solver and monitors of a run.
pub struct RunState<const D: usize> {
    /// The bodies with their contacts.
    pub system: ContactSystem<D>,
    /// The present step. Between steps only its start matters.
    pub stage: Stage,
    /// The method that solves a step.
    pub strategy: Box<dyn Strategy>,
    /// The step control.
    pub control: StepControl,
    /// The energies.
    pub ledger: EnergyLedger,
    /// The monitor of unexplained energy and impact.
    pub guard: RunGuard,
    /// The control of the step length by estimated errors.
    pub pace: StepPacing,
    /// The monitor of the rounding of displacements.
    pub precision: MotionPrecision,
    /// Settings of the solver, see [`solver_settings`].
    pub settings: Value,
}

/// The state at the end of an accepted step, except for fields.
#[derive(Clone)]
pub struct Snapshot {
    parts: Map<String, Value>,
    sources: Sources,
    /// Instant \[s\].
    pub time: f64,
}

/// A snapshot in a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredSnapshot {
    parts: Map<String, Value>,
    sources: Value,
    /// Settings of the solver, without which its state has no meaning.
    settings: Value,
}

/// Names of the parts, in the order of [`RunState::parts`].
const PARTS: [&str; 6] = ["stage", CONTROL, "ledger", "guard", "accuracy", "precision"];
const CONTROL: &str = "control";
const SYSTEM: &str = "system";
const SOLVER: &str = "solver";

impl StoredSnapshot {
    /// Checks that no part is missing.
    ///
    /// # Errors
    /// The first part that is missing.
    pub fn check(&self) -> Result<()> {
        PARTS.iter().chain(&[SYSTEM, SOLVER]).try_for_each(|name| self.part(name).map(drop))
    }

    fn part(&self, name: &str) -> Result<&Value> {
        self.parts.get(name).ok_or_else(|| Error::file(format!("a checkpoint without the part '{name}'")))
    }
}

impl<const D: usize> RunState<D> {
    /// All parts except for bodies and solver.
    fn parts(&self) -> [&dyn StatePart; PARTS.len()] {
        let Self { stage, control, ledger, guard, pace, precision, .. } = self;
        [stage, control, ledger, guard, pace, precision]
    }

    /// The same parts, to be restored.
    fn parts_mut(&mut self) -> [&mut dyn StatePart; PARTS.len()] {
        let Self { stage, control, ledger, guard, pace, precision, .. } = self;
        [stage, control, ledger, guard, pace, precision]
    }

    /// The state at the start of the next step.
    ///
    /// # Errors
    /// An internal error of the program.
    pub fn snapshot(&self) -> Result<Snapshot> {
        let mut sources = Sources::default();
        let mut parts = Map::new();
        for (name, part) in PARTS.iter().zip(self.parts()) {
            parts.insert((*name).to_owned(), part.numbers()?);
        }
        parts.insert(SYSTEM.to_owned(), numbers_of(&self.system.state(&mut sources))?);
        parts.insert(SOLVER.to_owned(), self.strategy.state(&self.system, &mut sources)?);
        Ok(Snapshot { parts, sources, time: self.stage.start.time })
    }

    /// The snapshot for the header of a checkpoint. Collective.
    ///
    /// # Errors
    /// An internal error of the program.
    pub fn stored(&self, snapshot: &Snapshot) -> Result<StoredSnapshot> {
        let sources = StoredSources::of(self.system.session(), &snapshot.sources);
        let (parts, settings) = (snapshot.parts.clone(), self.settings.clone());
        Ok(StoredSnapshot { parts, sources: numbers_of(&sources)?, settings })
    }

    /// The fields of the snapshot, which is that of the last accepted step.
    pub fn tables(&self, snapshot: &Snapshot) -> Vec<StoredTable> {
        let fields = self.parts().into_iter().flat_map(StatePart::fields).collect();
        state_tables(&self.system, fields, &snapshot.sources)
    }

    /// Restores the state from a checkpoint. The step control is restored unless `ends_elsewhere`,
    /// because the end of the case has changed. Collective.
    ///
    /// # Errors
    /// A part is missing, or PETSc reports an error.
    pub fn restore(
        &mut self,
        stored: &StoredSnapshot,
        fields: &StoredState,
        ends_elsewhere: bool,
    ) -> Result<()> {
        for (name, part) in PARTS.iter().zip(self.parts_mut()) {
            if *name != CONTROL || !ends_elsewhere {
                part.restore_from(stored.part(name)?, fields)?;
            }
        }
        let system: SystemState = from_numbers(stored.part(SYSTEM)?)?;
        let sources: StoredSources = from_numbers(&stored.sources)?;
        let sources = sources.sources(&self.system, fields)?;
        self.system.resume_pattern(&system, &sources)?;
        // Another solver begins with nothing.
        if stored.settings == self.settings {
            self.strategy.resume(stored.part(SOLVER)?, &sources, &mut self.system)?;
        }
        self.system.resume(&system, &sources, fields)?;
        self.stage.trial.copy_from(&self.stage.start)
    }
}

/// What the state of a solver depends on: the strategy, the case, and PETSc's options.
///
/// # Errors
/// An internal error of the program.
pub fn solver_settings(case: &Case, strategy: &dyn Strategy, session: &Session) -> Result<Value> {
    let json = case.to_json()?;
    Ok(json!({
        "strategy": strategy.describe(),
        "solver": json["solver"],
        "petsc": json["petsc"],
        "options": session.given(""),
    }))
}

impl StatePart for StepControl {
    fn numbers(&self) -> Result<Value> {
        numbers_of(self)
    }

    fn restore_from(&mut self, numbers: &Value, _: &StoredState) -> Result<()> {
        *self = from_numbers(numbers)?;
        Ok(())
    }
}

impl StatePart for RunGuard {
    fn numbers(&self) -> Result<Value> {
        numbers_of(self)
    }

    fn restore_from(&mut self, numbers: &Value, _: &StoredState) -> Result<()> {
        *self = from_numbers(numbers)?;
        Ok(())
    }
}

impl StatePart for MotionPrecision {
    fn numbers(&self) -> Result<Value> {
        numbers_of(&self.warned())
    }

    fn restore_from(&mut self, numbers: &Value, _: &StoredState) -> Result<()> {
        self.resume(from_numbers(numbers)?);
        Ok(())
    }
}

impl StatePart for EnergyLedger {
    fn numbers(&self) -> Result<Value> {
        numbers_of(&self.balances())
    }

    fn fields(&self) -> NamedFields {
        Self::fields(self)
    }

    fn restore_from(&mut self, numbers: &Value, fields: &StoredState) -> Result<()> {
        self.resume(from_numbers(numbers)?, |name| fields.field(name))
    }
}

impl StatePart for Stage {
    fn numbers(&self) -> Result<Value> {
        numbers_of(&self.start.time)
    }

    fn fields(&self) -> NamedFields {
        let mut fields =
            vec![named("u", &self.start.u), named("v", &self.start.v), named("force", &self.start_forces)];
        if self.inertia {
            fields.push(named("a", &self.start.a));
        }
        fields
    }

    fn restore_from(&mut self, numbers: &Value, fields: &StoredState) -> Result<()> {
        self.start.time = from_numbers(numbers)?;
        fields.fill("u", &mut self.start.u)?;
        fields.fill("v", &mut self.start.v)?;
        fields.fill("force", &mut self.start_forces)?;
        if self.inertia { fields.fill("a", &mut self.start.a) } else { Ok(()) }
    }
}
