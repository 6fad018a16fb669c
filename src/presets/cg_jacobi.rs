//! Conjugate gradients scaled by the diagonal.
//!
//! Needs a symmetric matrix.

use super::{BOTH, CG, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "conjugate gradients scaled by the diagonal: symmetric, for the mass matrix",
    formats: BOTH,
    options: &[CG[0], CG[1], ("pc_type", "jacobi")],
    ..Preset::CG
};
