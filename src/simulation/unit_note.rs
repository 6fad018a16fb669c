//! Describes the units of a case in one line.

use crate::case::Case;
use crate::mesh::PlaneState;

/// The units of a case that is not in SI. In the plane it includes the thickness to which forces
/// and energies refer.
pub(super) fn unit_note(case: &Case) -> Option<String> {
    let units = case.units;
    let plane = match case.dimension.value.coordinates() {
        2 if case.is_axisymmetric() => format!("; {}, whole revolution", PlaneState::Axisymmetric.name()),
        2 => {
            let state = if case.is_plane_stress() { PlaneState::Stress } else { PlaneState::Strain };
            format!("; {}, thickness 1 {}", state.name(), units.of("m"))
        }
        _ => String::new(),
    };
    let derived = ["N", "Pa", "J"].map(|unit| units.of(unit)).join(", ");
    (!units.is_si()).then(|| format!("units: {}; derived: {derived}{plane}", units.bases()))
}
