//! Conjugate gradients with algebraic multigrid.
//!
//! Needs a symmetric matrix in scalar rows. Without the rigid-body modes it takes about twice the
//! iterations.

use super::{CG, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "conjugate gradients with algebraic multigrid and rigid-body modes: large, symmetric, static",
    multigrid: true,
    options: &[CG[0], CG[1], ("pc_type", "gamg")],
    ..Preset::CG
};
