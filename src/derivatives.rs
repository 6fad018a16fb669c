//! Numbers that carry partial derivatives or divided differences of a function through its evaluation.
//!
//! A law writes its energy once over [`Real`]. Evaluated with a [`Dual`] it also gives its gradient, with a [`Jet`] its
//! gradient and second derivatives, and with a [`Secant`] the slopes between two states. The values of these numbers can be
//! [`lanes`](crate::lanes), so four elements are computed at once.

use std::ops::{Add, Mul, Neg, Sub};

use crate::lanes::isochoric::{Logarithm, Logarithmic, Traces, solve};
use crate::lanes::{Ratio, RatioSlope, Real};

/// A number and its derivatives by `N` variables.
#[derive(Debug, Clone, Copy)]
pub struct Dual<T, const N: usize> {
    /// The number.
    pub value: T,
    /// Its partial derivatives.
    pub partial: [T; N],
}

impl<T: Real, const N: usize> Dual<T, N> {
    /// A number that does not depend on the variables.
    #[inline(always)]
    pub fn fixed(value: T) -> Self {
        Self { value, partial: [value.constant(0.0); N] }
    }

    /// The variable of that number.
    #[inline(always)]
    pub fn variable(value: T, number: usize) -> Self {
        let mut out = Self::fixed(value);
        out.partial[number] = value.constant(1.0);
        out
    }

    /// A function of this number, by its value and slope there.
    #[inline(always)]
    fn chain(self, value: T, slope: T) -> Self {
        let mut partial = self.partial;
        for k in 0..N {
            partial[k] = partial[k] * slope;
        }
        Self { value, partial }
    }
}

impl<T: Real, const N: usize> Add for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut partial = self.partial;
        for k in 0..N {
            partial[k] = partial[k] + other.partial[k];
        }
        Self { value: self.value + other.value, partial }
    }
}

impl<T: Real, const N: usize> Sub for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let mut partial = self.partial;
        for k in 0..N {
            partial[k] = partial[k] - other.partial[k];
        }
        Self { value: self.value - other.value, partial }
    }
}

impl<T: Real, const N: usize> Mul for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut partial = self.partial;
        for k in 0..N {
            partial[k] = partial[k].mul_add(other.value, self.value * other.partial[k]);
        }
        Self { value: self.value * other.value, partial }
    }
}

impl<T: Real, const N: usize> Neg for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let mut partial = self.partial;
        for k in 0..N {
            partial[k] = -partial[k];
        }
        Self { value: -self.value, partial }
    }
}

impl<T: Real, const N: usize> Real for Dual<T, N> {
    #[inline(always)]
    fn constant(self, x: f64) -> Self {
        Self::fixed(self.value.constant(x))
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        let mut partial = self.partial;
        for k in 0..N {
            partial[k] = partial[k].mul_add(b.value, self.value.mul_add(b.partial[k], c.partial[k]));
        }
        Self { value: self.value.mul_add(b.value, c.value), partial }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let inverse = self.value.recip();
        self.chain(inverse, -(inverse * inverse))
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        let one = self.value.constant(1.0);
        self.chain(self.value.ln_1p(), (one + self.value).recip())
    }
    #[inline(always)]
    fn ln_1p_remainder(self) -> Self {
        let one = self.value.constant(1.0);
        self.chain(self.value.ln_1p_remainder(), self.value * (one + self.value).recip())
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        let growth = self.value.exp_m1();
        self.chain(growth, growth + growth.constant(1.0))
    }
    #[inline(always)]
    fn exp_m1_remainder(self) -> Self {
        let remainder = self.value.exp_m1_remainder();
        self.chain(remainder, self.value + remainder)
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        let factor = self.value.constant(factor);
        self.chain(self.value * factor, factor)
    }
}

