//! GMRES with algebraic multigrid and incomplete LU in turn.
//!
//! Multigrid alone breaks down on stiff contact, so incomplete LU follows each cycle.

use super::{AIJ, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "GMRES with multigrid and ILU in turn: large and static, without stiff contact",
    formats: AIJ,
    multigrid: true,
    options: &[
        ("ksp_type", "fgmres"),
        ("ksp_gmres_restart", "100"),
        ("pc_type", "composite"),
        ("pc_composite_type", "multiplicative"),
        ("pc_composite_pcs", "gamg,asm"),
        ("sub_1_pc_asm_overlap", "1"),
        ("sub_1_sub_pc_type", "ilu"),
    ],
    alone: &[("pc_composite_pcs", "gamg,ilu")],
    ..Preset::GMRES
};
