//! Contact: obstacles (2.2), normal and friction laws (2.8, 2.9), the point kernel with every term of (3.5) under its name, and what the
//! points of a surface remember.
//!
//! A contact is a contactor surface against a rigid obstacle ([`rigid`]), whose points are those of a rule on its facets, or against the
//! facets of a deformable body ([`mortar`]), whose points are its vertices.
//!
//! Pure: no PETSc, no MPI, no case.

mod check;
pub mod curvature;
pub mod evaluation;
pub mod friction;
pub mod geometry;
mod held;
pub mod history;
pub mod mortar;
pub mod multipliers;
pub mod normal;
pub mod obstacle;
#[cfg(test)]
mod pair_scene;
pub mod passage;
pub mod point;
pub mod rigid;
#[cfg(test)]
mod rigid_tests;
pub mod state;
pub mod surface;
pub mod target;
pub mod totals;
pub mod zone;
