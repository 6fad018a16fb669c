//! Parallel implicit finite elements for dynamic, large-deformation, frictional contact, on PETSc.

pub mod error;
pub mod mesh;
pub mod partition;
pub mod space;
pub mod tensor;
pub mod terms;
