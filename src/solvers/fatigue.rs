//! Age of a preconditioner that is reused for later matrices.

use serde::{Deserialize, Serialize};

/// Whether a preconditioner of an earlier matrix still serves. Most solves change the matrix little,
/// and an incomplete factorisation costs as much as several iterations. Of a matrix that changes
/// much, [`DiagonalBlocks`](super::diagonal::DiagonalBlocks) show it before the solve.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct SetupAge {
    /// Largest number of digits gained per iteration with the present preconditioner; 0 before
    /// there is one.
    fresh: f64,
    /// Largest number of digits gained per iteration so far.
    best: f64,
    /// Number of digits gained per iteration in the last solve.
    last: f64,
    /// Solves since the preconditioner was made.
    age: u32,
    /// Age at which a preconditioner that was poor from the start is rebuilt. Its matrix may have
    /// been unusual, such as that of an iterate of a failed attempt.
    ///
    /// The age doubles each time that the rebuild does not help. A rebuild that a new pattern
    /// forces is not counted.
    patience: u32,
}

impl SetupAge {
    /// A preconditioner is rebuilt when an iteration gains less than this part of its initial gain.
    const WORTH: f64 = 0.7;

    pub fn is_tired(self) -> bool {
        self.last <= Self::WORTH * self.fresh || self.is_poor() && self.age >= self.patience
    }

    /// Whether the last iteration gained much less than the best gain so far.
    pub fn is_poor(self) -> bool {
        self.last <= Self::WORTH * self.best
    }

    /// Discards the preconditioner, but not the knowledge of its best gain.
    pub fn discard(&mut self) {
        *self = Self { best: self.best, patience: self.patience, ..Self::default() };
    }

    pub fn record(&mut self, renewed: bool, iterations: u32, tolerance: f64) {
        let before = self.last;
        let chosen = self.fresh > 0.0;
        self.last = -tolerance.log10() / f64::from(iterations.max(1));
        let helped = chosen && before <= Self::WORTH * self.last || !self.is_poor();
        self.best = self.best.max(self.last);
        if renewed {
            self.fresh = self.last;
            self.age = 0;
            self.patience = match (helped, chosen) {
                (true, _) => 0,
                (false, true) => self.patience.saturating_mul(2).max(1),
                (false, false) => self.patience,
            };
        }
        self.fresh = self.fresh.max(self.last);
        self.age = self.age.saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simulates solves with these iterations, each with a new preconditioner if the last one has
    /// aged. Returns the solves that had a new one.
    fn renewals(iterations: impl IntoIterator<Item = u32>) -> Vec<usize> {
        let mut fatigue = SetupAge::default();
        let renewed = iterations.into_iter().enumerate().filter_map(|(solve, iterations)| {
            let renewed = fatigue.is_tired();
            fatigue.record(renewed, iterations, 1e-8);
            renewed.then_some(solve)
        });
        renewed.collect()
    }

    /// A preconditioner is kept while it serves, and rebuilt after a solve in which it did not.
    #[test]
    fn what_serves_is_kept() {
        assert_eq!(renewals([12, 13, 15, 14, 12]), [0]);
        assert_eq!(renewals([12, 13, 30, 13, 12]), [0, 3]);
    }

    /// A preconditioner for an unusual matrix is replaced. If every matrix is hard, rebuilds are
    /// rare.
    #[test]
    fn what_was_poor_from_the_start_is_tried_again() {
        assert_eq!(renewals([12, 35, 34, 13, 13, 13]), [0, 2, 3]);
        let hard = renewals(std::iter::once(12).chain(std::iter::repeat_n(30, 63)));
        assert!(hard.len() <= 8, "{hard:?}");
        // Rebuilds that new patterns force do not count against renewals.
        let mut fatigue = SetupAge::default();
        fatigue.record(true, 12, 1e-8);
        for _ in 0..6 {
            fatigue.discard();
            assert!(fatigue.is_tired());
            fatigue.record(true, 28, 1e-8);
        }
        assert!(fatigue.is_tired());
        // The patience grows, however often a new one is poor compared with the first.
        let worse = [30, 50].into_iter().cycle().take(200);
        assert_eq!(renewals(std::iter::once(12).chain(worse))[0], 0);
    }
}
