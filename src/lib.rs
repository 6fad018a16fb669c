//! Parallel implicit finite elements for dynamic, large-deformation, frictional contact, on PETSc.

pub mod contact;
pub mod error;
pub mod mesh;
pub mod space;
pub mod tensor;
pub mod terms;
#[cfg(test)]
pub mod taylor;
