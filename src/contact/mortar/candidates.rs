//! Candidate pairs: facets of contactor and target that may share segments, with a cache of the
//! segments.

use std::cell::RefCell;
use std::rc::Rc;

use super::overlap::{Overlap, StepOverlap};

/// Largest distance between candidate facets \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateRange {
    /// Along the normal of the contactor facet, in front of it and behind it.
    pub across: f64,
    /// Along the contactor facet, beyond its ends. The surfaces may slide this far before the
    /// candidates are searched again.
    pub along: f64,
    /// Cosine of the angle between the normals of two facets above which they are left out, because they do
    /// not face each other; `None` if the angle does not matter.
    pub alike: Option<f64>,
}

impl CandidateRange {
    /// Largest distance along any coordinate axis \[m\], for any orientation of the facet.
    pub(super) fn farthest<const D: usize>(&self) -> f64 {
        (self.across.powi(2) + (D as f64 - 1.0) * self.along.powi(2)).sqrt()
    }
}

/// Pairs of facets that may be in contact. Their segments are cached, so that force and stiffness
/// at the same fields compute them only once.
#[derive(Debug, Clone)]
pub struct Candidates<const D: usize> {
    /// Contactor facet and target facet, in ascending order.
    couples: Vec<(u32, u32)>,
    /// Nodes of all facets, each listed once.
    nodes: Vec<u32>,
    /// Segments at the iterate.
    pub(super) overlap: Cached<Overlap<D>>,
    /// Segments at the start of a step over which the forces act.
    pub(super) start: Cached<Overlap<D>>,
    /// Segments and gradients over that step.
    pub(super) step: Cached<StepOverlap<D>>,
}

/// The last value and the nodal fields for which it was computed.
#[derive(Debug)]
pub(super) struct Cached<T>(RefCell<Option<(Vec<f64>, Rc<T>)>>);

impl<T> Cached<T> {
    /// The value for these fields. It is recomputed only if they differ from the previous ones.
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
    pub(super) fn new(couples: Vec<(u32, u32)>, nodes: Vec<u32>) -> Self {
        Self { couples, nodes, overlap: Cached::default(), start: Cached::default(), step: Cached::default() }
    }

    /// Contactor facet and target facet, in ascending order.
    pub fn couples(&self) -> &[(u32, u32)] {
        &self.couples
    }

    /// Values of these fields at the nodes of all pairs.
    pub(super) fn values(&self, fields: &[&[f64]]) -> Vec<f64> {
        let mut values = Vec::with_capacity(fields.len() * self.nodes.len() * D);
        for field in fields {
            self.nodes.iter().for_each(|&node| values.extend_from_slice(&field[node as usize * D..][..D]));
        }
        values
    }
}
