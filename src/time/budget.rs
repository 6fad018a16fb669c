//! How much error may be added until the end, and which share of it a step may use.

use serde::{Deserialize, Serialize};

/// Error that the steps may add up to.
///
/// The sum of what the steps add shall not pass `tolerance * scale`; the scale is the largest there was so far. What
/// quiet times leave over is there for lively ones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    tolerance: f64,
    scale: f64,
    spent: f64,
}

impl Budget {
    /// A step may use its even share times this at most, where others have left it over.
    const MOST: f64 = 4.0;
    /// And times this at least, where they have used up all there was: the run goes on.
    const LEAST: f64 = 0.25;
    /// Part of what is left that an event may use.
    const EVENT: f64 = 0.05;

    /// Errors up to `tolerance` times a scale that is not known yet.
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, scale: 0.0, spent: 0.0 }
    }

    /// Takes note of the present size of what the error is compared with.
    pub fn observe(&mut self, size: f64) {
        self.scale = self.scale.max(size);
    }

    /// The largest size there was.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// What a step may add that takes the part `share` of all the time, and the part `left` of it is left.
    pub fn share(&self, share: f64, left: f64) -> f64 {
        let all = self.tolerance * self.scale;
        let even = all * share;
        let fair = (all - self.spent).max(0.0) * share / left.max(share);
        fair.clamp(Self::LEAST * even, Self::MOST * even)
    }

    /// What an event may add.
    pub fn event(&self) -> f64 {
        Self::EVENT * (self.tolerance * self.scale - self.spent).max(0.0)
    }

    /// A step added as much.
    pub fn spend(&mut self, error: f64) {
        self.spent += error;
    }

    /// Sum of what was added, over the scale.
    pub fn achieved(&self) -> f64 {
        if self.spent == 0.0 { 0.0 } else { self.spent / self.scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps that use their shares add up to what was allowed; a quiet beginning leaves more for the rest.
    #[test]
    fn shares_add_up() {
        let mut budget = Budget::new(1e-2);
        budget.observe(5.0);
        budget.observe(2.0);
        for k in 0..10 {
            let share = budget.share(0.1, 1.0 - 0.1 * f64::from(k));
            budget.spend(if k < 5 { 0.0 } else { share });
        }
        assert!((budget.achieved() - 1e-2).abs() < 1e-12, "{}", budget.achieved());
        assert!(budget.share(0.1, 0.1) > 0.0 && budget.event() < 1e-15);
    }
}
