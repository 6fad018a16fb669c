//! Contact: obstacles (2.2), normal and friction laws (2.8), (2.9), every term of (3.5) under its
//! name, and the history of contact points.
//!
//! A contactor surface is in contact with a rigid body, at rest or moving ([`rigid`]), or with the
//! facets of a deformable body.
//! The contact points are the vertices of the contactor ([`mortar`]).
//!
//! This module is independent of PETSc, MPI and the case file.

mod augmentation;
pub mod damping;
pub mod evaluation;
pub mod friction;
mod held;
pub mod history;
pub mod linearised;
pub mod mortar;
pub mod multipliers;
pub mod nodal;
pub mod normal;
pub mod obstacle;
#[cfg(test)]
mod pair_scene;
pub mod passage;
pub mod point;
pub mod rigid;
pub mod state;
pub mod surface;
pub mod target;
pub mod totals;
