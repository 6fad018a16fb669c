//! Hilber, Hughes and Taylor.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{IntegrationScheme, Method};
use crate::reader::findings::Findings;
use crate::reader::quantity::Number;

/// Hilber, Hughes, Taylor with the spectral radius at infinity (1/2 to 1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Hht {
    /// Spectral radius at infinite frequency, between 0.5 and 1; 1 is Newmark.
    pub spectral_radius: Number,
}

impl Default for Hht {
    fn default() -> Self {
        Self { spectral_radius: Number::new(0.8) }
    }
}

impl Hht {
    pub(super) fn samples() -> Vec<Self> {
        [0.5, 0.8, 1.0].map(|radius| Self { spectral_radius: Number::new(radius) }).to_vec()
    }
}

impl IntegrationScheme for Hht {
    fn method(&self) -> Method {
        Method::hht(self.spectral_radius.value)
    }

    fn check(&self, found: &mut Findings) {
        super::within(found, "the spectral radius of hht", &self.spectral_radius, [0.5, 1.0]);
    }
}
