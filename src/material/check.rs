//! Checks of parameters that several laws share.

use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};

/// Requires Young's modulus to be positive, and Poisson's ratio to be in its range.
pub fn check_engineering(young_modulus: Pressure, poisson_ratio: Number, findings: &mut Findings) {
    findings.positive("Young's modulus", young_modulus);
    check_poisson_ratio(poisson_ratio, findings);
}

/// Requires Poisson's ratio to be between -1 and 0.5.
pub fn check_poisson_ratio(ratio: Number, findings: &mut Findings) {
    if !(ratio.value > -1.0 && ratio.value < 0.5) {
        findings.say(ratio.place, format!("Poisson's ratio must be > -1 and < 0.5, found {}", ratio.value));
        findings.cure("use 0.49 or 0.499 for an almost incompressible solid");
    }
}
