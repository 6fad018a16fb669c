//! Convergence of the sweeps of a staggered step, extrapolated to the next sweeps.

/// Differences between the stages after a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// `|u_I - u_II|` \[m\].
    pub distance: f64,
    /// Distance `|u_I - u_II|`, relative to the increment of the step.
    pub relative_distance: f64,
    /// Change of the friction forces, relative to the normal forces.
    pub friction: f64,
    /// Residual of the full system at `u_I`.
    pub residual: f64,
    /// Scalar product of `u_I - u_II` with that of the previous sweep \[m^2\].
    pub product: f64,
}

/// Factor by which a full sweep, without relaxation, changes the difference between the stages.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Factor {
    /// Ratio of the lengths.
    contraction: f64,
    /// Component along the previous difference, relative to its length. It is negative if the sweep
    /// overshoots.
    along: f64,
}

impl Factor {
    /// Computes the factor from the lengths `d` and `last` of two consecutive differences and their
    /// scalar `product`.
    ///
    /// If the stages exchange the part `part` of their change, the differences satisfy
    /// `d - (1 - part) last = part J last`, with the matrix `J` of a full sweep.
    fn new(part: f64, d: f64, last: f64, product: f64) -> Self {
        let left = 1.0 - part;
        let cosine = product / (d * last).max(f64::MIN_POSITIVE);
        let ratio = d / last;
        let square = ratio * ratio + left * (left - 2.0 * ratio * cosine);
        let contraction = if part == 1.0 { ratio } else { square.max(0.0).sqrt() / part };
        Self { contraction, along: (ratio * cosine - left) / part }
    }

    /// Whether the sweep reverses the previous one and only changes its size. The remaining motion
    /// is then an oscillation along one direction.
    fn overshoots(&self) -> bool {
        self.along < -Progress::STRAIGHT * self.contraction
    }
}

/// State of the convergence estimate over the sweeps so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    number: u32,
    last: Option<f64>,
    factor: Option<Factor>,
    least: Option<f64>,
    idle: u32,
    /// Relaxation factor: the part of its change that a stage passes to the next one.
    part: f64,
}

impl Default for Progress {
    fn default() -> Self {
        Self { number: 0, last: None, factor: None, least: None, idle: 0, part: 1.0 }
    }
}

impl Progress {
    /// Number of sweeps without a smaller change of friction after which no improvement is
    /// expected.
    const PATIENCE: u32 = 10;
    /// Number of sweeps without a smaller change of friction after which sweeps stop, if the
    /// balance is met to rounding.
    const PAUSE: u32 = 2;
    /// Largest contraction that is used to estimate the error.
    const MOST: f64 = 0.9;
    /// Number of first sweeps that only approach the solution and give no asymptotic contraction.
    const FIRST: u32 = 5;
    /// Cosine between two consecutive differences above which they form an oscillation along one
    /// direction.
    const STRAIGHT: f64 = 0.9;
    /// Smallest relaxation factor.
    const LEAST: f64 = 0.1;

    /// Records a sweep.
    pub fn record(&mut self, sweep: &Sweep) {
        let last = self.last.filter(|last| *last > 0.0);
        self.factor = last.map(|last| Factor::new(self.part, sweep.distance, last, sweep.product));
        self.last = Some(sweep.distance);
        let better = self.least.is_none_or(|least| sweep.friction < least);
        self.idle = if better { 0 } else { self.idle + 1 };
        self.least = if better { Some(sweep.friction) } else { self.least };
        self.number += 1;
    }

    /// Ratio of the distance between the stages to that of the previous sweep, for a sweep without
    /// relaxation.
    pub fn contraction(&self) -> Option<f64> {
        self.factor.map(|factor| factor.contraction)
    }

    /// Ratio of the error to the last change, `1 / (1 - q)`, which is the sum of all future sweeps.
    /// Because noise can make `q` arbitrary, `q` is limited to [`MOST`](Self::MOST).
    pub fn amplification(&self) -> f64 {
        1.0 / (1.0 - self.contraction().unwrap_or(0.0).clamp(0.0, Self::MOST))
    }

    /// Whether the change of friction no longer decreases.
    pub fn stagnates(&self) -> bool {
        self.idle >= Self::PATIENCE
    }

    /// Whether the last sweeps did not reduce the change of friction. Rounding can cause this as
    /// well.
    pub fn pauses(&self) -> bool {
        self.idle >= Self::PAUSE
    }

    /// Returns the relaxation factor of bound and friction traction for the next sweep, or `None`
    /// if no relaxation is needed.
    ///
    /// Sweeps that overshoot by `q` oscillate about the solution, which lies at the fraction
    /// `1 / (1 + q)` of the change. The factor `1 / (1 + q)` for the largest `q` seen so far also
    /// makes every smaller overshoot contract. Sweeps that reach the `balance` within `max_sweeps`
    /// without relaxation are not relaxed.
    pub fn relax(&mut self, sweep: &Sweep, max_sweeps: u32, balance: f64) -> Option<f64> {
        let Some(factor) = self.factor.filter(Factor::overshoots) else { return self.relaxed() };
        if self.part == 1.0 {
            if self.number <= Self::FIRST || self.arrives(&factor, sweep, max_sweeps, balance) {
                return None;
            }
            (self.idle, self.least) = (0, None);
        }
        self.part = self.part.min(1.0 / (1.0 - factor.along)).max(Self::LEAST);
        self.relaxed()
    }

