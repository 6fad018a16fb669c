//! A coefficient that is a number.

use super::CoefficientValue;
use crate::contact::check::not_negative;
use crate::error::Result;

/// `mu`, constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constant {
    coefficient: f64,
}

impl Constant {
    /// From `mu >= 0` \[-\].
    ///
    /// # Errors
    /// When it is negative or not finite.
    pub fn new(coefficient: f64) -> Result<Self> {
        Ok(Self { coefficient: not_negative("the friction coefficient", coefficient)? })
    }

    pub(super) fn evaluate(&self) -> CoefficientValue {
        CoefficientValue { value: self.coefficient, by_traction: 0.0, by_speed: 0.0 }
    }
}
