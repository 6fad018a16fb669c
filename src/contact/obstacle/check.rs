//! Checks of positions and directions.

use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Length, Number};

/// Requires as many coordinates as the case has dimensions.
pub(super) fn check_place(what: &str, place: &At<Vec<Length>>, dimension: usize, findings: &mut Findings) {
    findings.entries(what, place, dimension);
}

/// Requires a positive radius of at most `most` \[m\].
pub(super) fn check_radius(what: &str, radius: Length, most: f64, findings: &mut Findings) {
    findings.positive(what, radius);
    if radius.value == 0.0 {
        findings.cure("a sharp edge has no normal; choose a radius above the penetration");
    } else if radius.value > most {
        let message = format!("{what} must be at most {most}, found {}", radius.value);
        findings.say(radius.place, message);
        findings.cure("choose a smaller radius, or a larger box");
    }
}

/// Requires a nonzero vector.
pub(super) fn check_direction(
    what: &str,
    direction: &At<Vec<Number>>,
    dimension: usize,
    findings: &mut Findings,
) {
    findings.entries(what, direction, dimension);
    let square: f64 = direction.iter().map(|component| component.value.powi(2)).sum();
    findings.require(square > 0.0, direction.place, format!("{what} is zero"));
}
