//! Unexplained energy over a whole run: its amount, and the steps that caused it.

use serde::{Deserialize, Serialize};

use crate::case::Units;
use crate::observe::energy::Energies;
use crate::time::Scheme;

/// Ratio of unexplained energy to the largest energy above which a run gets a warning.
const WORTH_A_WORD: f64 = 0.02;

/// Ratio of gained energy to the largest energy from which on a run with inertia warns while it
/// computes. Results do not depend on it: half of it warns earlier, twice of it later.
const GAIN: f64 = 0.1;

/// Uncertainty factor of the rounding estimate.
const ROUNDINGS: f64 = 16.0;

/// Number of steps that the warning names.
const NAMED: usize = 3;

/// A step is named if it left more than this fraction of the largest unexplained energy.
const NOTABLE: f64 = 0.1;

/// A step and the energy that it left unexplained.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Left {
    step: u64,
    /// Instant at its end \[s\].
    time: f64,
    /// Its length \[s\].
    dt: f64,
    /// Energy lost \[J\]; negative if energy was gained.
    energy: f64,
    /// Part of it that exceeds the error of the work \[J\].
    excess: f64,
}

/// Known errors of the energy balance of a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct KnownError {
    /// Estimated rounding error of the step \[J\].
    pub rounding: f64,
    /// Possible error of the work of all steps so far \[J\].
    pub work: f64,
}

/// Unexplained energy of the steps of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Unexplained {
    /// Sum at the end of the last step \[J\].
    now: f64,
    /// Possible error of the work at the end of the last step \[J\].
    work_error: f64,
    /// The sum that exceeded the error of the work by most \[J\], the excess \[J\], and its instant
    /// \[s\].
    largest: f64,
    excess: f64,
    at: f64,
    /// Possible contribution of rounding to that sum \[J\].
    rounding: f64,
    /// The steps that exceeded the error of their work by most, the largest first.
    steps: [Option<Left>; NAMED],
}

impl Unexplained {
    /// Unexplained energy of a step that ends in `energies`, negative if it was gained \[J\].
    pub fn left(&self, energies: &Energies) -> f64 {
        energies.numerical - self.now
    }

    /// Records an accepted step: its number, its end \[s\], its length \[s\], the energies at its
    /// end, and the known errors.
    pub fn record(&mut self, step: u64, time: f64, dt: f64, energies: &Energies, known: KnownError) {
        self.rounding += known.rounding;
        let energy = self.left(energies);
        let excess = energy.abs() - (known.work - self.work_error).max(0.0);
        self.now = energies.numerical;
        self.work_error = known.work;
        if self.now.abs() - known.work > self.excess {
            self.largest = self.now;
            self.excess = self.now.abs() - known.work;
            self.at = time;
        }
        let mut left = Some(Left { step, time, dt, energy, excess });
        let size = |left: &Option<Left>| left.map_or(0.0, |left| left.excess);
        for known in &mut self.steps {
            if size(&left) > size(known) {
                std::mem::swap(known, &mut left);
            }
        }
    }

    /// The warning while a run by `scheme` computes, whose largest energy so far is `scale` \[J\]. `None`
    /// unless more than a tenth of it was gained, and in statics, where the work of a step is known only
    /// approximately.
    pub fn gain(&self, scheme: Scheme, may_conserve: bool, scale: f64, units: Units) -> Option<String> {
        let certain = self.largest.abs() > ROUNDINGS * self.rounding;
        if scheme == Scheme::Static || !certain || self.largest >= 0.0 || self.excess <= GAIN * scale {
            return None;
        }
        let gained = -self.largest;
        let (s, joule) = (units.of("s"), units.of("J"));
        Some(format!(
            "warning: until t = {:.4e} {s}, unexplained energy of {gained:.3e} {joule} was gained, {:.1} % of the \
             largest energy so far\n\
             hint: {}; `guard: {{ energy: {GAIN} }}` ends a run at such a gain",
            self.at,
            100.0 * gained / scale,
            cure(scheme, true, may_conserve, true)
        ))
    }

