//! The cores that the runs of one test program share. Waiting ranks poll. If there are more ranks
//! than cores, two consecutive runs take less time than two concurrent ones (54 s instead of 94 s
//! for `ranks` on two cores).

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Cores in use by runs.
static TAKEN: Mutex<usize> = Mutex::new(0);
static GIVEN_BACK: Condvar = Condvar::new();

/// Longest wait, for a test that starts a run while it has another. The run starts afterwards in
/// any case.
const PATIENCE: Duration = Duration::from_secs(120);

/// The cores of a run, released at its end.
pub struct Share(usize);

impl Share {
    /// Waits until enough cores for the ranks are free, or until all are free if there are more
    /// ranks than cores.
    pub fn of(ranks: usize) -> Self {
        // Half as many more: runs begin and end with seconds in which ranks sleep.
        let cores = std::thread::available_parallelism().map_or(1, usize::from) * 3 / 2;
        let wanted = ranks.clamp(1, cores);
        let wait = GIVEN_BACK.wait_timeout_while(taken(), PATIENCE, |taken| *taken + wanted > cores);
        let (mut taken, _) = wait.unwrap_or_else(PoisonError::into_inner);
        *taken += wanted;
        Self(wanted)
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        *taken() -= self.0;
        GIVEN_BACK.notify_all();
    }
}

fn taken() -> MutexGuard<'static, usize> {
    TAKEN.lock().unwrap_or_else(PoisonError::into_inner)
}
