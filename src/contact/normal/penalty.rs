//! Penalty law `t_n = <-g> / normal_compliance` (2.8).

use super::NormalResponse;
use crate::contact::check::positive;
use crate::error::Result;

/// Linear penalty, (2.8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalty {
    normal_compliance: f64,
}

impl Penalty {
    /// From the compliance `eps_n` \[m/Pa\].
    ///
    /// # Errors
    /// When it is not positive and finite.
    pub fn new(normal_compliance: f64) -> Result<Self> {
        Ok(Self { normal_compliance: positive("compliance", normal_compliance)? })
    }

    /// `eps_n` \[m/Pa\].
    pub fn normal_compliance(&self) -> f64 {
        self.normal_compliance
    }

    pub(super) fn penetration(&self, pressure: f64) -> f64 {
        pressure * self.normal_compliance
    }

    pub(super) fn closed(&self, penetration: f64) -> NormalResponse {
        let traction = penetration / self.normal_compliance;
        NormalResponse {
            traction,
            derivative: -1.0 / self.normal_compliance,
            potential: 0.5 * penetration * traction,
        }
    }
}
