//! GMRES with ILU(1) on wider overlaps.
//!
//! The level of fill doubles the memory of the factors.

use super::{GMRES, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "GMRES with ILU(1) on wider overlaps: half the iterations of `gmres_asm_ilu`, twice the memory",
    options: &[
        GMRES[0],
        GMRES[1],
        GMRES[2],
        ("pc_type", "asm"),
        ("pc_asm_overlap", "2"),
        ("sub_pc_type", "ilu"),
        ("sub_pc_factor_levels", "1"),
    ],
    alone: &[("pc_type", "ilu"), ("pc_factor_levels", "1")],
    ..Preset::GMRES
};
