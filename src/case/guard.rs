//! `guard`: physics that a run must keep, or end.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::Number;

/// Limits that end a run with exit code 6 when they are passed; its results are kept.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Guard {
    /// Largest energy without a cause, `numerical` of energy.csv, over the largest energy or work so far, > 0; not watched if
    /// absent. 0.05 ends a run that made or lost a twentieth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<Number>,
}
