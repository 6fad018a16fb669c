//! Prescribed displacements: their motion in time, and their reaction forces.

use super::rollers::Rollers;
use crate::case::PlacedFunction;
use crate::error::{Error, Result};
use crate::model::Support;
use crate::space::{DofMap, PrescribedFields, PrescribedState};
use crate::tensor::in_space;

/// The displacement boundaries of a rank.
pub struct Supports<const D: usize> {
    /// Which unknowns are prescribed.
    pub dofs: DofMap<D>,
    /// The supports along directions that need not be axes.
    pub rollers: Rollers<D>,
    motions: Vec<[Option<PlacedFunction>; D]>,
}

impl<const D: usize> Supports<D> {
    /// Creates supports whose unknowns are resolved in `dofs`, in the same order.
    pub(super) fn new(dofs: DofMap<D>, rollers: Rollers<D>, supports: &[Support<D>]) -> Self {
        Self { dofs, rollers, motions: supports.iter().map(|support| support.components.clone()).collect() }
    }

    /// Writes prescribed `u`, `v`, `a` at `time`, times `factor`, into the local arrays.
    ///
    /// # Errors
    /// If a prescribed value is not finite, or too large for computations.
    pub fn fill(&self, points: &[[f64; D]], time: f64, factor: f64, fields: PrescribedFields) -> Result<()> {
        let motion = |boundary: usize, component: usize, point: &[f64; D]| {
            let Some(function) = &self.motions[boundary][component] else {
                return Err(Error::internal("a support has no function"));
            };
            let at = function.motion(in_space(point), time);
            function.require_sound(&at, point, time)?;
            Ok(PrescribedState { u: factor * at.value, v: factor * at.rate, a: factor * at.second })
        };
        let along_axes = PrescribedFields { u: &mut *fields.u, v: &mut *fields.v, a: &mut *fields.a };
        self.dofs.fill(points, motion, along_axes)?;
        self.rollers.fill(points, time, factor, fields)
    }

    /// Largest prescribed displacement \[m\] and velocity \[m/s\] of any component on this rank at
    /// `instants` \[s\].
    pub fn largest(&self, points: &[[f64; D]], instants: &[f64]) -> [f64; 2] {
        let mut most = self.rollers.largest(points, instants);
        for (boundary, motions) in self.dofs.boundaries.iter().zip(&self.motions) {
            for (component, function) in motions.iter().enumerate() {
                let Some(function) = function else { continue };
                let nodes = boundary.entries.iter().filter(|(_, of)| usize::from(*of) == component);
                let nodes = nodes.take(if function.is_constant_in_space() { 1 } else { usize::MAX });
                for (&(node, _), &time) in
                    nodes.flat_map(|entry| instants.iter().map(move |time| (entry, time)))
                {
                    let at = function.motion(in_space(&points[node as usize]), time);
                    most = [most[0].max(at.value.abs()), most[1].max(at.rate.abs())];
                }
            }
        }
        most
    }
}
