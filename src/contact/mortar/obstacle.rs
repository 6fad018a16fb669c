//! An obstacle as a contactor facet sees it: a shape, and the points of a rule on the facet.

use super::split::linear;
use crate::contact::obstacle::Shape;
use crate::mesh::ElementKind;
use crate::space::{Rule, reference};

/// An obstacle as a contactor facet sees it.
#[derive(Debug, Clone, Copy)]
pub struct PlacedObstacle<'a, const D: usize> {
    /// The obstacle.
    pub obstacle: &'a dyn Shape<D>,
    /// Points of the facet.
    pub rule: &'a Rule,
}

/// Whether a vertex on facets of this kind has the gap of its own place alone: straight facets over a plane, whose gap is linear between
/// corners. A facet that hangs over an edge then opens corner by corner.
pub fn is_lumped<const D: usize>(obstacle: &dyn Shape<D>, kind: ElementKind) -> bool {
    obstacle.is_plane() && linear(kind) == kind
}

/// The points of a facet: its corners where it is lumped, else Gauss points.
pub fn rule_of<const D: usize>(obstacle: &dyn Shape<D>, kind: ElementKind) -> &'static Rule {
    let element = reference(kind);
    let corners = element.nodal_rule().filter(|_| is_lumped(obstacle, kind));
    corners.unwrap_or_else(|| element.gauss_contact_rule())
}
