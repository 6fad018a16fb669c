//! From the words of a case to obstacles.

use crate::case;
use crate::contact::obstacle::{Cylinder, Obstacle, Plane, Side, Sphere};
use crate::error::Result;
use crate::tensor::Vector;

fn vector<const D: usize, const KG: i8, const M: i8, const S: i8>(
    values: &[crate::reader::quantity::Quantity<KG, M, S>],
) -> Vector<D> {
    Vector::from_fn(|i, _| values.get(i).map_or(0.0, |value| value.value))
}

/// The rigid obstacle that the case describes.
pub(super) fn obstacle<const D: usize>(obstacle: &case::Obstacle) -> Result<Obstacle<D>> {
    let side = |side: &case::Side| match side {
        case::Side::Outside => Side::Outside,
        case::Side::Inside => Side::Inside,
    };
    Ok(match obstacle {
        case::Obstacle::Plane { point, normal } => {
            Obstacle::Plane(Plane::new(vector(point), vector(normal))?)
        }
        case::Obstacle::Sphere { center, radius, side: on } => {
            Obstacle::Sphere(Sphere::new(vector(center), radius.value, side(on))?)
        }
        case::Obstacle::Cylinder { point, axis, radius, side: on } => {
            Obstacle::Cylinder(Cylinder::new(vector(point), vector(axis), radius.value, side(on))?)
        }
    })
}
