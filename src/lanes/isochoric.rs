//! Powers of the isochoric stretch from its invariants, without principal stretches.
//!
//! `B` is a symmetric, positive definite matrix with determinant one, and `h` are the logarithms of
//! its eigenvalues, which sum up to zero. Its [`Traces`] are
//!
//! `even = sum (cosh h_k - 1)`, `odd = sum sinh h_k`.
//!
//! Both are of at least second order and analytic in the invariants `J2 = (h : h) / 2` and `J3 = h_1
//! h_2 h_3` of `h`, also where eigenvalues coincide. With the complete symmetric polynomials `H_m =
//! J2 H_(m-2) + J3 H_(m-3)`, `H_0 = 1`, `H_1 = 0`, of the logarithms,
//!
//! `tr B - 3 = even + odd = sum_m H_m (2 J2 / (m + 2)! + 3 J3 / (m + 3)!)`.
//!
//! Terms of even degree in `h` belong to `even`, the others to `odd`. The traces of the square are
//! polynomials of those of the matrix, see `squared`. So a power is the series of a small
//! multiple of `h`, squared a few times. No operation cancels digits.

use super::Real;

/// How often the logarithm is halved before its series. Eigenvalues up to `exp(8)`, which are stretches
/// up to 50, then have logarithms up to one.
const HALVINGS: i32 = 3;

/// Terms of the series; with logarithms up to one the next would be below 1e-16.
const TERMS: usize = 18;

/// `1 / k!`.
const INVERSE_FACTORIALS: [f64; TERMS + 3] = {
    let mut all = [1.0; TERMS + 3];
    let mut k = 1;
    while k < TERMS + 3 {
        all[k] = all[k - 1] / k as f64;
        k += 1;
    }
    all
};

/// Traces of a symmetric matrix with determinant one and of its inverse.
#[derive(Debug, Clone, Copy)]
pub struct Traces<T> {
    /// `(tr B + tr B^-1) / 2 - 3`.
    pub even: T,
    /// `(tr B - tr B^-1) / 2`.
    pub odd: T,
}

/// Invariants of an eighth of the logarithm of such a matrix.
#[derive(Debug, Clone, Copy)]
pub struct Logarithm<T> {
    /// Half the sum of squares of its eigenvalues.
    pub second: T,
    /// The product of its eigenvalues.
    pub third: T,
}

/// Numbers of which the logarithm is known.
pub trait Logarithmic: Real {
    /// An eighth of the logarithm of a symmetric matrix with determinant one; the inverse of
    /// [`Logarithm::traces`]. No digits are lost at small logarithms.
    #[must_use]
    fn isochoric_logarithm(traces: Traces<Self>) -> Logarithm<Self>;
}

impl Logarithmic for f64 {
    fn isochoric_logarithm(traces: Traces<Self>) -> Logarithm<Self> {
        logarithm(&traces)
    }
}

/// An exponent, prepared for [`Logarithm::power_trace`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Exponent {
    second: f64,
    third: f64,
    squarings: i32,
}

impl Exponent {
    /// Of a finite exponent.
    pub fn new(exponent: f64) -> Self {
        let mut squarings = 0;
        let mut factor = exponent * 2_f64.powi(HALVINGS);
        while factor.abs() > 1.0 {
            factor *= 0.5;
            squarings += 1;
        }
        Self { second: factor * factor, third: factor * factor * factor, squarings }
    }
}

impl<T: Real> Logarithm<T> {
    /// `tr B^exponent - 3`.
    pub fn power_trace(&self, exponent: &Exponent) -> T {
        let part =
            Self { second: self.second.scale(exponent.second), third: self.third.scale(exponent.third) };
        let mut traces = small_traces(&part);
        for _ in 0..exponent.squarings {
            traces = squared(&traces);
        }
        traces.even + traces.odd
    }

    /// The traces of `B`.
    pub fn traces(&self) -> Traces<T> {
        let mut traces = small_traces(self);
        for _ in 0..HALVINGS {
            traces = squared(&traces);
        }
        traces
    }

    /// Derivatives of the traces of `B`: of `even` and of `odd`, by `second` and by `third`.
    pub fn slopes(&self) -> [[T; 2]; 2] {
        let mut traces = small_traces(self);
        let mut slopes = small_slopes(self);
        for _ in 0..HALVINGS {
            let [of_even, of_odd] = slopes;
            let four = traces.even.constant(4.0);
            let by_even = (traces.even + traces.even) + four;
            let by_odd = traces.odd + traces.odd;
            for k in 0..2 {
                slopes[0][k] = by_even.mul_add(of_even[k], by_odd * of_odd[k]);
                slopes[1][k] = (by_even + four).mul_add(of_odd[k], by_odd * of_even[k]);
            }
            traces = squared(&traces);
        }
        slopes
    }
}

/// The traces of the square of a matrix.
fn squared<T: Real>(traces: &Traces<T>) -> Traces<T> {
    let Traces { even, odd } = *traces;
    let more = even + even.constant(4.0);
    let odd_more = odd * more;
    Traces { even: even.mul_add(more, odd * odd), odd: odd_more + odd_more }
}

/// The sums `sum H_m / (m + shift)!` over even and over odd `m`.
fn sums<T: Real, const N: usize>(logarithm: &Logarithm<T>, shifts: [usize; N]) -> [[T; 2]; N] {
    let zero = logarithm.second.constant(0.0);
    let mut sums = [[zero; 2]; N];
    // H_m, H_(m-1), H_(m-2)
    let mut polynomials = [zero.constant(1.0), zero, zero];
    for m in 0..TERMS {
        for (sum, shift) in sums.iter_mut().zip(shifts) {
            sum[m % 2] = sum[m % 2] + polynomials[0].scale(INVERSE_FACTORIALS[m + shift]);
        }
        let [current, last, before] = polynomials;
        polynomials = [logarithm.second.mul_add(last, logarithm.third * before), current, last];
    }
    sums
}

