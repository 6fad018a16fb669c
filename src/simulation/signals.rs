//! Signals that ask a run to stop: remembered here, answered at the next iterate or at the end of a step.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::flag;

use crate::error::{Error, Result};
use crate::petsc::began_ignoring_hangup;

/// The signals and their names. `mpirun` hands SIGUSR1 on and leaves the ranks alive; after SIGTERM it soon kills them.
const SIGNALS: [(i32, &str); 4] =
    [(SIGTERM, "SIGTERM"), (SIGINT, "SIGINT"), (SIGUSR1, "SIGUSR1"), (SIGHUP, "SIGHUP")];
/// Signals of which a second one ends the process at once, with the code that shells have for it. What waits in a library, as
/// for memory that never comes, looks at no flag.
const IMPATIENT: [i32; 2] = [SIGTERM, SIGINT];

/// What this process was asked.
#[derive(Debug, Clone)]
pub struct Signals {
    last: Arc<AtomicUsize>,
}

impl Signals {
    /// Listens from now on; who asks again hears what came since the first time. A second SIGTERM or SIGINT ends the process at
    /// once.
    ///
    /// # Errors
    /// The system refuses.
    pub fn listen() -> Result<Self> {
        static LISTENER: Mutex<Option<Signals>> = Mutex::new(None);
        let mut listener = LISTENER.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(signals) = &*listener {
            return Ok(signals.clone());
        }
        let signals = Self::register()?;
        *listener = Some(signals.clone());
        Ok(signals)
    }

    fn register() -> Result<Self> {
        let last = Arc::<AtomicUsize>::default();
        let is_asked = Arc::<AtomicBool>::default();
        let mut registered = Ok(());
        for signal in IMPATIENT {
            registered = registered
                .and_then(|()| {
                    flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&is_asked))
                })
                .and_then(|_| flag::register(signal, Arc::clone(&is_asked)))
                .map(drop);
        }
        // Under `nohup` a terminal that goes away is none of our business.
        let heeded = |signal: i32| signal != SIGHUP || !began_ignoring_hangup();
        for (signal, _) in SIGNALS.into_iter().filter(|(signal, _)| heeded(*signal)) {
            registered = registered
                .and_then(|()| flag::register_usize(signal, Arc::clone(&last), signal as usize))
                .map(drop);
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
