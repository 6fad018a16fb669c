//! An obstacle opposite a contactor facet: a shape, and the quadrature points on the facet.

use super::split::linear;
use crate::contact::obstacle::Shape;
use crate::mesh::{ElementKind, PlaneState};
use crate::space::{Rule, reference};

/// An obstacle opposite a contactor facet.
#[derive(Debug, Clone, Copy)]
pub struct PlacedObstacle<'a, const D: usize> {
    /// The obstacle.
    pub obstacle: &'a dyn Shape<D>,
    /// Quadrature points of the facet.
    pub rule: &'a Rule,
}

/// Whether a vertex on facets of this kind takes the gap at its own position only. This holds for
/// straight facets over a plane, where the gap is linear between corners. A facet that overhangs an
/// edge then opens corner by corner. In axisymmetry the area grows along the facet, and a pressure on
/// corners would not be the consistent one at the ends of a surface.
pub fn is_lumped<const D: usize>(obstacle: &dyn Shape<D>, kind: ElementKind, plane: PlaneState) -> bool {
    obstacle.is_plane() && linear(kind) == kind && !plane.is_revolved()
}

/// The quadrature points of a facet: its corners if it is lumped, otherwise Gauss points.
pub fn rule_of<const D: usize>(
    obstacle: &dyn Shape<D>,
    kind: ElementKind,
    plane: PlaneState,
) -> &'static Rule {
    let element = reference(kind);
    let corners = element.nodal_rule().filter(|_| is_lumped(obstacle, kind, plane));
    corners.unwrap_or_else(|| element.gauss_contact_rule())
}
