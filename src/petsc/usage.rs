//! Linux information on this process: memory and processor time used, and ignored signals.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use nix::sys::resource::{UsageWho, getrusage};

/// Peak memory of this process since the start, or since `reset_peak` \[bytes\], including
/// libraries. 0 if the system does not report it.
pub fn peak_memory() -> u64 {
    since(status_bytes("VmHWM:"), NOT_FORGOTTEN.load(Ordering::Relaxed))
}

/// The peak of an earlier run that the system did not reset \[bytes\].
static NOT_FORGOTTEN: AtomicU64 = AtomicU64::new(0);

/// The peak since an earlier one; 0 (unknown) if the peak is still the earlier one.
fn since(peak: u64, earlier: u64) -> u64 {
    if peak > earlier { peak } else { 0 }
}

/// Current memory of this process \[bytes\]; 0 if the system does not report it.
pub fn memory() -> u64 {
    status_bytes("VmRSS:")
}

/// Processor time of this process in user mode \[s\]; 0 if the system does not report it.
pub fn user_seconds() -> f64 {
    getrusage(UsageWho::RUSAGE_SELF).map_or(0.0, |usage| {
        let time = usage.user_time();
        time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64
    })
}

/// Resets the peak memory to the current use.
pub(super) fn reset_peak() {
    give_back_what_is_free();
    if std::fs::write("/proc/self/clear_refs", "5").is_err() {
        NOT_FORGOTTEN.store(status_bytes("VmHWM:"), Ordering::Relaxed);
    }
}

/// Returns free memory to the system. The allocator keeps freed memory for later, and it would
/// count as used.
pub(super) fn give_back_what_is_free() {
    // SAFETY: may be called at any time; memory in use is not moved.
    #[cfg(target_env = "gnu")]
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Whether SIGHUP was ignored when the process began, as under `nohup`.
static BEGAN_IGNORING_HANGUP: AtomicBool = AtomicBool::new(false);

/// Runs before the libraries are initialized, because some of them catch the signal when they are
/// loaded (UCX, below Open MPI).
#[used]
#[unsafe(link_section = ".preinit_array")]
static NOTE_HANGUP_ACTION: extern "C" fn() = note_hangup_action;

extern "C" fn note_hangup_action() {
    // SAFETY: queries the action of a signal and changes nothing; a zeroed one is a valid place for
    // the result.
    let action = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(libc::SIGHUP, std::ptr::null(), &mut action);
        action.sa_sigaction
    };
    BEGAN_IGNORING_HANGUP.store(action == libc::SIG_IGN, Ordering::Relaxed);
}

/// Whether this process was started with SIGHUP ignored, for example by `nohup`.
pub fn began_ignoring_hangup() -> bool {
    BEGAN_IGNORING_HANGUP.load(Ordering::Relaxed)
}

/// A number of bytes from Linux's process status. Unlike `getrusage`, it does not inherit the peak
/// of the parent process.
fn status_bytes(field: &str) -> u64 {
    let kilobytes = status(field).split_whitespace().next().and_then(|word| word.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

/// A line of Linux's process status, without its name; empty if there is no such line.
fn status(field: &str) -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().find_map(|line| line.strip_prefix(field)).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::since;

    /// A peak that the system did not reset is not reported for a later run, unless that run
    /// exceeded it.
    #[test]
    fn an_earlier_peak_is_nobody_elses() {
        assert_eq!([since(7, 0), since(7, 7), since(9, 7)], [7, 0, 9]);
    }
}
