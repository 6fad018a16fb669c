//! Segments: regions in which two facets lie opposite each other, and the integration points of
//! contact there.
//!
//! A segment is the overlap of a piece of the contactor with a piece of the target, projected along
//! the normal of the contactor's piece. Its points have coordinates on both facets and a weight in
//! the reference domain of the contactor. These depend only on the positions of the corners of the
//! two pieces.

use super::split::{FacetPiece, MOST_CORNERS};
use crate::tensor::Vector;

/// Maximum number of corners of two pieces; those of the target begin at [`TARGET`].
pub const CORNERS: usize = 2 * MOST_CORNERS;

/// Index of the first corner of the target's piece.
pub const TARGET: usize = MOST_CORNERS;

/// Derivatives of a scalar by the positions of the corners of both pieces.
pub type ByCorners<const D: usize> = [Vector<D>; CORNERS];

/// Derivatives of a segment point by the corners of the two pieces.
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
    /// Weight in the reference domain of the contactor facet, > 0; 0 for the points on the boundary of
    /// [`Want::FixedPlaces`].
    pub weight: f64,
}

/// A piece with its current position.
#[derive(Debug, Clone, Copy)]
pub struct PlacedPiece<'a, const D: usize> {
    /// The piece and the kind of its facet.
    pub piece: &'a FacetPiece,
    /// Positions of its corners \[m\].
    pub corners: &'a [Vector<D>; MOST_CORNERS],
}

/// Whether the variation of the points of an overlap is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Want {
    /// Only values.
    Points,
    /// Values and variations of the points, of their gaps and measures.
    Variations,
    /// Also variations of their normals.
    NormalVariations,
    /// As [`NormalVariations`](Self::NormalVariations), at fixed places in the plane of the contactor's
    /// piece. Points on the boundary of the overlap follow, which have no weight but the derivatives
    /// of the weight by the motion of the boundary. In 2D this is [`NormalVariations`](Self::NormalVariations).
    ///
    /// The corners of an overlap whose edges are nearly parallel move along these edges far more than
    /// the nodes do, and so do the points between them. This changes no integral, but it enlarges the
    /// errors of their quadrature and dominates products of derivatives.
    ///
    /// Points on the boundary vary at half of its motion. Products of the derivatives of an integrand and
    /// of the weight there are then half of the second derivative by the motion of the boundary.
    FixedPlaces,
}

impl Want {
    /// Whether the normals vary.
    pub fn includes_normals(self) -> bool {
        matches!(self, Self::NormalVariations | Self::FixedPlaces)
    }
}
