//! GMRES preconditioned by a coarse space and incomplete factors on overlapping subdomains, and a
//! factorisation of the nodes in contact after them.
//!
//! `src/solvers/filtered_ilu.rs` implements the preconditioner.

use super::{BOTH, GMRES, Implementation, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "GMRES with ILU(0), a coarse space and a factorisation of the nodes in contact: large problems, ties, \
            and nearly incompressible bodies",
    formats: BOTH,
    implementation: Implementation::FilteredIlu,
    // On several ranks the preconditioner iterates, so the method has to be flexible.
    options: &[("ksp_type", "fgmres"), GMRES[1], GMRES[2], ("pc_type", "shell")],
    alone: &[GMRES[0]],
    ..Preset::GMRES
};
