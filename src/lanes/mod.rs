//! SIMD lanes that compute four numbers at once: the struct-of-arrays layout of the element
//! kernels.
//!
//! Kernels and laws are written once, generic over [`Real`]. [`dispatch`] runs them on four
//! elements at a time. It uses AVX2 with fused multiply-add if the processor supports it, and
//! otherwise the registers that every processor of the build target has. Every lane performs the
//! same operations, so a result does not depend on the other elements in a lane group.

#[cfg(target_arch = "x86_64")]
mod avx2;
pub mod isochoric;

use std::cell::Cell;
use std::ops::{Add, Mul, Neg, Sub};

use wide::f64x4;

use crate::rounding;

/// Number of elements computed at once.
pub const WIDTH: usize = 4;

/// One number of each element.
pub type Pack = [f64; WIDTH];

/// Number type of a law: `f64`, lanes, or the dual numbers of a derivative test.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// A number of this kind with the value `x` in every lane.
    #[must_use]
    fn constant(self, x: f64) -> Self;
    /// `self * b + c`, fused if that is fast.
    #[must_use]
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `1 / self`.
    #[must_use]
    fn recip(self) -> Self;
    /// `ln(1 + self)` without cancellation; NaN below -1.
    #[must_use]
    fn ln_1p(self) -> Self;
    /// `self - ln(1 + self)` without cancellation: of second order for small `self`. NaN below -1.
    #[must_use]
    fn ln_1p_remainder(self) -> Self;
    /// `exp(self) - 1` without cancellation.
    #[must_use]
    fn exp_m1(self) -> Self;
    /// `exp(self) - 1 - self` without cancellation: of second order for small `self`.
    #[must_use]
    fn exp_m1_remainder(self) -> Self;
    /// `self * factor`.
    #[must_use]
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        self * self.constant(factor)
    }
    /// Whether the value is zero in every lane, so that its factors need not be computed. Always
    /// false for numbers that carry derivatives.
    #[must_use]
    #[inline(always)]
    fn vanishes(self) -> bool {
        false
    }
}

/// Numbers with divided differences of the logarithm and of the exponential function.
pub trait Ratio: Real {
    /// `ln(1 + self) / self - 1` without cancellation, also at zero; NaN below -1.
    #[must_use]
    fn ln_1p_ratio(self) -> Self;
    /// `(exp(self) - 1) / self - 1` without cancellation, also at zero.
    #[must_use]
    fn exp_m1_ratio(self) -> Self;
}

/// Numbers that also have the derivatives of these divided differences.
pub trait RatioSlope: Ratio {
    /// [`Ratio::ln_1p_ratio`] and its derivative, both without cancellation.
    #[must_use]
    fn ln_1p_ratio_and_slope(self) -> [Self; 2];
    /// [`Ratio::exp_m1_ratio`] and its derivative, both without cancellation.
    #[must_use]
    fn exp_m1_ratio_and_slope(self) -> [Self; 2];
}

impl Real for f64 {
    #[inline(always)]
    fn constant(self, x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // Without the hardware instruction the fused form is a library call.
        if FUSED { f64::mul_add(self, b, c) } else { self * b + c }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        f64::ln_1p(self)
    }
    #[inline(always)]
    fn ln_1p_remainder(self) -> Self {
        if self.abs() <= NEAR_LOGARITHM { near_ln_1p_remainder(self) } else { far_ln_1p_remainder(self) }
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        f64::exp_m1(self)
    }
    #[inline(always)]
    fn exp_m1_remainder(self) -> Self {
        if self.abs() <= NEAR_EXPONENTIAL { near_exp_m1_remainder(self) } else { far_exp_m1_remainder(self) }
    }
    #[inline(always)]
    fn vanishes(self) -> bool {
        self == 0.0
    }
}

impl Ratio for f64 {
    #[inline(always)]
    fn ln_1p_ratio(self) -> Self {
        self.ln_1p_ratio_and_slope()[0]
    }
    #[inline(always)]
    fn exp_m1_ratio(self) -> Self {
        self.exp_m1_ratio_and_slope()[0]
    }
}

