//! Statics.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{IntegrationScheme, Method};
use crate::reader::at::At;

/// No inertia; time is the load parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Static {
    /// Number of equal load increments, >= 1, instead of `step`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub increments: Option<At<u32>>,
}

impl Static {
    pub(super) fn samples() -> Vec<Self> {
        vec![Self { increments: None }]
    }
}

impl IntegrationScheme for Static {
    fn method(&self) -> Method {
        Method::Static
    }
}