/// The traces of the exponential of a small matrix.
fn small_traces<T: Real>(logarithm: &Logarithm<T>) -> Traces<T> {
    let [[even_2, odd_2], [even_3, odd_3]] = sums(logarithm, [2, 3]);
    let twice = logarithm.second + logarithm.second;
    let thrice = logarithm.third.scale(3.0);
    Traces { even: twice.mul_add(even_2, thrice * odd_3), odd: twice.mul_add(odd_2, thrice * even_3) }
}

/// Derivatives of [`small_traces`]: of `even` and of `odd`, by `second` and by `third`.
fn small_slopes<T: Real>(logarithm: &Logarithm<T>) -> [[T; 2]; 2] {
    let [[even_1, odd_1], [even_2, odd_2]] = sums(logarithm, [1, 2]);
    [[even_1, odd_2], [odd_1, even_2]]
}

/// The solution of two linear equations.
pub fn solve<T: Real>(matrix: &[[T; 2]; 2], right: [T; 2]) -> [T; 2] {
    let [[a, b], [c, d]] = *matrix;
    let inverse = a.mul_add(d, -(b * c)).recip();
    [inverse * d.mul_add(right[0], -(b * right[1])), inverse * a.mul_add(right[1], -(c * right[0]))]
}

/// The traces of the square root of a matrix.
///
/// With `w = odd^2 / 4` of the matrix, `even` of its root is the largest zero of `x (x + 4) + w / (x +
/// 4)^2 - even`. That function is convex and positive where Newton's method starts, so the iterates
/// decrease to the zero.
fn square_root(traces: &Traces<f64>) -> Traces<f64> {
    let weight = 0.25 * traces.odd * traces.odd;
    let mut even = traces.even / (2.0 + (4.0 + traces.even).sqrt());
    for _ in 0..20 {
        let more = even + 4.0;
        let part = weight / (more * more);
        let value = even.mul_add(more, part) - traces.even;
        let step = value / (2.0 * (even + 2.0 - part / more));
        even -= step;
        if step.abs() <= 1e-9 * even.abs() {
            break;
        }
    }
    Traces { even, odd: 0.5 * traces.odd / (even + 4.0) }
}

/// An eighth of the logarithm of the matrix with these traces, by square roots and Newton's method.
///
/// What is not the trace of such a matrix gives some number or NaN.
fn logarithm(traces: &Traces<f64>) -> Logarithm<f64> {
    let mut small = *traces;
    for _ in 0..HALVINGS {
        small = square_root(&small);
    }
    let mut found = Logarithm { second: small.even, third: 2.0 * small.odd };
    for _ in 0..20 {
        let reached = small_traces(&found);
        let rest = [small.even - reached.even, small.odd - reached.odd];
        let [second, third] = solve(&small_slopes(&found), rest);
        found.second += second;
        found.third += third;
        // The convergence is quadratic: the next step would change nothing.
        if second.abs() <= 1e-9 * found.second.abs() && third.abs() <= 1e-9 * found.third.abs() {
            break;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn traces(logarithms: [f64; 3]) -> Traces<f64> {
        // Identities of logarithms that sum up to zero keep the digits.
        let halves = logarithms.map(|h| (0.5 * h).sinh());
        Traces {
            even: 2.0 * halves.map(|s| s * s).iter().sum::<f64>(),
            odd: 4.0 * halves.iter().product::<f64>(),
        }
    }

    /// Powers agree with those of the eigenvalues at distinct, double and triple eigenvalues, from
    /// tiny to large stretches.
    #[test]
    fn powers_agree_with_eigenvalues() {
        for size in [4.0, 1.5, 0.3, 1e-2, 1e-5, 1e-9, 0.0] {
            for direction in [[1.0, -0.2, -0.8], [1.0, -0.5, -0.5], [-1.0, 0.5, 0.5], [1.0, 0.0, -1.0]] {
                let logarithms = direction.map(|d| d * size);
                let found = f64::isochoric_logarithm(traces(logarithms));
                let again = found.traces();
                let given = traces(logarithms);
                assert!((again.even - given.even).abs() <= 4e-15 * given.even, "{size} {direction:?}");
                assert!((again.odd - given.odd).abs() <= 4e-15 * given.even, "{size} {direction:?}");
                for exponent in [0.5, 0.65, 2.5, -1.0, -3.0, 1.0] {
                    let power = found.power_trace(&Exponent::new(exponent));
                    let exact = traces(logarithms.map(|h| exponent * h));
                    let error = (power - (exact.even + exact.odd)).abs();
                    assert!(
                        error <= 2e-13 * exact.even,
                        "{size} {direction:?} {exponent}: {power} {exact:?}"
                    );
                }
            }
        }
    }

    /// The derivatives of the traces agree with differences.
    #[test]
    fn slopes_are_derivatives() {
        for at in [[0.1, 0.02], [0.3, -0.03], [0.0, 0.0]] {
            let new = |second: f64, third: f64| Logarithm { second: at[0] + second, third: at[1] + third };
            let slopes = new(0.0, 0.0).slopes();
            for (k, [second, third]) in [[1e-5, 0.0], [0.0, 1e-5]].into_iter().enumerate() {
                let low = new(-second, -third).traces();
                let high = new(second, third).traces();
                for (row, difference) in [high.even - low.even, high.odd - low.odd].into_iter().enumerate() {
                    let error = slopes[row][k] - 0.5e5 * difference;
                    assert!(error.abs() < 1e-6 * slopes[row][k].abs().max(1.0), "{at:?} {row} {k}: {error}");
                }
            }
        }
    }
}
