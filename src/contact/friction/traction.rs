//! Friction traction of one point with its derivatives: velocity form (2.8), (2.30), or return map
//! with history (2.32).
//!
//! `w` is the relative velocity and `d` the relative displacement since the start of the step. Both
//! are contactor minus target and not projected. The slip velocity is `v_T = P w`. The returned
//! derivatives are plain derivatives of the traction; the point kernel converts them to left-hand
//! sides.

use super::regularization::{InverseSlipSpeed, inverse_slip_speed, smooth_inverse_slip_speed};
use super::{Bound, Regularization};
use crate::reader::quantity::Velocity;
use crate::tensor::{Tensor, Vector, tangential_projector};

/// A trial traction within this relative distance of the bound counts as being on the bound. A
/// point that slid in the last step starts the next step exactly on the bound. Rounding must not
/// choose its branch, and most points that slid continue to slide.
const ON_THE_BOUND: f64 = 1e-12;

/// Branch of the law on which a point is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Branch {
    /// The branch that follows from the slip.
    #[default]
    Actual,
    /// The stick branch, continued beyond the bound. The Newton correction is computed from it if
    /// the slip direction reversed between two iterates. The root then lies between them, on the
    /// steep stick branch. The flat slip branches on both sides would jump over it in every
    /// iteration.
    Stick,
}

/// Motion of a point relative to its target, with its history from the last accepted step.
#[derive(Debug, Clone, Copy)]
pub struct Slip<'a, const D: usize> {
    /// Unit normal, outward from the target.
    pub normal: &'a Vector<D>,
    /// `w` \[m/s\].
    pub velocity: &'a Vector<D>,
    /// `d` \[m\].
    pub increment: &'a Vector<D>,
    /// `t_T` at the end of the last step, tangential to `old_normal` \[Pa\].
    pub old_traction: &'a Vector<D>,
    /// Normal at the end of the last step.
    pub old_normal: &'a Vector<D>,
}

/// Friction traction on the contactor and its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct FrictionTraction<const D: usize> {
    /// `t_T` \[Pa\], tangential, against the slip.
    pub traction: Vector<D>,
    /// True on the slip branch.
    pub slips: bool,
    /// `dt_T/db` at fixed slip \[-\].
    pub by_bound: Vector<D>,
    /// `dt_T/dw` at fixed bound \[Pa s/m\]: `-K_T` of the velocity form. Zero in the return map.
    pub by_velocity: Tensor<D>,
    /// `dt_T/dw` through the bound \[Pa s/m\]: `-C_mu`.
    pub by_velocity_through_bound: Tensor<D>,
    /// `dt_T/dd` \[Pa/m\]: `-K_T` of the return map. Zero in the velocity form.
    pub by_increment: Tensor<D>,
    /// `dt_T/dn` at fixed `w`, `d` \[Pa\].
    pub by_normal: Tensor<D>,
    /// Frictional heat per area over the step, return map only \[J/m^2\], >= 0.
    pub plastic_work: f64,
}

impl<const D: usize> FrictionTraction<D> {
    /// A constant traction without derivatives. A point that carries it slips.
    pub fn dead(traction: Vector<D>) -> Self {
        Self {
            traction,
            slips: true,
            by_bound: Vector::zeros(),
            by_velocity: Tensor::zeros(),
            by_velocity_through_bound: Tensor::zeros(),
            by_increment: Tensor::zeros(),
            by_normal: Tensor::zeros(),
            plastic_work: 0.0,
        }
    }
}

impl<const D: usize> FrictionTraction<D> {
    /// Whether the traction exceeds a bound.
    pub fn exceeds(&self, bound: f64) -> bool {
        self.traction.norm() > (1.0 + ON_THE_BOUND) * bound
    }
}

impl Regularization {
    /// Traction and derivatives, given a bound that was evaluated at the speed of `slip`.
    pub fn traction<const D: usize>(
        &self,
        bound: &Bound,
        slip: &Slip<'_, D>,
        branch: Branch,
    ) -> FrictionTraction<D> {
        let speed = slip.direction().0;
        match *self {
            Self::StickVelocity(velocity) | Self::SmoothStickVelocity(velocity)
                if branch == Branch::Stick =>
            {
                // The correction leads to a state of almost no slip, where the bound has no
                // influence.
                FrictionTraction {
                    by_bound: Vector::zeros(),
                    by_velocity_through_bound: Tensor::zeros(),
                    ..velocity_form(bound, slip, inverse_slip_speed(0.0, velocity.value), false)
                }
            }
            Self::StickVelocity(Velocity { value: limit, .. }) => {
                velocity_form(bound, slip, inverse_slip_speed(speed, limit), speed > limit)
            }
            Self::SmoothStickVelocity(Velocity { value: limit, .. }) => {
                velocity_form(bound, slip, smooth_inverse_slip_speed(speed, limit), speed > limit)
            }
            Self::StickStiffness(stiffness) => return_map(bound, slip, stiffness.value, branch),
        }
    }

    /// Energy per area that elastic stick stores \[J/m^2\]; zero in the velocity form.
    pub fn recoverable_energy<const D: usize>(&self, traction: &Vector<D>) -> f64 {
        self.stiffness().map_or(0.0, |stiffness| 0.5 * traction.norm_squared() / stiffness.value)
    }
}

