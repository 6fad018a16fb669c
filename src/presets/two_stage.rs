//! FGMRES with the two stages of the staggered scheme as preconditioner.
//!
//! The stages have symmetric matrices, which a preset for symmetric matrices solves.
//! `src/solvers/two_stage.rs` implements the preconditioner.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{AIJ, Implementation, Linear, Preset};
use crate::reader::tagged::tagged;

pub(super) const PRESET: Preset = Preset {
    about: "FGMRES with normal contact and friction in turn, each with a symmetric solver",
    formats: AIJ,
    implementation: Implementation::TwoStage,
    options: &[("ksp_type", "fgmres"), ("ksp_gmres_restart", "100"), ("pc_type", "shell")],
    ..Preset::GMRES
};

/// Parameters of the two-stage preconditioner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwoStage {
    /// Operator of the second half.
    pub second: Second,
    /// Solver for the symmetric matrices of the stages.
    pub inner: Inner,
}

/// Operator of the second half of the two-stage preconditioner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Second")]
pub enum Second {
    /// The operator of stage I again, which corrects the friction caused by new normal tractions.
    #[default]
    Coupling,
    /// The operator of stage II, without normal contact stiffness, with the normal components at
    /// contact nodes fixed.
    FrictionStage,
}
tagged!(Second, "second stage");

/// Solver for the symmetric matrices of the two-stage preconditioner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Inner")]
pub enum Inner {
    /// Chosen from size, dimension and inertia.
    #[default]
    Auto,
    /// Cholesky factorisation by MUMPS.
    Cholesky,
    /// Conjugate gradients scaled by the diagonal.
    CgJacobi,
    /// Conjugate gradients with incomplete Cholesky.
    CgIcc,
    /// Conjugate gradients with algebraic multigrid.
    CgAmg,
}
tagged!(Inner, "inner solver");

impl Inner {
    /// The linear solver; `None` if it is to be chosen.
    pub fn linear(self) -> Option<Linear> {
        match self {
            Self::Auto => None,
            Self::Cholesky => Some(Linear::Cholesky),
            Self::CgJacobi => Some(Linear::CgJacobi),
            Self::CgIcc => Some(Linear::CgIcc),
            Self::CgAmg => Some(Linear::CgAmg),
        }
    }
}
