//! Chung and Hulbert.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{IntegrationScheme, Method};
use crate::reader::findings::Findings;
use crate::reader::quantity::Number;

/// Chung, Hulbert with the spectral radius at infinity (0 to 1): second order, damps ringing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GeneralizedAlpha {
    /// Spectral radius at infinite frequency, between 0 and 1.
    pub spectral_radius: Number,
}

impl Default for GeneralizedAlpha {
    fn default() -> Self {
        Self { spectral_radius: Number::new(0.8) }
    }
}

impl GeneralizedAlpha {
    pub(super) fn samples() -> Vec<Self> {
        [0.0, 0.5, 0.8, 1.0].map(|radius| Self { spectral_radius: Number::new(radius) }).to_vec()
    }
}

impl IntegrationScheme for GeneralizedAlpha {
    fn method(&self) -> Method {
        Method::generalized_alpha(self.spectral_radius.value)
    }

    fn check(&self, found: &mut Findings) {
        super::within(found, "the spectral radius", &self.spectral_radius, [0.0, 1.0]);
    }
}
