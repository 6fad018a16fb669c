//! Quadrilaterals on `[-1, 1]^2`: corners anticlockwise, middles of edges 01, 12, 23, 30, centre.

use super::layout::{Layout, Rules};
use super::shape::Family;

const NODES: [[f64; 3]; 9] = [
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 0.0, 0.0],
];

const QUADRATIC: Rules = Rules { full: 5, mass: 5, contact: 5, nodal: 3 };

pub(super) const QUAD4: Layout = Layout {
    family: Family::Lagrange(1),
    nodes: NODES.split_at(4).0,
    rules: Rules { full: 3, mass: 3, contact: 3, nodal: 1 },
};

pub(super) const QUAD8: Layout =
    Layout { family: Family::Serendipity, nodes: NODES.split_at(8).0, rules: QUADRATIC };

pub(super) const QUAD9: Layout = Layout { family: Family::Lagrange(2), nodes: &NODES, rules: QUADRATIC };
