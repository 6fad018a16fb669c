//! Triangles on the unit simplex: corners, then the middles of edges 01, 12, 20.

use super::layout::{Layout, Rules};
use super::shape::Family;

pub(super) const TRI3: Layout = Layout {
    family: Family::Simplex(1),
    nodes: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    rules: Rules { full: 1, mass: 2, contact: 2, nodal: 1 },
};

pub(super) const TRI6: Layout = Layout {
    family: Family::Simplex(2),
    nodes: &[
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.5, 0.0, 0.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.0],
    ],
    rules: Rules { full: 2, mass: 4, contact: 5, nodal: 2 },
};
