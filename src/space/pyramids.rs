//! Pyramids on `|xi|, |eta| <= 1 - zeta`, `0 <= zeta <= 1`: corners of the base, then the apex.

use super::layout::{Layout, Rules};
use super::shape::Family;

const NODES: [[f64; 3]; 5] =
    [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Along a ray from the apex the gradients are constant, and across the rays they are polynomials of
/// degree one in each direction: two points there integrate a constant stress exactly on every
/// pyramid, and two along the axis the products of the mass.
pub(super) const PYRAMID5: Layout = Layout {
    family: Family::Pyramid,
    nodes: &NODES,
    rules: Rules { full: 2, mass: 2, contact: 2, nodal: 1 },
};
