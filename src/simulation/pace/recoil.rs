//! What a body that lands or takes off errs by: the scheme does not know when within the step it did.
//!
//! The force that the contact has at one end of the step and not at the other acts for a part of the step that is wrong by half
//! of it at most. So the impulse errs by `dt |dF| / 2`, and a body that nothing else holds carries the speed along until the end:
//! an error of first order, whatever the order of the scheme, that no difference of displacements sees.

use crate::assembly::ContactSystem;

/// Part of a step by which the instant of a landing is not known, on average.
const UNKNOWN: f64 = 0.5;

/// Sizes of the forces on the contacts at the trial state \[N\], 0 where nothing is closed. Collective.
pub fn loads<const D: usize>(system: &ContactSystem<D>) -> Vec<f64> {
    let load = |contact: crate::assembly::ContactSummary<D>| match contact.zone.points {
        0 => 0.0,
        _ => contact.zone.force.norm(),
    };
    system.contact_summaries().into_iter().map(load).collect()
}

/// Error of the speed over the length of the step in which contacts close that were open as a whole, or open \[m/s2\]:
/// `recoils` of each contact \[1/kg\], and its loads before and after \[N\].
pub fn thrown(recoils: &[f64], [before, now]: [&[f64]; 2]) -> f64 {
    let lands = |(before, now): (&f64, &f64)| {
        if (*before == 0.0) == (*now == 0.0) { 0.0 } else { (now - before).abs() }
    };
    let errors = before.iter().zip(now).map(lands).zip(recoils).map(|(force, recoil)| force * recoil);
    UNKNOWN * errors.map(|error| error * error).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What lands or takes off counts, what was closed and stays so does not.
    #[test]
    fn landings_count() {
        assert_eq!(thrown(&[0.1, 0.1], [&[0.0, 5.0], &[0.0, 9.0]]), 0.0);
        assert!((thrown(&[0.1, 0.2], [&[0.0, 4.0], &[3.0, 0.0]]) - 0.5 * 0.3f64.hypot(0.8)).abs() < 1e-15);
        assert_eq!(thrown(&[0.1], [&[], &[3.0]]), 0.0);
    }

    /// A mass that a constant force meets at an unknown instant within a step: the rule of the mean force errs by no more than
    /// what is thrown, and by most of it at worst.
    #[test]
    fn bounds_the_impulse_of_a_force_that_begins_within_a_step() {
        let (mass, force, dt) = (2.0, 6.0, 0.1);
        let bound = thrown(&[1.0 / mass], [&[0.0], &[force]]) * dt;
        let error = |at: f64| (0.5 * force * dt - force * (1.0 - at) * dt).abs() / mass;
        let worst = (0..=100).map(|k| error(f64::from(k) / 100.0)).fold(0.0, f64::max);
        assert!(worst <= bound * (1.0 + 1e-12) && worst > 0.9 * bound, "{worst:e}, {bound:e}");
    }
}
