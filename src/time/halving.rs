//! Nominal time steps that are halved on failure and grow again when both halves are done.

use serde::{Deserialize, Serialize};

use super::retry::Retry;

/// Advances from start to end in steps of the nominal length. Each step can split into halves,
/// recursively.
///
/// Times are computed from counters, not by accumulation, so that the last one is exactly the end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Halving {
    start: f64,
    nominal: f64,
    steps: u64,
    done: u64,
    /// Depth of the current cut: the step is `nominal / 2^depth`.
    depth: u32,
    /// Position within the nominal step, in units of the current step.
    position: u64,
    max_depth: u32,
    cuts: u64,
}

impl Halving {
    /// Creates steps of about `step` from `start` to `end` \[s\], each cut at most `max_depth`
    /// times.
    ///
    /// The nominal step is the largest that divides the interval and does not exceed `step`.
    pub fn new(start: f64, end: f64, step: f64, max_depth: u32) -> Self {
        let steps = ((end - start) / step * (1.0 - 1e-12)).ceil().max(1.0);
        Self {
            start,
            nominal: (end - start) / steps,
            steps: steps as u64,
            done: 0,
            depth: 0,
            position: 0,
            max_depth,
            cuts: 0,
        }
    }

    /// Whether the end is reached.
    pub fn finished(&self) -> bool {
        self.done == self.steps
    }

    /// Length of the next step \[s\].
    pub fn dt(&self) -> f64 {
        self.nominal / (1u64 << self.depth) as f64
    }

    /// Current time \[s\].
    pub fn time(&self) -> f64 {
        let within = self.position as f64 / (1u64 << self.depth) as f64;
        self.start + self.nominal * (self.done as f64 + within)
    }

    /// Time at the end of the next step \[s\].
    pub fn end_of_step(&self) -> f64 {
        let within = (self.position + 1) as f64 / (1u64 << self.depth) as f64;
        self.start + self.nominal * (self.done as f64 + within)
    }

    /// The end \[s\].
    pub fn end(&self) -> f64 {
        self.start + self.nominal * self.steps as f64
    }

    /// Completed fraction of the interval, between 0 and 1.
    pub fn fraction(&self) -> f64 {
        (self.time() - self.start) / (self.nominal * self.steps as f64)
    }

    /// Number of nominal steps.
    pub fn nominal_steps(&self) -> u64 {
        self.steps
    }

    /// Number of cuts so far.
    pub fn cuts(&self) -> u64 {
        self.cuts
    }

    /// Records that the step succeeded. When both halves of a cut are done, the next step is longer
    /// again.
    pub fn succeed(&mut self) {
        self.position += 1;
        while self.depth > 0 && self.position.is_multiple_of(2) {
            self.depth -= 1;
            self.position /= 2;
        }
        if self.depth == 0 {
            self.done += self.position;
            self.position = 0;
        }
    }

    /// Whether half of the step can be tried.
    pub fn can_cut(&self) -> bool {
        self.depth < self.max_depth
    }

    /// Records that the step failed, and halves it down to the allowed depth.
    pub fn fail(&mut self) -> Retry {
        if !self.can_cut() {
            return Retry::GiveUp;
        }
        self.depth += 1;
        self.position *= 2;
        self.cuts += 1;
        Retry::Cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without failures the step ends are multiples of the step, and the last one is exactly the
    /// end.
    #[test]
    fn walks_to_the_end() {
        let mut control = Halving::new(0.0, 0.07, 5e-4, 5);
        assert_eq!(control.nominal_steps(), 140);
        while !control.finished() {
            control.succeed();
        }
        assert_eq!(control.time(), 0.07);
    }

    /// A failed step is computed in halves and quarters. The next step has full length again.
    #[test]
    fn cuts_and_grows_again() {
        let mut control = Halving::new(0.0, 2.0, 1.0, 5);
        assert_eq!(control.fail(), Retry::Cut);
        assert_eq!(control.fail(), Retry::Cut);
        let mut instants = Vec::new();
        while !control.finished() {
            control.succeed();
            instants.push(control.time());
        }
        assert_eq!(instants, [0.25, 0.5, 1.0, 2.0]);
        assert_eq!(control.cuts(), 2);
    }

    /// At the allowed depth the control gives up and cuts no further.
    #[test]
    fn gives_up_at_the_depth() {
        let mut control = Halving::new(0.0, 1.0, 0.3, 1);
        assert!((control.dt() - 0.25).abs() < 1e-15);
        assert_eq!(control.fail(), Retry::Cut);
        assert_eq!(control.fail(), Retry::GiveUp);
    }
}
