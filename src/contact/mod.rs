//! Contact: obstacles and projection (2.2, 2.3), normal and friction laws (2.8, 2.9), the point kernel with every
//! term of (3.5) under its name, and what the points of a surface remember.
//!
//! Pure: no PETSc, no MPI, no case.

mod check;
pub mod deformable;
pub mod evaluation;
pub mod friction;
pub mod geometry;
pub mod history;
pub mod normal;
pub mod obstacle;
pub mod pairing;
pub mod point;
pub mod projection;
pub mod rigid;
#[cfg(test)]
mod rigid_tests;
pub mod search;
pub mod state;
pub mod surface;
pub mod target;
pub mod totals;
pub mod zone;
