//! Linear dashpot beside the normal law, after Kelvin and Voigt.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Closing, DampedTraction, NormalDamper};
use crate::contact::normal::NormalResponse;
use crate::reader::findings::Findings;
use crate::reader::quantity::AreaViscosity;

/// Linear dashpot: t_n = law(g) + viscosity * closing speed, while the point is in contact and never below zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Kelvin {
    /// Viscosity per area [Pa s/m], > 0.
    pub viscosity: AreaViscosity,
}

impl Kelvin {
    /// The dashpot with this viscosity [Pa s/m].
    pub fn of(viscosity: f64) -> Self {
        Self { viscosity: AreaViscosity::new(viscosity) }
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![Self::of(1e3), Self::of(2e6)]
    }
}

impl NormalDamper for Kelvin {
    fn damp(&self, _: &NormalResponse, closing: &Closing) -> DampedTraction {
        let (part, part_by_gap) = closing.part_in_contact();
        let full = self.viscosity.value * closing.speed;
        DampedTraction {
            traction: full * part,
            by_gap: full * part_by_gap,
            by_speed: self.viscosity.value * part,
        }
    }

    fn check(&self, findings: &mut Findings) {
        findings.positive("the viscosity", self.viscosity);
    }
}
