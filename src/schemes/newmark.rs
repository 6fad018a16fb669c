//! Newmark's method.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{IntegrationScheme, Method};
use crate::reader::findings::Findings;
use crate::reader::quantity::Number;

/// Newmark with beta and gamma, the paper's alpha and beta; 1/4 and 1/2 is its average acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Newmark {
    /// Between 0 (excluded) and 0.5.
    pub beta: Number,
    /// Between 0.5 and 1.
    pub gamma: Number,
}

impl Default for Newmark {
    fn default() -> Self {
        Self { beta: Number::new(0.25), gamma: Number::new(0.5) }
    }
}

impl Newmark {
    pub(super) fn samples() -> Vec<Self> {
        vec![Self::default(), Self { beta: Number::new(0.3025), gamma: Number::new(0.6) }]
    }
}

impl IntegrationScheme for Newmark {
    fn method(&self) -> Method {
        Method::newmark(self.beta.value, self.gamma.value)
    }

    fn check(&self, found: &mut Findings) {
        let Self { beta, gamma } = self;
        super::within(found, "beta", beta, [0.0, 0.5]);
        found.require(
            beta.value != 0.0,
            beta.place,
            "beta = 0 is an explicit scheme, which this program has not",
        );
        super::within(found, "gamma", gamma, [0.5, 1.0]);
    }
}
