//! Limit on how often the error of a mode is counted (4.14).
//!
//! A step rotates or damps a mode of frequency `w` by `c (w dt)^p`. The sum of this error over time
//! grows without bound. The true error does not: a mode whose phase is lost has an error of its own
//! size, once.
//!
//! The estimates therefore pass a filter that attenuates modes faster than those that lose their
//! phase by the end: `1 / (1 + (w / w_c)^2)^(p/2)`. Here `c w_c^p dt^(p-1) T` is how many times a
//! lost mode counts in the time `T`. Slow modes pass unchanged. The filter consists of `p`
//! first-order sections in series.

use serde::{Deserialize, Serialize};

use super::scheme::Scheme;

/// Largest number of sections of the filter.
pub const SECTIONS: usize = 3;

/// The filter during one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Fraction of the distance to its input that the state of a section moves in the step.
    pub gain: f64,
    /// Number of sections in use, 2 or 3.
    pub count: usize,
}

/// Fraction of a constant input that has passed each section since the filter started.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Passed([f64; SECTIONS]);

impl Section {
    /// Returns the filter for a step of `dt`, where `span` is the time in which modes can lose
    /// their phase \[s\].
    pub fn of(scheme: Scheme, dt: f64, span: f64) -> Self {
        /// Number of times that a lost mode counts.
        ///
        /// Two motions of equal size and arbitrary phases differ by the square root of two times
        /// that size. By measurement, six times this value keeps the sum above the true error where
        /// sections overlap.
        const LOST: f64 = 6.0 * std::f64::consts::SQRT_2;
        let [damping, turn] = scheme.local_error().unwrap_or_default();
        let damped = (LOST / (damping * dt * span)).sqrt();
        let turned = (LOST / (turn * dt * dt * span)).cbrt();
        let gain = -(-damped.min(turned) * dt).exp_m1();
        Self { gain, count: if damped < turned { 2 } else { SECTIONS } }
    }

    /// A section that passes its input unchanged.
    pub const WHOLE: Self = Self { gain: 1.0, count: SECTIONS };

    /// Weights of the states of the sections, followed by that of the input, in the state of
    /// section `last` after the step.
    pub fn weights(&self, last: usize) -> [f64; SECTIONS + 1] {
        let Self { gain, .. } = *self;
        let mut weights = [0.0; SECTIONS + 1];
        for section in 0..=last {
            weights[section] = (1.0 - gain) * gain.powi((last - section) as i32);
        }
        weights[SECTIONS] = gain.powi(last as i32 + 1);
        weights
    }
}

impl Passed {
    /// Returns the fractions after one more step.
    pub fn after(self, section: &Section) -> Self {
        let mut input = 1.0;
        Self(self.0.map(|state| {
            input = state + section.gain * (input - state);
            input
        }))
    }

    /// Fraction of a constant input that has passed the filter.
    pub fn part(&self, section: &Section) -> f64 {
        self.0[section.count - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest filtered value of `cos(w t)` in the last half of `steps`.
    fn passed(section: &Section, w: f64, dt: f64, steps: u32) -> f64 {
        let mut states = [0.0; SECTIONS];
        let mut most = 0.0f64;
        for step in 0..steps {
            let input = (w * dt * f64::from(step)).cos();
            let before = [states[0], states[1], states[2], input];
            for (last, state) in states.iter_mut().enumerate() {
                *state = section.weights(last).iter().zip(before).map(|(weight, value)| weight * value).sum();
            }
            if step > steps / 2 {
                most = most.max(states[section.count - 1].abs());
            }
        }
        most
    }

    /// A slow mode passes unchanged. A fast one counts a few times over the span, whatever its
    /// frequency.
    #[test]
    fn lost_modes_count_a_few_times() {
        let scheme = Scheme::Midpoint;
        let span = 1.0;
        let dt = 1e-5;
        let section = Section::of(scheme, dt, span);
        let rate = |w: f64| w.powi(3) * dt * dt / 12.0;
        assert_eq!(section.count, 3);
        assert!((passed(&section, 100.0, dt, 40_000) - 1.0).abs() < 1e-2);
        for w in [6e4, 1e5] {
            assert!(rate(w) * span > 50.0, "unfiltered, it would count {} times", rate(w) * span);
            let counted = rate(w) * span * passed(&section, w, dt, 40_000);
            assert!((7.0..10.0).contains(&counted), "{w}: {counted}");
        }
        let section = Section::of(Scheme::BackwardEuler, dt, span);
        assert_eq!(section.count, 2);
        let counted = 0.5 * 2e4f64.powi(2) * dt * span * passed(&section, 2e4, dt, 40_000);
        assert!((7.0..10.0).contains(&counted), "{counted}");
    }

    /// A constant passes gradually, by the fraction that [`Passed`] gives.
    #[test]
    fn constants_pass() {
        let section = Section::of(Scheme::Midpoint, 1e-2, 1.0);
        let mut passed = Passed::default();
        let mut states = [0.0; SECTIONS];
        for _ in 0..7 {
            let before = [states[0], states[1], states[2], 1.0];
            for (last, state) in states.iter_mut().enumerate() {
                *state = section.weights(last).iter().zip(before).map(|(weight, value)| weight * value).sum();
            }
            passed = passed.after(&section);
        }
        assert!((passed.part(&section) - states[2]).abs() < 1e-15 && states[2] > 0.5, "{states:?}");
    }
}
