//! A coefficient that decays with the slip speed, `mu = mu_k + (mu_s - mu_k) exp(-|v_T| / v_d)` (2.27).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CoefficientOfFriction, CoefficientValue};
use crate::reader::findings::Findings;
use crate::reader::place::Place;
use crate::reader::quantity::{Number, Velocity};

/// kinetic + (static - kinetic) exp(-(slip speed / decay_velocity)). Falling, it acts as negative damping (`C_mu`).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stribeck {
    /// Coefficient at rest, >= 0.
    #[serde(rename = "static")]
    pub rest: Number,
    /// Coefficient at high speed, >= 0.
    pub kinetic: Number,
    /// Speed over which the coefficient falls \[m/s\], > 0.
    pub decay_velocity: Velocity,
}

impl Stribeck {
    /// From `mu_s`, `mu_k` \[-\] and the decay velocity `v_d` \[m/s\].
    pub fn of(rest: f64, kinetic: f64, decay_velocity: f64) -> Self {
        Self {
            rest: Number::new(rest),
            kinetic: Number::new(kinetic),
            decay_velocity: Velocity::new(decay_velocity),
        }
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![Self::of(1.2, 0.8, 0.1), Self::of(0.5, 0.9, 1e-3)]
    }
}

impl CoefficientOfFriction for Stribeck {
    fn evaluate(&self, _normal_traction: f64, speed: f64) -> CoefficientValue {
        let decay_velocity = self.decay_velocity.value;
        let excess = (self.rest.value - self.kinetic.value) * (-speed / decay_velocity).exp();
        CoefficientValue {
            value: self.kinetic.value + excess,
            by_traction: 0.0,
            by_speed: -excess / decay_velocity,
        }
    }

    fn depends_on_speed(&self) -> bool {
        true
    }

    fn check(&self, _place: Place, findings: &mut Findings) {
        findings.not_negative("the static coefficient", self.rest.value, self.rest.place);
        findings.not_negative("the kinetic coefficient", self.kinetic.value, self.kinetic.place);
        findings.positive("the decay velocity", self.decay_velocity);
    }
}
