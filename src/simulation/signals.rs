//! Signals that ask a run to stop: remembered here, answered at the next iterate or at the end of a step.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::flag;

use crate::error::{Error, Result};
use crate::petsc::began_ignoring_hangup;

/// The signals and their names. `mpirun` hands SIGUSR1 on and leaves the ranks alive; after SIGTERM it soon kills them.
const SIGNALS: [(i32, &str); 4] =
    [(SIGTERM, "SIGTERM"), (SIGINT, "SIGINT"), (SIGUSR1, "SIGUSR1"), (SIGHUP, "SIGHUP")];
/// Exit code after a second SIGINT, as shells have it.
const INTERRUPTED: i32 = 128 + SIGINT;

/// What this process was asked.
#[derive(Debug, Clone)]
pub struct Signals {
    last: Arc<AtomicUsize>,
}

impl Signals {
    /// Listens from now on. A second SIGINT ends the process at once.
    ///
    /// # Errors
    /// The system refuses.
    pub fn listen() -> Result<Self> {
        let (last, interrupted) = (Arc::<AtomicUsize>::default(), Arc::<AtomicBool>::default());
        let once = flag::register_conditional_shutdown(SIGINT, INTERRUPTED, Arc::clone(&interrupted));
        let mut registered = once.and_then(|_| flag::register(SIGINT, interrupted));
        // Under `nohup` a terminal that goes away is none of our business.
        let heeded = |signal: i32| signal != SIGHUP || !began_ignoring_hangup();
        for (signal, _) in SIGNALS.into_iter().filter(|(signal, _)| heeded(*signal)) {
            registered =
                registered.and_then(|_| flag::register_usize(signal, Arc::clone(&last), signal as usize));
        }
        registered.map_err(|error| Error::internal(format!("signals: {error}")))?;
        Ok(Self { last })
    }

    /// Number of the last signal; 0 without.
    pub fn last(&self) -> i32 {
        self.last.load(Ordering::Relaxed) as i32
    }

    /// Name of a signal.
    pub fn name(signal: i32) -> &'static str {
        SIGNALS.iter().find(|(number, _)| *number == signal).map_or("a signal", |(_, name)| name)
    }
}
