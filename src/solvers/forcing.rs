//! Forcing terms of the inexact Newton method (Eisenstat and Walker 1996, choice 2 with safeguard).

/// Relative tolerance of each linear solve, from the progress of the residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Forcing {
    loosest: f64,
    tightest: f64,
    last: Option<(f64, f64)>,
}

impl Forcing {
    const FACTOR: f64 = 0.9;
    const SAFEGUARD: f64 = 0.1;

    /// Tolerances between `tightest` and `loosest`; equal bounds give a fixed tolerance.
    pub fn new(loosest: f64, tightest: f64) -> Self {
        Self { loosest, tightest, last: None }
    }

    /// Forgets the progress: a new solve begins.
    pub fn restart(&mut self) {
        self.last = None;
    }

    /// Tolerance of the next linear solve at residual `norm`, when `target` ends the Newton iteration.
    ///
    /// Never tighter than the target warrants: the last solve may stop where half the target is met.
    pub fn next(&mut self, norm: f64, target: f64) -> f64 {
        let progress = match self.last {
            None => self.loosest,
            Some((before, tolerance)) => {
                let choice = Self::FACTOR * (norm / before).powi(2);
                let guard = Self::FACTOR * tolerance * tolerance;
                if guard > Self::SAFEGUARD { choice.max(guard) } else { choice }
            }
        };
        let enough = 0.5 * target / norm;
        let tolerance = progress.max(enough).clamp(self.tightest, self.loosest);
        self.last = Some((norm, tolerance));
        tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quadratic progress tightens the tolerance, stagnation loosens it, and the bounds hold.
    #[test]
    fn follows_the_progress() {
        let mut forcing = Forcing::new(1e-1, 1e-8);
        assert_eq!(forcing.next(1.0, 1e-12), 1e-1);
        let tight = forcing.next(1e-2, 1e-12);
        assert!(tight < 1e-3, "{tight}");
        assert_eq!(forcing.next(1e-2, 1e-12), 1e-1);
        assert_eq!(Forcing::new(1e-3, 1e-3).next(1.0, 1e-9), 1e-3);
    }

    /// Close to the target the linear solve is no tighter than the target needs.
    #[test]
    fn does_not_solve_beyond_the_target() {
        let mut forcing = Forcing::new(0.5, 1e-10);
        forcing.next(1.0, 1e-6);
        let last = forcing.next(1e-5, 1e-6);
        assert!((last - 0.05).abs() < 1e-12, "{last}");
    }
}