impl<T: Logarithmic, const N: usize> Logarithmic for Dual<T, N> {
    /// The derivatives of the inverse function: those of the traces, solved for.
    fn isochoric_logarithm(traces: Traces<Self>) -> Logarithm<Self> {
        let Traces { even, odd } = traces;
        let value = T::isochoric_logarithm(Traces { even: even.value, odd: odd.value });
        let slopes = value.slopes();
        let mut second = Self::fixed(value.second);
        let mut third = Self::fixed(value.third);
        for k in 0..N {
            [second.partial[k], third.partial[k]] = solve(&slopes, [even.partial[k], odd.partial[k]]);
        }
        Logarithm { second, third }
    }
}

impl<T: RatioSlope, const N: usize> Ratio for Dual<T, N> {
    #[inline(always)]
    fn ln_1p_ratio(self) -> Self {
        let [value, slope] = self.value.ln_1p_ratio_and_slope();
        self.chain(value, slope)
    }
    #[inline(always)]
    fn exp_m1_ratio(self) -> Self {
        let [value, slope] = self.value.exp_m1_ratio_and_slope();
        self.chain(value, slope)
    }
}

/// A number and its first and second derivatives by three variables.
#[derive(Debug, Clone, Copy)]
pub struct Jet<T> {
    /// The number.
    pub value: T,
    /// Its partial derivatives.
    pub first: [T; 3],
    /// Its second partial derivatives by the variables of [`PAIRS`](Self::PAIRS).
    pub second: [T; 6],
}

impl<T: Real> Jet<T> {
    /// The pairs of variables that the second derivatives belong to.
    pub const PAIRS: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

    /// A number that does not depend on the variables.
    #[inline(always)]
    fn fixed(value: T) -> Self {
        let zero = value.constant(0.0);
        Self { value, first: [zero; 3], second: [zero; 6] }
    }

    /// The variable of that number.
    #[inline(always)]
    pub fn variable(value: T, number: usize) -> Self {
        let mut out = Self::fixed(value);
        out.first[number] = value.constant(1.0);
        out
    }

    /// A function of this number, by its value, slope and second derivative there.
    #[inline(always)]
    fn chain(self, value: T, slope: T, curvature: T) -> Self {
        let mut out = self;
        out.value = value;
        for k in 0..3 {
            out.first[k] = self.first[k] * slope;
        }
        let mut bent = self.first;
        for k in 0..3 {
            bent[k] = self.first[k] * curvature;
        }
        for (p, [k, l]) in Self::PAIRS.into_iter().enumerate() {
            out.second[p] = self.second[p].mul_add(slope, bent[k] * self.first[l]);
        }
        out
    }

    /// Each number of the two combined.
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut out = self;
        out.value = f(self.value, other.value);
        for k in 0..3 {
            out.first[k] = f(self.first[k], other.first[k]);
        }
        for p in 0..6 {
            out.second[p] = f(self.second[p], other.second[p]);
        }
        out
    }
}

impl<T: Real> Add for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<T: Real> Sub for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<T: Real> Mul for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut out = self;
        out.value = self.value * other.value;
        for k in 0..3 {
            out.first[k] = self.first[k].mul_add(other.value, self.value * other.first[k]);
        }
        for (p, [k, l]) in Self::PAIRS.into_iter().enumerate() {
            let ends = self.second[p].mul_add(other.value, self.value * other.second[p]);
            let mixed = self.first[l].mul_add(other.first[k], ends);
            out.second[p] = self.first[k].mul_add(other.first[l], mixed);
        }
        out
    }
}

impl<T: Real> Neg for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.zip(self, |a, _| -a)
    }
}