    fn relaxed(&self) -> Option<f64> {
        Some(self.part).filter(|part| *part < 1.0)
    }

    /// Whether sweeps with the contraction of this one reduce the residual to `balance` within
    /// `max_sweeps` sweeps.
    fn arrives(&self, factor: &Factor, sweep: &Sweep, max_sweeps: u32, balance: f64) -> bool {
        let left = f64::from(max_sweeps.saturating_sub(self.number));
        factor.contraction < 1.0 && sweep.residual * factor.contraction.powf(left) <= balance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(distance: f64, friction: f64) -> Sweep {
        Sweep { distance, relative_distance: distance, friction, residual: distance, product: 0.0 }
    }

    /// The contraction is the ratio of two consecutive distances, so it is unknown after the first
    /// sweep.
    #[test]
    fn contraction_compares_two_sweeps() {
        let mut progress = Progress::default();
        progress.record(&sweep(1e-2, 1.0));
        assert_eq!(progress.contraction(), None);
        progress.record(&sweep(2e-3, 0.5));
        assert!(progress.contraction().is_some_and(|c| (c - 0.2).abs() < 1e-12));
    }

    /// With a slow contraction the error is larger than the last change.
    #[test]
    fn the_error_is_all_sweeps_to_come() {
        let mut progress = Progress::default();
        assert_eq!(progress.amplification(), 1.0);
        progress.record(&sweep(1.0, 1.0));
        progress.record(&sweep(0.5, 0.5));
        assert_eq!(progress.amplification(), 2.0);
        progress.record(&sweep(5.0, 0.5));
        assert!((progress.amplification() - 10.0).abs() < 1e-12);
    }

    /// Friction that does not improve in ten sweeps counts as stagnating, however large the
    /// distance between the stages.
    #[test]
    fn stagnation_is_seen() {
        let mut progress = Progress::default();
        for k in 0..10 {
            progress.record(&sweep(1.0, 0.1 + f64::from(k % 2)));
            assert!(!progress.stagnates());
            assert_eq!(progress.pauses(), k >= 2);
        }
        progress.record(&sweep(1.0, 0.1));
        assert!(progress.stagnates());
        progress.record(&sweep(1.0, 0.05));
        assert!(!progress.stagnates());
    }

    /// Sweeps with the eigenvalues `modes`, each starting at 1. Returns their contractions and the
    /// remaining distance.
    fn sweeps(modes: &[f64], count: usize) -> (Vec<f64>, f64) {
        let mut errors = vec![1.0; modes.len()];
        let mut progress = Progress::default();
        let mut last = vec![0.0; modes.len()];
        let mut contractions = Vec::new();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for _ in 0..count {
            let apart: Vec<f64> =
                errors.iter().zip(modes).map(|(error, mode)| (mode - 1.0) * error).collect();
            let distance = dot(&apart, &apart).sqrt();
            let sweep = Sweep { product: dot(&apart, &last), ..sweep(distance, distance) };
            progress.record(&sweep);
            contractions.extend(progress.contraction());
            let part = progress.relax(&sweep, 150, 1e-9).unwrap_or(1.0);
            errors.iter_mut().zip(&apart).for_each(|(error, apart)| *error += part * apart);
            last = apart;
        }
        (contractions, progress.last.unwrap_or(f64::NAN))
    }

    /// Sweeps that overshoot by more than the initial error converge, together with smaller
    /// overshoots. The reported contraction is still that of a full sweep.
    #[test]
    fn overshoots_are_relaxed() {
        for largest in [-0.95, -1.2, -1.6, -4.0] {
            let (contractions, left) = sweeps(&[largest, -0.3, 0.1, 0.4], 60);
            assert!(left < 1e-5, "{largest}: {left:.1e}");
            let first = contractions.iter().take(8).copied().fold(0.0, f64::max);
            assert!((first + largest).abs() < 0.1 * first, "{largest}: {first}");
        }
    }

    /// Sweeps that converge without relaxation, or do not overshoot, are not relaxed.
    #[test]
    fn nothing_else_is_relaxed() {
        for modes in [&[-0.8, 0.2][..], &[0.95, -0.2]] {
            let (_, left) = sweeps(modes, 30);
            let whole: f64 =
                modes.iter().map(|mode| ((mode - 1.0) * mode.powi(29)).powi(2)).sum::<f64>().sqrt();
            assert!((left / whole - 1.0).abs() < 1e-9, "{modes:?}: {left} instead of {whole}");
        }
    }
}