    /// The warning at the end of a run by `scheme`, with or without contact, whose largest energy
    /// was `scale` \[J\]. `may_conserve` is whether the scheme `conserving` accepts the bodies. Returns
    /// `None` if no warning is needed.
    pub fn warning(
        &self,
        scheme: Scheme,
        contact: bool,
        may_conserve: bool,
        scale: f64,
        units: Units,
    ) -> Option<String> {
        let worthy = scale > 0.0 && self.excess / scale >= WORTH_A_WORD;
        if !worthy || self.largest.abs() <= ROUNDINGS * self.rounding {
            return None;
        }
        let verb = if self.largest < 0.0 { "gained" } else { "lost" };
        let (s, joule) = (units.of("s"), units.of("J"));
        let notable = |left: &&Left| left.excess >= NOTABLE * self.excess;
        let name = |left: &Left| {
            let verb = if left.energy < 0.0 { "gained" } else { "lost" };
            let Left { step, time, dt, energy, .. } = left;
            format!("step {step} (t = {time:.4e} {s}, {dt:.1e} {s} long) {verb} {:.3e} {joule}", energy.abs())
        };
        let steps: Vec<String> = self.steps.iter().flatten().filter(notable).map(name).collect();
        let steps = match steps.is_empty() {
            true => "gradually, less than a tenth of it in any single step".to_owned(),
            false => steps.join(", "),
        };
        Some(format!(
            "warning: until t = {:.4e} {s}, unexplained energy of {:.3e} {joule} was {verb}, {:.1} % of the \
             largest energy of the run: {steps}\n\
             hint: {}",
            self.at,
            self.largest.abs(),
            100.0 * self.largest.abs() / scale,
            cure(scheme, contact, may_conserve, self.largest < 0.0)
        ))
    }
}

/// Hint for a scheme that damps fast motion.
const DAMPS: &str = "this scheme damps motions that are fast compared with the step: use a shorter step, \
                     accuracy: { time: ... } or `scheme: conserving`";
/// Hint for a scheme that damps fast motion, for bodies that the scheme `conserving` refuses.
const DAMPS_ONLY: &str = "this scheme damps motions that are fast compared with the step: use a shorter step or \
                          accuracy: { time: ... }";

/// Hint for steps that are too long.
const LONG: &str = "the steps are too long to resolve the motion: use a shorter step, accuracy: { time: ... } or \
                    `scheme: conserving`";
/// Hint for steps that are too long, for bodies that the scheme `conserving` refuses.
const LONG_ONLY: &str =
    "the steps are too long to resolve the motion: use a shorter step or accuracy: { time: ... }";

