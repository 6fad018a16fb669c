//! Bound of the compliance law, `b = c_T <-g>^m_T` (2.9).

use super::{Bound, Pressed};
use crate::contact::check::{not_negative, positive};
use crate::error::Result;

/// Friction bound that depends on the penetration alone, (2.9).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    tangential_stiffness: f64,
    tangential_exponent: f64,
}

impl PowerLaw {
    /// From `c_T >= 0` \[Pa/m^m_T\] and `m_T > 0` \[-\].
    ///
    /// # Errors
    /// Outside these ranges.
    pub fn new(tangential_stiffness: f64, tangential_exponent: f64) -> Result<Self> {
        Ok(Self {
            tangential_stiffness: not_negative("the tangential stiffness", tangential_stiffness)?,
            tangential_exponent: positive("the tangential exponent", tangential_exponent)?,
        })
    }

    pub(super) fn bound(&self, at: Pressed) -> Bound {
        let penetration = (-at.gap).max(f64::MIN_POSITIVE);
        let (c, m) = (self.tangential_stiffness, self.tangential_exponent);
        Bound { value: c * penetration.powf(m), by_gap: -m * c * penetration.powf(m - 1.0), by_speed: 0.0 }
    }
}
