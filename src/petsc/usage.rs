//! What Linux tells of this process: memory and processor time that it has used, signals that it ignores.

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

/// The signals that this process ignores, bit `n - 1` for signal `n`; none where the system does not tell.
pub(super) fn ignored_signals() -> u64 {
    u64::from_str_radix(status("SigIgn:").trim(), 16).unwrap_or(0)
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
