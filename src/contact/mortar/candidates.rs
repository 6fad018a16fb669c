//! Candidate pairs: facets of contactor and target that may share segments, with a cache of the segments.

use std::cell::RefCell;
use std::rc::Rc;

use super::contact::{Overlap, VertexContact};
use super::over_step::StepOverlap;
use super::shape::FacetShape;
use crate::mesh::{Bounds, BoundsTree, ElementKind};
use crate::space::facet_normal;
use crate::tensor::Vector;

/// How far apart facets may be to be candidates \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateRange {
    /// Along the normal of the contactor facet, in front of it and behind.
    pub across: f64,
    /// Along the contactor facet, beyond its ends: how far the surfaces may slide until candidates are sought anew.
    pub along: f64,
}

impl CandidateRange {
    /// Largest distance along a coordinate axis \[m\], whichever way the facet is turned.
    fn farthest<const D: usize>(&self) -> f64 {
        (self.across.powi(2) + (D as f64 - 1.0) * self.along.powi(2)).sqrt()
    }
}

/// Facets that may meet. Their segments are cached, so that force and stiffness at the same fields compute them once.
#[derive(Debug, Clone)]
pub struct Candidates<const D: usize> {
    /// Contactor facet and target facet, in ascending order.
    couples: Vec<(u32, u32)>,
    /// Their nodes, each once.
    nodes: Vec<u32>,
    /// Segments at the iterate.
    pub(super) overlap: Cached<Overlap<D>>,
    /// Segments at the start of a step over which forces act.
    pub(super) start: Cached<Overlap<D>>,
    /// Segments and gradients over such a step.
    pub(super) step: Cached<StepOverlap<D>>,
}

/// The last value, with the nodal fields for which it was computed.
#[derive(Debug)]
pub(super) struct Cached<T>(RefCell<Option<(Vec<f64>, Rc<T>)>>);

impl<T> Cached<T> {
    /// The value for these fields, computed only if they differ from the last ones.
    pub fn at(&self, fields: Vec<f64>, find: impl FnOnce() -> T) -> Rc<T> {
        if let Some((known, value)) = &*self.0.borrow()
            && *known == fields
        {
            return Rc::clone(value);
        }
        let value = Rc::new(find());
        *self.0.borrow_mut() = Some((fields, Rc::clone(&value)));
        value
    }
}

impl<T> Default for Cached<T> {
    fn default() -> Self {
        Self(RefCell::new(None))
    }
}

impl<T> Clone for Cached<T> {
    /// An empty cache.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<const D: usize> Default for Candidates<D> {
    fn default() -> Self {
        Self::new(Vec::new(), Vec::new())
    }
}

impl<const D: usize> Candidates<D> {
    fn new(couples: Vec<(u32, u32)>, nodes: Vec<u32>) -> Self {
        Self { couples, nodes, overlap: Cached::default(), start: Cached::default(), step: Cached::default() }
    }

    /// Contactor facet and target facet, in ascending order.
    pub fn couples(&self) -> &[(u32, u32)] {
        &self.couples
    }

    /// These fields at the nodes of all couples.
    pub(super) fn values(&self, fields: &[&[f64]]) -> Vec<f64> {
        let mut values = Vec::with_capacity(fields.len() * self.nodes.len() * D);
        for field in fields {
            self.nodes.iter().for_each(|&node| values.extend_from_slice(&field[node as usize * D..][..D]));
        }
        values
    }
}

impl<const D: usize> VertexContact<D> {
    /// These couples of facets (contactor, target), in ascending order.
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

    /// Pairs (contactor facet, target facet) that come within `range` of having a common segment at the displacements `u`.
    /// A pair without a segment contributes nothing, so too many pairs cost time only; a missing pair would change the result.
    ///
    /// Facets that share a node are left out: surfaces of one body that meet at an edge do not press each other there. Over an obstacle
    /// every facet is a candidate.
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

    /// Whether the extents of two facets in these directions come within `range` of each other.
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
