//! LU factorisation by MUMPS.
//!
//! Solves every matrix that is not singular. In 3D the factors grow with the power 4/3 of the number of
//! unknowns. Every ladder ends with it.

use super::{BOTH, Preset};

pub(super) const PRESET: Preset = Preset {
    about: "LU factorisation by MUMPS: any matrix, memory grows faster than the problem",
    formats: BOTH,
    options: &[
        ("ksp_type", "preonly"),
        ("pc_type", "lu"),
        ("pc_factor_mat_solver_type", "mumps"),
        ("mat_mumps_icntl_7", "5"),
        ("mat_mumps_icntl_14", "50"),
    ],
    ..Preset::FACTORISATION
};
