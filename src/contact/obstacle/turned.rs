//! Solid of revolution in space: a turned part, given by its profile.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::chain::{Chain, Ends, MOST_POINTS, crossing, encloses_area, repeated};
use super::check::{check_direction, check_place};
use super::drawing::{Drawing, Window};
use super::shape::{CENTRE, Outline, Proximity, Shape};
use super::side::Side;
use super::solid::{SolidMoments, moments_of_revolution};
use super::{numbers, tangents_of};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Length, Number};
use crate::tensor::{Vector, cross, tangential_projector};

/// Solid of revolution with rounded edges, in 3D only: a cylinder or cone of finite length, a stepped
/// pin, a ring; side: outside or inside.
///
/// The surface is at the distance `radius` outside of the region that the profile encloses. If the
/// first and the last point of the profile are on the axis, the region is between the profile and the
/// axis. Otherwise a line joins the last point to the first one, and the solid is a ring.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TurnedObstacle {
    /// The point of the axis at z = 0 of the profile \[m\].
    pub point: At<Vec<Length>>,
    /// Direction of the axis, of any non-zero length.
    pub axis: At<Vec<Number>>,
    /// Points of the profile \[m\], at most 10 000: the distance r from the axis, >= 0, and the
    /// position z along it. Either only the first and the last point have r = 0, or all points of a ring
    /// have r > `radius`.
    pub profile: At<Vec<At<Vec<Length>>>>,
    /// Distance of the surface from the profile \[m\], > 0. It rounds edges that point outward. Make
    /// it larger than the penetration.
    pub radius: Length,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

impl TurnedObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        if dimension != 3 {
            findings.say(self.profile.place, "a turned solid is a 3D obstacle");
            findings.cure(
                "use a closed `polyline`; with `dimension: axisymmetric` it is the half of the section beside \
                 the axis",
            );
            return;
        }
        let before = findings.is_empty();
        check_place("the point of a turned solid", &self.point, dimension, findings);
        check_direction("the axis of a turned solid", &self.axis, dimension, findings);
        findings.positive("the radius of a turned solid", self.radius);
        if self.radius.value == 0.0 {
            findings.cure("a sharp edge has no normal; choose a radius above the penetration");
        }
        let count = self.profile.len();
        if count < 3 {
            let message = format!("the profile of a turned solid needs at least 3 points, found {count}");
            findings.say(self.profile.place, message);
            findings.cure("a line on the axis with a radius is a `capsule`, and a circle about it a `torus`");
            return;
        }
        let message =
            format!("the profile of a turned solid has at most {MOST_POINTS} points, found {count}");
        findings.require(count <= MOST_POINTS, self.profile.place, message);
        for (k, point) in self.profile.iter().enumerate() {
            let number = k + 1;
            if point.len() != 2 {
                let message =
                    format!("point {number} of a profile needs the 2 entries [r, z], found {}", point.len());
                findings.say(point.place, message);
            } else if point[0].value < 0.0 {
                let message = format!(
                    "point {number} of a profile must have a distance r >= 0, found {}",
                    point[0].value
                );
                findings.say(point.place, message);
                findings.cure("give the half of the section on one side of the axis");
            }
        }
        if before && findings.is_empty() {
            self.check_ends(findings);
        }
        if before && findings.is_empty() {
            self.check_outline(findings);
        }
    }

    /// Either both ends of the profile are on the axis and no other point is, or the profile is that
    /// of a ring with a hole.
    fn check_ends(&self, findings: &mut Findings) {
        let last = self.profile.len() - 1;
        let is_on_axis = |k: usize| self.profile[k][0].value == 0.0;
        if let Some(k) = (1..last).find(|&k| is_on_axis(k)) {
            let message = format!("point {} of a profile is on the axis between the ends", k + 1);
            findings.say(self.profile[k].place, message);
            findings.cure(
                "let only the first and the last point have r = 0; describe solids that meet in a point as \
                 two obstacles",
            );
        } else if is_on_axis(0) != is_on_axis(last) {
            let beside = if is_on_axis(0) { last } else { 0 };
            let r = self.profile[beside][0].value;
            let message = format!("the profile has one end on the axis, and point {} at r = {r}", beside + 1);
            findings.say(self.profile[beside].place, message);
            findings.cure("let both ends have r = 0; no point of a ring is on the axis");
        } else if !is_on_axis(0) {
            let distances = self.profile.iter().map(|point| point[0].value);
            let least = distances.fold(f64::INFINITY, f64::min);
            let radius = self.radius.value;
            if radius >= least {
                let message = format!(
                    "the radius of a ring must be smaller than the distance {least} of its profile from the \
                     axis, found {radius}"
                );
                findings.say(self.radius.place, message);
                findings
                    .cure("make `radius` smaller, or let a profile without a hole start and end at r = 0");
            }
        }
    }

    /// The points are the outline of a region.
    fn check_outline(&self, findings: &mut Findings) {
        let points = self.vertices();
        for [one, other] in repeated(&points, true) {
            let message = format!("points {} and {} of a profile are the same", one + 1, other + 1);
            findings.say(self.profile[one].place, message);
            findings.cure("remove one of them; the last point is not repeated");
        }
        if !findings.is_empty() {
            return;
        }
        if !encloses_area(&points) {
            findings.say(self.profile.place, "the profile encloses no area");
            findings.cure("order the points along the outline of the section");
        } else if let Some([one, other]) = crossing(&points) {
            let message = format!("the lines from points {} and {} of the profile meet", one + 1, other + 1);
            findings.say(self.profile[one].place, message);
            findings.cure("order the points along the outline, which must not touch itself");
        }
    }

    fn vertices(&self) -> Vec<Vector<2>> {
        self.profile.iter().map(|point| numbers(point)).collect()
    }

    /// Whether it bounds a solid on the side of its region.
    pub(super) fn is_solid(&self) -> bool {
        self.side == Side::Outside
    }

    /// The point of the axis in the middle of the length.
    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        let heights = self.profile.iter().filter_map(|point| point.get(1)).map(|height| height.value);
        let [least, most] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], height| {
            [least.min(height), most.max(height)]
        });
        let axis = numbers::<D, 0, 0, 0>(&self.axis).normalize();
        numbers::<D, 0, 1, 0>(&self.point) + axis * (0.5 * (least + most))
    }

    pub(super) fn shape<const D: usize>(&self) -> Turned<D> {
        let points = self.vertices();
        let is_on_axis = points.first().is_some_and(|point| point[0] == 0.0);
        let ends = if is_on_axis { Ends::Mirrored } else { Ends::Joined };
        let section = Chain::new(points, ends, self.radius.value);
        let axis = numbers::<D, 0, 0, 0>(&self.axis).normalize();
        Turned { point: numbers(&self.point), axis, section, side: self.side }
    }

    /// From the point and the direction of the axis, the points of the profile and the radius \[m\], and
    /// the free side.
    pub fn of(point: [f64; 3], axis: [f64; 3], profile: &[[f64; 2]], radius: f64, side: Side) -> Self {
        let point = point.map(Length::new).to_vec().into();
        let axis = axis.map(Number::new).to_vec().into();
        let profile: Vec<At<Vec<Length>>> =
            profile.iter().map(|point| point.map(Length::new).to_vec().into()).collect();
        Self { point, axis, profile: profile.into(), radius: Length::new(radius), side }
    }

    pub(super) fn samples() -> Vec<Self> {
        let cone = [[0.0, -0.9], [0.5, -0.9], [0.2, 0.9], [0.0, 0.9]];
        let ring = [[0.75, 0.2], [0.9, -0.35], [0.6, -0.35]];
        let hollow = [[0.0, -1.5], [1.2, -1.5], [1.0, 1.5], [0.0, 1.7]];
        vec![
            Self::of([0.1, -0.2, 0.1], [1.0, 2.0, -1.5], &cone, 0.2, Side::Outside),
            Self::of([0.9, 0.1, -0.6], [1.0, -1.0, 2.5], &ring, 0.45, Side::Outside),
            Self::of([0.3, 0.2, 0.1], [0.3, -0.2, 1.0], &hollow, 0.3, Side::Inside),
        ]
    }
}

