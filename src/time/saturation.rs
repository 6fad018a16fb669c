//! How often the error of a mode counts, at most (4.14).
//!
//! A step turns or damps a mode of frequency `w` by `c (w dt)^p`, and the sum of it over time grows without end. The error does
//! not: a mode whose phase is lost errs by its own size, once. So the estimates pass a filter that takes from them what
//! is faster than the modes lost by the end: `1 / (1 + (w / w_c)^2)^(p/2)`, where `c w_c^p dt^(p-1) T` is the number of times
//! that a lost mode shall count in the time `T`. Slow modes pass as they are. The filter is `p` sections of first order in a
//! row.

use serde::{Deserialize, Serialize};

use super::scheme::Scheme;

/// Sections of the filter, at most.
pub const SECTIONS: usize = 3;

/// The filter during one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Part of the way to its input that a section goes.
    pub gain: f64,
    /// Sections in use, 2 or 3.
    pub count: usize,
}

/// How much of a constant input has come through each section since the filter began.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Passed([f64; SECTIONS]);

impl Scheme {
    /// The filter for a step of `dt`, where `span` is the time in which modes may lose their phase \[s\].
    pub fn saturation(self, dt: f64, span: f64) -> Section {
        /// How often a lost mode counts: two motions of the same size and any phases are the square root of two times
        /// it apart, and six times of that keep the sum above the true error where sections overlap, as measured.
        const LOST: f64 = 6.0 * std::f64::consts::SQRT_2;
        let [damping, turn] = self.local_error().unwrap_or_default();
        let damped = (LOST / (damping * dt * span)).sqrt();
        let turned = (LOST / (turn * dt * dt * span)).cbrt();
        let gain = -(-damped.min(turned) * dt).exp_m1();
        Section { gain, count: if damped < turned { 2 } else { SECTIONS } }
    }
}

impl Section {
    /// Lets everything through.
    pub const WHOLE: Self = Self { gain: 1.0, count: SECTIONS };

    /// Weights of the states of the sections, then of the input, in the state of section `last` after the step.
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
    /// After another step.
    pub fn after(self, section: &Section) -> Self {
        let mut input = 1.0;
        Self(self.0.map(|state| {
            input = state + section.gain * (input - state);
            input
        }))
    }

    /// Part of a constant input that has come through.
    pub fn part(&self, section: &Section) -> f64 {
        self.0[section.count - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the filter leaves of `cos(w t)`, largest of the last half of `steps`.
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

    /// A slow mode passes whole; a fast one counts a few times over the span, whatever its frequency.
    #[test]
    fn lost_modes_count_a_few_times() {
        let scheme = Scheme::Midpoint;
        let span = 1.0;
        let dt = 1e-5;
        let section = scheme.saturation(dt, span);
        let rate = |w: f64| w.powi(3) * dt * dt / 12.0;
        assert_eq!(section.count, 3);
        assert!((passed(&section, 100.0, dt, 40_000) - 1.0).abs() < 1e-2);
        for w in [6e4, 1e5] {
            assert!(rate(w) * span > 50.0, "unfiltered, it would count {} times", rate(w) * span);
            let counted = rate(w) * span * passed(&section, w, dt, 40_000);
            assert!((7.0..10.0).contains(&counted), "{w}: {counted}");
        }
        let section = Scheme::BackwardEuler.saturation(dt, span);
        assert_eq!(section.count, 2);
        let counted = 0.5 * 2e4f64.powi(2) * dt * span * passed(&section, 2e4, dt, 40_000);
        assert!((7.0..10.0).contains(&counted), "{counted}");
    }

    /// A constant comes through by and by, as much as [`Passed`] says.
    #[test]
    fn constants_pass() {
        let section = Scheme::Midpoint.saturation(1e-2, 1.0);
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
