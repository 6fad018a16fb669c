//! Box with rounded edges, in the plane a rounded rectangle.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::{check_direction, check_place, check_radius};
use super::drawing::{Drawing, Window, round_cuboid};
use super::shape::{Outline, Proximity, Shape};
use super::side::Side;
use super::solid::{SolidMoments, rounded_box};
use super::{numbers, rotation_about};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Length, Number};
use crate::tensor::{Tensor, Vector};

/// Box with rounded edges, in 2D a rounded rectangle; side: outside or inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxObstacle {
    /// Centre \[m\].
    pub center: At<Vec<Length>>,
    /// Full edge lengths, with the rounding \[m\], > 0.
    pub size: At<Vec<Length>>,
    /// Radius of the edges and corners \[m\], > 0, at most half of the smallest edge length. A
    /// sharp edge has no normal. Make the radius larger than the penetration.
    pub radius: Length,
    /// Angle by which the box is rotated about its centre \[rad\], counterclockwise in 2D.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<Number>,
    /// Axis of this rotation in 3D, of any non-zero length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<At<Vec<Number>>>,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

impl BoxObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        check_place("the centre of a box", &self.center, dimension, findings);
        findings.entries("the size of a box", &self.size, dimension);
        self.size.iter().for_each(|&size| findings.positive("an edge length of a box", size));
        let smallest = self.size.iter().map(|size| size.value).fold(f64::INFINITY, f64::min);
        check_radius("the radius of the edges of a box", self.radius, 0.5 * smallest, findings);
        match (&self.axis, self.angle) {
            (Some(axis), _) if dimension == 2 => {
                findings.say(axis.place, "a box in 2D rotates about z");
                findings.cure("remove `axis`");
            }
            (Some(axis), None) => {
                findings.say(axis.place, "a box has the axis of a rotation, but no `angle`");
                findings.cure("add `angle` in radians, or remove `axis`");
            }
            (None, Some(angle)) if dimension == 3 => {
                findings.say(angle.place, "a rotation of a box in 3D needs an `axis`");
                findings.cure("add `axis`, for example `axis: [0, 0, 1]`");
            }
            (Some(axis), Some(_)) => {
                check_direction("the axis of the rotation of a box", axis, dimension, findings);
            }
            _ => {}
        }
    }

    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        numbers(&self.center)
    }

    pub(super) fn shape<const D: usize>(&self) -> Cuboid<D> {
        let angle = self.angle.map_or(0.0, |angle| angle.value);
        let axis = self.axis.as_ref().map_or_else(Vector::<3>::z, |axis| numbers(axis));
        let rotation = rotation_about(&axis, angle);
        Cuboid::new(numbers(&self.center), numbers(&self.size), self.radius.value, rotation, self.side)
    }

    /// From the centre, the edge lengths and the radius of the edges \[m\], and the free side.
    pub fn of(center: &[f64], size: &[f64], radius: f64, side: Side) -> Self {
        let lengths = |list: &[f64]| list.iter().map(|&x| Length::new(x)).collect::<Vec<_>>();
        let (center, size) = (lengths(center).into(), lengths(size).into());
        Self { center, size, radius: Length::new(radius), angle: None, axis: None, side }
    }

    pub(super) fn samples() -> Vec<Self> {
        let turned = |angle: f64, axis: Option<[f64; 3]>, sample: Self| {
            let axis = axis.map(|axis| axis.map(Number::new).to_vec().into());
            Self { angle: Some(Number::new(angle)), axis, ..sample }
        };
        vec![
            turned(0.3, None, Self::of(&[0.1, 0.1], &[0.9, 0.8], 0.35, Side::Outside)),
            Self::of(&[0.2, -0.1], &[1.6, 1.8], 0.7, Side::Inside),
            turned(
                0.4,
                Some([1.0, 2.0, -1.0]),
                Self::of(&[0.9, 0.1, -0.2], &[1.6, 1.5, 1.7], 0.7, Side::Outside),
            ),
            Self::of(&[0.2, -0.1, -0.4], &[2.0, 1.9, 2.2], 0.8, Side::Inside),
        ]
    }
}

/// A box (2D: a rectangle) with rounded edges, or the hollow of one: all points at the radius from
/// a smaller box, the core.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid<const D: usize> {
    centre: Vector<D>,
    /// Half edge lengths of the core \[m\].
    half: Vector<D>,
    radius: f64,
    /// Takes vectors from the axes of the box to space.
    rotation: Tensor<D>,
    side: Side,
}

impl<const D: usize> Cuboid<D> {
    /// From centre, edge lengths and radius of the edges \[m\], a rotation and the free side.
    pub fn new(centre: Vector<D>, size: Vector<D>, radius: f64, rotation: Tensor<D>, side: Side) -> Self {
        let half = size.map(|size| (0.5 * size - radius).max(0.0));
        Self { centre, half, radius, rotation, side }
    }
}

impl<const D: usize> Shape<D> for Cuboid<D> {
    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        let local = self.rotation.transpose() * (x - self.centre);
        let beyond = Vector::<D>::from_fn(|i, _| local[i].abs() - self.half[i]);
        let sign = |i: usize| 1.0_f64.copysign(local[i]);
        // From the nearest point of the core.
        let way = Vector::<D>::from_fn(|i, _| if beyond[i] > 0.0 { beyond[i] * sign(i) } else { 0.0 });
        let away = way.norm();
        let (distance, normal, hessian) = if away > 0.0 {
            let normal = way / away;
            let free = Tensor::<D>::from_fn(|i, j| f64::from(u8::from(i == j && beyond[i] > 0.0)));
            (away, normal, (free - normal * normal.transpose()) / away)
        } else {
            // In the core the nearest face counts.
            let face = beyond.imax();
            let normal = Vector::from_fn(|i, _| if i == face { sign(i) } else { 0.0 });
            (beyond[face], normal, Tensor::zeros())
        };
        let turn = self.rotation;
        Proximity {
            gap: distance - self.radius,
            normal: turn * normal,
            hessian: turn * hessian * turn.transpose(),
        }
        .on(self.side)
    }

    fn outline(&self) -> Outline {
        Outline::Edged
    }

    fn solid(&self) -> Option<SolidMoments<D>> {
        (self.side == Side::Outside)
            .then(|| rounded_box(self.centre, &self.half, self.radius, &self.rotation))
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        let mut drawing = round_cuboid(&self.half, self.radius, window);
        drawing.points.iter_mut().for_each(|x| *x = self.centre + self.rotation * *x);
        drawing
    }

    fn anchored(&self, _near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(*self)
    }
}
