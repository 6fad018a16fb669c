//! GMRES with ILU(0) on overlapping subdomains.
//!
//! The overlap is at least 1: block Jacobi needs an order of magnitude more iterations if a partition
//! boundary meets the contact zone. The program implements the subdomains. These options apply when the
//! user sets some of them.

use super::{GMRES, Implementation, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "GMRES with ILU(0) on overlapping subdomains: best in 3D and with inertia, also with contact",
    implementation: Implementation::Overlapping,
    options: &[
        GMRES[0],
        GMRES[1],
        GMRES[2],
        ("pc_type", "asm"),
        ("pc_asm_overlap", "1"),
        ("sub_pc_type", "ilu"),
    ],
    alone: &[("pc_type", "ilu")],
    ..Preset::GMRES
};