impl<T: Real> Real for Jet<T> {
    #[inline(always)]
    fn constant(self, x: f64) -> Self {
        Self::fixed(self.value.constant(x))
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        let mut out = c;
        out.value = self.value.mul_add(b.value, c.value);
        for k in 0..3 {
            let part = self.value.mul_add(b.first[k], c.first[k]);
            out.first[k] = self.first[k].mul_add(b.value, part);
        }
        for (p, [k, l]) in Self::PAIRS.into_iter().enumerate() {
            let part = self.value.mul_add(b.second[p], c.second[p]);
            let ends = self.second[p].mul_add(b.value, part);
            let mixed = self.first[l].mul_add(b.first[k], ends);
            out.second[p] = self.first[k].mul_add(b.first[l], mixed);
        }
        out
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let inverse = self.value.recip();
        let slope = -(inverse * inverse);
        let curvature = -(slope * inverse);
        self.chain(inverse, slope, curvature + curvature)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        let slope = (self.value.constant(1.0) + self.value).recip();
        self.chain(self.value.ln_1p(), slope, -(slope * slope))
    }
    #[inline(always)]
    fn ln_1p_remainder(self) -> Self {
        let inverse = (self.value.constant(1.0) + self.value).recip();
        self.chain(self.value.ln_1p_remainder(), self.value * inverse, inverse * inverse)
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        let growth = self.value.exp_m1();
        let slope = growth + growth.constant(1.0);
        self.chain(growth, slope, slope)
    }
    #[inline(always)]
    fn exp_m1_remainder(self) -> Self {
        let remainder = self.value.exp_m1_remainder();
        let growth = self.value + remainder;
        self.chain(remainder, growth, growth + growth.constant(1.0))
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        let factor = self.value.constant(factor);
        self.zip(self, |a, _| a * factor)
    }
}

/// A quantity at the start and at the end of a step, and its slopes by `N` variables between the two.
///
/// The slopes times the changes of the variables sum up to the change of the quantity, to rounding, however large or small the step
/// is: every operation has a rule with that property, and none subtracts the start from the end of a result. They are
/// symmetric in start and end, and the partial derivatives where the two are equal.
#[derive(Debug, Clone, Copy)]
pub struct Secant<T, const N: usize> {
    /// At the start.
    pub start: T,
    /// At the end.
    pub end: T,
    /// Slopes between start and end.
    pub slope: [T; N],
}

impl<T: Real, const N: usize> Secant<T, N> {
    /// The variable of that number.
    #[inline(always)]
    pub fn variable(start: T, end: T, number: usize) -> Self {
        let mut slope = [start.constant(0.0); N];
        slope[number] = start.constant(1.0);
        Self { start, end, slope }
    }

    /// A function of this quantity, by its values and its slope between them.
    #[inline(always)]
    fn chain(self, start: T, end: T, slope: T) -> Self {
        let mut slopes = self.slope;
        for k in 0..N {
            slopes[k] = slopes[k] * slope;
        }
        Self { start, end, slope: slopes }
    }
}

impl<T: Real, const N: usize> Add for Secant<T, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut slope = self.slope;
        for k in 0..N {
            slope[k] = slope[k] + other.slope[k];
        }
        Self { start: self.start + other.start, end: self.end + other.end, slope }
    }
}

impl<T: Real, const N: usize> Sub for Secant<T, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let mut slope = self.slope;
        for k in 0..N {
            slope[k] = slope[k] - other.slope[k];
        }
        Self { start: self.start - other.start, end: self.end - other.end, slope }
    }
}

impl<T: Real, const N: usize> Mul for Secant<T, N> {
    type Output = Self;
    /// `a1 b1 - a0 b0 = (b0 + b1) / 2 (a1 - a0) + (a0 + a1) / 2 (b1 - b0)`
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let half = self.start.constant(0.5);
        let mean = half * (self.start + self.end);
        let its = half * (other.start + other.end);
        let mut slope = self.slope;
        for k in 0..N {
            slope[k] = slope[k].mul_add(its, mean * other.slope[k]);
        }
        Self { start: self.start * other.start, end: self.end * other.end, slope }
    }
}

impl<T: Real, const N: usize> Neg for Secant<T, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let minus = -self.start.constant(1.0);
        self.chain(-self.start, -self.end, minus)
    }
}

