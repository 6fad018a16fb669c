//! Penalty law `t_n = <-g> / normal_compliance` (2.8).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{NormalContact, NormalLaw, NormalResponse, PressedSide};
use crate::reader::findings::Findings;
use crate::reader::quantity::{Compliance, Length};

/// t_n = penetration / compliance, (2.8). With neither key the stiffness follows from the softer side's modulus and edge length.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Penalty {
    /// Normal compliance [m/Pa], > 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compliance: Option<Compliance>,
    /// Largest penetration that is acceptable \[m\], > 0; the compliance is derived from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub penetration: Option<Length>,
}

impl Penalty {
    /// Ratio of pressure to modulus at which the accepted penetration is reached. Beyond it bodies
    /// of this kind have lost a tenth of their height.
    const REFERENCE_PRESSURE: f64 = 0.1;

    /// Stiffness of the derived penalty relative to that of a layer of elements: 5 % of h at a
    /// pressure of E.
    const STIFFNESS_RATIO: f64 = 20.0;

    /// The law with this compliance [m/Pa].
    pub fn of(compliance: f64) -> Self {
        Self { compliance: Some(Compliance::new(compliance)), penetration: None }
    }

    /// `eps_n` [m/Pa]; infinite before the law is [completed](NormalContact::completed).
    fn normal_compliance(&self) -> f64 {
        self.compliance.map_or(f64::INFINITY, |compliance| compliance.value)
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![Self::of(1e-10), Self::of(1e-2)]
    }
}

impl NormalContact for Penalty {
    fn closed(&self, penetration: f64) -> NormalResponse {
        let compliance = self.normal_compliance();
        let traction = penetration / compliance;
        NormalResponse { traction, derivative: -1.0 / compliance, potential: 0.5 * penetration * traction }
    }

    fn penetration(&self, pressure: f64) -> f64 {
        pressure * self.normal_compliance()
    }

    fn check(&self, findings: &mut Findings) {
        if let (Some(_), Some(penetration)) = (self.compliance, self.penetration) {
            let message = "a penalty is given by its compliance or by a penetration, not by both";
            findings.say(penetration.place, message);
        }
        self.compliance.into_iter().for_each(|value| findings.positive("the compliance", value));
        self.penetration.into_iter().for_each(|value| findings.positive("the penetration", value));
    }

    fn completed(&self, side: &PressedSide) -> Option<NormalLaw> {
        let modulus = side.young_modulus;
        let compliance = match (self.compliance, self.penetration) {
            (Some(_), _) => return None,
            (None, Some(penetration)) => penetration.value / (Self::REFERENCE_PRESSURE * modulus),
            (None, None) => side.facet_size / (Self::STIFFNESS_RATIO * modulus),
        };
        Some(Self::of(compliance).into())
    }

    fn accepted_penetration(&self) -> Option<f64> {
        self.penetration.filter(|_| self.compliance.is_none()).map(|penetration| penetration.value)
    }

    fn linear_compliance(&self) -> Option<f64> {
        Some(self.normal_compliance())
    }

    fn stiffened(&self, factor: f64) -> Option<NormalLaw> {
        let compliance = self.normal_compliance() / factor;
        (compliance > 0.0 && compliance.is_finite()).then(|| Self::of(compliance).into())
    }
}
