//! Infinite cone with a round tip, in the plane a wedge.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::{check_direction, check_place};
use super::drawing::{Drawing, Window};
use super::shape::{CENTRE, Outline, Proximity, Shape, tube_about};
use super::side::Side;
use super::{numbers, tangents_of};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Length, Number};
use crate::tensor::{Tensor, Vector, cross, tangential_projector};

/// Infinite circular cone with a round tip, in 2D a wedge; side: outside or inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConeObstacle {
    /// Foremost point of the round tip \[m\].
    pub tip: At<Vec<Length>>,
    /// Direction from the tip into the cone, of any non-zero length.
    pub axis: At<Vec<Number>>,
    /// Angle between axis and surface \[rad\], > 0 and < pi/2.
    pub half_angle: Number,
    /// Radius of the tip \[m\], > 0. A sharp tip has no normal.
    pub radius: Length,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

impl ConeObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        check_place("the tip of a cone", &self.tip, dimension, findings);
        check_direction("the axis of a cone", &self.axis, dimension, findings);
        let angle = self.half_angle;
        if !(angle.value > 0.0 && angle.value < std::f64::consts::FRAC_PI_2) {
            let found = angle.value;
            let message = format!("the half angle of a cone must be between 0 and pi/2, found {found}");
            findings.say(angle.place, message);
            findings.cure("the angle is in radians: 70.3 degrees are 1.227; use a `plane` for pi/2");
        }
        findings.positive("the radius of the tip", self.radius);
        if self.radius.value == 0.0 {
            findings.cure("a sharp tip has no normal; choose a radius above the penetration");
        }
    }

    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        numbers(&self.tip)
    }

    pub(super) fn shape<const D: usize>(&self) -> Cone<D> {
        let axis = numbers::<D, 0, 0, 0>(&self.axis).normalize();
        let centre = numbers::<D, 0, 1, 0>(&self.tip) + axis * self.radius.value;
        let (sine, cosine) = self.half_angle.value.sin_cos();
        Cone { centre, axis, sine, cosine, radius: self.radius.value, side: self.side }
    }

    /// From the tip \[m\], the axis, the half angle \[rad\], the radius of the tip \[m\] and the
    /// free side.
    pub fn of(tip: &[f64], axis: &[f64], half_angle: f64, radius: f64, side: Side) -> Self {
        let tip = tip.iter().map(|&x| Length::new(x)).collect::<Vec<_>>().into();
        let axis = axis.iter().map(|&x| Number::new(x)).collect::<Vec<_>>().into();
        Self { tip, axis, half_angle: Number::new(half_angle), radius: Length::new(radius), side }
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![
            Self::of(&[0.3, 0.6], &[-1.0, -2.0], 1.1, 0.5, Side::Outside),
            Self::of(&[0.4, 0.9], &[0.2, -1.0], 0.9, 0.4, Side::Inside),
            Self::of(&[0.6, 0.6, 0.8], &[1.0, -1.0, -1.5], 1.1, 0.4, Side::Outside),
            Self::of(&[0.9, 0.7, 0.75], &[-0.9, -0.5, -0.7], 0.8, 0.4, Side::Inside),
        ]
    }
}

/// An infinite cone (2D: a wedge) with a round tip, or the hollow of one: all points at the radius
/// of the tip from a sharp cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone<const D: usize> {
    /// Centre of the tip, which is the tip of the sharp cone \[m\].
    centre: Vector<D>,
    axis: Vector<D>,
    sine: f64,
    cosine: f64,
    radius: f64,
    side: Side,
}

impl<const D: usize> Shape<D> for Cone<D> {
    /// On the axis all directions across it are equally near. One of them is used, without
    /// curvature.
    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        let offset = x - self.centre;
        let height = self.axis.dot(&offset);
        let across = offset - self.axis * height;
        let reach = across.norm();
        if height * self.cosine + reach * self.sine <= 0.0 {
            let (distance, normal, hessian) = tube_about(&offset, None, self.radius);
            return Proximity { gap: distance - self.radius, normal, hessian }.on(self.side);
        }
        let on_axis = reach <= CENTRE * self.radius;
        let outward = if on_axis { tangents_of(&self.axis)[0] } else { across / reach };
        let distance = reach * self.cosine - height * self.sine;
        let normal = outward * self.cosine - self.axis * self.sine;
        // In 2D the sides are straight.
        let hessian = if D == 2 || on_axis {
            Tensor::zeros()
        } else {
            (tangential_projector(&self.axis) - outward * outward.transpose()) * (self.cosine / reach)
        };
        Proximity { gap: distance - self.radius, normal, hessian }.on(self.side)
    }

    fn outline(&self) -> Outline {
        Outline::Edged
    }

    /// In space a cone can rotate about its axis.
    fn motions_along(&self, x: &Vector<D>) -> [Vector<D>; 6] {
        let mut motions = [Vector::zeros(); 6];
        if D == 3 {
            motions[0] = cross(&self.axis, &(x - self.centre));
        }
        motions
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        let flank = self.sine.asin();
        let length = window.reach() + (window.centre - self.centre).norm();
        let end = Vector::<2>::new(self.cosine, -self.sine) * self.radius
            + Vector::<2>::new(self.sine, self.cosine) * length;
        let side: Vec<_> =
            window.arc(Vector::<2>::zeros(), self.radius, [-0.5 * PI, -flank]).chain([end]).collect();
        if D == 2 {
            let other = side.iter().skip(1).rev().map(|x| Vector::<2>::new(-x[0], x[1]));
            let outline: Vec<_> = other.chain(side.iter().copied()).collect();
            return Drawing::chain_about(outline, false, &self.centre, &self.axis);
        }
        Drawing::revolved(&side, false, &self.centre, &self.axis, window)
    }

    fn anchored(&self, _near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(*self)
    }
}
