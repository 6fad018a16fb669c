//! The midpoint rule.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{IntegrationScheme, Method};

/// Balance in the middle of the step: second order, keeps linear and angular momentum, damps nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Midpoint {}

impl Midpoint {
    pub(super) fn samples() -> Vec<Self> {
        vec![Self {}]
    }
}

impl IntegrationScheme for Midpoint {
    fn method(&self) -> Method {
        Method::Midpoint
    }
}
