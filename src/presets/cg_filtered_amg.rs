//! Conjugate gradients with the preconditioner of `filtered_amg`.

use super::{BOTH, CG, Implementation, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "conjugate gradients with the preconditioner of `filtered_amg`: large, symmetric, with contact",
    formats: BOTH,
    multigrid: true,
    implementation: Implementation::FilteredAmg,
    // On several ranks the preconditioner iterates, so the method has to be flexible.
    options: &[("ksp_type", "fcg"), CG[1], ("pc_type", "shell")],
    alone: &[CG[0]],
    ..Preset::CG
};
