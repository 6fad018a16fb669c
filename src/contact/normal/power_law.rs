//! Power law of Oden and Martins, `t_n = c_N <-g>^m_N` (2.9).

use super::NormalResponse;
use crate::contact::check::positive;
use crate::error::{Error, Result};

/// Compliance of a rough surface, (2.9).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    normal_stiffness: f64,
    normal_exponent: f64,
}

impl PowerLaw {
    /// From `c_N` \[Pa/m^m_N\] and `m_N >= 1` \[-\].
    ///
    /// # Errors
    /// When `c_N` is not positive and finite, or `m_N` lies below 1 (infinite slope at first touch).
    pub fn new(normal_stiffness: f64, normal_exponent: f64) -> Result<Self> {
        let normal_stiffness = positive("stiffness", normal_stiffness)?;
        let normal_exponent = positive("exponent", normal_exponent)?;
        if normal_exponent < 1.0 {
            let message = format!("the normal exponent {normal_exponent} is below 1");
            return Err(Error::case(message)
                .hint("below 1 the contact is infinitely stiff at first touch; use 1 to 3"));
        }
        Ok(Self { normal_stiffness, normal_exponent })
    }

    pub(super) fn penetration(&self, pressure: f64) -> f64 {
        (pressure / self.normal_stiffness).powf(1.0 / self.normal_exponent)
    }

    pub(super) fn closed(&self, penetration: f64) -> NormalResponse {
        let (c, m) = (self.normal_stiffness, self.normal_exponent);
        let traction = c * penetration.powf(m);
        NormalResponse {
            traction,
            derivative: -m * c * penetration.powf(m - 1.0),
            potential: traction * penetration / (m + 1.0),
        }
    }
}
