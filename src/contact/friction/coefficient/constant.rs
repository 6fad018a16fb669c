//! A constant coefficient.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CoefficientOfFriction, CoefficientValue};
use crate::reader::findings::Findings;
use crate::reader::place::Place;

/// Constant coefficient, >= 0; in the case file the number alone is enough.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Constant(pub f64);

impl Constant {
    pub(super) fn samples() -> Vec<Self> {
        vec![Self(0.3), Self(1e3)]
    }
}

impl CoefficientOfFriction for Constant {
    fn evaluate(&self, _normal_traction: f64, _speed: f64) -> CoefficientValue {
        CoefficientValue { value: self.0, by_traction: 0.0, by_speed: 0.0 }
    }

    fn check(&self, place: Place, findings: &mut Findings) {
        findings.not_negative("the coefficient of friction", self.0, place);
    }
}
