//! Signals that request a run to stop. They are stored here and evaluated at the next iterate or at
//! the end of a step.

use std::io::{self, Read};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::flag;
use signal_hook::low_level::{self, pipe};

use crate::error::{Error, Result};
use crate::petsc::began_ignoring_hangup;

/// The signals and their names. `mpirun` forwards SIGUSR1 and leaves the ranks alive; after SIGTERM
/// it soon kills them.
const SIGNALS: [(i32, &str); 4] =
    [(SIGTERM, "SIGTERM"), (SIGINT, "SIGINT"), (SIGUSR1, "SIGUSR1"), (SIGHUP, "SIGHUP")];
/// Signals that end the process at once when they are repeated, with the exit code that shells use
/// for them. A process that waits inside a library does not check a flag.
const IMPATIENT: [i32; 2] = [SIGTERM, SIGINT];
/// Minimum delay of a repeated signal. `timeout` and batch systems send the same signal to a
/// process and to its group, one right after the other. Both count as one request, because a
/// checkpoint is worth more than a second.
const PATIENCE: Duration = Duration::from_secs(1);

/// The signals that this process received.
#[derive(Debug, Clone)]
pub struct Signals {
    last: Arc<AtomicUsize>,
}

impl Signals {
    /// Installs the signal handlers; later calls return the same listener. A repeated SIGTERM or
    /// SIGINT ends the process at once if it arrives a second or more after the first, or if it is
    /// the third.
    ///
    /// # Errors
    /// The operating system refuses the signal handlers.
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
        let refused = |error: io::Error| Error::internal(format!("signals: {error}"));
        let last = Arc::<AtomicUsize>::default();
        // Under `nohup` the hangup of a terminal is ignored.
        let heeded = |signal: i32| signal != SIGHUP || !began_ignoring_hangup();
        for (signal, _) in SIGNALS.into_iter().filter(|(signal, _)| heeded(*signal)) {
            flag::register_usize(signal, Arc::clone(&last), signal as usize).map_err(refused)?;
        }
        // Registered after the flags, so that the last signal is known when the thread wakes up.
        end_on_a_later_one(&last).map_err(refused)?;
        Ok(Self { last })
    }

    /// Number of the last signal; 0 if there was no signal.
    pub fn last(&self) -> i32 {
        self.last.load(Ordering::Relaxed) as i32
    }

    /// Name of a signal.
    pub fn name(signal: i32) -> &'static str {
        SIGNALS.iter().find(|(number, _)| *number == signal).map_or("a signal", |(_, name)| name)
    }
}

/// Lets a repeated signal of [`IMPATIENT`] end the process once [`PATIENCE`] has elapsed since the
/// first one. The third one ends it in any case, because only a user who waits sends the same
/// request three times. A separate thread counts them, since the other threads may be busy.
fn end_on_a_later_one(last: &Arc<AtomicUsize>) -> io::Result<()> {
    let (mut signals, sender) = UnixStream::pair()?;
    for signal in IMPATIENT {
        pipe::register(signal, sender.try_clone()?)?;
    }
    let last = Arc::clone(last);
    let count = move || {
        let mut first = None;
        for number in 1.. {
            if signals.read_exact(&mut [0]).is_err() {
                return;
            }
            let first = *first.get_or_insert_with(Instant::now);
            if number > 2 || first.elapsed() >= PATIENCE {
                low_level::exit(128 + last.load(Ordering::Relaxed) as i32);
            }
        }
    };
    Builder::new().name("signals".into()).spawn(count).map(drop)
}
