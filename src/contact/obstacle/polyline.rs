//! Chain of straight lines with a radius, in the plane.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::chain::{Chain, Ends, MOST_POINTS, crossing, encloses_area, repeated};
use super::drawing::{Drawing, Window};
use super::numbers;
use super::shape::{Outline, Proximity, Shape};
use super::side::Side;
use super::solid::{SolidMoments, moments_of_section};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::Length;
use crate::tensor::{Tensor, Vector};

/// Chain of straight lines with a radius, in 2D only: a profile, or a bent plate.
///
/// A closed chain bounds a solid, whose surface is at the distance `radius` outside of the chain.
/// An open chain is a plate of the thickness `2 radius` with round ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolylineObstacle {
    /// Points of the chain \[m\], at most 10 000.
    pub points: At<Vec<At<Vec<Length>>>>,
    /// Distance of the surface from the chain \[m\], > 0. It rounds corners that point outward. Make
    /// it larger than the penetration.
    pub radius: Length,
    /// Whether the last point is joined to the first one.
    #[serde(default)]
    pub closed: bool,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

impl PolylineObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        if dimension != 2 {
            findings.say(self.points.place, "a polyline is a 2D obstacle");
            findings
                .cure("use `turned` for a solid of revolution, or a `surface`, which is read from a file");
            return;
        }
        let count = self.points.len();
        let least = if self.closed { 3 } else { 2 };
        if count < least {
            findings
                .say(self.points.place, format!("a polyline needs at least {least} points, found {count}"));
            return;
        }
        let message = format!("a polyline has at most {MOST_POINTS} points, found {count}");
        findings.require(count <= MOST_POINTS, self.points.place, message);
        let before = findings.is_empty();
        self.points.iter().for_each(|point| findings.entries("a point of a polyline", point, 2));
        findings.positive("the radius of a polyline", self.radius);
        if self.radius.value == 0.0 {
            findings.cure("a sharp corner has no normal; choose a radius above the penetration");
        }
        if !(before && findings.is_empty()) {
            return;
        }
        let points = self.vertices::<2>();
        for [one, other] in repeated(&points, self.closed) {
            let message = format!("points {} and {} of a polyline are the same", one + 1, other + 1);
            findings.say(self.points[one].place, message);
            findings.cure("remove one of them; with `closed: true` the last point is not repeated");
        }
        if self.closed && !encloses_area(&points) {
            findings.say(self.points.place, "the closed polyline encloses no area");
            findings.cure("order the points along the outline, or remove `closed`");
        } else if self.closed
            && findings.is_empty()
            && let Some([one, other]) = crossing(&points)
        {
            let message =
                format!("the lines from points {} and {} of the closed polyline meet", one + 1, other + 1);
            findings.say(self.points[one].place, message);
            findings
                .cure("order the points along the outline, which must not touch itself, or remove `closed`");
        }
        if !self.closed && self.side == Side::Inside {
            findings.say(self.points.place, "an open polyline has no inside");
            findings.cure("add `closed: true`, or remove `side`");
        }
    }

    fn vertices<const D: usize>(&self) -> Vec<Vector<D>> {
        self.points.iter().map(|point| numbers(point)).collect()
    }

    /// Whether it bounds a solid on the side of its region.
    pub(super) fn is_solid(&self) -> bool {
        self.closed && self.side == Side::Outside
    }

    /// From points and radius \[m\], whether the last point is joined to the first one, and the free
    /// side.
    pub fn of(points: &[[f64; 2]], radius: f64, closed: bool, side: Side) -> Self {
        let points = points.iter().map(|point| At::from(point.map(Length::new).to_vec()));
        Self { points: points.collect::<Vec<_>>().into(), radius: Length::new(radius), closed, side }
    }

    /// The mean of the points.
    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        let points = self.vertices::<D>();
        points.iter().sum::<Vector<D>>() / points.len().max(1) as f64
    }

    pub(super) fn shape<const D: usize>(&self) -> Polyline<D> {
        let ends = if self.closed { Ends::Joined } else { Ends::Free };
        Polyline { chain: Chain::new(self.vertices(), ends, self.radius.value), side: self.side }
    }

    pub(super) fn samples() -> Vec<Self> {
        let profile = [[-0.3, -0.2], [0.2, -0.3], [0.2, 0.1], [-0.1, 0.2]];
        vec![
            Self::of(&profile, 0.4, true, Side::Outside),
            Self::of(&[[-1.5, -1.4], [-1.3, 1.3], [1.4, 0.7], [1.1, -1.2]], 0.3, true, Side::Inside),
            Self::of(&[[-0.9, 0.1], [-0.1, 0.0], [0.1, -0.9]], 0.5, false, Side::Outside),
        ]
    }
}

/// All points at the radius from a chain of straight lines in the plane, or from the region within
/// it.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline<const D: usize> {
    chain: Chain,
    side: Side,
}

impl<const D: usize> Shape<D> for Polyline<D> {
    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        let flat = self.chain.proximity(&Vector::<2>::new(x[0], x[1]));
        let in_plane = |i: usize| i < 2;
        Proximity {
            gap: flat.gap,
            normal: Vector::from_fn(|i, _| if in_plane(i) { flat.normal[i] } else { 0.0 }),
            hessian: Tensor::from_fn(
                |i, j| {
                    if in_plane(i) && in_plane(j) { flat.hessian[(i, j)] } else { 0.0 }
                },
            ),
        }
        .on(self.side)
    }

    fn outline(&self) -> Outline {
        Outline::Edged
    }

    fn solid(&self) -> Option<SolidMoments<D>> {
        if D != 2 || self.side == Side::Inside {
            return None;
        }
        let flat = moments_of_section(&self.chain.outline()?);
        Some(SolidMoments {
            volume: flat.volume,
            centroid: Vector::from_fn(|i, _| flat.centroid[i]),
            second: Tensor::from_fn(|i, j| flat.second[(i, j)]),
        })
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        Drawing::chain(self.chain.curve(window), true)
    }

    fn anchored(&self, _near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(self.clone())
    }
}
