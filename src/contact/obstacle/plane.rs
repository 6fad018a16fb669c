//! Half space below a plane.

use super::{Proximity, direction};
use crate::contact::check::finite;
use crate::error::Result;
use crate::tensor::{Tensor, Vector};

/// A plane (2D: a line), free on the side to which its normal points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane<const D: usize> {
    point: Vector<D>,
    normal: Vector<D>,
}

impl<const D: usize> Plane<D> {
    /// From any point on it \[m\] and a normal of any length.
    ///
    /// # Errors
    /// When the normal is zero or a number is not finite.
    pub fn new(point: Vector<D>, normal: Vector<D>) -> Result<Self> {
        for c in point.iter() {
            finite("a coordinate of the plane's point", *c)?;
        }
        Ok(Self { point, normal: direction("normal of the plane", normal)? })
    }

    /// A point on it \[m\].
    pub(super) fn point(&self) -> Vector<D> {
        self.point
    }

    /// Unit normal, towards the free side.
    pub(super) fn normal(&self) -> Vector<D> {
        self.normal
    }

    pub(super) fn gap(&self, x: &Vector<D>) -> f64 {
        (x - self.point).dot(&self.normal)
    }

    pub(super) fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        Proximity { gap: self.gap(x), normal: self.normal, hessian: Tensor::zeros() }
    }
}
