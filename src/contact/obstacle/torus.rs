//! Torus: a ring of circular section, in space.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::{check_direction, check_place};
use super::drawing::{Drawing, Window};
use super::shape::{CENTRE, Outline, Proximity, Shape};
use super::side::Side;
use super::solid::{SolidMoments, ring};
use super::{numbers, tangents_of};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Length, Number};
use crate::tensor::{Tensor, Vector, cross, tangential_projector};

/// Ring of circular section, in 3D only; side: outside, or inside of a bent pipe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TorusObstacle {
    /// Centre \[m\].
    pub center: At<Vec<Length>>,
    /// Direction of the axis of the ring, of any non-zero length.
    pub axis: At<Vec<Number>>,
    /// Radius of the circle in the middle of the tube \[m\], > 0.
    pub ring_radius: Length,
    /// Radius of the tube \[m\], > 0 and below `ring_radius`.
    pub tube_radius: Length,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

impl TorusObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        if dimension != 3 {
            findings.say(self.center.place, "a torus is a 3D obstacle: a section of it is two discs");
            findings.cure(
                "use a `sphere` for each disc, which is a disc in 2D; with `dimension: axisymmetric` one of them \
                 at x = ring_radius",
            );
            return;
        }
        check_place("the centre of a torus", &self.center, dimension, findings);
        check_direction("the axis of a torus", &self.axis, dimension, findings);
        findings.positive("the radius of the ring", self.ring_radius);
        findings.positive("the radius of the tube", self.tube_radius);
        let [ring, tube] = [self.ring_radius.value, self.tube_radius.value];
        if tube >= ring && ring > 0.0 {
            let message =
                format!("the tube of a torus must be thinner than the ring of radius {ring}, found {tube}");
            findings.say(self.tube_radius.place, message);
            findings.cure("make `tube_radius` smaller than `ring_radius`");
        }
    }

    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        numbers(&self.center)
    }

    pub(super) fn shape<const D: usize>(&self) -> Torus<D> {
        let [ring, tube] = [self.ring_radius.value, self.tube_radius.value];
        let axis = numbers::<D, 0, 0, 0>(&self.axis).normalize();
        Torus { centre: numbers(&self.center), axis, ring, tube, side: self.side }
    }

    /// From the centre \[m\], the axis, the radii of the ring and of the tube \[m\] and the free
    /// side.
    pub fn of(center: [f64; 3], axis: [f64; 3], [ring, tube]: [f64; 2], side: Side) -> Self {
        let center = center.map(Length::new).to_vec().into();
        let axis = axis.map(Number::new).to_vec().into();
        Self { center, axis, ring_radius: Length::new(ring), tube_radius: Length::new(tube), side }
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![
            Self::of([1.1, -0.2, 0.0], [1.0, 2.0, -1.5], [0.7, 0.4], Side::Outside),
            Self::of([2.0, 0.2, 0.9], [0.2, -0.3, 1.0], [1.9, 0.6], Side::Inside),
        ]
    }
}

/// A torus about an axis, or the hollow of one: all points at the radius of the tube from a circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torus<const D: usize> {
    centre: Vector<D>,
    axis: Vector<D>,
    ring: f64,
    tube: f64,
    side: Side,
}

impl<const D: usize> Shape<D> for Torus<D> {
    /// On the axis all directions across it are equally near, and on the circle all directions
    /// across the tube. One of them is the normal there, without curvature.
    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        let offset = x - self.centre;
        let height = self.axis.dot(&offset);
        let across = offset - self.axis * height;
        let reach = across.norm();
        let on_axis = reach <= CENTRE * self.ring;
        let outward = if on_axis { tangents_of(&self.axis)[0] } else { across / reach };
        // From the middle of the tube, which rotates with the position around the axis.
        let way = outward * (reach - self.ring) + self.axis * height;
        let distance = way.norm();
        if distance <= CENTRE * self.tube {
            let gap = distance - self.tube;
            return Proximity { gap, normal: outward, hessian: Tensor::zeros() }.on(self.side);
        }
        let normal = way / distance;
        let around = tangential_projector(&self.axis) - outward * outward.transpose();
        let along = Tensor::identity() - around - normal * normal.transpose();
        let part = if on_axis { 0.0 } else { (reach - self.ring) / (reach * distance) };
        Proximity { gap: distance - self.tube, normal, hessian: along / distance + around * part }
            .on(self.side)
    }

    fn outline(&self) -> Outline {
        Outline::Smooth
    }

    /// A torus can rotate about its axis.
    fn motions_along(&self, x: &Vector<D>) -> [Vector<D>; 6] {
        let mut motions = [Vector::zeros(); 6];
        motions[0] = cross(&self.axis, &(x - self.centre));
        motions
    }

    fn solid(&self) -> Option<SolidMoments<D>> {
        (self.side == Side::Outside).then(|| ring(self.centre, &self.axis, self.ring, self.tube))
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        let tube = window.circle(Vector::<2>::new(self.ring, 0.0), self.tube);
        Drawing::revolved(&tube, true, &self.centre, &self.axis, window)
    }

    fn anchored(&self, _near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(*self)
    }
}
