//! Hexahedra on `[-1, 1]^3` in VTK's order: corners of the bottom and of the top, edges of the
//! bottom, of the top, the vertical ones, then the faces -x, +x, -y, +y, -z, +z, then the centre.

use super::layout::{Layout, Rules};
use super::shape::Family;

#[rustfmt::skip]
const NODES: [[f64; 3]; 27] = [
    [-1.0, -1.0, -1.0], [1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0],
    [0.0, -1.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [-1.0, 0.0, -1.0],
    [0.0, -1.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [-1.0, 0.0, 1.0],
    [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0],
    [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0],
    [0.0, 0.0, 0.0],
];

const QUADRATIC: Rules = Rules { full: 5, mass: 5, contact: 5, nodal: 3 };

pub(super) const HEX8: Layout = Layout {
    family: Family::Lagrange(1),
    nodes: NODES.split_at(8).0,
    rules: Rules { full: 3, mass: 3, contact: 3, nodal: 1 },
};

pub(super) const HEX20: Layout =
    Layout { family: Family::Serendipity, nodes: NODES.split_at(20).0, rules: QUADRATIC };

pub(super) const HEX27: Layout = Layout { family: Family::Lagrange(2), nodes: &NODES, rules: QUADRATIC };
