//! `guard`: physics that a run must keep, or end.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::quantity::Number;

/// Limits of what a run may do: energy without a cause ends it with exit code 6, its results are kept; a step in which
/// surfaces in contact move too far is cut.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Guard {
    /// Largest energy without a cause, `numerical` of energy.csv, over the largest energy or work so far, > 0; not watched if
    /// absent. 0.05 ends a run that made or lost a twentieth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<Number>,
    /// Largest way that surfaces slide or roll over each other in one step, under friction, over the extent of their facets, > 0;
    /// 1.25 if absent. A longer step is cut as often as `time.cuts` allows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Number>,
}
