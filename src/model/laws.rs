//! From the words of a case to laws of contact: obstacles, normal laws, friction.

use super::NormalChoice;
use crate::case;
use crate::contact::friction::coefficient::{Coefficient, Constant, GroschSchallamach, Stribeck};
use crate::contact::friction::{Coulomb, Friction, FrictionLaw, PowerLaw as PowerFriction, Regularization};
use crate::contact::normal::{NormalLaw, Penalty, PowerLaw as PowerNormal};
use crate::contact::obstacle::{Cylinder, Obstacle, Plane, Side, Sphere};
use crate::error::Result;
use crate::tensor::Vector;

/// Pressure at which the penetration that a user accepts is reached, over the modulus of the contactor: beyond
/// it bodies of this kind have lost a tenth of their height.
const REFERENCE_PRESSURE: f64 = 0.1;

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

/// The normal law against a body of such a modulus \[Pa\], and the penetration \[m\] that it was derived from.
pub(super) fn normal(normal: &case::Normal, young_modulus: f64) -> Result<(NormalChoice, Option<f64>)> {
    Ok(match normal {
        case::Normal::Penalty(penalty) => match (penalty.compliance, penalty.penetration) {
            (Some(compliance), _) => {
                (NormalChoice::Law(NormalLaw::Penalty(Penalty::new(compliance.value)?)), None)
            }
            (None, Some(penetration)) => {
                let compliance = penetration.value / (REFERENCE_PRESSURE * young_modulus);
                (NormalChoice::Law(NormalLaw::Penalty(Penalty::new(compliance)?)), Some(penetration.value))
            }
            (None, None) => (NormalChoice::FromStiffness, None),
        },
        case::Normal::PowerLaw { stiffness, exponent } => {
            (NormalChoice::Law(NormalLaw::PowerLaw(PowerNormal::new(stiffness.value, exponent.value)?)), None)
        }
    })
}

/// Friction with its regularization, where there is any.
pub(super) fn friction(friction: &case::Friction) -> Result<Option<Friction>> {
    let (law, regularization) = match friction {
        case::Friction::None => return Ok(None),
        case::Friction::Coulomb { coefficient: mu, regularization } => {
            (FrictionLaw::Coulomb(Coulomb { coefficient: coefficient(mu)? }), regularization)
        }
        case::Friction::PowerLaw { stiffness, exponent, regularization } => {
            (FrictionLaw::PowerLaw(PowerFriction::new(stiffness.value, exponent.value)?), regularization)
        }
    };
    let regularization = match regularization {
        case::Regularization::StickVelocity(velocity) => Regularization::stick_velocity(velocity.value)?,
        case::Regularization::SmoothStickVelocity(velocity) => {
            Regularization::smooth_stick_velocity(velocity.value)?
        }
        case::Regularization::StickStiffness(stiffness) => Regularization::stick_stiffness(stiffness.value)?,
    };
    Ok(Some(Friction { law, regularization }))
}

fn coefficient(coefficient: &case::Coefficient) -> Result<Coefficient> {
    Ok(match coefficient {
        case::Coefficient::Constant(value) => Coefficient::Constant(Constant::new(*value)?),
        case::Coefficient::GroschSchallamach { reference, modulus, exponent } => {
            Coefficient::GroschSchallamach(GroschSchallamach::new(
                reference.value,
                modulus.value,
                exponent.value,
            )?)
        }
        case::Coefficient::Stribeck { rest, kinetic, decay_velocity } => {
            Coefficient::Stribeck(Stribeck::new(rest.value, kinetic.value, decay_velocity.value)?)
        }
    })
}
