//! Broad phase: finds the pairs of facets that may have common segments.

use super::candidates::{CandidateRange, Candidates};
use super::contact::VertexContact;
use super::shape::FacetShape;
use crate::mesh::{Bounds, BoundsTree, ElementKind};
use crate::space::facet_normal;
use crate::tensor::Vector;

impl<const D: usize> VertexContact<D> {
    /// Candidates from these pairs of facets (contactor, target), in ascending order.
    pub fn candidates_of(&self, couples: Vec<(u32, u32)>) -> Candidates<D> {
        let mut nodes = Vec::new();
        for &(facet, target) in &couples {
            nodes.extend_from_slice(self.surface.facet_nodes(&self.surface.facets()[facet as usize]));
            nodes.extend_from_slice(self.target.nodes(target));
        }
        nodes.sort_unstable();
        nodes.dedup();
        Candidates::new(couples, nodes)
    }

    /// Pairs (contactor facet, target facet) that come within `range` of having a common segment at
    /// the displacements `u`. A pair without a segment contributes nothing, so surplus pairs cost
    /// time only. A missing pair would change the result.
    ///
    /// Pairs of facets that share a node are excluded: surfaces of one body that meet at an edge do
    /// not press on each other there. Over an obstacle every facet is a candidate.
    pub fn candidates(&self, u: &[f64], range: &CandidateRange) -> Candidates<D> {
        let Some(opposite) = self.target.body() else {
            return self
                .candidates_of((0..self.surface.facets().len() as u32).map(|facet| (facet, 0)).collect());
        };
        let mut couples = Vec::new();
        let targets = 0..opposite.count() as u32;
        let mut nodes = Vec::new();
        let mut boxes = Vec::with_capacity(opposite.count());
        for target in targets {
            opposite.current(target, u, &mut nodes);
            boxes.push(Bounds::of_facet(opposite.kind(target), nodes.iter().map(|&x| x.into())));
        }
        let tree = BoundsTree::new(&boxes);
        let mut positions = Vec::new();
        for (index, facet) in self.surface.facets().iter().enumerate() {
            let own = self.surface.facet_nodes(facet);
            positions.clear();
            let placed = self.surface.reference_points(facet).iter().zip(own);
            positions.extend(placed.map(|(x, &n)| x + Vector::from_column_slice(&u[n as usize * D..][..D])));
            let around = Bounds::of_facet(facet.kind, positions.iter().map(|&x: &Vector<D>| x.into()));
            let frame = Frame::of(facet.kind, &positions);
            for target in tree.meeting(&around.inflate(range.farthest::<D>())) {
                let others = opposite.nodes(target);
                if own.iter().any(|node| others.contains(node)) {
                    continue;
                }
                opposite.current(target, u, &mut nodes);
                if frame.as_ref().is_none_or(|frame| frame.is_near(&positions, &nodes, range)) {
                    couples.push((index as u32, target));
                }
            }
        }
        couples.sort_unstable();
        self.candidates_of(couples)
    }
}

/// Directions along a facet and across it.
struct Frame<const D: usize> {
    along: Vec<Vector<D>>,
    across: Vector<D>,
}

impl<const D: usize> Frame<D> {
    fn of(kind: ElementKind, nodes: &[Vector<D>]) -> Option<Self> {
        let centre = if kind.corners() == 3 { [1.0 / 3.0; 2] } else { [0.0; 2] };
        let shape = FacetShape::at(kind, centre);
        let tangent = |k: usize| nodes.iter().zip(shape.gradient).map(|(x, g)| x * g[k]).sum::<Vector<D>>();
        let first = tangent(0).try_normalize(0.0)?;
        if D == 2 {
            return Some(Self { along: vec![first], across: facet_normal(&[first, Vector::zeros()]) });
        }
        let across = facet_normal(&[first, tangent(1)]).try_normalize(0.0)?;
        Some(Self { along: vec![first, facet_normal(&[across, first])], across })
    }

    /// Whether the extents of two facets in the directions of this frame come within `range` of
    /// each other.
    fn is_near(&self, nodes: &[Vector<D>], others: &[Vector<D>], range: &CandidateRange) -> bool {
        let extent = |nodes: &[Vector<D>], axis: &Vector<D>| {
            nodes
                .iter()
                .map(|x| x.dot(axis))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)))
        };
        let meets = |axis: &Vector<D>, by: f64| {
            let ((low, high), (other_low, other_high)) = (extent(nodes, axis), extent(others, axis));
            low - by <= other_high && other_low - by <= high
        };
        meets(&self.across, range.across) && self.along.iter().all(|axis| meets(axis, range.along))
    }
}
