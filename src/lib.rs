//! Parallel implicit finite elements for dynamic, large-deformation, frictional contact, on PETSc.

pub mod element;
pub mod error;
pub mod lanes;
pub mod material;
pub mod mesh;
pub mod space;
pub mod square;
#[cfg(test)]
pub mod taylor;
pub mod tensor;
pub mod terms;
