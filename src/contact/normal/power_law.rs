//! Power law of Oden and Martins, `t_n = c_N <-g>^m_N` (2.9).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{NormalContact, NormalResponse};
use crate::reader::findings::Findings;
use crate::reader::power_stiffness::PowerStiffness;
use crate::reader::quantity::Number;

/// t_n = stiffness * penetration^exponent, (2.9).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NormalPowerLaw {
    /// c_N [Pa/m^exponent], > 0.
    pub stiffness: PowerStiffness,
    /// m_N, >= 1.
    pub exponent: Number,
}

impl NormalPowerLaw {
    /// From `c_N` \[Pa/m^m_N\] and `m_N` \[-\].
    pub fn of(stiffness: f64, exponent: f64) -> Self {
        Self { stiffness: PowerStiffness::new(stiffness), exponent: Number::new(exponent) }
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![Self::of(1e10, 1.0), Self::of(1e14, 2.0), Self::of(1e18, 3.0), Self::of(1e3, 1.5)]
    }
}

impl NormalContact for NormalPowerLaw {
    fn closed(&self, penetration: f64) -> NormalResponse {
        let (c, m) = (self.stiffness.value, self.exponent.value);
        let traction = c * penetration.powf(m);
        NormalResponse {
            traction,
            derivative: -m * c * penetration.powf(m - 1.0),
            potential: traction * penetration / (m + 1.0),
        }
    }

    fn penetration(&self, pressure: f64) -> f64 {
        (pressure / self.stiffness.value).powf(1.0 / self.exponent.value)
    }

    fn check(&self, findings: &mut Findings) {
        self.stiffness.check(self.exponent, findings);
        let exponent = self.exponent.value;
        if exponent > 0.0 && exponent < 1.0 {
            findings.say(self.exponent.place, format!("the normal exponent must be >= 1, found {exponent}"));
            findings.cure("with an exponent below 1 contact is infinitely stiff at first touch; use 1 to 3");
        }
    }
}
