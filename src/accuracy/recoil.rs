//! Error of a body that lands or takes off. The scheme does not resolve the instant within the step
//! at which this happens.
//!
//! A contact force that exists at only one end of the step acts for an unknown part of the step,
//! which is wrong by at most half of it. The impulse therefore has an error of `dt |dF| / 2`. A
//! free body keeps the resulting error of its speed until the end. This error is of first order,
//! whatever the order of the scheme, and no difference of displacements detects it.

use crate::assembly::ContactSystem;
use crate::observe::contact::{self, ContactLoad};

/// Average uncertainty of the instant of a landing, as a fraction of the step.
const UNKNOWN: f64 = 0.5;

/// Magnitudes of the contact forces at the trial state \[N\]; 0 for a contact that only touches.
/// Collective.
pub fn loads<const D: usize>(system: &ContactSystem<D>) -> Vec<f64> {
    let load = |load: ContactLoad<D>| if load.pressing == 0 { 0.0 } else { load.force.norm() };
    contact::loads(system).into_iter().map(load).collect()
}

/// Error of the speed, divided by the length of the step, when contacts close as a whole or open as
/// a whole \[m/s2\].
///
/// `recoils` is given for each contact \[1/kg\], `calm` says whether it is calm, and the loads are
/// those before and after \[N\]. Returns the error from the calm contacts, whose forces are
/// impulses, and the error from all contacts.
pub fn thrown(recoils: &[f64], calm: &[bool], [before, now]: [&[f64]; 2]) -> [f64; 2] {
    let mut squares = [0.0; 2];
    for (((before, now), recoil), calm) in before.iter().zip(now).zip(recoils).zip(calm) {
        if (*before == 0.0) != (*now == 0.0) {
            let square = ((now - before) * recoil).powi(2);
            squares[0] += if *calm { square } else { 0.0 };
            squares[1] += square;
        }
    }
    squares.map(|square| UNKNOWN * square.sqrt())
}

/// Whether contacts carry a body that is free to move: first for calm contacts, then for any
/// contact.
pub fn held(recoils: &[f64], calm: &[bool], loads: &[f64]) -> [bool; 2] {
    let carries = |k: &usize| loads[*k] * recoils[*k] > 0.0;
    let carrying = (0..loads.len().min(recoils.len())).filter(carries);
    carrying.fold([false; 2], |[impulse, _], k| [impulse || calm[k], true])
}

/// Whether a contact that was completely open closes, given the loads before and after \[N\].
pub fn strikes([before, now]: [&[f64]; 2]) -> bool {
    before.iter().zip(now).any(|(before, now)| *before == 0.0 && *now != 0.0)
}

/// How poorly a step of `dt` resolves an oscillation of the time `swing` \[s\]: 0 if it is
/// resolved, 1 if it is not.
pub fn unresolved(dt: f64, swing: f64) -> f64 {
    1.0 / (1.0 + (swing / dt).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A landing counts as a strike; a take-off or a contact that stays closed does not. A short
    /// step resolves an oscillation, a long step does not.
    #[test]
    fn landings_strike_and_short_steps_resolve() {
        let carried = |loads: &[f64]| held(&[0.1, 0.2, 0.0], &[true, false, true], loads);
        assert_eq!(carried(&[0.0, 0.0, 3.0]), [false, false]);
        assert_eq!(carried(&[0.0, 2.0, 3.0]), [false, true]);
        assert_eq!(carried(&[1.0, 2.0, 3.0]), [true, true]);
        assert!(strikes([&[0.0, 5.0], &[1.0, 5.0]]) && !strikes([&[3.0, 5.0], &[0.0, 9.0]]));
        assert_eq!(unresolved(1e-3, 0.0), 1.0);
        assert!(
            unresolved(1e-4, 1e-3) < 0.01 && unresolved(1e-2, 1e-3) > 0.99 && unresolved(1.0, 1.0) == 0.5
        );
    }

    /// Contacts that close or open contribute to the error; contacts that stay closed do not.
    #[test]
    fn landings_count() {
        let calm = [true; 2];
        assert_eq!(thrown(&[0.1, 0.1], &calm, [&[0.0, 5.0], &[0.0, 9.0]]), [0.0; 2]);
        let lands = |calm: &[bool]| thrown(&[0.1, 0.2], calm, [&[0.0, 4.0], &[3.0, 0.0]]);
        let expected = 0.5 * 0.3f64.hypot(0.8);
        assert!(lands(&calm).iter().all(|thrown| (thrown - expected).abs() < 1e-15));
        assert!((lands(&[true, false])[0] - 0.15).abs() < 1e-15 && lands(&[true, false])[1] > 0.4);
        assert_eq!(thrown(&[0.1], &[true], [&[], &[3.0]]), [0.0; 2]);
    }

    /// A constant force starts to act on a mass at an unknown instant within a step. The error of
    /// averaging the force never exceeds the bound of [`thrown`] and nearly reaches it in the worst
    /// case.
    #[test]
    fn bounds_the_impulse_of_a_force_that_begins_within_a_step() {
        let (mass, force, dt) = (2.0, 6.0, 0.1);
        let bound = thrown(&[1.0 / mass], &[true], [&[0.0], &[force]])[0] * dt;
        let error = |at: f64| (0.5 * force * dt - force * (1.0 - at) * dt).abs() / mass;
        let worst = (0..=100).map(|k| error(f64::from(k) / 100.0)).fold(0.0, f64::max);
        assert!(worst <= bound * (1.0 + 1e-12) && worst > 0.9 * bound, "{worst:e}, {bound:e}");
    }
}
