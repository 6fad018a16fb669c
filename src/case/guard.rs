//! `guard`: physics that a run must keep, or end.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::quantity::Number;

/// Limits of a run. If unexplained energy exceeds its limit, the run ends with exit code 6 and
/// keeps its results. A step in which surfaces in contact move too far is cut.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Guard {
    /// Largest unexplained energy, `numerical` of energy.csv, relative to the largest energy or
    /// work so far, > 0; no limit if absent. 0.05 ends a run that gained or lost a twentieth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<Number>,
    /// Largest distance by which surfaces with friction slide or roll over each other in one step,
    /// relative to the size of their facets, > 0; 1.25 if absent. A longer step is cut as often as
    /// `time.cuts` allows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Number>,
}
