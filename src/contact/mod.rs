//! Contact: obstacles, search and projection (2.2, 2.3), normal and friction laws (2.8, 2.9), the point kernel with
//! every term of (3.5) under its name, and what the points of a surface remember.
//!
//! A contact is a contactor surface against a rigid obstacle ([`rigid`]) or against the facets of a deformable body
//! ([`deformable`]); for the latter [`search`] gives each point its facet, which [`pairing`] keeps.
//!
//! Pure: no PETSc, no MPI, no case.

mod check;
pub mod curvature;
pub mod deformable;
#[cfg(test)]
mod deformable_tests;
pub mod evaluation;
pub mod friction;
pub mod geometry;
mod held;
pub mod history;
mod looks;
pub mod mortar;
pub mod multipliers;
pub mod normal;
pub mod obstacle;
#[cfg(test)]
mod pair_scene;
pub mod pairing;
pub mod passage;
pub mod point;
pub mod projection;
pub mod rigid;
#[cfg(test)]
mod rigid_tests;
pub mod search;
mod shield;
pub mod state;
pub mod surface;
pub mod target;
pub mod totals;
pub mod zone;
