//! Tetrahedra on the unit simplex: corners, then the middles of edges 01, 12, 20, 03, 13, 23.

use super::layout::{Layout, Rules};
use super::shape::Family;

const NODES: [[f64; 3]; 10] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.5, 0.0, 0.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.0],
    [0.0, 0.0, 0.5],
    [0.5, 0.0, 0.5],
    [0.0, 0.5, 0.5],
];

pub(super) const TET4: Layout = Layout {
    family: Family::Simplex(1),
    nodes: NODES.split_at(4).0,
    rules: Rules { full: 1, mass: 2, contact: 2, nodal: 1 },
};

pub(super) const TET10: Layout = Layout {
    family: Family::Simplex(2),
    nodes: &NODES,
    rules: Rules { full: 2, mass: 4, contact: 5, nodal: 2 },
};
