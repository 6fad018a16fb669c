//! Definition of an element: shape functions, nodes and quadrature rules.

use super::shape::Family;

/// Data that a family's file specifies for an element; all other data are derived.
pub(super) struct Layout {
    /// Construction of the shape functions from the nodes.
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
    /// Degree that the nodal rule, if there is one, integrates exactly.
    pub nodal: usize,
}
