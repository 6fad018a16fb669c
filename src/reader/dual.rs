//! Numbers with exact first and second derivatives in time, so that a prescribed motion needs no differences.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What an expression can be evaluated in.
pub(super) trait ExpressionNumber:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant.
    fn constant(value: f64) -> Self;
    /// The value without derivatives, which comparisons look at.
    fn real(self) -> f64;
    /// f of this number, given f, f' and f'' at its value.
    fn chain(self, f: f64, first: f64, second: f64) -> Self;
    /// Whether this number does not depend on time.
    fn is_constant(self) -> bool;

    /// This number to a power.
    fn power(self, exponent: Self) -> Self {
        if !exponent.is_constant() {
            let log = self.real().ln();
            let inner = exponent * self.chain(log, 1.0 / self.real(), -1.0 / self.real().powi(2));
            let power = self.real().powf(exponent.real());
            return inner.chain(power, power, power);
        }
        let (x, n) = (self.real(), exponent.real());
        // A factor that vanishes goes first: 0 * 0^-1 is 0 here, since d(x^1)/dx has no x in it.
        let term = |factor: f64, n: f64| if factor == 0.0 { 0.0 } else { factor * x.powf(n) };
        self.chain(x.powf(n), term(n, n - 1.0), term(n * (n - 1.0), n - 2.0))
    }

    /// The angle of the point (x, this number) from the positive x axis, in (-pi, pi]; with respect to `x` and this number
    /// it has derivatives everywhere except at the origin.
    fn angle_over(self, x: Self) -> Self {
        let angle = self.real().atan2(x.real());
        if self.is_constant() && x.is_constant() {
            return Self::constant(angle);
        }
        // The slopes of the arc tangent of the smaller coordinate over the larger one.
        let slopes = |u: f64| (1.0 / (1.0 + u * u), -2.0 * u / (1.0 + u * u).powi(2));
        if self.real().abs() <= x.real().abs() {
            let ratio = self / x;
            let (first, second) = slopes(ratio.real());
            return ratio.chain(angle, first, second);
        }
        let ratio = x / self;
        let (first, second) = slopes(ratio.real());
        ratio.chain(angle, -first, -second)
    }

    /// Remainder of the division by `divisor`, with the sign of the divisor.
    ///
    /// The derivatives are those between the jumps: that of the remainder by this number is 1.
    fn modulo(self, divisor: Self) -> Self {
        let (x, b) = (self.real(), divisor.real());
        let mut rest = x % b;
        if rest * b < 0.0 {
            rest += b;
        }
        let times = ((x - rest) / b).round();
        (self - Self::constant(times) * divisor).chain(rest, 1.0, 0.0)
    }
}

impl ExpressionNumber for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn real(self) -> f64 {
        self
    }
    fn chain(self, f: f64, _: f64, _: f64) -> Self {
        f
    }
    fn is_constant(self) -> bool {
        true
    }
}

/// Value, first and second derivative with respect to time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// The function.
    pub value: f64,
    /// Its first derivative \[1/s\].
    pub rate: f64,
    /// Its second derivative [1/s2].
    pub second: f64,
}

/// Largest value or derivative, in the units of the case: energies and norms take its powers, which must be finite.
const LARGEST: f64 = 1e60;

impl Motion {
    /// Why nothing can be computed with it, if so.
    pub fn trouble(&self) -> Option<String> {
        let named = [("value", self.value), ("derivative", self.rate), ("second derivative", self.second)];
        let (what, number) =
            named.into_iter().find(|(_, number)| number.is_nan() || number.abs() > LARGEST)?;
        Some(match number.is_finite() {
            true => format!("the {what} is {number:e}, too large to compute with,"),
            false => format!("the {what} is not finite"),
        })
    }

    /// Time itself.
    pub(super) fn time(t: f64) -> Self {
        Self { value: t, rate: 1.0, second: 0.0 }
    }
}

impl ExpressionNumber for Motion {
    fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, second: 0.0 }
    }
    fn real(self) -> f64 {
        self.value
    }
    fn chain(self, f: f64, first: f64, second: f64) -> Self {
        if self.is_constant() {
            return Self::constant(f);
        }
        Self { value: f, rate: first * self.rate, second: second * self.rate.powi(2) + first * self.second }
    }
    fn is_constant(self) -> bool {
        self.rate == 0.0 && self.second == 0.0
    }
}

impl Add for Motion {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self { value: self.value + b.value, rate: self.rate + b.rate, second: self.second + b.second }
    }
}

impl Neg for Motion {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, rate: -self.rate, second: -self.second }
    }
}

impl Sub for Motion {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + (-b)
    }
}

impl Mul for Motion {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self {
            value: self.value * b.value,
            rate: self.rate * b.value + self.value * b.rate,
            second: self.second * b.value + 2.0 * self.rate * b.rate + self.value * b.second,
        }
    }
}

impl Div for Motion {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        if b.is_constant() {
            return Self {
                value: self.value / b.value,
                rate: self.rate / b.value,
                second: self.second / b.value,
            };
        }
        let x = b.value;
        let product = self * b.chain(1.0 / x, -1.0 / (x * x), 2.0 / (x * x * x));
        // A reciprocal rounds once more, and overflows where the quotient does not.
        Self { value: self.value / x, ..product }
    }
}