impl<const D: usize> Slip<'_, D> {
    /// `P w`.
    pub fn slip_velocity(&self) -> Vector<D> {
        self.velocity - self.normal * self.normal.dot(self.velocity)
    }

    /// `P d`.
    pub fn slip_increment(&self) -> Vector<D> {
        self.increment - self.normal * self.normal.dot(self.increment)
    }

    /// Slip speed and unit direction; at rest the direction is zero.
    pub fn direction(&self) -> (f64, Vector<D>) {
        unit(&self.slip_velocity())
    }

    /// `P`.
    pub fn tangential_projector(&self) -> Tensor<D> {
        tangential_projector(self.normal)
    }

    /// Derivative of the slip velocity by the normal at fixed `w`.
    pub fn projected_velocity_by_normal(&self) -> Tensor<D> {
        self.projection_by_normal(self.velocity)
    }

    /// `d(P field)/dn = -((n . field) 1 + n field^T)`.
    fn projection_by_normal(&self, field: &Vector<D>) -> Tensor<D> {
        -(Tensor::identity() * self.normal.dot(field) + self.normal * field.transpose())
    }
}

/// Length and direction; the direction of a zero vector is zero.
fn unit<const D: usize>(vector: &Vector<D>) -> (f64, Vector<D>) {
    // Scale first: the square of a tiny component underflows.
    let largest = vector.amax();
    if largest < f64::MIN_POSITIVE {
        return (0.0, Vector::zeros());
    }
    let scaled = vector / largest;
    let length = scaled.norm();
    (length * largest, scaled / length)
}

/// `P - e e`: projector onto the tangent direction across the slip. Exactly zero in the plane.
fn across<const D: usize>(normal: &Vector<D>, direction: &Vector<D>) -> Tensor<D> {
    match D {
        2 => Tensor::zeros(),
        _ => tangential_projector(normal) - direction * direction.transpose(),
    }
}

fn velocity_form<const D: usize>(
    bound: &Bound,
    slip: &Slip<'_, D>,
    phi: InverseSlipSpeed,
    slips: bool,
) -> FrictionTraction<D> {
    let (speed, direction) = slip.direction();
    let slip_velocity = direction * speed;
    let along = direction * direction.transpose();
    // b d(phi |v_T|)/d|v_T|: exactly zero on the slip branch of the clipped phi.
    let slope = bound.value * (phi.value + phi.derivative * speed);
    let slope_along = if slips && phi.derivative * speed <= -phi.value { 0.0 } else { slope.max(0.0) };
    let by_velocity = match speed > 0.0 {
        true => -(across(slip.normal, &direction) * (bound.value * phi.value) + along * slope_along),
        false => -tangential_projector(slip.normal) * (bound.value * phi.value),
    };
    let by_bound = -slip_velocity * phi.value;
    let by_velocity_through_bound = by_bound * direction.transpose() * bound.by_speed;
    // The projected slip velocity also changes along n; there the traction is proportional to it.
    let stretch = Tensor::identity() * (bound.value * phi.value)
        + slip_velocity * direction.transpose() * (bound.value * phi.derivative + bound.by_speed * phi.value);
    FrictionTraction {
        traction: by_bound * bound.value,
        slips,
        by_bound,
        by_velocity,
        by_velocity_through_bound,
        by_increment: Tensor::zeros(),
        by_normal: -stretch * slip.projection_by_normal(slip.velocity),
        plastic_work: 0.0,
    }
}

fn return_map<const D: usize>(
    bound: &Bound,
    slip: &Slip<'_, D>,
    stiffness: f64,
    branch: Branch,
) -> FrictionTraction<D> {
    let (rotated, rotated_by_normal) = rotate(slip.old_traction, slip.old_normal, slip.normal);
    let trial = rotated - slip.slip_increment() * stiffness;
    let trial_by_normal = rotated_by_normal - slip.projection_by_normal(slip.increment) * stiffness;
    let projector = tangential_projector(slip.normal);
    let (size, direction) = unit(&trial);
    let below = size < bound.value * (1.0 - ON_THE_BOUND) || size == 0.0;
    if below || branch == Branch::Stick {
        return FrictionTraction {
            traction: trial,
            slips: false,
            by_bound: Vector::zeros(),
            by_velocity: Tensor::zeros(),
            by_velocity_through_bound: Tensor::zeros(),
            by_increment: -projector * stiffness,
            by_normal: trial_by_normal,
            plastic_work: 0.0,
        };
    }
    let shrink = bound.value / size;
    let sideways = across(slip.normal, &direction);
    let slip_direction = slip.direction().1;
    let through_bound = direction * slip_direction.transpose() * bound.by_speed;
    // Not `across`: the trial traction rotates with n, so it also changes along n.
    let turn = (Tensor::identity() - direction * direction.transpose()) * shrink;
    FrictionTraction {
        traction: direction * bound.value,
        slips: true,
        by_bound: direction,
        by_velocity: Tensor::zeros(),
        by_velocity_through_bound: through_bound,
        by_increment: -sideways * (stiffness * shrink),
        by_normal: turn * trial_by_normal + through_bound * slip.projection_by_normal(slip.velocity),
        plastic_work: bound.value * ((size - bound.value).max(0.0) / stiffness),
    }
}

/// Rotates a traction tangential to `from` by the smallest rotation that takes `from` to `to`. The
/// length is preserved. The second value is the derivative with respect to `to`.
pub fn rotate<const D: usize>(
    traction: &Vector<D>,
    from: &Vector<D>,
    to: &Vector<D>,
) -> (Vector<D>, Tensor<D>) {
    let cosine_plus_one = 1.0 + from.dot(to);
    if cosine_plus_one < 1e-12 {
        // Opposite normals: half a turn about an axis in the tangent plane. The axis is not
        // determined.
        return (-traction, Tensor::zeros());
    }
    let lift = to.dot(traction) / cosine_plus_one;
    let sum = from + to;
    let by_normal = sum * (from * lift - traction).transpose() / cosine_plus_one - Tensor::identity() * lift;
    (traction - sum * lift, by_normal)
}
