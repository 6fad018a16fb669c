//! The midpoint rule.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{IntegrationScheme, Method};

/// Midpoint rule: second order, conserves linear and angular momentum, no numerical damping.
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
