//! Damping in proportion to the normal law, after Hunt and Crossley.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Closing, DampedTraction, NormalDamper};
use crate::contact::normal::NormalResponse;
use crate::reader::findings::Findings;
use crate::reader::quantity::InverseVelocity;

/// Damping in proportion to the pressure: t_n = law(g) * (1 + factor * closing speed), never below zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HuntCrossley {
    /// Factor of the closing speed [s/m], > 0.
    pub factor: InverseVelocity,
}

impl HuntCrossley {
    /// The law with this factor of the closing speed [s/m].
    pub fn of(factor: f64) -> Self {
        Self { factor: InverseVelocity::new(factor) }
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![Self::of(0.3), Self::of(2.0)]
    }
}

impl NormalDamper for HuntCrossley {
    fn damp(&self, normal: &NormalResponse, closing: &Closing) -> DampedTraction {
        let factor = self.factor.value;
        DampedTraction {
            traction: factor * closing.speed * normal.traction,
            by_gap: factor * closing.speed * normal.derivative,
            by_speed: factor * normal.traction,
        }
    }

    fn check(&self, findings: &mut Findings) {
        findings.positive("the factor", self.factor);
    }
}
