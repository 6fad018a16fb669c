//! Lines on `[-1, 1]`: ends, then the middle.

use super::layout::{Layout, Rules};
use super::shape::Family;

pub(super) const LINE2: Layout = Layout {
    family: Family::Lagrange(1),
    nodes: &[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
    rules: Rules { full: 3, mass: 3, contact: 3, nodal: 1 },
};

pub(super) const LINE3: Layout = Layout {
    family: Family::Lagrange(2),
    nodes: &[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    rules: Rules { full: 5, mass: 5, contact: 5, nodal: 3 },
};
