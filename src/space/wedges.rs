//! Wedges on the unit triangle times `[-1, 1]`: corners of the bottom, then of the top.

use super::layout::{Layout, Rules};
use super::shape::Family;

const NODES: [[f64; 3]; 6] =
    [[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];

/// On a wedge whose quadrilaterals are not parallelograms the gradients vary over the triangle:
/// three points there and two along the axis integrate a constant stress exactly.
pub(super) const WEDGE6: Layout =
    Layout { family: Family::Wedge, nodes: &NODES, rules: Rules { full: 2, mass: 2, contact: 2, nodal: 1 } };
