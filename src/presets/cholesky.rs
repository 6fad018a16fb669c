//! Cholesky factorisation by MUMPS.
//!
//! Needs a symmetric matrix.

use super::Preset;

pub(super) const PRESET: Preset = Preset {
    about: "symmetric factorisation by MUMPS: half the work of `direct`",
    symmetric: true,
    options: &[
        ("ksp_type", "preonly"),
        ("pc_type", "cholesky"),
        ("pc_factor_mat_solver_type", "mumps"),
        ("mat_mumps_icntl_7", "5"),
        ("mat_mumps_icntl_14", "50"),
    ],
    ..Preset::FACTORISATION
};
