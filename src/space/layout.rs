//! What the family of an element is made of: shape functions, nodes, rules.

use super::shape::Family;

/// What a family's file writes down of an element; the rest follows.
pub(super) struct Layout {
    /// How the shape functions follow from the nodes.
    pub family: Family,
    /// Node coordinates in VTK's order.
    pub nodes: &'static [[f64; 3]],
    /// Degrees of the rules.
    pub rules: Rules,
}

/// Polynomial degrees of the rules of an element (in each direction on lines, quads and hexes).
pub(super) struct Rules {
    /// Stiffness.
    pub full: usize,
    /// Mass: products of shape functions.
    pub mass: usize,
    /// Contact integrated by Gauss points.
    pub contact: usize,
    /// What the nodal rule, if there is one, integrates exactly.
    pub nodal: usize,
}
