//! Forcing terms of the inexact Newton method (Eisenstat and Walker 1996), tight enough that linear
//! errors do not affect the result (theory, section 6.5).
//!
//! A linear solve that stops early leaves an error that depends on the preconditioner, and so on
//! the number of ranks. Each tolerance therefore stays a margin below the reduction that Newton's
//! method is expected to reach. An iterate does not end the iteration if its linear error may have
//! determined its residual. The number of iterates and the contact points are then those of exact
//! linear solves.

use serde::{Deserialize, Serialize};

/// Relative tolerance of each linear solve, computed from the progress of the residual.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Forcing {
    loosest: f64,
    tightest: f64,
    /// Residual at the previous solve.
    last: Option<f64>,
    /// Reduction by the first correction of the last Newton solve that had a second.
    opening: Option<f64>,
    /// The last requested tolerance.
    tolerance: f64,
    solves: u32,
    decides: bool,
}

impl Forcing {
    /// Factor by which a linear solve reduces the residual further than Newton's method.
    const MARGIN: f64 = 1e-3;
    /// Factor by which Newton's method may be better than expected. If it may meet the target in
    /// this way, the linear solve is accurate enough for it.
    const LUCK: f64 = 1e-2;

    /// Reductions of up to this many times the tolerance are attributed to the linear solver.
    const BLUR: f64 = 10.0;
    /// Factor by which a solve that may end the iteration may be tighter than all others.
    const LAST: f64 = 1e-2;

    /// Creates tolerances between `tightest` and `loosest`. Equal bounds give a fixed tolerance.
    pub fn new(loosest: f64, tightest: f64) -> Self {
        Self { loosest, tightest, last: None, opening: None, tolerance: 0.0, solves: 0, decides: true }
    }

    /// Discards the progress at the start of a new solve.
    pub fn restart(&mut self) {
        self.last = None;
        self.solves = 0;
    }

    /// Whether the error of the last linear solve is small compared with the target, so that the
    /// residual after it is Newton's own.
    pub fn decides(&self) -> bool {
        self.decides
    }

    /// Tolerance of a linear solve at residual `norm` with a kept tangent, which should reach
    /// `target`. It gives no information on Newton's method.
    pub fn next_kept(&mut self, norm: f64, target: f64) -> f64 {
        self.restart();
        self.decides = true;
        let enough = Self::MARGIN * target / norm;
        self.tolerance = enough.clamp(Self::LAST * self.tightest, self.loosest.max(self.tightest));
        self.tolerance
    }

    /// Tolerance of the next linear solve at residual `norm`, when `target` ends the Newton
    /// iteration.
    ///
    /// Quadratic convergence squares the last reduction. The first reduction is assumed to equal
    /// that of the last step. No solve needs to reduce the residual below `target`.
    pub fn next(&mut self, norm: f64, target: f64) -> f64 {
        // A reduction that hardly exceeds the last tolerance reflects the linear solve. Newton's
        // method may have been better by any amount.
        let own = |ratio: f64| if ratio <= Self::BLUR * self.tolerance { 0.0 } else { ratio };
        let reduction = self.last.map(|before| own(norm / before));
        if self.solves == 1 {
            self.opening = reduction;
        }
        let expected = reduction.map(|ratio| ratio * ratio).or(self.opening).unwrap_or(0.0);
        self.last = Some(norm);
        self.solves += 1;
        let enough = target / norm;
        let last = Self::LUCK * expected <= enough;
        self.decides = last || self.loosest <= self.tightest;
        self.tolerance = match last && self.loosest > self.tightest {
            true => (Self::MARGIN * enough).clamp(Self::LAST * self.tightest, self.loosest),
            false => (Self::MARGIN * expected).clamp(self.tightest, self.loosest),
        };
        self.tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The very first solve is tight. Later ones follow the square of the progress, within the
    /// bounds.
    #[test]
    fn follows_the_progress() {
        let mut forcing = Forcing::new(1e-2, 1e-8);
        assert_eq!(forcing.next(1.0, 1e-12), 1e-10);
        assert!((forcing.next(1e-1, 1e-12) - 1e-5).abs() < 1e-12);
        assert!((forcing.next(1e-3, 1e-12) - 1e-7).abs() < 1e-12);
        assert_eq!(forcing.next(1e-3, 1e-12), 1e-3);
        assert_eq!(Forcing::new(1e-3, 1e-3).next(1.0, 1e-9), 1e-3);
    }

    /// The first solve of a step uses the reduction of the first correction in the last step.
    #[test]
    fn begins_as_the_last_step_did() {
        let mut forcing = Forcing::new(1e-2, 1e-8);
        forcing.next(1.0, 1e-12);
        forcing.next(1e-2, 1e-12);
        forcing.next(1e-6, 1e-12);
        forcing.restart();
        assert!((forcing.next(3.0, 1e-12) - 1e-5).abs() < 1e-12);
    }

    /// A solve whose error may be as large as the target does not end the iteration. One close to
    /// the target does.
    #[test]
    fn only_a_tight_solve_decides() {
        let mut forcing = Forcing::new(1e-4, 1e-8);
        forcing.next(1.0, 1e-9);
        assert!(forcing.decides(), "nothing is known of Newton's method");
        forcing.next(1e-2, 1e-9);
        assert!(!forcing.decides());
        assert!((forcing.next(1e-5, 1e-9) - 1e-7).abs() < 1e-12);
        assert!(forcing.decides());
    }

    /// A reduction due to the linear solver gives no information, so the next solve may be the
    /// last.
    #[test]
    fn a_reduction_to_the_tolerance_tells_nothing() {
        let mut forcing = Forcing::new(1e-4, 1e-8);
        forcing.next(1.0, 1e-9);
        let loose = forcing.next(1e-1, 1e-9);
        forcing.next(2.0 * loose * 1e-1, 1e-9);
        assert!(loose > 1e-6 && forcing.decides());
    }

    /// Close to the target the linear solve is no tighter than the target requires.
    #[test]
    fn does_not_solve_beyond_the_target() {
        let mut forcing = Forcing::new(0.5, 1e-10);
        assert_eq!(Forcing::new(1e-8, 1e-8).next(1.0, 1e-12), 1e-8);
        forcing.next(1.0, 1e-6);
        let last = forcing.next(1e-5, 1e-6);
        assert!((last - 1e-4).abs() < 1e-12, "{last}");
    }
}
