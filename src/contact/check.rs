//! Ranges that every constructor of a contact law checks in the same words.

use crate::error::{Error, Result};

/// `value`, if it is positive and finite.
pub(crate) fn positive(what: &str, value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::case(format!("{what} must be positive and finite, but is {value}")))
}

/// `value`, if it is finite.
pub(crate) fn finite(what: &str, value: f64) -> Result<f64> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(Error::case(format!("{what} must be a finite number, but is {value}")))
}