/// A solid of revolution, or the hollow of one: all points at the radius from the region that a
/// profile sweeps around an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Turned<const D: usize> {
    /// The point of the axis at height zero \[m\].
    point: Vector<D>,
    axis: Vector<D>,
    /// In the half plane of the distance from the axis and the height.
    section: Chain,
    side: Side,
}

impl<const D: usize> Shape<D> for Turned<D> {
    /// On the axis all directions across it are equally near, and one of them is used. The curvature
    /// around the axis is that in the half plane there: its limit where the normal is along the axis.
    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        let offset = x - self.point;
        let height = self.axis.dot(&offset);
        let across = offset - self.axis * height;
        // Near the axis, rounding leaves a part along it.
        let across = across - self.axis * self.axis.dot(&across);
        let reach = across.norm();
        let on_axis = reach <= CENTRE * self.section.radius();
        let outward = if on_axis { tangents_of(&self.axis)[0] } else { across / reach };
        let Proximity { gap, normal, hessian } = self.section.proximity(&Vector::<2>::new(reach, height));
        let around = tangential_projector(&self.axis) - outward * outward.transpose();
        let part = if on_axis { hessian[(0, 0)] } else { normal[0] / reach };
        let mixed = outward * self.axis.transpose();
        let in_section = outward * outward.transpose() * hessian[(0, 0)]
            + (mixed + mixed.transpose()) * hessian[(0, 1)]
            + self.axis * self.axis.transpose() * hessian[(1, 1)];
        Proximity {
            gap,
            normal: outward * normal[0] + self.axis * normal[1],
            hessian: in_section + around * part,
        }
        .on(self.side)
    }

    fn outline(&self) -> Outline {
        Outline::Edged
    }

    fn solid(&self) -> Option<SolidMoments<D>> {
        if D != 3 || self.side == Side::Inside {
            return None;
        }
        Some(moments_of_revolution(&self.section.outline()?, &self.point, &self.axis))
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        let curve = self.section.curve(window);
        Drawing::revolved(&curve, self.section.is_joined(), &self.point, &self.axis, window)
    }

    /// It can rotate about its axis.
    fn motions_along(&self, x: &Vector<D>) -> [Vector<D>; 6] {
        let mut motions = [Vector::zeros(); 6];
        motions[0] = cross(&self.axis, &(x - self.point));
        motions
    }

    fn anchored(&self, _near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests;
