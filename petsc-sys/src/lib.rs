//! The PETSc functions that contact-petsc calls, bound to the system's PETSc by an explicit list.
//!
//! MPI handles are those of `mpi-sys`, so a communicator of the crate `mpi` goes to PETSc as it is.
//! PETSc's own documentation of each function applies; the safe owners live in contact-petsc's `petsc` module.

#![allow(non_upper_case_globals, non_camel_case_types, non_snake_case, missing_docs, clippy::all)]

pub use mpi_sys::MPI_Comm;

/// A code that every PETSc function returns, 0 for success.
///
/// An `int` in Debian's PETSc and an enumeration of the same width in stricter builds of 3.19 and newer.
pub type PetscErrorCode = std::ffi::c_int;

include!(concat!(env!("OUT_DIR"), "/bindings.rs"));

/// Lets PETSc work a size out (`PETSC_DECIDE`, `PETSC_DETERMINE`).
pub const DETERMINE: PetscInt = -1;
/// No error.
pub const SUCCESS: PetscErrorCode = 0;
/// A pivot of an LU factorisation is zero (`PETSC_ERR_MAT_LU_ZRPVT`).
pub const ERROR_ZERO_PIVOT_LU: PetscErrorCode = 71;
/// A pivot of a Cholesky factorisation is zero (`PETSC_ERR_MAT_CH_ZRPVT`).
pub const ERROR_ZERO_PIVOT_CHOLESKY: PetscErrorCode = 81;
/// A user's callback failed (`PETSC_ERR_USER`).
pub const ERROR_USER: PetscErrorCode = 83;
