//! The error that may still be added until the end, and the share of it that a step may use.

use serde::{Deserialize, Serialize};

/// Error that the steps may add in total.
///
/// The sum of the errors of all steps must not exceed `tolerance * scale`. The scale is the largest
/// size observed so far. Error that quiet phases do not use is available in later phases.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    tolerance: f64,
    scale: f64,
    spent: f64,
}

impl Budget {
    /// Largest multiple of its even share that a step may use, if other steps have left enough.
    const MOST: f64 = 4.0;
    /// Smallest multiple of its even share that a step may use. The run continues even if the
    /// budget is used up.
    const LEAST: f64 = 0.25;
    /// Fraction of the remaining budget that an event may use.
    const EVENT: f64 = 0.05;

    /// Creates a budget of `tolerance` times a scale that is not known yet.
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, scale: 0.0, spent: 0.0 }
    }

    /// Records the current size of the quantity that the error is compared with.
    pub fn observe(&mut self, size: f64) {
        self.scale = self.scale.max(size);
    }

    /// The largest size observed so far.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Error that a step may add. The step takes the fraction `share` of the total time, and the
    /// fraction `left` of it remains.
    pub fn share(&self, share: f64, left: f64) -> f64 {
        let all = self.tolerance * self.scale;
        let even = all * share;
        let fair = (all - self.spent).max(0.0) * share / left.max(share);
        fair.clamp(Self::LEAST * even, Self::MOST * even)
    }

    /// Error that an event may add.
    pub fn event(&self) -> f64 {
        Self::EVENT * (self.tolerance * self.scale - self.spent).max(0.0)
    }

    /// Records the error that a step added.
    pub fn spend(&mut self, error: f64) {
        self.spent += error;
    }

    /// Sum of the added errors, divided by the scale.
    pub fn achieved(&self) -> f64 {
        if self.spent == 0.0 { 0.0 } else { self.spent / self.scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps that use their shares add up to the allowed error. A quiet beginning leaves more for
    /// the later steps.
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
