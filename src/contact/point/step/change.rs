//! The change of the gap over a step that a point answers for.

/// Square of two: a force is tilted, and its size changed, by a quarter at most.
const TILT: f64 = 4.0;

/// The change of the gap that the motion along the normal misses, as far as the motion of the point relative to its target
/// answers for it: `E = c N`, `c = m / (N + (2 m)^2 + s^2)`.
///
/// `m` is what is missed \[m\], `N` the square of the motion \[m^2\], `s` a motion too small to answer for anything \[m\]. For `m`
/// small against the motion `E` is `m` but for a part `4 m^2 / N` of it; it is smooth in all, and at most a quarter of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Missed {
    /// `c` \[1/m\].
    pub value: f64,
    /// `dc/dm` \[1/m^2\].
    pub by_miss: f64,
    /// `dc/dN` \[1/m^3\].
    pub by_square: f64,
}

impl Missed {
    /// `c` and its derivatives; zero where nothing moves and nothing is missed.
    pub fn of(miss: f64, square: f64, still: f64) -> Self {
        let size = square + TILT * miss * miss + still * still;
        if size < f64::MIN_POSITIVE {
            return Self::default();
        }
        let value = miss / size;
        Self { value, by_miss: (1.0 - 2.0 * TILT * miss * value) / size, by_square: -value / size }
    }

    /// Both, where `other` misses what no motion changes.
    fn with(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            by_square: self.by_square + other.by_square,
            by_miss: self.by_miss,
        }
    }
}

/// Gaps of a point over a step, and what it answers for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// The gap that counts at the start \[m\].
    pub start: f64,
    /// The gap that counts at the end, `start + along + c N` \[m\].
    pub end: f64,
    /// `delta`, the motion along the normal \[m\].
    pub along: f64,
    /// `N = delta^2 + |s|^2` \[m^2\].
    pub square: f64,
    /// `c` with its derivatives by `m` and `N`.
    pub missed: Missed,
}

impl Change {
    /// Between the gap that counts at the start and the gap that there is at the `end`, with the motion `along` the normal and
    /// `across` it; what counts lags behind the gap that there is at the start by `lag`; all in m. Motions below the two of `still`
    /// answer for nothing of what this step misses, and of the lag.
    pub fn new([start, lag]: [f64; 2], end: f64, [along, across]: [f64; 2], still: [f64; 2]) -> Self {
        let square = along * along + across * across;
        let missed = Missed::of(end - (start + lag) - along, square, still[0]);
        let missed = if lag == 0.0 { missed } else { missed.with(Missed::of(lag, square, still[1])) };
        Self { start, end: start + along + missed.value * square, along, square, missed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::taylor_rate;

    /// What is answered for is what is missed where that is small against the motion, stays below the motion wherever it is
    /// not, and has smooth derivatives at any size of either.
    #[test]
    fn missed_change_is_bounded_and_smooth() {
        for still in [0.0, 1e-6] {
            for motion in [1e-3_f64, 1e-9, 0.0, 1e-30, 2e-5] {
                for miss in [-1e-2, -1e-8, 0.0, 1e-40, 3e-4] {
                    let square = motion * motion;
                    let whole = Missed::of(miss, square, still).value * square;
                    assert!(whole.abs() <= 0.25 * motion * (1.0 + 1e-15), "{miss} {motion} {still}: {whole}");
                    assert!(whole * miss >= 0.0 && whole.abs() <= miss.abs() * (1.0 + 1e-15));
                    let size = 0.1 * f64::abs(miss).max(motion).max(still);
                    if size < 1e-100 {
                        continue;
                    }
                    // In units of the size, so that no power underflows in the test.
                    let f = |x: &[f64]| vec![size * Missed::of(x[0] * size, x[1] * size * size, still).value];
                    let df = |x: &[f64], d: &[f64]| {
                        let at = Missed::of(x[0] * size, x[1] * size * size, still);
                        vec![size * size * (at.by_miss * d[0] + at.by_square * size * d[1])]
                    };
                    let at = [miss / size, square / (size * size)];
                    let rate = taylor_rate(f, df, &at, &[0.3, 0.7]);
                    assert!(rate > 1.9, "{miss} {motion} {still}: {rate}");
                }
            }
        }
        let near = Change::new([-1e-4, 0.0], 1e-3 + 1e-6 - 1e-4, [1e-3, 0.0], [0.0; 2]);
        assert!((near.end - (1e-3 + 1e-6 - 1e-4)).abs() < 5e-6 * 1e-6);
        assert_eq!(Missed::of(0.0, 0.0, 0.0), Missed::default());
    }

    /// What counts lags behind by a hundredth of the penetration: as the point moves on it is made up for,
    /// by a spring along the surface of a thousandth of the law's stiffness, where one of a hundredth would stem from this step.
    #[test]
    fn a_lag_is_made_up_for_without_haste() {
        let (depth, lag) = (8e-5, 8e-7);
        let still = [0.3 * depth, 3.0 * depth];
        let spring = |lag: f64, miss: f64| {
            // `q = tau c s` over the motion `s`, by the stiffness `tau / depth`.
            let c = |across: f64| {
                Change::new([-depth - lag, lag], -depth + miss, [0.0, across], still).missed.value
            };
            let at = |across: f64| c(across) * across * depth;
            (at(1e-9) / 1e-9).abs()
        };
        assert!((1.0e-3..1.2e-3).contains(&spring(lag, 0.0)), "{:e}", spring(lag, 0.0));
        assert!((0.1..0.12).contains(&spring(0.0, lag)), "{:e}", spring(0.0, lag));
        let mut left = lag;
        for _ in 0..400 {
            let change = Change::new([-depth - left, left], -depth, [0.0, 0.3 * depth], still);
            let next = -depth - change.end;
            assert!(next < left && next > 0.0);
            left = next;
        }
        assert!(left < 0.05 * lag, "{left:e}");
    }
}
