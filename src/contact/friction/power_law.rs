//! Bound of the compliance law, `b = c_T <-g>^m_T` (2.9).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Bound, FrictionBound, Pressed, Regularization};
use crate::reader::findings::Findings;
use crate::reader::power_stiffness::PowerStiffness;
use crate::reader::quantity::Number;

/// The bound is stiffness * penetration^exponent, (2.9).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionPowerLaw {
    /// c_T [Pa/m^exponent], > 0.
    pub stiffness: PowerStiffness,
    /// m_T, > 0.
    pub exponent: Number,
    /// How stick is approximated.
    pub regularization: Regularization,
}

impl FrictionPowerLaw {
    /// From `c_T` \[Pa/m^m_T\] and `m_T` \[-\].
    pub fn of(stiffness: f64, exponent: f64, regularization: Regularization) -> Self {
        Self { stiffness: PowerStiffness::new(stiffness), exponent: Number::new(exponent), regularization }
    }

    pub(super) fn samples() -> Vec<Self> {
        let of = |(stiffness, exponent)| Self::of(stiffness, exponent, Regularization::stick_stiffness(1e9));
        [(3e9, 8.0 / 9.0), (1e15, 16.0 / 9.0)].into_iter().map(of).collect()
    }
}

impl FrictionBound for FrictionPowerLaw {
    fn bound(&self, at: Pressed) -> Bound {
        let penetration = (-at.gap).max(f64::MIN_POSITIVE);
        let (c, m) = (self.stiffness.value, self.exponent.value);
        Bound { value: c * penetration.powf(m), by_gap: -m * c * penetration.powf(m - 1.0), by_speed: 0.0 }
    }

    fn regularization(&self) -> Option<Regularization> {
        Some(self.regularization)
    }

    fn check(&self, findings: &mut Findings) {
        self.stiffness.check(self.exponent, findings);
    }
}
