//! Parallel implicit finite elements for dynamic, large-deformation, frictional contact, on PETSc.

pub mod error;
pub mod output;
pub mod plot;
pub mod tensor;
pub mod terms;
