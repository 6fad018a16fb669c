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
    /// In turn, both with symmetric matrices, until they agree: in more sweeps the larger the coefficient of friction, each a part
    /// of the way where whole ones overshoot. Without friction nothing is left to take in turn, and the step is solved as by
    /// `monolithic`.
    Staggered {
        /// Error of the displacements over the increment of the step, and of friction forces over normal forces, as distance
        /// and contraction of the stages tell them; between 0 and 1, both excluded. The full system is balanced to
        /// three tenths of Newton's tolerance as well.
        #[serde(default = "sweep_tolerance")]
        tolerance: Number,
        /// Sweeps over both stages before the step is cut, >= 1.
        #[serde(default = "sweeps")]
        max_sweeps: At<u32>,
        /// What the first stage knows of friction.
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

/// What stage I of the staggered strategy knows of friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Variant")]
pub enum Variant {
    /// The bound: friction follows the slip up to it.
    #[default]
    FrozenBound,
    /// The friction traction itself: simpler, and contracts less well. The same answer for one and a half to four times as
    /// many solves.
    FrozenTraction,
}
tagged!(Variant, "variant");

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
    /// Whether early iterations solve the linear system only as accurately as they need (Eisenstat and Walker). If absent: true from
    /// 20 000 unknowns on and in every case with `accuracy`. Exact solves take the same number of iterations on any number of ranks.
    /// If true and steps follow their error in time, the tangent of an earlier step is reused while one correction with it converges.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inexact: Option<bool>,
}

impl Default for Newton {
    fn default() -> Self {
        Self { tolerance: Number::new(1e-9), max_iterations: 25.into(), line_search: true, inexact: None }
    }
}

/// Iterative linear solvers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Krylov {
    /// True residual over right-hand side, between 0 and 1, both excluded; with `newton.inexact` the tightest one.
    pub tolerance: Number,
}

impl Default for Krylov {
    fn default() -> Self {
        Self { tolerance: Number::new(1e-8) }
    }
}
