//! Sphere, in the plane a disc.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::check_place;
use super::drawing::{Drawing, Window, in_direction};
use super::numbers;
use super::shape::{Core, Proximity, RoundSurface, Shape};
use super::side::Side;
use super::solid::{SolidMoments, rounded_box};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::Length;
use crate::tensor::{Tensor, Vector, rotations};

/// Ball, in 2D a disc; side: outside or inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereObstacle {
    /// Centre \[m\].
    pub center: At<Vec<Length>>,
    /// Radius \[m\], > 0.
    pub radius: Length,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

impl SphereObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        check_place("the centre of a sphere", &self.center, dimension, findings);
        findings.positive("the radius", self.radius);
    }

    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        numbers(&self.center)
    }

    pub(super) fn shape<const D: usize>(&self) -> Sphere<D> {
        Sphere::new(numbers(&self.center), self.radius.value, self.side)
    }

    /// From centre \[m\], radius \[m\] and the free side.
    pub fn of(center: &[f64], radius: f64, side: Side) -> Self {
        let center = center.iter().map(|&x| Length::new(x)).collect::<Vec<_>>();
        Self { center: center.into(), radius: Length::new(radius), side }
    }

    pub(super) fn samples() -> Vec<Self> {
        let on = |side| [Self::of(&[0.2, -0.1], 0.7, side), Self::of(&[0.2, -0.1, -0.4], 0.7, side)];
        [Side::Outside, Side::Inside].into_iter().flat_map(on).collect()
    }
}

/// A sphere (2D: a disc), or the hollow of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere<const D: usize> {
    centre: Vector<D>,
    radius: f64,
    side: Side,
    surface: RoundSurface<D>,
}

impl<const D: usize> Sphere<D> {
    /// From centre \[m\], radius > 0 \[m\] and the free side.
    pub fn new(centre: Vector<D>, radius: f64, side: Side) -> Self {
        let up = Vector::from_fn(|i, _| f64::from(i + 1 == D));
        Self { centre, radius, side, surface: RoundSurface::new(&centre, &up, radius, side.sign()) }
    }
}

impl<const D: usize> Shape<D> for Sphere<D> {
    fn gap(&self, x: &Vector<D>) -> f64 {
        self.surface.gap(x, &Tensor::identity())
    }

    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        self.surface.proximity(x, &Tensor::identity())
    }

    fn core(&self) -> Option<Core<D>> {
        let core = Core { radius: self.radius, point: self.centre, axis: None };
        (self.side == Side::Outside).then_some(core)
    }

    /// A sphere can rotate about its centre.
    fn motions_along(&self, x: &Vector<D>) -> [Vector<D>; 6] {
        let mut motions = [Vector::zeros(); 6];
        motions[..3].copy_from_slice(&rotations(&(x - self.centre)));
        motions
    }

    fn solid(&self) -> Option<SolidMoments<D>> {
        (self.side == Side::Outside)
            .then(|| rounded_box(self.centre, &Vector::zeros(), self.radius, &Tensor::identity()))
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        let circle = window.circle(Vector::<2>::zeros(), self.radius);
        if D == 2 {
            return Drawing::chain_about(circle, true, &self.centre, &in_direction(1));
        }
        // From the point that is nearest to the bodies.
        let offset = window.centre - self.centre;
        let axis = offset.try_normalize(0.0).unwrap_or_else(|| in_direction(2));
        let last = 0.5 * PI - window.half_angle(offset.norm());
        let side: Vec<_> = window.arc(Vector::<2>::zeros(), self.radius, [last, 0.5 * PI]).collect();
        Drawing::revolved(&side, false, &self.centre, &axis, window)
    }

    fn anchored(&self, near: &Vector<D>) -> Box<dyn Shape<D>> {
        let direction = (near - self.centre).try_normalize(0.0);
        let surface = direction.map_or(self.surface, |to| self.surface.seen_from(&self.centre, &to));
        Box::new(Self { surface, ..*self })
    }
}
