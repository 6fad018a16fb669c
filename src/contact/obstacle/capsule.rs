//! Capsule: a cylinder with round ends, in the plane a stadium.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::check_place;
use super::drawing::{Drawing, Window};
use super::shape::{Outline, Proximity, Shape, tube_about};
use super::side::Side;
use super::solid::{SolidMoments, rounded_box};
use super::{numbers, tangents_of};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::Length;
use crate::tensor::{Tensor, Vector, cross};

/// Cylinder of finite length with round ends, in 2D a stadium; side: outside or inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CapsuleObstacle {
    /// Centre of the ball at one end \[m\].
    pub from: At<Vec<Length>>,
    /// Centre of the ball at the other end \[m\].
    pub to: At<Vec<Length>>,
    /// Radius \[m\], > 0.
    pub radius: Length,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

impl CapsuleObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        check_place("`from` of a capsule", &self.from, dimension, findings);
        check_place("`to` of a capsule", &self.to, dimension, findings);
        findings.positive("the radius", self.radius);
        if numbers::<3, 0, 1, 0>(&self.from) == numbers::<3, 0, 1, 0>(&self.to) {
            findings.say(self.to.place, "both ends of a capsule are the same point");
            findings.cure("use a `sphere`");
        }
    }

    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        (numbers::<D, 0, 1, 0>(&self.from) + numbers::<D, 0, 1, 0>(&self.to)) * 0.5
    }

    pub(super) fn shape<const D: usize>(&self) -> Capsule<D> {
        Capsule { ends: [numbers(&self.from), numbers(&self.to)], radius: self.radius.value, side: self.side }
    }

    /// From the centres of both ends and the radius \[m\], and the free side.
    pub fn of(from: &[f64], to: &[f64], radius: f64, side: Side) -> Self {
        let lengths = |list: &[f64]| list.iter().map(|&x| Length::new(x)).collect::<Vec<_>>().into();
        Self { from: lengths(from), to: lengths(to), radius: Length::new(radius), side }
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![
            Self::of(&[-0.4, 0.0], &[0.35, 0.1], 0.5, Side::Outside),
            Self::of(&[-0.2, -0.1], &[0.2, 0.3], 0.7, Side::Inside),
            Self::of(&[0.5, 0.0, 0.1], &[1.1, 0.2, -0.3], 0.5, Side::Outside),
            Self::of(&[0.2, -0.5, 0.1], &[0.1, 1.5, 0.4], 0.6, Side::Inside),
        ]
    }
}

/// A capsule (2D: a stadium), or the hollow of one: all points at the radius from a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule<const D: usize> {
    ends: [Vector<D>; 2],
    radius: f64,
    side: Side,
}

impl<const D: usize> Shape<D> for Capsule<D> {
    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        let [from, to] = self.ends;
        let span = to - from;
        let along = span.dot(&(x - from)) / span.norm_squared();
        let axis = (along > 0.0 && along < 1.0).then(|| span.normalize());
        let nearest = from + span * along.clamp(0.0, 1.0);
        let (distance, normal, hessian) = tube_about(&(x - nearest), axis.as_ref(), self.radius);
        Proximity { gap: distance - self.radius, normal, hessian }.on(self.side)
    }

    fn outline(&self) -> Outline {
        Outline::Smooth
    }

    /// In space a capsule can rotate about its axis.
    fn motions_along(&self, x: &Vector<D>) -> [Vector<D>; 6] {
        let mut motions = [Vector::zeros(); 6];
        if D == 3 {
            let [from, to] = self.ends;
            motions[0] = cross(&(to - from).normalize(), &(x - from));
        }
        motions
    }

    fn solid(&self) -> Option<SolidMoments<D>> {
        let [from, to] = self.ends;
        let half = Vector::from_fn(|i, _| if i == 0 { 0.5 * (to - from).norm() } else { 0.0 });
        // In 2D the second tangent of the axis is zero.
        let axis = (to - from).try_normalize(0.0)?;
        let across = tangents_of(&axis);
        let columns: [Vector<D>; D] = std::array::from_fn(|i| if i == 0 { axis } else { across[i - 1] });
        let rotation = Tensor::from_columns(&columns);
        (self.side == Side::Outside).then(|| rounded_box((from + to) * 0.5, &half, self.radius, &rotation))
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        let [from, to] = self.ends;
        let length = (to - from).norm();
        let axis = (to - from) / length;
        let end =
            |along: f64, angles: [f64; 2]| window.arc(Vector::<2>::new(0.0, along), self.radius, angles);
        if D == 2 {
            let outline = end(0.0, [-PI, 0.0]).chain(end(length, [0.0, PI]));
            return Drawing::chain_about(outline, true, &from, &axis);
        }
        let side: Vec<_> = end(0.0, [-0.5 * PI, 0.0]).chain(end(length, [0.0, 0.5 * PI])).collect();
        Drawing::revolved(&side, false, &from, &axis, window)
    }

    fn anchored(&self, _near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(*self)
    }
}
