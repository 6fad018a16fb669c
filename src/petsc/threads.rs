//! Threads of the BLAS below PETSc: one a rank, since the ranks are the parallelism.
//!
//! A BLAS with threads starts one a core of its own accord, in every rank, and matrices of a few hundred rows then cost
//! three times as much. Which BLAS there is the dynamic linker knows, hence the functions are looked for by name.

use std::ffi::{CStr, c_int};

/// A BLAS with threads: its functions, and the environment variables by which a user chooses their number.
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

/// One thread for the BLAS of this process, unless the user chose a number.
pub(super) fn one_unless_chosen() {
    for library in &LIBRARIES {
        let chosen = library.chosen_by.iter().any(|name| std::env::var_os(name).is_some());
        let Some(set) = address(library.set).filter(|_| !chosen) else { continue };
        // SAFETY: a function of that name takes an int and returns nothing, in every release of the library.
        unsafe { std::mem::transmute::<*mut libc::c_void, Set>(set)(1) };
    }
}

/// Threads of the BLAS of this process; nothing where it has none, or is one that this program does not know.
pub fn blas_threads() -> Option<u32> {
    let get = LIBRARIES.iter().find_map(|library| address(library.get))?;
    // SAFETY: a function of that name takes nothing and returns an int, in every release of the library.
    let count = unsafe { std::mem::transmute::<*mut libc::c_void, Get>(get)() };
    u32::try_from(count).ok()
}

/// Where a function is that some library of this process offers.
pub(super) fn address(name: &CStr) -> Option<*mut libc::c_void> {
    // SAFETY: the name ends with a zero; looking for it changes nothing.
    let found = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
    (!found.is_null()).then_some(found)
}