impl RatioSlope for f64 {
    #[inline(always)]
    fn ln_1p_ratio_and_slope(self) -> [Self; 2] {
        if self.abs() <= NEAR { near_ln_1p_ratio(self) } else { far_ln_1p_ratio(self) }
    }
    #[inline(always)]
    fn exp_m1_ratio_and_slope(self) -> [Self; 2] {
        if self.abs() <= NEAR_EXPONENTIAL { near_exp_m1_ratio(self) } else { far_exp_m1_ratio(self) }
    }
}

/// Whether the build target always has fused multiply-add. Portable lanes fuse in the same case.
const FUSED: bool = cfg!(any(target_feature = "fma", target_arch = "aarch64"));

/// [`WIDTH`] numbers in parallel.
pub trait Lane: RatioSlope {
    /// The kind of these lanes.
    fn kind(self) -> LaneKind;
    /// The numbers of `values` in lanes.
    #[must_use]
    fn load(self, values: [f64; WIDTH]) -> Self;
    /// Numbers of single precision in lanes.
    #[must_use]
    #[inline(always)]
    fn load_single(self, values: [f32; WIDTH]) -> Self {
        self.load(values.map(f64::from))
    }
    /// The values of the lanes.
    fn lanes(self) -> [f64; WIDTH];
    /// Runs a part of a task in a function of its own, with the same instructions. The value of the
    /// lanes does not matter.
    ///
    /// Everything else is inlined into its task. The compiler's time grows faster than linearly with the
    /// size of a function, and laws share the parts that do not depend on them.
    fn apart<P: LanePart>(self, part: P) -> P::Output;
    /// Announces that `values[at]` is read soon; positions behind the end are accepted.
    ///
    /// The processor's own prefetch ends at page boundaries. If the loop depends on the previous
    /// results, it does not run ahead of them either.
    #[inline(always)]
    fn prefetch<T>(self, _values: &[T], _at: usize) {}
    /// Four lane groups as four rows of one element each.
    #[inline(always)]
    fn transpose(rows: [Self; WIDTH]) -> [[f64; WIDTH]; WIDTH] {
        let rows = rows.map(Self::lanes);
        let mut out = [[0.0; WIDTH]; WIDTH];
        for lane in 0..WIDTH {
            for row in 0..WIDTH {
                out[lane][row] = rows[row][lane];
            }
        }
        out
    }
}

/// Lanes in the registers that every processor of the build target has: pairs of two numbers on x86-64
/// (SSE2) and on 64-bit ARM, one of four numbers if the target always has AVX.
#[derive(Clone, Copy, Debug)]
pub struct Portable(f64x4);

