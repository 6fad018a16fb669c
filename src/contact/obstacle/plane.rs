//! Half space below a plane.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::{check_direction, check_place};
use super::drawing::{Drawing, Window, flat};
use super::shape::{Proximity, Shape};
use super::{numbers, tangents_of};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Length, Number};
use crate::tensor::{Tensor, Vector};

/// Half space below a plane, free where the normal points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneObstacle {
    /// A point of the plane \[m\].
    pub point: At<Vec<Length>>,
    /// Normal out of the obstacle, of any non-zero length.
    pub normal: At<Vec<Number>>,
}

impl PlaneObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        check_place("the point of a plane", &self.point, dimension, findings);
        check_direction("the normal of a plane", &self.normal, dimension, findings);
    }

    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        numbers(&self.point)
    }

    pub(super) fn shape<const D: usize>(&self) -> Plane<D> {
        Plane::new(numbers(&self.point), numbers(&self.normal))
    }

    /// The plane through a point \[m\] with a normal.
    pub fn of(point: &[f64], normal: &[f64]) -> Self {
        let point = point.iter().map(|&x| Length::new(x)).collect::<Vec<_>>();
        let normal = normal.iter().map(|&x| Number::new(x)).collect::<Vec<_>>();
        Self { point: point.into(), normal: normal.into() }
    }

    pub(super) fn samples() -> Vec<Self> {
        vec![
            Self::of(&[0.0, 0.1], &[0.0, 1.0]),
            Self::of(&[0.0, 0.1], &[1.0, -0.7]),
            Self::of(&[0.0, 0.1, 0.2], &[0.0, 0.0, 1.0]),
            Self::of(&[0.0, 0.1, 0.2], &[1.0, -0.7, -2.4]),
        ]
    }
}

/// A plane (2D: a line), free on the side to which its normal points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane<const D: usize> {
    point: Vector<D>,
    normal: Vector<D>,
}

impl<const D: usize> Plane<D> {
    /// From any point on it \[m\] and a nonzero normal.
    pub fn new(point: Vector<D>, normal: Vector<D>) -> Self {
        Self { point, normal: normal.normalize() }
    }
}

impl<const D: usize> Shape<D> for Plane<D> {
    fn gap(&self, x: &Vector<D>) -> f64 {
        (x - self.point).dot(&self.normal)
    }

    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        Proximity { gap: self.gap(x), normal: self.normal, hessian: Tensor::zeros() }
    }

    fn is_plane(&self) -> bool {
        true
    }

    /// A plane can slide along itself and rotate about its normal.
    fn motions_along(&self, x: &Vector<D>) -> [Vector<D>; 6] {
        let mut motions = [Vector::zeros(); 6];
        let [first, second] = tangents_of(&self.normal);
        motions[0] = first;
        if D == 3 {
            let arm = x - self.point;
            motions[1] = second;
            motions[2] = first * second.dot(&arm) - second * first.dot(&arm);
        }
        motions
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        flat(window.centre - self.normal * self.gap(&window.centre), &self.normal, window)
    }

    fn anchored(&self, near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(Self { point: near - self.normal * self.gap(near), normal: self.normal })
    }
}