impl<T: Ratio, const N: usize> Real for Secant<T, N> {
    #[inline(always)]
    fn constant(self, x: f64) -> Self {
        let x = self.start.constant(x);
        Self { start: x, end: x, slope: [self.start.constant(0.0); N] }
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let start = self.start.recip();
        let end = self.end.recip();
        self.chain(start, end, -(start * end))
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        let inverse = (self.start + self.start.constant(1.0)).recip();
        let ratio = ((self.end - self.start) * inverse).ln_1p_ratio();
        self.chain(self.start.ln_1p(), self.end.ln_1p(), ratio.mul_add(inverse, inverse))
    }
    #[inline(always)]
    fn ln_1p_remainder(self) -> Self {
        let inverse = (self.start + self.start.constant(1.0)).recip();
        let ratio = ((self.end - self.start) * inverse).ln_1p_ratio();
        let slope = (self.start - ratio) * inverse;
        self.chain(self.start.ln_1p_remainder(), self.end.ln_1p_remainder(), slope)
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        let growth = self.start.exp_m1();
        let ratio = (self.end - self.start).exp_m1_ratio();
        let one = growth.constant(1.0);
        self.chain(growth, self.end.exp_m1(), (one + growth) * (one + ratio))
    }
    #[inline(always)]
    fn exp_m1_remainder(self) -> Self {
        let growth = self.start.exp_m1();
        let ratio = (self.end - self.start).exp_m1_ratio();
        let slope = growth.mul_add(ratio, growth + ratio);
        self.chain(self.start.exp_m1_remainder(), self.end.exp_m1_remainder(), slope)
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        let slope = self.start.constant(factor);
        self.chain(self.start.scale(factor), self.end.scale(factor), slope)
    }
}

