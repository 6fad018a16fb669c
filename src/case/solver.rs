//! `solver`: strategy, Newton iteration, linear solver; every key has a default.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::presets::Linear;
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
    /// In turn, by default both with symmetric matrices, in sweeps until they agree. The number of sweeps
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
        /// Matrix of both stages.
        #[serde(default)]
        matrix: StageMatrix,
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

/// Matrix of the stages of the staggered strategy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "StageMatrix")]
pub enum StageMatrix {
    /// The symmetric terms of its derivative, for methods that need symmetry.
    #[default]
    Symmetric,
    /// The complete derivative, for methods without this need. Over curved and deformable targets
    /// a stage takes far fewer iterations with it, and converges where it otherwise would not.
    Complete,
}
tagged!(StageMatrix, "matrix");

/// Newton iteration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Newton {
    /// Residual relative to the largest force, between 0 and 1, both excluded. Forces and
    /// displacements of a step have errors of about this size, relative to the largest ones. If
    /// absent: a tenth of the `accuracy` that is requested (`time`, in statics `slip`), else 1e-9
    /// for `scheme: conserving`, whose energy is as exact as the balance, for `strategy: staggered`
    /// and for the static start, else 1e-7.
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
