//! A coefficient that decays with the slip speed, `mu = mu_k + (mu_s - mu_k) exp(-|v_T| / v_d)` (2.27).

use super::CoefficientValue;
use crate::contact::check::{not_negative, positive};
use crate::error::Result;

/// Speed-dependent coefficient: static at rest, kinetic at speed. Falling, it acts as negative damping (`C_mu`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stribeck {
    static_coefficient: f64,
    kinetic_coefficient: f64,
    decay_velocity: f64,
}

impl Stribeck {
    /// From `mu_s`, `mu_k >= 0` \[-\] and the decay velocity `v_d > 0` \[m/s\].
    ///
    /// # Errors
    /// Outside these ranges.
    pub fn new(static_coefficient: f64, kinetic_coefficient: f64, decay_velocity: f64) -> Result<Self> {
        Ok(Self {
            static_coefficient: not_negative("the static coefficient", static_coefficient)?,
            kinetic_coefficient: not_negative("the kinetic coefficient", kinetic_coefficient)?,
            decay_velocity: positive("the decay velocity", decay_velocity)?,
        })
    }

    pub(super) fn evaluate(&self, speed: f64) -> CoefficientValue {
        let excess =
            (self.static_coefficient - self.kinetic_coefficient) * (-speed / self.decay_velocity).exp();
        CoefficientValue {
            value: self.kinetic_coefficient + excess,
            by_traction: 0.0,
            by_speed: -excess / self.decay_velocity,
        }
    }
}
