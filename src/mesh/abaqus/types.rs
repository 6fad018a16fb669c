//! Element types of Abaqus and CalculiX, and the numbers of their faces.

use crate::mesh::{ElementKind, PlaneState};
use ElementKind::*;

/// What becomes of an element type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Class {
    /// A solid element. Its formulation differs from that of this program if it is a variant, such
    /// as one with reduced integration.
    Solid { kind: ElementKind, is_variant: bool },
    /// A plane element of another state across the plane: the state.
    Plane(&'static str),
    /// A solid element that this program does not have: the reason.
    Unknown(&'static str),
    /// Not a solid element, such as a spring, beam or shell.
    Other,
}

/// Types of solid elements and their kinds. Nodes are in the same order. Those in plane stress begin with `CPS` in
/// place of `CPE`.
const SOLIDS: [(&str, ElementKind); 10] = [
    ("CPE3", Tri3),
    ("CPE4", Quad4),
    ("CPE6", Tri6),
    ("CPE8", Quad8),
    ("C3D4", Tet4),
    ("C3D5", Pyramid5),
    ("C3D6", Wedge6),
    ("C3D8", Hex8),
    ("C3D10", Tet10),
    ("C3D20", Hex20),
];

/// Letters after the number of nodes that change the formulation: reduced, hybrid, incompatible or
/// improved, modified, stress at the surface, reduced dilatation.
const VARIANTS: &str = "RHIMST";

/// The class of a type in upper case, for plane elements of the state `plane`.
pub(super) fn classify(name: &str, plane: PlaneState) -> Class {
    let (solid, own) = match (name.strip_prefix("CPS"), name.strip_prefix("CAX")) {
        (Some(rest), _) => (format!("CPE{rest}"), PlaneState::Stress),
        (_, Some(rest)) => (format!("CPE{rest}"), PlaneState::Axisymmetric),
        _ => (name.to_owned(), PlaneState::Strain),
    };
    for (base, kind) in SOLIDS {
        let Some(variant) = solid.strip_prefix(base) else { continue };
        if variant.chars().all(|letter| VARIANTS.contains(letter)) {
            if kind.dimension() == 2 && own != plane {
                return Class::Plane(own.name());
            }
            return Class::Solid { kind, is_variant: !variant.is_empty() };
        }
    }
    let begins = |starts: &[&str]| starts.iter().any(|start| name.starts_with(start));
    let nodes = name.trim_start_matches("C3D").trim_end_matches(char::is_alphabetic);
    match name {
        _ if begins(&["CPS"]) => Class::Unknown(""),
        _ if begins(&["CPEG"]) => Class::Plane("generalised plane strain"),
        _ if begins(&["CAX"]) => Class::Unknown(""),
        _ if begins(&["CGAX"]) => Class::Plane("axisymmetry with twist"),
        _ if begins(&["C3D"]) && nodes == "15" => Class::Unknown(" (a wedge of second order)"),
        _ if begins(&["C3D"]) && nodes == "13" => Class::Unknown(" (a pyramid of second order)"),
        _ if begins(&["C3D", "CPE", "CCL", "CSS", "SC6", "SC8", "DC", "AC", "F3D", "F2D"]) => {
            Class::Unknown("")
        }
        _ => Class::Other,
    }
}

/// The names of all types of solid elements, for messages.
pub(super) fn known() -> String {
    SOLIDS.map(|(name, _)| name).join(", ") + ", CPS3, CPS4, CPS6, CPS8, CAX3, CAX4, CAX6, CAX8"
}

/// Face `S1`, `S2`, ... of a kind as an index into [`ElementKind::sides`].
pub(super) fn side(kind: ElementKind, face: usize) -> Option<u8> {
    let sides: &[u8] = match kind {
        Tri3 | Tri6 => &[0, 1, 2],
        Quad4 | Quad8 | Quad9 => &[0, 1, 2, 3],
        Wedge6 | Pyramid5 => &[0, 1, 2, 3, 4],
        Tet4 | Tet10 => &[3, 0, 1, 2],
        Hex8 | Hex20 | Hex27 => &[4, 5, 2, 1, 3, 0],
        Line2 | Line3 => &[],
    };
    sides.get(face.checked_sub(1)?).copied()
}