impl Add for Portable {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}
impl Sub for Portable {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}
impl Mul for Portable {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}
impl Neg for Portable {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Real for Portable {
    #[inline(always)]
    fn constant(self, x: f64) -> Self {
        Self(f64x4::splat(x))
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // Two operations where no instruction fuses them.
        Self(self.0.mul_add(b.0, c.0))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self(f64x4::ONE / self.0)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        ln_1p(self)
    }
    #[inline(always)]
    fn ln_1p_remainder(self) -> Self {
        by_lane(self, NEAR_LOGARITHM, near_ln_1p_remainder(self), far_ln_1p_remainder)
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        by_lane(self, NEAR_EXPONENTIAL, self + near_exp_m1_remainder(self), far_exp_m1)
    }
    #[inline(always)]
    fn exp_m1_remainder(self) -> Self {
        by_lane(self, NEAR_EXPONENTIAL, near_exp_m1_remainder(self), far_exp_m1_remainder)
    }
    #[inline(always)]
    fn vanishes(self) -> bool {
        self.lanes() == [0.0; WIDTH]
    }
}

impl Ratio for Portable {
    #[inline(always)]
    fn ln_1p_ratio(self) -> Self {
        self.ln_1p_ratio_and_slope()[0]
    }
    #[inline(always)]
    fn exp_m1_ratio(self) -> Self {
        self.exp_m1_ratio_and_slope()[0]
    }
}

impl RatioSlope for Portable {
    #[inline(always)]
    fn ln_1p_ratio_and_slope(self) -> [Self; 2] {
        both_by_lane(self, NEAR, near_ln_1p_ratio(self), far_ln_1p_ratio)
    }
    #[inline(always)]
    fn exp_m1_ratio_and_slope(self) -> [Self; 2] {
        both_by_lane(self, NEAR_EXPONENTIAL, near_exp_m1_ratio(self), far_exp_m1_ratio)
    }
}

impl Lane for Portable {
    #[inline(always)]
    fn kind(self) -> LaneKind {
        LaneKind::Portable
    }
    #[inline(always)]
    fn load(self, values: [f64; WIDTH]) -> Self {
        Self(f64x4::new(values))
    }
    #[inline(always)]
    fn lanes(self) -> [f64; WIDTH] {
        self.0.to_array()
    }
    #[inline(never)]
    fn apart<P: LanePart>(self, part: P) -> P::Output {
        part.run()
    }
}

/// `ln(1 + x)` by the series of `2 artanh(x / (2 + x))`, to rounding for `|x| <= 1/4`; the
/// library's function otherwise.
///
/// The choice is made lane by lane, so that neighbouring lanes have no influence.
#[inline(always)]
fn ln_1p<L: Lane>(x: L) -> L {
    let s = x * (x + x.constant(2.0)).recip();
    let z = s * s;
    let mut sum = x.constant(1.0 / 17.0);
    for odd in [15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        sum = sum.mul_add(z, x.constant(1.0 / odd));
    }
    let double = s + s;
    let near = (double * z).mul_add(sum, double);
    let far = x.lanes();
    if far.iter().all(|x| x.abs() <= 0.25) {
        return near;
    }
    let mut out = near.lanes();
    for (out, x) in out.iter_mut().zip(far) {
        // The library also handles NaN.
        if x.abs() > 0.25 || x.is_nan() {
            *out = far_ln_1p(x);
        }
    }
    x.load(out)
}

/// Kept out of the kernels, because the library's logarithm is large.
#[inline(never)]
fn far_ln_1p(x: f64) -> f64 {
    f64::ln_1p(x)
}

/// Up to this value [`Ratio::ln_1p_ratio`] is computed by a series; for larger arguments the closed
/// form has no cancellation.
const NEAR: f64 = 0.0625;

/// The series `sum (-x)^k / (k + 1)`, `k >= 1`, and its derivative, to rounding for `|x| <= NEAR`.
#[inline(always)]
fn near_ln_1p_ratio<T: Real>(x: T) -> [T; 2] {
    let (mut value, mut slope) = (x.constant(0.0), x.constant(0.0));
    for k in (1..=13).rev() {
        let k = f64::from(k);
        value = -(x * (value + x.constant(1.0 / (k + 1.0))));
        slope = -(x * slope + x.constant(k / (k + 1.0)));
    }
    [value, slope]
}

/// Kept out of the kernels, because the library's logarithm is large.
#[inline(never)]
fn far_ln_1p_ratio(x: f64) -> [f64; 2] {
    let ratio = f64::ln_1p(x) / x;
    [ratio - 1.0, (1.0 / (1.0 + x) - ratio) / x]
}

/// Up to this value [`Real::ln_1p_remainder`] is computed by a series. For larger arguments the
/// difference loses three bits at most.
const NEAR_LOGARITHM: f64 = 0.25;

/// `x - ln(1 + x) = x s - 2 (artanh(s) - s)` with `s = x / (2 + x)`, to rounding for `|x| <=
/// NEAR_LOGARITHM`.
#[inline(always)]
fn near_ln_1p_remainder<T: Real>(x: T) -> T {
    let s = x * (x + x.constant(2.0)).recip();
    let z = s * s;
    let mut sum = x.constant(1.0 / 17.0);
    for odd in [15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        sum = sum.mul_add(z, x.constant(1.0 / odd));
    }
    x * s - (s + s) * z * sum
}

#[inline(never)]
fn far_ln_1p_remainder(x: f64) -> f64 {
    x - f64::ln_1p(x)
}

/// Up to this value functions of the exponential are computed by series of 16 terms. For larger
/// arguments differences lose two bits at most.
const NEAR_EXPONENTIAL: f64 = 0.5;

/// `exp(x) - 1 - x` by its series, to rounding for `|x| <= NEAR_EXPONENTIAL`.
#[inline(always)]
fn near_exp_m1_remainder<T: Real>(x: T) -> T {
    let mut sum = x.constant(1.0 / FACTORIALS[16]);
    for k in (2..16).rev() {
        sum = sum.mul_add(x, x.constant(1.0 / FACTORIALS[k]));
    }
    sum * x * x
}

#[inline(never)]
fn far_exp_m1(x: f64) -> f64 {
    f64::exp_m1(x)
}

#[inline(never)]
fn far_exp_m1_remainder(x: f64) -> f64 {
    f64::exp_m1(x) - x
}

/// `sum x^k / (k + 1)!`, `k >= 1`, and its derivative, to rounding for `|x| <= NEAR_EXPONENTIAL`.
#[inline(always)]
fn near_exp_m1_ratio<T: Real>(x: T) -> [T; 2] {
    let mut value = x.constant(0.0);
    let mut slope = x.constant(0.0);
    for k in (1..16).rev() {
        let coefficient = 1.0 / FACTORIALS[k + 1];
        value = value.mul_add(x, x.constant(coefficient));
        slope = slope.mul_add(x, x.constant(k as f64 * coefficient));
    }
    [value * x, slope]
}

#[inline(never)]
fn far_exp_m1_ratio(x: f64) -> [f64; 2] {
    let growth = f64::exp_m1(x);
    let ratio = growth / x;
    [ratio - 1.0, (growth + 1.0 - ratio) / x]
}

/// `k!`.
const FACTORIALS: [f64; 17] = {
    let mut all = [1.0; 17];
    let mut k = 1;
    while k < 17 {
        all[k] = all[k - 1] * k as f64;
        k += 1;
    }
    all
};

/// `near` in the lanes with `|x| <= limit`, and `far` in the others. The choice is made lane by
/// lane, so that neighbouring lanes have no influence.
#[inline(always)]
fn by_lane<L: Lane>(x: L, limit: f64, near: L, far: fn(f64) -> f64) -> L {
    let lanes = x.lanes();
    if lanes.iter().all(|x| x.abs() <= limit) {
        return near;
    }
    let mut out = near.lanes();
    for (out, x) in out.iter_mut().zip(lanes) {
        // The library also handles NaN.
        if x.abs() > limit || x.is_nan() {
            *out = far(x);
        }
    }
    x.load(out)
}

/// [`by_lane`] for a function and its derivative.
#[inline(always)]
fn both_by_lane<L: Lane>(x: L, limit: f64, near: [L; 2], far: fn(f64) -> [f64; 2]) -> [L; 2] {
    let lanes = x.lanes();
    if lanes.iter().all(|x| x.abs() <= limit) {
        return near;
    }
    let mut value = near[0].lanes();
    let mut slope = near[1].lanes();
    for lane in 0..WIDTH {
        // The library also handles NaN.
        if lanes[lane].abs() > limit || lanes[lane].is_nan() {
            [value[lane], slope[lane]] = far(lanes[lane]);
        }
    }
    [x.load(value), x.load(slope)]
}

/// A task that runs in lanes.
pub trait LaneTask {
    /// Result of the task.
    type Output;
    /// Runs the task. All lanes are created from the seed `unit` (ones). Must be
    /// `#[inline(always)]`.
    fn run<L: Lane>(self, unit: L) -> Self::Output;
}

/// A part of a task, which holds numbers in lanes: see [`Lane::apart`].
pub trait LanePart {
    /// Result of the part.
    type Output;
    /// Runs the part. Must be `#[inline(always)]`, or it is compiled without the instructions of the lanes.
    fn run(self) -> Self::Output;
}

/// A kind of lanes that this processor has.
#[derive(Clone, Copy)]
pub enum LaneKind {
    /// AVX2 registers with fused multiply-add, with the proof that the processor has them.
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    /// The registers that every processor of the build target has.
    Portable,
}

impl LaneKind {
    /// Runs `task` on lanes of this kind.
    #[inline(always)]
    pub fn run<K: LaneTask>(self, task: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(v3) => avx2::run(v3, task),
            Self::Portable => dispatch_portable(task),
        }
    }
}

