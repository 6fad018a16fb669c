//! Infinite circular cylinder in space.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::{check_direction, check_place};
use super::drawing::{Drawing, Window};
use super::shape::{Core, Proximity, RoundSurface, Shape};
use super::side::Side;
use super::{numbers, tangents_of};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Length, Number};
use crate::tensor::{Tensor, Vector, cross, tangential_projector};

/// Infinite cylinder, in 3D only; side: outside or inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderObstacle {
    /// A point of the axis \[m\].
    pub point: At<Vec<Length>>,
    /// Direction of the axis, of any non-zero length.
    pub axis: At<Vec<Number>>,
    /// Radius \[m\], > 0.
    pub radius: Length,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

impl CylinderObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        if dimension != 3 {
            findings.say(self.point.place, "a cylinder is a 3D obstacle");
            findings.cure(
                "use a `sphere`, which is a disc in 2D; with `dimension: axisymmetric` a `plane` with the normal \
                 [1, 0] or [-1, 0] for a cylinder about the axis",
            );
            return;
        }
        check_place("the point of a cylinder", &self.point, dimension, findings);
        check_direction("the axis of a cylinder", &self.axis, dimension, findings);
        findings.positive("the radius", self.radius);
    }

    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        numbers(&self.point)
    }

    pub(super) fn shape<const D: usize>(&self) -> Cylinder<D> {
        Cylinder::new(numbers(&self.point), numbers(&self.axis), self.radius.value, self.side)
    }

    /// From a point on the axis \[m\], the axis, the radius \[m\] and the free side.
    pub fn of(point: [f64; 3], axis: [f64; 3], radius: f64, side: Side) -> Self {
        let point = point.map(Length::new).to_vec();
        let axis = axis.map(Number::new).to_vec();
        Self { point: point.into(), axis: axis.into(), radius: Length::new(radius), side }
    }

    pub(super) fn samples() -> Vec<Self> {
        let on = |side| Self::of([0.1, -0.2, 0.3], [1.0, 2.0, -0.5], 0.6, side);
        [Side::Outside, Side::Inside].map(on).to_vec()
    }
}

/// An infinite cylinder, or the hollow of one. In the plane a disc ([`super::Sphere`]) is used
/// instead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder<const D: usize> {
    point: Vector<D>,
    axis: Vector<D>,
    radius: f64,
    side: Side,
    transverse: Tensor<D>,
    surface: RoundSurface<D>,
}

impl<const D: usize> Cylinder<D> {
    /// From a point on the axis \[m\], the nonzero axis, radius > 0 \[m\] and the free side.
    pub fn new(point: Vector<D>, axis: Vector<D>, radius: f64, side: Side) -> Self {
        let axis = axis.normalize();
        let [across, _] = tangents_of(&axis);
        let surface = RoundSurface::new(&point, &across, radius, side.sign());
        Self { point, axis, radius, side, transverse: tangential_projector(&axis), surface }
    }
}

impl<const D: usize> Shape<D> for Cylinder<D> {
    fn gap(&self, x: &Vector<D>) -> f64 {
        self.surface.gap(x, &self.transverse)
    }

    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        self.surface.proximity(x, &self.transverse)
    }

    fn core(&self) -> Option<Core<D>> {
        let core = Core { radius: self.radius, point: self.point, axis: Some(self.axis) };
        (self.side == Side::Outside).then_some(core)
    }

    /// A cylinder can slide along its axis and rotate about it.
    fn motions_along(&self, x: &Vector<D>) -> [Vector<D>; 6] {
        let mut motions = [Vector::zeros(); 6];
        motions[0] = self.axis;
        motions[1] = cross(&self.axis, &self.surface.offset(x, &self.transverse));
        motions
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        let middle = self.point + self.axis * self.axis.dot(&(window.centre - self.point));
        let line = [-1.0, 1.0].map(|end| Vector::<2>::new(self.radius, end * window.reach()));
        Drawing::revolved(&line, false, &middle, &self.axis, window)
    }

    fn anchored(&self, near: &Vector<D>) -> Box<dyn Shape<D>> {
        let offset = self.transverse * (near - self.point);
        let direction = offset.try_normalize(0.0);
        let surface = direction.map_or(self.surface, |to| self.surface.seen_from(&(near - offset), &to));
        Box::new(Self { surface, ..*self })
    }
}
