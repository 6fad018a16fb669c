//! Thin owners of PETSc's objects. Together with METIS this is the only unsafe code of the program.
//!
//! A [`Session`] starts MPI and PETSc; every [`Vector`], [`Matrix`] and [`KrylovSolver`] keeps it alive.
//! Functions that all ranks must call together are marked `Collective.` A failed call of PETSc is
//! an [`Error`](crate::error::Error) with PETSc's own text. A linear solve that does not converge
//! is an [`LinearOutcome`], not an error.

mod alone;
mod call;
mod census;
mod event_totals;
mod events;
mod graph_parts;
mod hdf5;
mod krylov;
mod limits;
mod matrix;
mod operator;
mod options;
mod outcome;
mod pattern;
mod reduce;
mod scatter;
mod sends;
mod session;
mod shell;
mod storage;
mod submatrix;
mod threads;
mod usage;
mod values;
mod vector;
mod versions;

pub use crate::matrix_format::Format;
pub use census::{Census, Kind, census};
pub use events::{Event, Running};
pub use graph_parts::{GraphRows, partition_graph};
pub use hdf5::{Hdf5File, NumberType, Rows, Width, require_hdf5};
pub use krylov::KrylovSolver;
pub use limits::outlive_file_limits;
pub use matrix::{Matrix, Symmetry};
pub use operator::{Kronecker, Operator, SharedOperator, residual_norm};
pub use options::validate as validate_options;
pub use outcome::{InitialGuess, LinearOutcome, Reason, Reuse};
pub use pattern::BlockPattern;
pub use reduce::{max_over_ranks, sum_over_ranks};
pub use scatter::{BlockReader, BlockValues, NO_SLOT};
pub use sends::Sends;
pub use session::Session;
pub use shell::ShellOperator;
pub use submatrix::SubMatrix;
pub use threads::blas_threads;
pub use usage::{began_ignoring_hangup, memory, peak_memory};
pub use values::{Values, ValuesMut};
pub use vector::Vector;
pub use versions::versions;
