//! System limits of this process, as set by `ulimit`, at which libraries would fail with obscure
//! errors.

use std::ffi::{CStr, c_char, c_int};
use std::os::unix::process::parent_id;

use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};

use super::alone::is_alone;
use crate::error::{Error, Result};

/// The loader runs this before the constructors of the libraries.
#[used]
#[unsafe(link_section = ".preinit_array")]
static BEGIN: extern "C" fn(c_int, Strings, Strings) = begin_frugally;

/// C strings, terminated by a null pointer.
type Strings = *const *const c_char;

/// Environment variables that reduce the memory use of libraries. Each is listed with the variables
/// by which a user chooses otherwise.
const FRUGAL: [(&CStr, &[&[u8]]); 2] = [
    (c"OPENBLAS_NUM_THREADS=1", &[b"OPENBLAS_NUM_THREADS=", b"GOTO_NUM_THREADS=", b"OMP_NUM_THREADS="]),
    (c"MALLOC_ARENA_MAX=1", &[b"MALLOC_ARENA_MAX="]),
];

/// If memory is limited, restarts the program with the variables of [`FRUGAL`] that the user has
/// not set.
///
/// When it is loaded, OpenBLAS starts one thread per core. If there is too little memory for them,
/// it retries forever. By the time `main` runs it is too late. The C library reserves 64 MiB or
/// more for each thread of MPI.
///
/// Setting a variable here has no effect, because the C library reads the environment of the
/// process only after this function.
extern "C" fn begin_frugally(_: c_int, arguments: Strings, environment: Strings) {
    let is_limited = |limit| getrlimit(limit).is_ok_and(|(soft, _)| soft != RLIM_INFINITY);
    if !is_limited(Resource::RLIMIT_AS) && !is_limited(Resource::RLIMIT_DATA) {
        return;
    }
    // SAFETY: the loader passes arrays of strings that end with a null, and both live as long as
    // the process. The path of the program is such a string too. If the loader was started as a
    // program, the path is its own and there is no base address. If `execve` fails, it has no
    // effect.
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

/// Makes a write beyond the limit of `ulimit -f` return an error instead of ending the process.
pub fn outlive_file_limits() {
    // SAFETY: ignores a signal for which there is no other handler.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
}

/// Size of a file through which Open MPI's processes on a host share memory \[bytes\]. The
/// launching process creates it and fails below this limit (Open MPI 4.1.4: 4095 KiB fail, 4096 KiB
/// succeed).
const SHARED: u64 = 4 << 20;

/// Checks that MPI can create its shared-memory files, which a single rank without `mpirun` does not
/// need. Otherwise MPI would end this process with code 1 and messages about its internals.
///
/// # Errors
/// The limit on the size of files is too small.
pub(super) fn require_file_size() -> Result<()> {
    if is_alone() {
        return Ok(());
    }
    let own = getrlimit(Resource::RLIMIT_FSIZE).map_or(RLIM_INFINITY, |(limit, _)| limit);
    let is_started_by_mpirun = std::env::var_os("OMPI_COMM_WORLD_RANK").is_some();
    let limit = if is_started_by_mpirun { own.max(parents_file_size()) } else { own };
    if limit >= SHARED {
        return Ok(());
    }
    let text = format!("files are limited to {} KiB, and MPI needs {} KiB", limit >> 10, SHARED >> 10);
    Err(Error::file(text).hint("raise the limit with `ulimit -f unlimited`"))
}

/// The file size limit of the parent process \[bytes\].
fn parents_file_size() -> u64 {
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", parent_id())).unwrap_or_default();
    let line = limits.lines().find_map(|line| line.strip_prefix("Max file size"));
    let soft = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
    soft.unwrap_or(RLIM_INFINITY)
}
