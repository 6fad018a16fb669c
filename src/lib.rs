//! Parallel implicit finite elements for dynamic, large-deformation, frictional contact, on PETSc.

pub mod case;
pub mod cli;
pub mod error;
pub mod tensor;
pub mod terms;
