//! Phases of the run: PETSc log events (`-log_view`) that also measure their wall time.

use super::call::petsc;
use super::event_totals::EventTotals;
use super::options::text;
use super::session::Session;
use crate::error::Result;
use petsc_sys as sys;
use std::cell::Cell;
use std::rc::Rc;
use std::time::Instant;

/// A named phase. Clones are cheap and share one count.
#[derive(Clone)]
pub struct Event {
    shared: Rc<EventTotals>,
    _session: Rc<Session>,
}

impl Event {
    /// The phase with this name, a single word such as `ElementKernels`. All events with one name
    /// share one count.
    ///
    /// # Errors
    /// PETSc cannot register it.
    pub fn register(session: &Rc<Session>, name: &str) -> Result<Self> {
        let own = |shared: &Rc<EventTotals>| Self { shared: Rc::clone(shared), _session: Rc::clone(session) };
        if let Some(known) = session.events().borrow().iter().find(|shared| shared.name == name) {
            return Ok(own(known));
        }
        let (mut class, mut id) = (0, 0);
        petsc!(PetscClassIdRegister(c"contact-petsc".as_ptr(), &mut class))?;
        petsc!(PetscLogEventRegister(text(name)?.as_ptr(), class, &mut id))?;
        let shared = EventTotals {
            name: name.to_owned(),
            id,
            seconds: Cell::default(),
            calls: Cell::default(),
            depth: Cell::default(),
        };
        let shared = Rc::new(shared);
        session.events().borrow_mut().push(Rc::clone(&shared));
        Ok(own(&shared))
    }

    /// Begins the phase; it ends when the returned guard is dropped. A nested phase of the same
    /// name counts once.
    #[must_use = "the phase ends when the guard is dropped"]
    pub fn begin(&self) -> Running {
        let shared = Rc::clone(&self.shared);
        shared.depth.set(shared.depth.get() + 1);
        // SAFETY: the event is registered. A failure of the log does not justify a failure of the
        // run.
        unsafe { sys::contact_log_begin(shared.id) };
        Running { shared, since: Instant::now() }
    }

    /// Runs `work` as the phase.
    pub fn time<R>(&self, work: impl FnOnce() -> R) -> R {
        let _running = self.begin();
        work()
    }

    /// Wall time on this rank \[s\] and calls of the phase with this name; zero if there is no such
    /// phase.
    pub fn totals(session: &Session, name: &str) -> (f64, u64) {
        let events = session.events().borrow();
        let found = events.iter().find(|shared| shared.name == name);
        found.map_or((0.0, 0), |shared| (shared.seconds.get().as_secs_f64(), shared.calls.get()))
    }

    /// Name of the phase.
    pub fn name(&self) -> &str {
        &self.shared.name
    }

    /// Wall time spent in the phase on this rank so far \[s\].
    pub fn seconds(&self) -> f64 {
        self.shared.seconds.get().as_secs_f64()
    }

    /// Number of times the phase was entered.
    pub fn calls(&self) -> u64 {
        self.shared.calls.get()
    }
}

/// A running phase.
pub struct Running {
    shared: Rc<EventTotals>,
    since: Instant,
}

impl Drop for Running {
    fn drop(&mut self) {
        let shared = &self.shared;
        // SAFETY: the event is registered, as at its beginning.
        unsafe { sys::contact_log_end(shared.id) };
        shared.depth.set(shared.depth.get() - 1);
        if shared.depth.get() == 0 {
            shared.seconds.set(shared.seconds.get() + self.since.elapsed());
            shared.calls.set(shared.calls.get() + 1);
        }
    }
}
