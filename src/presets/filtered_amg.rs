//! GMRES preconditioned by a multigrid cycle for the bodies and a factorisation of the nodes in
//! contact before and after it.
//!
//! `src/solvers/filtered_amg.rs` implements the preconditioner.

use super::{BOTH, GMRES, Implementation, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "GMRES with multigrid for the bodies and a factorisation of the nodes in contact: mostly slower \
            than `filtered_ilu`",
    formats: BOTH,
    multigrid: true,
    implementation: Implementation::FilteredAmg,
    // On several ranks the preconditioner iterates, so the method has to be flexible.
    options: &[("ksp_type", "fgmres"), GMRES[1], GMRES[2], ("pc_type", "shell")],
    alone: &[GMRES[0]],
    ..Preset::GMRES
};
