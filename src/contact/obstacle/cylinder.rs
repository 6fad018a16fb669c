//! Endless circular cylinder in space.

use super::{Proximity, Side, direction, round};
use crate::contact::check::{finite, positive};
use crate::error::{Error, Result};
use crate::tensor::{Vector, tangential_projector};

/// A cylinder without ends or the hollow of one. In the plane a disc ([`super::Sphere`]) does its work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder<const D: usize> {
    point: Vector<D>,
    axis: Vector<D>,
    radius: f64,
    side: Side,
}

impl<const D: usize> Cylinder<D> {
    /// From a point on the axis \[m\], the axis (any length), radius > 0 \[m\] and the free side.
    ///
    /// # Errors
    /// In the plane; when the axis is zero, the radius not positive or a number not finite.
    pub fn new(point: Vector<D>, axis: Vector<D>, radius: f64, side: Side) -> Result<Self> {
        if D != 3 {
            let cure = "in 2D use `sphere`, which is a disc there";
            return Err(Error::case("a cylinder exists in 3D only").hint(cure));
        }
        for c in point.iter() {
            finite("a coordinate of the cylinder's point", *c)?;
        }
        let axis = direction("axis of the cylinder", axis)?;
        Ok(Self { point, axis, radius: positive("the radius of the cylinder", radius)?, side })
    }

    /// Direction of the axis, of length 1.
    pub fn axis(&self) -> Vector<D> {
        self.axis
    }

    /// From the axis to `x` \[m\], square to it.
    pub fn offset(&self, x: &Vector<D>) -> Vector<D> {
        let offset = x - self.point;
        offset - self.axis * self.axis.dot(&offset)
    }

    pub(super) fn outer_radius(&self) -> Option<f64> {
        (self.side == Side::Outside).then_some(self.radius)
    }

    pub(super) fn gap(&self, x: &Vector<D>) -> f64 {
        self.side.sign() * (self.offset(x).norm() - self.radius)
    }

    pub(super) fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        round(&self.offset(x), &tangential_projector(&self.axis), self.radius, self.side)
    }
}