/// Runs `task` on the fastest lanes of this processor.
pub fn dispatch<K: LaneTask>(task: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = pulp::x86::V3::try_new().filter(|_| rounding::vectors() && !PORTABLE.get()) {
        return avx2::run(v3, task);
    }
    dispatch_portable(task)
}

thread_local! {
    /// Whether this thread uses portable lanes only.
    static PORTABLE: Cell<bool> = const { Cell::new(false) };
}

/// Does `work`, in which all tasks of this thread run on portable lanes: to compare both kinds of lanes.
pub fn on_portable_lanes<T>(work: impl FnOnce() -> T) -> T {
    let before = PORTABLE.replace(true);
    let done = work();
    PORTABLE.set(before);
    done
}

/// Runs `task` on portable lanes; the fallback of [`dispatch`].
pub fn dispatch_portable<K: LaneTask>(task: K) -> K::Output {
    task.run(Portable(f64x4::ONE))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Logarithms([f64; WIDTH]);
    impl LaneTask for Logarithms {
        type Output = [f64; WIDTH];
        #[inline(always)]
        fn run<L: Lane>(self, unit: L) -> [f64; WIDTH] {
            unit.load(self.0).ln_1p().lanes()
        }
    }

    /// The logarithm of the lanes equals the library's to rounding, from the smallest number to
    /// infinity, and propagates NaN.
    #[test]
    fn logarithm_agrees_with_the_library() {
        for x in [0.0, 1e-300, -1e-16, 1e-9, -0.01, 0.1, -0.24, 0.25, 0.3, -0.9, 50.0, 1e300] {
            for y in [dispatch(Logarithms([x; WIDTH]))[2], dispatch_portable(Logarithms([x; WIDTH]))[1]] {
                assert!((y - f64::ln_1p(x)).abs() <= 4.0 * f64::EPSILON * y.abs(), "{x}: {y}");
            }
        }
        assert!(
            dispatch(Logarithms([-2.0, 1.0, 1.0, f64::NAN])).map(f64::is_nan) == [true, false, false, true]
        );
    }

    /// The ratio and its slope equal those of the library's logarithm if it is accurate, and those
    /// of the series otherwise.
    #[test]
    fn logarithmic_ratio_is_smooth() {
        for x in [-0.5_f64, -0.07, 0.063, 0.2, 3.0] {
            let [value, slope] = x.ln_1p_ratio_and_slope();
            assert!((value + 1.0 - x.ln_1p() / x).abs() < 1e-15);
            assert!((slope - (1.0 / (1.0 + x) - x.ln_1p() / x) / x).abs() < 1e-13);
        }
        for x in [-0.0625_f64, -1e-3, 0.0, 1e-9, 0.04, 0.0625] {
            let [value, slope] = x.ln_1p_ratio_and_slope();
            let low = (x - 1e-4).ln_1p_ratio();
            let high = (x + 1e-4).ln_1p_ratio();
            assert!((0.5 * (high - low) / 1e-4 - slope).abs() < 1e-8, "{x}");
            assert!((value + 0.5 * x - x * x / 3.0).abs() <= 0.3 * x.abs().powi(3) + 1e-17, "{x}");
        }
        assert!((-2.0_f64).ln_1p_ratio().is_nan() && f64::NAN.ln_1p_ratio_and_slope()[1].is_nan());
    }

    /// The remainders have full precision near zero, and equal the library's differences if these
    /// are accurate.
    #[test]
    fn remainders_do_not_cancel() {
        for x in [1e-12_f64, -1e-9, 1e-5, -1e-4] {
            let logarithm = x * x / 2.0 - x.powi(3) / 3.0 + x.powi(4) / 4.0 - x.powi(5) / 5.0;
            assert!((x.ln_1p_remainder() / logarithm - 1.0).abs() < 1e-14, "{x}");
            let exponential = x * x / 2.0 + x.powi(3) / 6.0 + x.powi(4) / 24.0 + x.powi(5) / 120.0;
            assert!((x.exp_m1_remainder() / exponential - 1.0).abs() < 1e-14, "{x}");
        }
        for x in [-0.9_f64, -0.5, -0.26, -0.24, 0.1, 0.24, 0.26, 0.49, 0.51, 2.0, 5.0] {
            assert!((x.ln_1p_remainder() - (x - x.ln_1p())).abs() < 4e-16 * x.abs().max(1.0), "{x}");
            assert!((x.exp_m1_remainder() - (x.exp_m1() - x)).abs() < 1e-15 * x.exp(), "{x}");
            assert!((x.exp_m1_ratio() + 1.0 - x.exp_m1() / x).abs() < 1e-15 * x.exp(), "{x}");
            let difference = 0.5e4 * ((x + 1e-4).exp_m1_ratio() - (x - 1e-4).exp_m1_ratio());
            assert!((x.exp_m1_ratio_and_slope()[1] - difference).abs() < 1e-8 * x.exp(), "{x}");
        }
        assert!(f64::NAN.exp_m1_remainder().is_nan() && (-2.0_f64).ln_1p_remainder().is_nan());
    }

    struct Single([f32; WIDTH]);
    impl LaneTask for Single {
        type Output = [f64; WIDTH];
        #[inline(always)]
        fn run<L: Lane>(self, unit: L) -> [f64; WIDTH] {
            unit.load_single(self.0).lanes()
        }
    }

    /// Numbers of single precision are those of double precision, each in its lane.
    #[test]
    fn single_precision_is_widened() {
        let numbers = [0.1, -3.0e38, 1e-45, f32::INFINITY];
        for found in [dispatch(Single(numbers)), dispatch_portable(Single(numbers))] {
            assert_eq!(found, numbers.map(f64::from));
        }
    }

    struct Functions([f64; WIDTH]);
    impl LaneTask for Functions {
        type Output = [[f64; WIDTH]; 5];
        #[inline(always)]
        fn run<L: Lane>(self, unit: L) -> Self::Output {
            let x = unit.load(self.0);
            let [ratio, slope] = x.exp_m1_ratio_and_slope();
            [
                x.ln_1p_remainder().lanes(),
                x.exp_m1().lanes(),
                x.exp_m1_remainder().lanes(),
                ratio.lanes(),
                slope.lanes(),
            ]
        }
    }

    /// The functions of the lanes agree with those of plain numbers, near zero, far from it, and in
    /// mixed lanes.
    #[test]
    fn functions_in_lanes_agree_with_plain_numbers() {
        let x = [1e-12, -0.2, 0.7, -0.6];
        for found in [dispatch(Functions(x)), dispatch_portable(Functions(x))] {
            for (lane, x) in x.into_iter().enumerate() {
                let [ratio, slope] = x.exp_m1_ratio_and_slope();
                let plain = [x.ln_1p_remainder(), x.exp_m1(), x.exp_m1_remainder(), ratio, slope];
                for (found, plain) in found.iter().zip(plain) {
                    assert!((found[lane] - plain).abs() <= 1e-15 * plain.abs(), "{x}: {found:?} {plain}");
                }
            }
        }
    }

    struct Transposed;
    impl LaneTask for Transposed {
        type Output = [[f64; WIDTH]; WIDTH];
        #[inline(always)]
        fn run<L: Lane>(self, unit: L) -> Self::Output {
            let row = |i: usize| unit.load(std::array::from_fn(|j| (10 * i + j) as f64));
            L::transpose([row(0), row(1), row(2), row(3)])
        }
    }

    /// Rows become lanes for both lane types.
    #[test]
    fn transposes() {
        let expected: [[f64; WIDTH]; WIDTH] =
            std::array::from_fn(|i| std::array::from_fn(|j| (10 * j + i) as f64));
        assert_eq!(dispatch(Transposed), expected);
        assert_eq!(dispatch_portable(Transposed), expected);
    }

    /// The logarithm of a lane is bitwise independent of its neighbours.
    #[test]
    fn lanes_do_not_see_each_other() {
        let alone = dispatch(Logarithms([0.1; WIDTH]))[0];
        let beside = dispatch(Logarithms([5.0, 0.1, -0.5, 0.2]))[1];
        assert_eq!(alone.to_bits(), beside.to_bits());
    }
}
