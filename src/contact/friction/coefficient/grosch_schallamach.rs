//! Friction of rubber after Grosch and Schallamach, `mu = mu_0 (t_n / E)^e` (2.26).
//!
//! The paper prints `e = +1/9`, which contradicts its own compliance parameters (2.28) and the
//! measured decrease of rubber friction with pressure. The law with `-1/9` agrees with both.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CoefficientOfFriction, CoefficientValue};
use crate::reader::findings::Findings;
use crate::reader::place::Place;
use crate::reader::quantity::{Number, Pressure};

/// reference * (t_n / modulus)^exponent: rubber, whose coefficient falls with pressure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroschSchallamach {
    /// mu_0, >= 0: the coefficient at t_n = modulus.
    pub reference: Number,
    /// Normal traction at which the coefficient is the reference \[Pa\], > 0.
    pub modulus: Pressure,
    /// Between -1 and 1, -1 excluded; -1/9 if absent. The paper prints +1/9, which contradicts its own
    /// constants and measurement.
    #[serde(default = "default_exponent")]
    pub exponent: Number,
}

fn default_exponent() -> Number {
    Number::new(GroschSchallamach::EXPONENT)
}

impl GroschSchallamach {
    /// The exponent that the paper's compliance parameters imply.
    pub const EXPONENT: f64 = -1.0 / 9.0;

    /// From `mu_0` \[-\], `E` \[Pa\] and the exponent `e` \[-\].
    pub fn of(reference: f64, modulus: f64, exponent: f64) -> Self {
        Self {
            reference: Number::new(reference),
            modulus: Pressure::new(modulus),
            exponent: Number::new(exponent),
        }
    }

    pub(super) fn samples() -> Vec<Self> {
        [-1.0 / 9.0, 1.0 / 9.0, -0.5].into_iter().map(|exponent| Self::of(1.0, 5e6, exponent)).collect()
    }
}

impl CoefficientOfFriction for GroschSchallamach {
    fn evaluate(&self, normal_traction: f64, _speed: f64) -> CoefficientValue {
        // As t_n -> 0 the coefficient is unbounded (the bound mu t_n is not), so the ratio has a
        // lower limit.
        let ratio = (normal_traction / self.modulus.value).max(f64::MIN_POSITIVE);
        let value = (self.reference.value * ratio.powf(self.exponent.value)).min(f64::MAX);
        CoefficientValue { value, by_traction: self.exponent.value * value, by_speed: 0.0 }
    }

    fn depends_on_pressure(&self) -> bool {
        true
    }

    fn check(&self, _place: Place, findings: &mut Findings) {
        findings.not_negative("the reference coefficient", self.reference.value, self.reference.place);
        findings.positive("the modulus", self.modulus);
        let exponent = self.exponent.value;
        let fits = exponent > -1.0 && exponent <= 1.0;
        let message = format!("the exponent must be > -1 and <= 1, found {exponent}");
        findings.require(fits, self.exponent.place, message);
        if !fits {
            findings
                .cure("use -0.1111111111 for rubber; the sign of +0.1111111111 in the paper is a misprint");
        }
    }
}
