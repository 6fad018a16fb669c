//! The augmented Lagrangian: multipliers that bring contact to a requested penetration and slip.

use super::{Equations, Stage};
use crate::error::Result;

/// By how much contact misses the requested tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shortfall {
    /// Largest ratio, over all points, of the length to its tolerance.
    pub ratio: f64,
    /// The length at that point \[m\].
    pub length: f64,
    /// Name of the length.
    pub name: &'static str,
    /// The key of the case that limits it.
    pub key: &'static str,
}

impl Shortfall {
    /// Of a penetration, or of a gap under pressure \[m\].
    pub fn penetration(length: f64, tolerance: f64) -> Self {
        Self { ratio: length / tolerance, length, name: "gap or penetration", key: "accuracy.penetration" }
    }

    /// Of an elastic slip \[m\].
    pub fn slip(length: f64, tolerance: f64) -> Self {
        Self { ratio: length / tolerance, length, name: "elastic slip", key: "accuracy.slip" }
    }

    /// The one with the larger ratio.
    #[must_use]
    pub fn larger(self, other: Self) -> Self {
        if other.ratio > self.ratio { other } else { self }
    }
}

/// Correction of contact towards a requested penetration and slip. By default none is requested.
pub trait Augmentation: Equations {
    /// Resets the multipliers that are sought to those of the last accepted step.
    fn reset_multipliers(&mut self) {}

    /// Returns how far contact points of the last residual, that of the trial state, are from touching
    /// exactly and from exact stick. `None` if no tolerance was requested. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn shortfall(&self, _stage: &Stage) -> Result<Option<Shortfall>> {
        Ok(None)
    }

    /// Brings contacts that are not in motion closer to the requested tolerance, by multipliers or
    /// by a stiffer penalty. Collective.
    fn improve(&mut self) {}
}
