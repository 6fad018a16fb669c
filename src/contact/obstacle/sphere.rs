//! Sphere, in the plane a disc.

use super::{Proximity, Side, round};
use crate::contact::check::{finite, positive};
use crate::error::Result;
use crate::tensor::{Tensor, Vector};

/// A sphere (2D: a disc) or the hollow of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere<const D: usize> {
    centre: Vector<D>,
    radius: f64,
    side: Side,
}

impl<const D: usize> Sphere<D> {
    /// From centre \[m\], radius > 0 \[m\] and the free side.
    ///
    /// # Errors
    /// When the radius is not positive or a number is not finite.
    pub fn new(centre: Vector<D>, radius: f64, side: Side) -> Result<Self> {
        for c in centre.iter() {
            finite("a coordinate of the sphere's centre", *c)?;
        }
        Ok(Self { centre, radius: positive("the radius of the sphere", radius)?, side })
    }

    pub(super) fn outer_radius(&self) -> Option<f64> {
        (self.side == Side::Outside).then_some(self.radius)
    }

    pub(super) fn centre(&self) -> Vector<D> {
        self.centre
    }

    pub(super) fn gap(&self, x: &Vector<D>) -> f64 {
        self.side.sign() * ((x - self.centre).norm() - self.radius)
    }

    pub(super) fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        round(&(x - self.centre), &Tensor::identity(), self.radius, self.side)
    }
}
