//! Thin owners of PETSc's objects; the only place, with METIS, where the program leaves safe Rust.
//!
//! A [`Session`] starts MPI and PETSc; every [`Vector`], [`Matrix`] and [`Krylov`] keeps it alive. Functions that all
//! ranks must call together say `Collective.` A failing call of PETSc is an [`Error`](crate::error::Error) with PETSc's
//! own text; a linear solve that does not converge is an [`Outcome`], not an error.

mod call;
mod events;
mod krylov;
mod matrix;
mod options;
mod pattern;
mod scatter;
mod session;
mod shell;
mod vector;

pub use events::{Event, Running};
pub use krylov::{Krylov, Outcome, Reason, Reuse, Start, residual_norm};
pub use matrix::{Format, Kronecker, Matrix, Operator, Symmetry};
pub use options::validate as validate_options;
pub use pattern::BlockPattern;
pub use scatter::{BlockValues, NO_SLOT};
pub use session::{Session, memory, peak_memory, versions};
pub use shell::ShellOperator;
pub use vector::{Values, ValuesMut, Vector};
