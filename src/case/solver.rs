//! `solver`: strategy, Newton iteration, linear solver; every key has a default.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::place::At;
use super::quantity::Number;
use super::tagged::tagged;

/// How the equations of a step are solved.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Treatment of normal contact and friction.
    pub strategy: Strategy,
    /// Newton iteration.
    pub newton: Newton,
    /// Linear solver.
    pub linear: At<Linear>,
    /// Iterative linear solvers.
    pub krylov: Krylov,
}

/// Treatment of normal contact and friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Strategy")]
pub enum Strategy {
    /// Together, by Newton with the full non-symmetric tangent.
    #[default]
    Monolithic,
}
tagged!(Strategy, "strategy");

/// Newton iteration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Newton {
    /// Residual over the largest of the forces, between 0 and 1, both excluded.
    pub tolerance: Number,
    /// Iterations before the step is cut, >= 1.
    pub max_iterations: At<u32>,
    /// Whether a step that does not reduce the residual is shortened.
    pub line_search: bool,
    /// Whether early iterations solve the linear system only as well as they need (Eisenstat and Walker).
    pub inexact: bool,
}

impl Default for Newton {
    fn default() -> Self {
        Self { tolerance: Number::new(1e-9), max_iterations: 25.into(), line_search: true, inexact: true }
    }
}

/// Linear solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Linear")]
pub enum Linear {
    /// Chosen from size, dimension, inertia and symmetry; a solver that fails is followed by a stronger one.
    #[default]
    Auto,
    /// LU factorisation by MUMPS.
    Direct,
    /// GMRES with additive Schwarz of overlap 1 and incomplete LU.
    GmresAsmIlu,
    /// The same with overlap 2 and one level of fill: fewer iterations, more memory.
    GmresAsmIlu1,
    /// GMRES with algebraic multigrid and rigid-body modes.
    GmresAmg,
    /// Cholesky factorisation by MUMPS; symmetric systems only.
    Cholesky,
    /// Conjugate gradients scaled by the diagonal; symmetric systems only.
    CgJacobi,
    /// Conjugate gradients with incomplete Cholesky; symmetric systems only.
    CgIcc,
    /// Conjugate gradients with algebraic multigrid; symmetric systems only.
    CgAmg,
}
tagged!(Linear, "linear solver");

impl Linear {
    /// Every linear solver.
    pub const ALL: [Self; 9] = [
        Self::Auto,
        Self::Direct,
        Self::GmresAsmIlu,
        Self::GmresAsmIlu1,
        Self::GmresAmg,
        Self::Cholesky,
        Self::CgJacobi,
        Self::CgIcc,
        Self::CgAmg,
    ];

    /// The name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Direct => "direct",
            Self::GmresAsmIlu => "gmres_asm_ilu",
            Self::GmresAsmIlu1 => "gmres_asm_ilu1",
            Self::GmresAmg => "gmres_amg",
            Self::Cholesky => "cholesky",
            Self::CgJacobi => "cg_jacobi",
            Self::CgIcc => "cg_icc",
            Self::CgAmg => "cg_amg",
        }
    }

    /// Whether the method needs a symmetric matrix, hence no friction and no follower load.
    pub fn needs_symmetry(self) -> bool {
        matches!(self, Self::Cholesky | Self::CgJacobi | Self::CgIcc | Self::CgAmg)
    }
}

/// Iterative linear solvers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Krylov {
    /// True residual over right-hand side, between 0 and 1, both excluded; with `newton.inexact` the tightest that is asked.
    pub tolerance: Number,
}

impl Default for Krylov {
    fn default() -> Self {
        Self { tolerance: Number::new(1e-8) }
    }
}
