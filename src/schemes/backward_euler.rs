//! Backward Euler.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{IntegrationScheme, Method};

/// First order, strong damping, the most robust.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BackwardEuler {}

impl BackwardEuler {
    pub(super) fn samples() -> Vec<Self> {
        vec![Self {}]
    }
}

impl IntegrationScheme for BackwardEuler {
    fn method(&self) -> Method {
        Method::BackwardEuler
    }
}
