//! What Linux tells of this process: memory and processor time that it has used, signals that it ignores.

use std::sync::atomic::{AtomicBool, Ordering};

use nix::sys::resource::{UsageWho, getrusage};

/// Largest memory that this process has held since the start, or since `forget_peak` \[bytes\]; 0 where the system does
/// not tell.
pub fn peak_memory() -> u64 {
    status_bytes("VmHWM:")
}

/// Memory that this process holds now \[bytes\]; 0 where the system does not tell.
pub fn memory() -> u64 {
    status_bytes("VmRSS:")
}

/// Processor time that this process has spent outside of the kernel \[s\]; 0 where the system does not tell.
pub fn user_seconds() -> f64 {
    getrusage(UsageWho::RUSAGE_SELF).map_or(0.0, |usage| {
        let time = usage.user_time();
        time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64
    })
}

/// Lets the peak of the memory begin anew at what is held now. Where the system refuses, the old peak stands.
pub(super) fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Whether SIGHUP was ignored when the process began, as under `nohup`.
static BEGAN_IGNORING_HANGUP: AtomicBool = AtomicBool::new(false);

/// Looked at before the libraries begin, some of which catch the signal as they are loaded (UCX, below Open MPI).
#[used]
#[unsafe(link_section = ".preinit_array")]
static LOOK: extern "C" fn() = look;

extern "C" fn look() {
    // SAFETY: asks for the action of a signal and changes nothing; a zeroed one is a place for the answer.
    let action = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(libc::SIGHUP, std::ptr::null(), &mut action);
        action.sa_sigaction
    };
    BEGAN_IGNORING_HANGUP.store(action == libc::SIG_IGN, Ordering::Relaxed);
}

/// Whether this process was started with SIGHUP ignored, as by `nohup`.
pub fn began_ignoring_hangup() -> bool {
    BEGAN_IGNORING_HANGUP.load(Ordering::Relaxed)
}

/// A number of bytes in Linux's process status; unlike `getrusage` it does not inherit the peak of the process that started us.
fn status_bytes(field: &str) -> u64 {
    let kilobytes = status(field).split_whitespace().next().and_then(|word| word.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

/// A line of Linux's process status, without its name; empty where there is none.
fn status(field: &str) -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().find_map(|line| line.strip_prefix(field)).unwrap_or_default().to_owned()
}
