//! Segments: where two facets lie opposite each other, and the points at which contact is integrated there.
//!
//! A segment is the overlap of a piece of the contactor with a piece of the target, seen along the normal of the
//! contactor's piece. Its points have coordinates on both facets and a weight in the reference domain of the contactor,
//! all of which are functions of the positions of the corners of the two pieces, and of nothing else.

use super::split::{FacetPiece, MOST_CORNERS};
use crate::tensor::Vector;

/// Most corners of two pieces; those of the target begin at [`TARGET`].
pub const CORNERS: usize = 2 * MOST_CORNERS;

/// Where the corners of the target's piece begin.
pub const TARGET: usize = MOST_CORNERS;

/// A scalar's derivatives by the positions of the corners of both pieces.
pub type ByCorners<const D: usize> = [Vector<D>; CORNERS];

/// How a segment point moves with the corners of the two pieces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointVariation<const D: usize> {
    /// `dxi_k/dz` \[1/m\].
    pub xi: [ByCorners<D>; 2],
    /// `deta_k/dz` \[1/m\].
    pub eta: [ByCorners<D>; 2],
    /// `dw/dz` \[1/m\].
    pub weight: ByCorners<D>,
}

impl<const D: usize> Default for PointVariation<D> {
    fn default() -> Self {
        let none = [Vector::zeros(); CORNERS];
        Self { xi: [none; 2], eta: [none; 2], weight: none }
    }
}

/// An integration point of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentPoint<const D: usize> {
    /// Coordinates on the contactor facet.
    pub xi: [f64; 2],
    /// Coordinates on the target facet.
    pub eta: [f64; 2],
    /// Weight in the reference domain of the contactor facet, > 0.
    pub weight: f64,
}

/// A piece where it is now.
#[derive(Debug, Clone, Copy)]
pub struct PlacedPiece<'a, const D: usize> {
    /// Which piece of which kind of facet.
    pub piece: &'a FacetPiece,
    /// Positions of its corners \[m\].
    pub corners: &'a [Vector<D>; MOST_CORNERS],
}

/// Whether an overlap brings the variation of its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Want {
    /// Values alone.
    Points,
    /// How the points move as well.
    Variations,
}
