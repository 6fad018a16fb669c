//! Calls to PETSc, and conversion of its error codes to messages.

use crate::error::{Error, Result};
use petsc_sys as sys;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::{Mutex, PoisonError};

/// Calls one function of PETSc and converts its error code to a [`Result`].
///
/// The arguments must satisfy the requirements in PETSc's documentation of that function.
macro_rules! petsc {
    ($function:ident ( $($argument:expr),* $(,)? )) => {{
        // SAFETY: handles are alive while their owner is, and each call site passes what the
        // function documents.
        let code = unsafe { petsc_sys::$function($($argument),*) };
        $crate::petsc::call::check(stringify!($function), code)
    }};
}
pub(super) use petsc;

/// PETSc's messages about the error that is currently propagated, innermost first.
static DETAIL: Mutex<Option<String>> = Mutex::new(None);

/// Returns an error with the function, the code, PETSc's text for it and PETSc's message from the
/// location of the error.
pub(super) fn check(function: &str, code: sys::PetscErrorCode) -> Result<()> {
    if code == sys::SUCCESS {
        return Ok(());
    }
    let mut message = format!("petsc call {function} failed ({code}): {}", text(code));
    if let Some(detail) = take_detail() {
        message.push_str(": ");
        message.push_str(&detail);
    }
    Err(Error::internal(message))
}

/// Stores the message of a callback for the error of the call that ran it.
pub(super) fn keep_detail(detail: String) {
    DETAIL.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(detail);
}

/// Removes and returns PETSc's message about the last error.
pub(super) fn take_detail() -> Option<String> {
    DETAIL.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// PETSc's text for a code.
fn text(code: sys::PetscErrorCode) -> String {
    let mut words: *const c_char = std::ptr::null();
    // SAFETY: PETSc returns a pointer to a constant string, or null for an unknown code.
    let known = unsafe { sys::PetscErrorMessage(code, &mut words, std::ptr::null_mut()) } == sys::SUCCESS;
    // SAFETY: PETSc's text for a code is a constant string, and it is not null here.
    if known && !words.is_null() { unsafe { string(words) } } else { "unknown error".to_owned() }
}

/// A C string as an owned one.
///
/// # Safety
/// `words` is null or points to a string that ends with a zero.
pub(super) unsafe fn string(words: *const c_char) -> String {
    if words.is_null() {
        return String::new();
    }
    // SAFETY: promised by the caller.
    unsafe { CStr::from_ptr(words) }.to_string_lossy().into_owned()
}

/// Error handler for PETSc. It prints nothing and stores the first message, so that the program
/// reports it once.
pub(super) unsafe extern "C" fn quiet_handler(
    _comm: sys::MPI_Comm,
    _line: c_int,
    function: *const c_char,
    _file: *const c_char,
    code: sys::PetscErrorCode,
    kind: sys::PetscErrorType,
    message: *const c_char,
    _context: *mut c_void,
) -> sys::PetscErrorCode {
    if kind == sys::PETSC_ERROR_INITIAL {
        // SAFETY: PETSc passes null or strings.
        let (function, message) = unsafe { (string(function), string(message)) };
        let words: Vec<&str> = message.split_whitespace().collect();
        let _ = take_detail();
        keep_detail(format!("{} (in {function})", words.join(" ")));
    }
    code
}
