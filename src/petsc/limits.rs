//! Limits of the system for this process, as `ulimit` sets them, under which the libraries would fail in their own ways.

use std::ffi::{CStr, c_char, c_int};
use std::os::unix::process::parent_id;

use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};

use crate::error::{Error, Result};

/// Run by the loader before the libraries begin, that is before their constructors.
#[used]
#[unsafe(link_section = ".preinit_array")]
static BEGIN: extern "C" fn(c_int, Strings, Strings) = begin_frugally;

/// Strings of C, with a null behind the last.
type Strings = *const *const c_char;

/// Variables that make libraries frugal with memory, each with those by which a user decides otherwise.
const FRUGAL: [(&CStr, &[&[u8]]); 2] = [
    (c"OPENBLAS_NUM_THREADS=1", &[b"OPENBLAS_NUM_THREADS=", b"GOTO_NUM_THREADS=", b"OMP_NUM_THREADS="]),
    (c"MALLOC_ARENA_MAX=1", &[b"MALLOC_ARENA_MAX="]),
];

/// Where memory is limited, starts the program again with the variables of [`FRUGAL`] that the user has not decided.
///
/// OpenBLAS starts a thread a core as it is loaded, and tries for ever to get memory for them if there is too little. By the
/// time `main` runs it is too late. The C library reserves 64 MiB or more for each thread of MPI.
///
/// Setting a variable here has no effect: the C library takes the environment of the process only after this function.
extern "C" fn begin_frugally(_: c_int, arguments: Strings, environment: Strings) {
    let is_limited = |limit| getrlimit(limit).is_ok_and(|(soft, _)| soft != RLIM_INFINITY);
    if !is_limited(Resource::RLIMIT_AS) && !is_limited(Resource::RLIMIT_DATA) {
        return;
    }
    // SAFETY: the loader passes arrays of strings that end with a null, and both live as long as the process. The path of the
    // program is such a string too; it is the loader's own if that was started as a program, which then has no base.
    // If `execve` fails, nothing has happened.
    unsafe {
        let mut variables: Vec<*const c_char> =
            (0..).map(|k| *environment.add(k)).take_while(|variable| !variable.is_null()).collect();
        let is_set = |name: &&[u8]| variables.iter().any(|&v| CStr::from_ptr(v).to_bytes().starts_with(name));
        let more = FRUGAL.iter().filter(|(_, names)| !names.iter().any(is_set));
        let more: Vec<*const c_char> = more.map(|(variable, _)| variable.as_ptr()).collect();
        let program = libc::getauxval(libc::AT_EXECFN) as *const c_char;
        if more.is_empty() || program.is_null() || libc::getauxval(libc::AT_BASE) == 0 {
            return;
        }
        variables.extend(more);
        variables.push(std::ptr::null());
        libc::execve(program, arguments, variables.as_ptr());
    }
}

/// From now on a file that would grow beyond the limit of `ulimit -f` is an error of the write, not the end of the process.
pub fn outlive_file_limits() {
    // SAFETY: ignores a signal, for which nothing else has an action.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
}

/// Size of a file through which Open MPI's processes on a host share memory \[bytes\]. The process that starts the others makes
/// it, and gives up below this limit (Open MPI 4.1.4: 4095 KiB fail, 4096 KiB do).
const SHARED: u64 = 4 << 20;

/// Makes sure that MPI may make the files that it shares memory by: it would end this process by itself, with code 1 and
/// messages about its own parts.
///
/// # Errors
/// There is too small a limit on the size of files.
pub(super) fn require_file_size() -> Result<()> {
    let own = getrlimit(Resource::RLIMIT_FSIZE).map_or(RLIM_INFINITY, |(limit, _)| limit);
    let is_started_by_mpirun = std::env::var_os("OMPI_COMM_WORLD_RANK").is_some();
    let limit = if is_started_by_mpirun { own.max(parents_file_size()) } else { own };
    if limit >= SHARED {
        return Ok(());
    }
    let text = format!("files are limited to {} KiB, and MPI needs {} KiB", limit >> 10, SHARED >> 10);
    Err(Error::file(text).hint("raise the limit by `ulimit -f unlimited`"))
}

/// The limit on the size of files of the process that started this one \[bytes\].
fn parents_file_size() -> u64 {
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", parent_id())).unwrap_or_default();
    let line = limits.lines().find_map(|line| line.strip_prefix("Max file size"));
    let soft = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
    soft.unwrap_or(RLIM_INFINITY)
}
