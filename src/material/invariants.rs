//! The invariants of the stretch, and what a law that is a function of them provides.

use crate::composed::Composed;
use crate::lanes::Real;
use crate::lanes::isochoric::Traces;

/// A law that is a function of the invariants.
pub trait Isotropic: Copy + 'static {
    /// Numbers that the law is evaluated with.
    type Coefficients: Copy + 'static;

    /// Energy per reference volume [J/m^3].
    ///
    /// Write it as a sum of terms that are each of second order in the strain, as [`Invariants`] offers them. Its derivatives then
    /// lose no digits at small strain. Terms of first order that cancel each other would lose all of them at a strain of 1e-16.
    fn energy_of<T: Composed>(coefficients: &Self::Coefficients, invariants: &Invariants<T>) -> T;

    /// What is left to the limit of a law with a limit.
    #[inline(always)]
    fn reserve_of<T: Real>(_: &Self::Coefficients, _: &Invariants<T>) -> Option<T> {
        None
    }
}

/// Invariants of `e = C - 1`, and terms from which laws are built.
#[derive(Debug, Clone, Copy)]
pub struct Invariants<T> {
    /// `i_1 = tr e = tr C - 3`.
    pub first: T,
    /// `i_2 = (tr^2 e - e : e) / 2`.
    pub second: T,
    /// `i_3 = det e`.
    pub third: T,
    /// `J^2 - 1 = i_1 + i_2 + i_3`.
    pub growth: T,
    /// `J^2 - 1 - 2 ln J`, of second order.
    pub remainder: T,
}

/// The first two invariants of the isochoric stretch `J^(-2/3) C`, less their values at rest. Both are of second order.
#[derive(Debug, Clone, Copy)]
pub struct Isochoric<T> {
    /// `J^(-2/3) tr C - 3`.
    pub first: T,
    /// `J^(-4/3) (tr^2 C - C : C) / 2 - 3`.
    pub second: T,
}

impl<T: Real> Isochoric<T> {
    /// The traces of the isochoric stretch `J^(-2/3) C`.
    #[inline(always)]
    pub fn traces(&self) -> Traces<T> {
        Traces { even: (self.first + self.second).scale(0.5), odd: (self.first - self.second).scale(0.5) }
    }
}

impl<T: Real> Invariants<T> {
    /// From the three invariants of `e`.
    #[inline(always)]
    pub fn new(first: T, second: T, third: T) -> Self {
        let growth = first + second + third;
        Self { first, second, third, growth, remainder: growth.ln_1p_remainder() }
    }

    /// `(J^2 - 1 - 2 ln J) / 4`. Times the bulk modulus it is a volumetric energy that is convex in `J` and grows without bound
    /// where `J` goes to zero; the pressure is `-K (J - 1/J) / 2`.
    #[inline(always)]
    pub fn volumetric(&self) -> T {
        self.remainder.scale(0.25)
    }

    /// The isochoric invariants.
    ///
    /// With `x = J^2 - 1`, `y = 2 ln J`, `J^(-2/3) = 1 - x/3 + p` and `J^(-4/3) = 1 - 2x/3 + q` the terms of first order cancel by
    /// hand:
    ///
    /// * `J^(-2/3) (1 + i_1/3) - 1 = -(i_2 + i_3)/3 - x i_1/9 + p (1 + i_1/3)`
    /// * `J^(-4/3) (1 + s) - 1 = -i_2/3 - 2 i_3/3 - 2 x s/3 + q (1 + s)` with `s = (2 i_1 + i_2)/3`
    #[inline(always)]
    pub fn isochoric(&self) -> Isochoric<T> {
        let third = 1.0 / 3.0;
        let root = (self.remainder - self.growth).scale(third);
        // exp(-y/3) - 1 - (-y/3), and the same of -2y/3
        let single = root.exp_m1_remainder();
        let power = root + single;
        let double = power.mul_add(power, single + single);
        let p = self.remainder.mul_add(self.growth.constant(third), single);
        let q = self.remainder.mul_add(self.growth.constant(2.0 * third), double);
        let t = self.first.scale(third);
        let s = (self.first + self.first + self.second).scale(third);
        let first = p.mul_add(t, p) - (self.second + self.third + t * self.growth).scale(third);
        let twice = self.third + s * self.growth;
        let second = q.mul_add(s, q) - (self.second + twice + twice).scale(third);
        Isochoric { first: first.scale(3.0), second: second.scale(3.0) }
    }
}

/// `sum coefficients[k] x^(k + 1)`.
#[inline(always)]
pub fn polynomial<T: Real, const N: usize>(coefficients: &[f64; N], x: T) -> T {
    let mut sum = x.constant(coefficients[N - 1]);
    for k in (0..N - 1).rev() {
        sum = sum.mul_add(x, x.constant(coefficients[k]));
    }
    sum * x
}
