//! Overlap of two surfaces: pairs of facets with common segments, and the sums over them for all
//! vertices.

use std::rc::Rc;

use super::integrals::PairIntegrals;
use super::kernel::{VertexRows, VertexSums};

/// A pair of facets with common segments.
#[derive(Debug)]
pub(super) struct ActivePair<const D: usize> {
    pub facet: u32,
    pub target: u32,
    pub integrals: PairIntegrals<D>,
}

/// All pairs with common segments, and the sums over them for all vertices.
#[derive(Debug)]
pub(super) struct Overlap<const D: usize> {
    /// In the order of the couples.
    pub pairs: Vec<ActivePair<D>>,
    pub sums: Vec<VertexSums<D>>,
}

/// The sums of a vertex at the ends of a step and in its middle.
#[derive(Debug, Clone, Copy)]
pub(super) struct VertexEnds<const D: usize> {
    pub start: VertexSums<D>,
    pub middle: VertexSums<D>,
    pub end: VertexSums<D>,
}

/// Geometric quantities of a step for all vertices.
#[derive(Debug)]
pub(super) struct StepOverlap<const D: usize> {
    pub at_start: Rc<Overlap<D>>,
    /// Of the pairs around active vertices; the sums of other vertices are incomplete.
    pub at_middle: Overlap<D>,
    pub at_end: Overlap<D>,
    pub ends: Vec<VertexEnds<D>>,
    /// Whether each vertex presses at one of the ends.
    pub active: Vec<bool>,
    /// Rows of the active vertices, with gradients in the middle of the step.
    pub rows: Vec<VertexRows<D>>,
}

impl<const D: usize> StepOverlap<D> {
    pub fn lists(&self) -> [&[ActivePair<D>]; 3] {
        [&self.at_middle.pairs, &self.at_start.pairs, &self.at_end.pairs]
    }
}