/// The hint on what to change, depending on whether energy was `gained`.
fn cure(scheme: Scheme, contact: bool, may_conserve: bool, gained: bool) -> &'static str {
    let long = if may_conserve { LONG } else { LONG_ONLY };
    let damps = match (gained, may_conserve) {
        (true, _) => long,
        (false, true) => DAMPS,
        (false, false) => DAMPS_ONLY,
    };
    match scheme {
        Scheme::Static if !contact => {
            "the bodies jumped from one equilibrium to another, or the equilibrium path is strongly curved: \
             use more load steps"
        }
        Scheme::Static => {
            "the bodies jumped from one equilibrium to another, or the equilibrium path is strongly curved: \
             use more load steps; the rest comes from contact: refine its surfaces, or use `area: \
             reference`"
        }
        Scheme::Conserving => {
            "the steps are too long to resolve the motion: use a shorter step, or a smaller \
             solver.newton.tolerance"
        }
        Scheme::BackwardEuler => damps,
        Scheme::Newmark { gamma, alpha_m, alpha_f, .. } if gamma > 0.5 || alpha_m != alpha_f => damps,
        Scheme::Newmark { .. } | Scheme::Midpoint => long,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(numerical: &[f64]) -> Unexplained {
        let mut unexplained = Unexplained::default();
        for (k, &numerical) in numerical.iter().enumerate() {
            let energies = Energies { numerical, ..Energies::default() };
            unexplained.record(k as u64 + 1, 0.1 * (k + 1) as f64, 0.1, &energies, KnownError::default());
        }
        unexplained
    }

    /// The largest sum counts even if a later step compensates it. The steps that caused it are
    /// named, the largest first; other steps are not.
    #[test]
    fn the_steps_that_left_most_are_named() {
        let scheme = Scheme::newmark(0.25, 0.5);
        let text = run(&[0.0, -1.0, -31.0, -31.5, -81.5, 2.0])
            .warning(scheme, true, true, 100.0, Units::default())
            .expect("a warning");
        assert!(
            text.contains("t = 5.0000e-1 s, unexplained energy of 8.150e1 J was gained, 81.5 %"),
            "{text}"
        );
        let named =
            "largest energy of the run: step 6 (t = 6.0000e-1 s, 1.0e-1 s long) lost 8.350e1 J, step 5 (";
        assert!(text.contains(named) && text.contains("gained 5.000e1 J, step 3 ("), "{text}");
        assert!(!text.contains("step 2") && !text.contains("step 4"), "{text}");
    }

    /// A scheme that damps is blamed for a loss, not for a gain.
    #[test]
    fn the_cure_depends_on_the_sign() {
        let text = |sum: f64| {
            let warning = run(&[sum]).warning(Scheme::BackwardEuler, true, true, 100.0, Units::default());
            warning.expect("a warning")
        };
        assert!(text(30.0).contains("this scheme damps"), "{}", text(30.0));
        assert!(text(-30.0).contains("steps are too long") && !text(-30.0).contains("damps"));
    }

    /// A deviation within the error of the work counts as explained. Only the excess names steps.
    #[test]
    fn the_error_of_the_work_explains() {
        let run = |second: f64| {
            let mut unexplained = Unexplained::default();
            for (step, numerical, work) in [(1, 20.0, 22.0), (2, 20.0 + second, 23.0)] {
                let energies = Energies { numerical, ..Energies::default() };
                unexplained.record(step, 1.0, 0.5, &energies, KnownError { rounding: 0.0, work });
            }
            unexplained.warning(Scheme::Static, true, true, 100.0, Units::default())
        };
        assert_eq!(run(4.0), None);
        let text = run(9.0).expect("a warning");
        assert!(text.contains("29.0 %") && text.contains(": step 2 (") && !text.contains("step 1"), "{text}");
    }

    /// A gain above a tenth of the largest energy is reported. Losses are not, nor is anything in statics.
    #[test]
    fn a_gain_is_reported() {
        let reports = |numericals: &[f64], scheme: Scheme| {
            run(numericals).gain(scheme, true, 100.0, Units::default()).is_some()
        };
        let scheme = Scheme::Conserving;
        assert!(!reports(&[-4.0, -9.9], scheme) && reports(&[-4.0, -10.1], scheme));
        assert!(!reports(&[9.0, 11.0, 50.0], scheme) && !reports(&[-50.0], Scheme::Static));
    }

    /// Below 2 % there is no warning, nor for a run without any energy.
    #[test]
    fn little_is_not_mentioned() {
        let warning =
            |numerical: f64, scheme| run(&[numerical]).warning(scheme, true, true, 100.0, Units::default());
        assert_eq!(warning(1.9, Scheme::Conserving), None);
        assert!(warning(2.1, Scheme::Conserving).is_some_and(|text| text.contains("a shorter step")));
        assert_eq!(run(&[0.0]).warning(Scheme::Static, true, true, 0.0, Units::default()), None);
        assert_eq!(warning(1.9, Scheme::Static), None);
        assert!(warning(2.1, Scheme::Static).is_some_and(|text| text.contains("more load steps")));
        let alone = run(&[2.1]).warning(Scheme::Static, false, true, 100.0, Units::default());
        assert!(alone.is_some_and(|text| !text.contains("contact")));
        let mut rounded = Unexplained::default();
        let energies = Energies { numerical: 50.0, ..Energies::default() };
        rounded.record(1, 1.0, 1.0, &energies, KnownError { rounding: 4.0, work: 0.0 });
        assert_eq!(rounded.warning(Scheme::Conserving, true, true, 100.0, Units::default()), None);
        let many: Vec<f64> = (1..=100).map(|k| 0.1 * f64::from(k)).collect();
        let text =
            run(&many).warning(Scheme::Conserving, true, true, 100.0, Units::default()).expect("a warning");
        assert!(text.contains("gradually"), "{text}");
    }
}
