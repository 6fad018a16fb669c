//! Contact: obstacles (2.2), normal and friction laws (2.8), (2.9), every term of (3.5) under its name, and what contact points remember.
//!
//! A contact is a contactor surface against a rigid obstacle or the facets of a deformable body. Its points are the vertices of the
//! contactor ([`mortar`]).
//!
//! Pure: no PETSc, no MPI, no case.

mod augmentation;
pub mod evaluation;
pub mod friction;
mod held;
pub mod history;
pub mod mortar;
pub mod multipliers;
pub mod nodal;
pub mod normal;
pub mod obstacle;
#[cfg(test)]
mod pair_scene;
pub mod passage;
pub mod point;
pub mod state;
pub mod surface;
pub mod target;
pub mod totals;
pub mod zone;
