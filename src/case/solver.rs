//! `solver`: strategy, Newton iteration, linear solver; every key has a default.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::at::At;
use crate::reader::quantity::Number;
use crate::reader::tagged::tagged;

/// How the equations of a step are solved.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Treatment of normal contact and friction.
    pub strategy: At<Strategy>,
    /// Newton iteration.
    pub newton: Newton,
    /// Linear solver.
    pub linear: At<Linear>,
    /// Iterative linear solvers.
    pub krylov: Krylov,
}

/// Treatment of normal contact and friction.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "Strategy")]
pub enum Strategy {
    /// Together, by Newton with the full non-symmetric tangent.
    #[default]
    Monolithic,
    /// In turn, both with symmetric matrices, in sweeps until they agree. The number of sweeps
    /// grows with the coefficient of friction, and sweeps that overshoot are relaxed. Without
    /// friction the step is solved as by `monolithic`.
    Staggered {
        /// Error of the displacements relative to the increment of the step, and of friction forces
        /// relative to normal forces, estimated from distance and contraction of the stages;
        /// between 0 and 1, both excluded. The full system is balanced to three tenths of Newton's
        /// tolerance as well.
        #[serde(default = "sweep_tolerance")]
        tolerance: Number,
        /// Largest number of sweeps over both stages before the step is cut, >= 1.
        #[serde(default = "sweeps")]
        max_sweeps: At<u32>,
        /// Friction in the first stage.
        #[serde(default)]
        variant: Variant,
    },
}
tagged!(Strategy, "strategy");

fn sweep_tolerance() -> Number {
    Number::new(1e-6)
}

fn sweeps() -> At<u32> {
    150.into()
}

/// Friction in stage I of the staggered strategy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Variant")]
pub enum Variant {
    /// The friction bound is frozen: friction follows the slip up to it.
    #[default]
    FrozenBound,
    /// The friction traction is frozen: simpler, but contracts less well. It needs one and a half
    /// to four times as many solves for the same result.
    FrozenTraction,
}
tagged!(Variant, "variant");

/// Newton iteration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Newton {
    /// Residual relative to the largest force, between 0 and 1, both excluded. Forces and
    /// displacements of a step have errors of about this size, relative to the largest ones. If
    /// absent: a tenth of the `accuracy` that is requested (`time`, in statics `slip`), else 1e-9
    /// for `scheme: conserving`, whose energy is as exact as the balance, else 1e-7.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Number>,
    /// Largest number of iterations before the step is cut, >= 1.
    pub max_iterations: At<u32>,
    /// Whether corrections that do not reduce the residual are shortened.
    pub line_search: bool,
    /// Whether early iterations solve the linear system only as accurately as needed (Eisenstat and
    /// Walker). If absent: true from 20 000 unknowns on and in every case with `accuracy`. Exact
    /// solves take the same number of iterations on any number of ranks. If true and the step
    /// length is controlled by the error in time, the tangent of an earlier step is reused as long
    /// as one correction with it converges.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inexact: Option<bool>,
}

impl Default for Newton {
    fn default() -> Self {
        Self { tolerance: None, max_iterations: 25.into(), line_search: true, inexact: None }
    }
}

/// Linear solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "Linear")]
pub enum Linear {
    /// Chosen from size, dimension, inertia and symmetry; if it fails, a more robust solver is
    /// used.
    #[default]
    Auto,
    /// LU factorisation by MUMPS.
    Direct,
    /// GMRES with additive Schwarz of overlap 1 and incomplete LU.
    GmresAsmIlu,
    /// GMRES with additive Schwarz of overlap 2 and incomplete LU with one level of fill: fewer
    /// iterations, more memory.
    GmresAsmIlu1,
    /// FGMRES with the two stages of the staggered scheme as preconditioner.
    TwoStage {
        /// Operator of the second half.
        #[serde(default)]
        second: Second,
        /// Solver for the symmetric matrices of the stages.
        #[serde(default)]
        inner: Inner,
    },
    /// GMRES preconditioned by a multigrid cycle for the bodies and a factorisation of the nodes in
    /// contact before and after it.
    FilteredAmg {
        /// Element layers around the facets in contact that are factorised with them.
        #[serde(default = "layers")]
        layers: u32,
        /// When the factorisation is used.
        #[serde(default)]
        passes: Passes,
    },
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
    /// Conjugate gradients with the preconditioner of `filtered_amg`; symmetric systems only.
    CgFilteredAmg {
        /// Element layers around the facets in contact that are factorised with them.
        #[serde(default = "layers")]
        layers: u32,
    },
}
tagged!(Linear, "linear solver");

const LAYERS: u32 = 2;

fn layers() -> u32 {
    LAYERS
}

/// When the filtered multigrid solves for the nodes in contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Passes")]
pub enum Passes {
    /// Before and after the multigrid cycle.
    #[default]
    Around,
    /// Only before it, to measure the benefit of the second solve.
    Before,
}
tagged!(Passes, "order of passes");

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
    /// The linear solver that it is; none where it is to be chosen.
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

impl Linear {
    /// Every linear solver.
    pub const ALL: [Self; 12] = [
        Self::Auto,
        Self::Direct,
        Self::GmresAsmIlu,
        Self::GmresAsmIlu1,
        Self::TwoStage { second: Second::Coupling, inner: Inner::Auto },
        Self::FilteredAmg { layers: LAYERS, passes: Passes::Around },
        Self::GmresAmg,
        Self::Cholesky,
        Self::CgJacobi,
        Self::CgIcc,
        Self::CgAmg,
        Self::CgFilteredAmg { layers: LAYERS },
    ];

    /// The name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Direct => "direct",
            Self::GmresAsmIlu => "gmres_asm_ilu",
            Self::GmresAsmIlu1 => "gmres_asm_ilu1",
            Self::TwoStage { .. } => "two_stage",
            Self::FilteredAmg { .. } => "filtered_amg",
            Self::GmresAmg => "gmres_amg",
            Self::Cholesky => "cholesky",
            Self::CgJacobi => "cg_jacobi",
            Self::CgIcc => "cg_icc",
            Self::CgAmg => "cg_amg",
            Self::CgFilteredAmg { .. } => "cg_filtered_amg",
        }
    }

    /// Whether the method needs a symmetric matrix, hence no friction and no follower load.
    pub fn needs_symmetry(self) -> bool {
        matches!(
            self,
            Self::Cholesky | Self::CgJacobi | Self::CgIcc | Self::CgAmg | Self::CgFilteredAmg { .. }
        )
    }
}

/// Iterative linear solvers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Krylov {
    /// True residual relative to the right-hand side, between 0 and 1, both excluded; with
    /// `newton.inexact` the smallest tolerance.
    pub tolerance: Number,
}

impl Default for Krylov {
    fn default() -> Self {
        Self { tolerance: Number::new(1e-8) }
    }
}