impl<T: Logarithmic + Ratio, const N: usize> Logarithmic for Secant<T, N> {
    /// The slopes of the inverse function: those of the traces over the step, solved for.
    fn isochoric_logarithm(traces: Traces<Self>) -> Logarithm<Self> {
        let Traces { even, odd } = traces;
        let start = T::isochoric_logarithm(Traces { even: even.start, odd: odd.start });
        let end = T::isochoric_logarithm(Traces { even: even.end, odd: odd.end });
        let over_step = Logarithm {
            second: Secant::<T, 2>::variable(start.second, end.second, 0),
            third: Secant::variable(start.third, end.third, 1),
        };
        let traces = over_step.traces();
        let slopes = [traces.even.slope, traces.odd.slope];
        let mut second = even.chain(start.second, end.second, start.second);
        let mut third = odd.chain(start.third, end.third, start.third);
        for k in 0..N {
            [second.slope[k], third.slope[k]] = solve(&slopes, [even.slope[k], odd.slope[k]]);
        }
        Logarithm { second, third }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uses every operation of [`Real`].
    fn sample<T: Real>(x: T, y: T) -> T {
        let mixed = x.mul_add(y, -x) - y.scale(0.3);
        let logarithms = mixed.ln_1p() * y.ln_1p_remainder() + x.exp_m1();
        logarithms + (x + y).exp_m1_remainder() * (x.constant(2.0) + y).recip()
    }

    /// First derivatives agree with differences, second ones with differences of the first.
    #[test]
    fn dual_numbers_carry_derivatives() {
        let step = 1e-5;
        let first = |x: f64, y: f64| sample(Dual::<f64, 2>::variable(x, 0), Dual::variable(y, 1)).partial;
        for (x, y) in [(0.3_f64, -0.4_f64), (0.1, 0.8), (-0.6, 0.3), (1e-4, -1e-3)] {
            let inner = |x: f64, k: usize| Dual::variable(x, k);
            let both =
                sample(Dual::variable(inner(x, 0), 0), Dual::<Dual<f64, 2>, 2>::variable(inner(y, 1), 1));
            for k in 0..2 {
                let (dx, dy) = if k == 0 { (step, 0.0) } else { (0.0, step) };
                let difference = (sample(x + dx, y + dy) - sample(x - dx, y - dy)) / (2.0 * step);
                assert!((both.partial[k].value - difference).abs() < 1e-9, "{x} {y} {k}");
                for l in 0..2 {
                    let difference = (first(x + dx, y + dy)[l] - first(x - dx, y - dy)[l]) / (2.0 * step);
                    assert!((both.partial[l].partial[k] - difference).abs() < 1e-8, "{x} {y} {k} {l}");
                }
            }
        }
    }

    /// First and second derivatives of a jet are those of dual numbers of dual numbers.
    #[test]
    fn jets_are_nested_dual_numbers() {
        fn of_three<T: Real>([x, y, z]: [T; 3]) -> T {
            sample(x, y) * (z.recip() + sample(z, x)) - y
        }
        for at in [[0.3, -0.4, 0.7], [-0.6, 0.3, 0.2], [1e-4, -1e-3, 0.5]] {
            let jet = of_three([0, 1, 2].map(|k| Jet::variable(at[k], k)));
            let nested =
                of_three([0, 1, 2].map(|k| Dual::<_, 3>::variable(Dual::<f64, 3>::variable(at[k], k), k)));
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-14 * b.abs().max(1.0);
            assert!(close(jet.value, nested.value.value), "{at:?}");
            for (second, [k, l]) in jet.second.into_iter().zip(Jet::<f64>::PAIRS) {
                assert!(close(jet.first[k], nested.partial[k].value), "{at:?} {k}");
                assert!(close(second, nested.partial[k].partial[l]), "{at:?} {k} {l}");
            }
        }
    }

    /// Slopes times changes are the change of the function, for steps of any size; without a step they are its derivatives, and
    /// they do not depend on which end is which.
    #[test]
    fn secants_sum_up_to_the_change() {
        for size in [1.0, 0.1, 1e-3, 1e-7, 1e-12, 0.0] {
            let x = [0.3, 0.3 + 0.4 * size];
            let y = [-0.2, -0.2 + 0.7 * size];
            let along = |from: usize| {
                let to = 1 - from;
                let first = Secant::<f64, 2>::variable(x[from], x[to], 0);
                sample(first, Secant::variable(y[from], y[to], 1))
            };
            let secant = along(0);
            let change = secant.slope[0] * (x[1] - x[0]) + secant.slope[1] * (y[1] - y[0]);
            assert!((change - (sample(x[1], y[1]) - sample(x[0], y[0]))).abs() < 2e-15, "{size}");
            let derivative = sample(Dual::<f64, 2>::variable(x[0], 0), Dual::variable(y[0], 1)).partial;
            for k in 0..2 {
                assert!((secant.slope[k] - along(1).slope[k]).abs() < 2e-15, "{size}");
                assert!((secant.slope[k] - derivative[k]).abs() < 2.0 * size + 2e-15, "{size}");
            }
        }
    }

    /// The derivatives of the slopes by the end of the step agree with differences, also where start and end coincide.
    #[test]
    fn secants_of_dual_numbers_carry_derivatives() {
        for size in [1.0, 1e-3, 0.0] {
            let x = [0.3, 0.3 + 0.4 * size];
            let y = [-0.2, -0.2 + 0.7 * size];
            let slopes = |dx: f64, dy: f64| {
                let first = Secant::<f64, 2>::variable(x[0], x[1] + dx, 0);
                sample(first, Secant::variable(y[0], y[1] + dy, 1)).slope
            };
            let first = Secant::<_, 2>::variable(Dual::<f64, 2>::fixed(x[0]), Dual::variable(x[1], 0), 0);
            let both = sample(first, Secant::variable(Dual::fixed(y[0]), Dual::variable(y[1], 1), 1));
            for k in 0..2 {
                let (dx, dy) = if k == 0 { (1e-5, 0.0) } else { (0.0, 1e-5) };
                let low = slopes(-dx, -dy);
                let high = slopes(dx, dy);
                for l in 0..2 {
                    let difference = 0.5e5 * (high[l] - low[l]);
                    assert!((both.slope[l].partial[k] - difference).abs() < 1e-8, "{size} {k} {l}");
                }
            }
        }
    }
}
