//! Totals of a phase of the run.

use std::cell::Cell;
use std::time::Duration;

use petsc_sys as sys;

/// Totals of all events with one name; the session stores them.
pub(super) struct EventTotals {
    pub name: String,
    pub id: sys::PetscLogEvent,
    pub seconds: Cell<Duration>,
    pub calls: Cell<u64>,
    pub depth: Cell<u32>,
}

impl EventTotals {
    /// Resets the totals.
    pub(super) fn reset(&self) {
        self.seconds.set(Duration::ZERO);
        self.calls.set(0);
    }
}
