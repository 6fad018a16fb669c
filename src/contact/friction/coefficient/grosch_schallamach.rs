//! Rubber after Grosch and Schallamach, `mu = mu_0 (t_n / E)^e` (2.26).
//!
//! The paper prints `e = +1/9`, which contradicts its own compliance parameters (2.28) and the measured fall of
//! rubber friction with pressure; `-1/9` is the law that agrees with both.

use super::CoefficientValue;
use crate::contact::check::{not_negative, positive};
use crate::error::{Error, Result};

/// Pressure-dependent coefficient of rubber.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroschSchallamach {
    reference_coefficient: f64,
    modulus: f64,
    exponent: f64,
}

impl GroschSchallamach {
    /// The exponent that the paper's compliance parameters imply.
    pub const EXPONENT: f64 = -1.0 / 9.0;

    /// From `mu_0 >= 0` \[-\], `E > 0` \[Pa\] and the exponent `e > -1` \[-\].
    ///
    /// # Errors
    /// Outside these ranges.
    pub fn new(reference_coefficient: f64, modulus: f64, exponent: f64) -> Result<Self> {
        if !(exponent > -1.0 && exponent.is_finite()) {
            let message = format!("the Grosch-Schallamach exponent must be above -1, but is {exponent}");
            return Err(Error::case(message).hint("rubber has -0.1111111111; the paper prints +0.1111111111"));
        }
        Ok(Self {
            reference_coefficient: not_negative("the reference coefficient", reference_coefficient)?,
            modulus: positive("the modulus", modulus)?,
            exponent,
        })
    }

    pub(super) fn evaluate(&self, normal_traction: f64) -> CoefficientValue {
        // As t_n -> 0 the coefficient is unbounded (the bound mu t_n is not): the ratio has a floor.
        let ratio = (normal_traction / self.modulus).max(f64::MIN_POSITIVE);
        let value = (self.reference_coefficient * ratio.powf(self.exponent)).min(f64::MAX);
        CoefficientValue { value, by_traction: self.exponent * value, by_speed: 0.0 }
    }
}
