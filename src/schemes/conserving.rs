//! The conserving scheme.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{IntegrationScheme, Method};

/// Midpoint rule with energy-conserving forces, for impact: conserves energy, linear and angular
/// momentum, no numerical damping.
///
/// Contact acts on the reference area. Best with `mass: redistributed`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Conserving {}

impl Conserving {
    pub(super) fn samples() -> Vec<Self> {
        vec![Self {}]
    }
}

impl IntegrationScheme for Conserving {
    fn method(&self) -> Method {
        Method::Conserving
    }
}
