//! Weight of a contactor facet by the angle between it and the opposite surface.

use super::shape::{FacetShape, MOST_NODES, tangents};
use super::split::linear;
use crate::mesh::ElementKind;
use crate::space::{area_variation, facet_normal};
use crate::tensor::{Vector, tangential_projector};

/// Cosine of the angle between two surfaces from which on they have full weight (60 degrees). Below
/// it the weight decreases to 0, which it reaches where one stands upright on the other. The side of
/// a block therefore does not press when its corner touches.
///
/// A block without friction on a wider one, with its bottom and sides as the
/// contactor, takes 2, and 27 with 0.25. With 0.9 facets would lose weight from 26 degrees on, at which
/// coarse curved surfaces meet.
const FACING: f64 = 0.5;

/// Weight as a function of that cosine, and its derivative.
pub fn facing(cosine: f64) -> (f64, f64) {
    let s = (cosine / FACING).clamp(0.0, 1.0);
    (s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / FACING)
}

/// Cosine of the angle by which a facet may turn before candidates are searched again (20 degrees).
///
/// With 10 degrees the linear solves of `collision/solid` and of blocks in a pile, with `contact: all`, take
/// as long. With 40 those of the first take four times as long, as if no facets were left out, because the
/// facets of one curved side may then face each other. The number of searches is the same.
const TURNED: f64 = 0.94;

/// Cosine of the angle between the normals of two facets above which they do not face each other, even
/// after both have turned by 20 degrees: that of 50 degrees, rounded up.
pub const ALIKE: f64 = 0.643;

/// The unit normal at the centre of a facet.
#[derive(Debug, Clone, Copy)]
pub struct FacetNormal<const D: usize>(Vector<D>);

impl<const D: usize> FacetNormal<D> {
    /// Computes it from the nodes of the facet \[m\]. It is not a number if the facet has no area.
    pub fn of(kind: ElementKind, nodes: &[Vector<D>]) -> Self {
        Self(Centre::of(kind, nodes).normal)
    }

    /// The vector itself.
    #[cfg(test)]
    pub fn vector(&self) -> Vector<D> {
        self.0
    }

    /// Whether the cosine of the angle between these normals is above `limit`. It is not if a facet has no
    /// normal.
    pub fn is_like(&self, other: &Self, limit: f64) -> bool {
        self.0.dot(&other.0) > limit
    }

    /// Whether the facet has turned so far that candidates have to be searched again, or has lost its normal.
    pub fn has_turned(&self, before: &Self) -> bool {
        let cosine = self.0.dot(&before.0);
        cosine < TURNED || cosine.is_nan() && !before.0[0].is_nan()
    }
}

/// Weight of two facets.
#[derive(Debug)]
pub struct PairFacing<const D: usize> {
    /// The weight, above 0.
    pub part: f64,
    /// Derivatives of its logarithm by the nodes of both facets [1/m]; `None` if it is 1.
    pub by_nodes: Option<[[f64; D]; 2 * MOST_NODES]>,
}

/// A facet at its centre.
struct Centre<const D: usize> {
    shape: FacetShape,
    tangents: [Vector<D>; 2],
    normal: Vector<D>,
    size: f64,
}

impl<const D: usize> Centre<D> {
    fn of(kind: ElementKind, nodes: &[Vector<D>]) -> Self {
        let third = 1.0 / 3.0;
        let place = if linear(kind) == ElementKind::Tri3 { [third, third] } else { [0.0; 2] };
        let shape = FacetShape::at(kind, place);
        let tangents = tangents(&shape, nodes);
        let area = facet_normal(&tangents);
        let size = area.norm();
        Self { shape, tangents, normal: area / size, size }
    }
}

/// Weight of the angle between a contactor facet and a target facet, given by their kinds and the
/// positions of their nodes \[m\], between their centres; `None` if they do not face each other.
pub fn pair_facing<const D: usize>(sides: [(ElementKind, &[Vector<D>]); 2]) -> Option<PairFacing<D>> {
    let centres = sides.map(|(kind, nodes)| Centre::of(kind, nodes));
    let cosine = -centres[0].normal.dot(&centres[1].normal);
    let (part, slope) = facing(cosine);
    if part <= 0.0 {
        return None;
    }
    // Of a facet without a normal the segments decide.
    if slope == 0.0 || cosine.is_nan() {
        return Some(PairFacing { part: 1.0, by_nodes: None });
    }
    let mut by_nodes = [[0.0; D]; 2 * MOST_NODES];
    let (below, above) = by_nodes.split_at_mut(sides[0].1.len());
    for (k, by_nodes) in [below, above].into_iter().enumerate() {
        let (own, other) = (&centres[k], &centres[1 - k]);
        let turned = tangential_projector(&own.normal) * other.normal / own.size;
        for (by, gradient) in by_nodes.iter_mut().zip(&own.shape.gradient).take(sides[k].1.len()) {
            let by_area = area_variation(&own.tangents, gradient);
            *by = (by_area.tr_mul(&turned) * (-slope / part)).into();
        }
    }
    Some(PairFacing { part, by_nodes: Some(by_nodes) })
}
