//! Conjugate gradients with incomplete Cholesky.
//!
//! Needs a symmetric matrix in scalar rows.

use super::{CG, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "conjugate gradients with incomplete Cholesky: symmetric problems with inertia",
    options: &[
        CG[0],
        CG[1],
        ("pc_type", "asm"),
        ("pc_asm_type", "basic"),
        ("pc_asm_overlap", "1"),
        ("sub_pc_type", "icc"),
    ],
    alone: &[("pc_type", "icc")],
    ..Preset::CG
};
