//! `time`: from when to when, in which steps, by which scheme.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::at::At;
use crate::reader::quantity::Duration;
use crate::schemes::Scheme;

/// Time and its discretisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// End \[s\], > 0; the start is 0. In statics time is only the load parameter.
    pub end: Duration,
    /// Largest step \[s\], between 0 and end. In statics `increments` of the scheme can be given
    /// instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Duration>,
    /// Integration scheme.
    #[serde(default)]
    pub scheme: At<Scheme>,
    /// How often a failed step is halved before the run ends; the step grows again after both
    /// halves succeed.
    #[serde(default = "five")]
    pub cuts: At<u32>,
}

impl Time {
    /// The largest step \[s\]; the whole time where a case is not completed.
    pub fn step(&self) -> f64 {
        self.step.map_or(self.end.value, |step| step.value)
    }
}

fn five() -> At<u32> {
    5.into()
}
