//! Threads of the libraries below PETSc: one per rank, because the ranks provide the parallelism.
//!
//! A multithreaded BLAS starts one thread per core in every rank by default. Matrices of a few
//! hundred rows then take three times as long. Only the dynamic linker knows which BLAS is loaded,
//! so the functions are looked up by name.
//!
//! PT-Scotch starts threads as well. With them its parts differ from run to run, and version 7.0.3
//! crashed on small graphs on seven ranks.

use std::ffi::{CStr, c_char, c_int};

use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};

use super::usage::give_back_what_is_free;
use crate::error::{Error, Result};

/// A multithreaded BLAS: its functions, and the environment variables by which a user sets the
/// number of threads.
struct Library {
    set: &'static CStr,
    get: &'static CStr,
    chosen_by: [&'static str; 2],
}

const LIBRARIES: [Library; 2] = [
    Library {
        set: c"openblas_set_num_threads",
        get: c"openblas_get_num_threads",
        chosen_by: ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"],
    },
    Library {
        set: c"MKL_Set_Num_Threads",
        get: c"MKL_Get_Max_Threads",
        chosen_by: ["MKL_NUM_THREADS", "OMP_NUM_THREADS"],
    },
];

type Set = unsafe extern "C" fn(c_int);
type Get = unsafe extern "C" fn() -> c_int;

/// Environment variable by which Scotch learns the number of its threads.
const SCOTCH_THREADS: &str = "SCOTCH_PTHREAD_NUMBER";

/// Sets one thread for the BLAS of this process, unless the user chose a number, and for Scotch. The
/// process must have no threads yet.
pub(super) fn one_unless_chosen() {
    // SAFETY: no other thread reads or writes the environment, because MPI has not started.
    unsafe { std::env::set_var(SCOTCH_THREADS, "1") };
    for library in &LIBRARIES {
        let chosen = library.chosen_by.iter().any(|name| std::env::var_os(name).is_some());
        let Some(set) = address(library.set).filter(|_| !chosen) else { continue };
        // SAFETY: a function of that name takes an int and returns nothing, in every release of the
        // library.
        unsafe { std::mem::transmute::<*mut libc::c_void, Set>(set)(1) };
    }
}

/// Threads of the BLAS of this process; `None` if it has no threads or is an unknown BLAS.
pub fn blas_threads() -> Option<u32> {
    let get = LIBRARIES.iter().find_map(|library| address(library.get))?;
    // SAFETY: a function of that name takes nothing and returns an int, in every release of the
    // library.
    let count = unsafe { std::mem::transmute::<*mut libc::c_void, Get>(get)() };
    u32::try_from(count).ok()
}

/// Address space of an OpenBLAS thread, which is allocated with its first matrix \[bytes\].
const BUFFER: usize = 128 << 20;
/// Additional address space that a small run needs \[bytes\].
const RUN: usize = 16 << 20;

/// Makes the BLAS allocate its buffers now, if there is enough memory. Without enough memory
/// OpenBLAS would retry endlessly.
///
/// # Errors
/// There is not enough memory, due to a limit such as `ulimit -v`.
pub(super) fn take_buffers() -> Result<()> {
    require_buffers()?;
    let Some(solve) = address(c"dtrsm_") else { return Ok(()) };
    // As wide as the integers of any BLAS, which reads only the part that it needs.
    let count = ORDER as i64;
    let one = 1.0;
    let mut matrix = [0.0; ORDER * ORDER];
    (0..ORDER).for_each(|k| matrix[k * (ORDER + 1)] = 1.0);
    let mut right = [1.0; ORDER * ORDER];
    let (left, upper, plain) = (c"L".as_ptr(), c"U".as_ptr(), c"N".as_ptr());
    let (count, one) = (&raw const count, &raw const one);
    let (matrix, right) = (matrix.as_ptr(), right.as_mut_ptr());
    // SAFETY: the signature of the BLAS, with the hidden lengths of the words; the matrices have
    // the announced sizes.
    unsafe {
        let solve = std::mem::transmute::<*mut libc::c_void, Solve>(solve);
        solve(left, upper, plain, plain, count, count, one, matrix, count, right, count, 1, 1, 1, 1);
    }
    Ok(())
}

/// Checks that there is enough memory for the buffers of the BLAS and a small run. MPI needs some
/// of it as well, and its own error messages are obscure.
///
/// # Errors
/// The errors of [`take_buffers`].
pub(super) fn require_buffers() -> Result<()> {
    require_room(needed_room(blas_threads()))
}

/// Address space for a BLAS with this number of threads and a small run \[bytes\]. A BLAS without
/// threads allocates no such buffers.
fn needed_room(threads: Option<u32>) -> usize {
    let buffers = threads.map_or(0, |threads| BUFFER.saturating_mul(threads.max(1) as usize));
    buffers.saturating_add(RUN)
}

/// Order of the matrices that are solved to trigger the allocation of the buffers.
const ORDER: usize = 32;

type Solve = unsafe extern "C" fn(
    *const c_char,
    *const c_char,
    *const c_char,
    *const c_char,
    *const i64,
    *const i64,
    *const f64,
    *const f64,
    *const i64,
    *mut f64,
    *const i64,
    usize,
    usize,
    usize,
    usize,
);

fn require_room(bytes: usize) -> Result<()> {
    let fits = Vec::<u8>::new().try_reserve_exact(bytes).is_ok();
    // The allocator may keep the reserved memory for later, unavailable to libraries that allocate
    // from the system.
    give_back_what_is_free();
    if fits {
        return Ok(());
    }
    let limits = [("v", Resource::RLIMIT_AS), ("d", Resource::RLIMIT_DATA)];
    let limits = limits.into_iter().filter_map(|(option, limit)| Some((option, getrlimit(limit).ok()?.0)));
    let lowest = limits.filter(|(_, limit)| *limit != RLIM_INFINITY).min_by_key(|(_, limit)| *limit);
    let least = bytes >> 20;
    let text = format!(
        "there is not enough memory for the libraries, which need {least} MiB of address space in addition \
         to the program"
    );
    let cure = match lowest {
        None => "free some memory, or use a machine with more memory".to_owned(),
        Some((option, limit)) => {
            format!("the limit is {} kB: raise it with `ulimit -{option} unlimited`", limit >> 10)
        }
    };
    Err(Error::internal(text).hint(&cure))
}

/// Address of a function in any library of this process; `None` if there is no such function.
pub(super) fn address(name: &CStr) -> Option<*mut libc::c_void> {
    // SAFETY: the name ends with a zero; the lookup changes nothing.
    let found = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
    (!found.is_null()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Memory for buffers is required only for a multithreaded BLAS.
    #[test]
    fn buffers_are_those_of_a_blas_with_threads() {
        assert_eq!(needed_room(None), 16 << 20);
        assert_eq!(needed_room(Some(1)), 144 << 20);
        assert_eq!(needed_room(Some(4)), 528 << 20);
    }
}
