//! The laws over a step: friction under the mean pressure, and the energy of elastic stick.

use super::{ContactLaw, Manner};
use crate::contact::friction::Pressed;
use crate::contact::friction::traction::{FrictionTraction, Slip};
use crate::tensor::Vector;

/// Energy that elastic stick stores under a traction \[J/m^2\].
pub fn stored<const D: usize>(law: &ContactLaw, traction: &Vector<D>) -> f64 {
    law.friction.map_or(0.0, |f| f.regularization.recoverable_energy(traction))
}

/// Elastic slip under a traction \[m\]; zero in the velocity form.
pub fn elastic_slip<const D: usize>(law: &ContactLaw, traction: &Vector<D>) -> Vector<D> {
    let stiffness = law.friction.and_then(|friction| friction.regularization.stiffness());
    stiffness.map_or_else(Vector::zeros, |stiffness| -traction / stiffness.value)
}

/// Bound, `dt_T/dt_n` and the traction. The bound is that of the penetration under the mean
/// pressure.
pub fn friction<const D: usize>(
    law: &ContactLaw,
    pressure: f64,
    slip: &Slip<'_, D>,
    manner: &Manner<D>,
) -> (f64, Vector<D>, FrictionTraction<D>) {
    let nothing = || FrictionTraction::dead(Vector::zeros());
    let Some(friction) = law.friction.filter(|_| manner.frozen.friction_traction.is_none()) else {
        return (0.0, Vector::zeros(), nothing());
    };
    let gap = -law.normal.penetration(pressure);
    let normal = law.normal.evaluate(gap);
    let bound = friction.law.bound(Pressed { normal, gap, slip_speed: slip.direction().0 });
    let answer = friction.regularization.traction(&bound, slip, manner.branch);
    let by_pressure = if normal.derivative < 0.0 { bound.by_gap / normal.derivative } else { 0.0 };
    (bound.value, answer.by_bound * by_pressure, answer)
}
