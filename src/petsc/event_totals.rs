//! What a phase of the run has counted so far.

use std::cell::Cell;
use std::time::Duration;

use petsc_sys as sys;

/// What all events of one name count together; the session keeps them.
pub(super) struct EventTotals {
    pub name: String,
    pub id: sys::PetscLogEvent,
    pub seconds: Cell<Duration>,
    pub calls: Cell<u64>,
    pub depth: Cell<u32>,
}

impl EventTotals {
    /// Begins to count anew.
    pub(super) fn forget(&self) {
        self.seconds.set(Duration::ZERO);
        self.calls.set(0);
    }
}
