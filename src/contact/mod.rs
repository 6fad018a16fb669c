//! Contact: obstacles and projection (2.2, 2.3), normal and friction laws (2.8, 2.9), the point kernel with every
//! term of (3.5) under its name, and what the points of a surface remember.
//!
//! Pure: no PETSc, no MPI, no case.

mod check;
pub mod friction;
pub mod normal;
pub mod obstacle;
#[cfg(test)]
pub(crate) mod testing;
