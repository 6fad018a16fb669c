//! What the sweeps of a staggered step tell of those to come.

/// How far the stages are from agreement after a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// `|u_I - u_II|` \[m\].
    pub distance: f64,
    /// The same over the increment of the step.
    pub relative_distance: f64,
    /// Change of the friction forces over the normal forces.
    pub friction: f64,
    /// Balance of the full system at `u_I`.
    pub residual: f64,
    /// `(u_I - u_II) . (u_I - u_II)'`, with that of the sweep before \[m^2\].
    pub product: f64,
}

/// How a sweep changes what the stages differ by, if it goes all the way.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Factor {
    /// Length over length.
    contraction: f64,
    /// Component along the difference before, over that: negative where the sweep overshoots.
    along: f64,
}

impl Factor {
    /// Of the differences `d` and `last` of two sweeps in a row, `product` their scalar product, where the stages told each
    /// other the part `part` of their way: `d - (1 - part) last = part J last` with the matrix `J` of a whole sweep.
    fn new(part: f64, d: f64, last: f64, product: f64) -> Self {
        let left = 1.0 - part;
        let cosine = product / (d * last).max(f64::MIN_POSITIVE);
        let ratio = d / last;
        let square = ratio * ratio + left * (left - 2.0 * ratio * cosine);
        let contraction = if part == 1.0 { ratio } else { square.max(0.0).sqrt() / part };
        Self { contraction, along: (ratio * cosine - left) / part }
    }

    /// The sweep undoes the one before, and more or less: what is left is one motion to and fro.
    fn overshoots(&self) -> bool {
        self.along < -Progress::STRAIGHT * self.contraction
    }
}

/// What the sweeps so far tell of the next ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    number: u32,
    last: Option<f64>,
    factor: Option<Factor>,
    least: Option<f64>,
    idle: u32,
    /// Part of its way that what a stage finds goes on to the next.
    part: f64,
}

impl Default for Progress {
    fn default() -> Self {
        Self { number: 0, last: None, factor: None, least: None, idle: 0, part: 1.0 }
    }
}

impl Progress {
    /// Sweeps without a smaller change of friction after which none is expected.
    const PATIENCE: u32 = 10;
    /// The same where the balance is met to rounding, so that none is asked for.
    const PAUSE: u32 = 2;
    /// Largest contraction that the error is told from.
    const MOST: f64 = 0.9;
    /// Sweeps that tell of the way to the solution, not yet of its neighbourhood.
    const FIRST: u32 = 5;
    /// Cosine between two differences in a row from which on they are one motion to and fro.
    const STRAIGHT: f64 = 0.9;
    /// Least part of its way that something goes.
    const LEAST: f64 = 0.1;

    /// Takes a sweep into account.
    pub fn record(&mut self, sweep: &Sweep) {
        let last = self.last.filter(|last| *last > 0.0);
        self.factor = last.map(|last| Factor::new(self.part, sweep.distance, last, sweep.product));
        self.last = Some(sweep.distance);
        let better = self.least.is_none_or(|least| sweep.friction < least);
        self.idle = if better { 0 } else { self.idle + 1 };
        self.least = if better { Some(sweep.friction) } else { self.least };
        self.number += 1;
    }

    /// Distance of the stages over that of the sweep before, as it is where all that a stage finds goes on to the next.
    pub fn contraction(&self) -> Option<f64> {
        self.factor.map(|factor| factor.contraction)
    }

    /// The error over the last change, `1 / (1 - q)`: all sweeps to come added up. Noise may make `q` anything: it counts up to
    /// [`MOST`](Self::MOST).
    pub fn amplification(&self) -> f64 {
        1.0 / (1.0 - self.contraction().unwrap_or(0.0).clamp(0.0, Self::MOST))
    }

    /// Friction has stopped to change less.
    pub fn stagnates(&self) -> bool {
        self.idle >= Self::PATIENCE
    }

    /// The last sweeps left friction no closer, which rounding does as well.
    pub fn pauses(&self) -> bool {
        self.idle >= Self::PAUSE
    }

    /// Part of the way that bound and friction traction are to go to the next sweep, where that is not all of it.
    ///
    /// Sweeps that overshoot by `q` go to and fro about what they seek: it lies `1 / (1 + q)` of the way off, and the part that
    /// is `1 / (1 + q)` for the largest `q` seen makes every smaller overshoot contract as well. Sweeps that come to the
    /// `balance` within `max_sweeps` at their own pace are left alone.
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

    /// Whether sweeps that contract as this one bring the residual down to `balance` before there are `max_sweeps`.
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

    /// The contraction is the quotient of two distances in a row, and is not known after the first.
    #[test]
    fn contraction_compares_two_sweeps() {
        let mut progress = Progress::default();
        progress.record(&sweep(1e-2, 1.0));
        assert_eq!(progress.contraction(), None);
        progress.record(&sweep(2e-3, 0.5));
        assert!(progress.contraction().is_some_and(|c| (c - 0.2).abs() < 1e-12));
    }

    /// A slow contraction leaves more open than the last change tells.
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

    /// Friction that does not become smaller in ten sweeps will not, however far the stages are apart.
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

    /// Sweeps with the eigenvalues `modes`, each beginning at 1: their contractions, and the distance that is left.
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

    /// What overshoots by more than it was off converges, with smaller overshoots beside it, and what is told of it is still
    /// the contraction of a whole sweep.
    #[test]
    fn overshoots_are_relaxed() {
        for largest in [-0.95, -1.2, -1.6, -4.0] {
            let (contractions, left) = sweeps(&[largest, -0.3, 0.1, 0.4], 60);
            assert!(left < 1e-5, "{largest}: {left:.1e}");
            let first = contractions.iter().take(8).copied().fold(0.0, f64::max);
            assert!((first + largest).abs() < 0.1 * first, "{largest}: {first}");
        }
    }

    /// What converges at its own pace, or does not overshoot, is left alone.
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
