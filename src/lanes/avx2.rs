//! Lanes in AVX2 registers with fused multiply-add.
//!
//! All code is safe: `pulp` provides its token only if the processor has the instructions.

use super::{
    Lane, LaneKind, LanePart, LaneTask, NEAR, NEAR_EXPONENTIAL, NEAR_LOGARITHM, Ratio, RatioSlope, Real,
    WIDTH, both_by_lane, by_lane, far_exp_m1, far_exp_m1_ratio, far_exp_m1_remainder, far_ln_1p_ratio,
    far_ln_1p_remainder, ln_1p, near_exp_m1_ratio, near_exp_m1_remainder, near_ln_1p_ratio,
    near_ln_1p_remainder,
};
use pulp::cast;
use pulp::x86::V3;
use std::arch::x86_64::{__m256d, _MM_HINT_T0};
use std::ops::{Add, Mul, Neg, Sub};

/// Lanes in one register; the first field proves that the processor has AVX2 and FMA.
#[derive(Clone, Copy)]
struct Register(V3, __m256d);

struct Enter<K>(V3, K);

impl<K: LaneTask> pulp::NullaryFnOnce for Enter<K> {
    type Output = K::Output;
    #[inline(always)]
    fn call(self) -> K::Output {
        let one = self.0.avx._mm256_set1_pd(1.0);
        self.1.run(Register(self.0, one))
    }
}

struct Apart<P>(P);

impl<P: LanePart> pulp::NullaryFnOnce for Apart<P> {
    type Output = P::Output;
    #[inline(always)]
    fn call(self) -> P::Output {
        self.0.run()
    }
}

pub fn run<K: LaneTask>(v3: V3, task: K) -> K::Output {
    v3.vectorize(Enter(v3, task))
}

impl Add for Register {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0, self.0.avx._mm256_add_pd(self.1, other.1))
    }
}
impl Sub for Register {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0, self.0.avx._mm256_sub_pd(self.1, other.1))
    }
}
impl Mul for Register {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0, self.0.avx._mm256_mul_pd(self.1, other.1))
    }
}
impl Neg for Register {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let sign = self.0.avx._mm256_set1_pd(-0.0);
        Self(self.0, self.0.avx._mm256_xor_pd(self.1, sign))
    }
}

impl Real for Register {
    #[inline(always)]
    fn constant(self, x: f64) -> Self {
        Self(self.0, self.0.avx._mm256_set1_pd(x))
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(self.0, self.0.fma._mm256_fmadd_pd(self.1, b.1, c.1))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let one = self.0.avx._mm256_set1_pd(1.0);
        Self(self.0, self.0.avx._mm256_div_pd(one, self.1))
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

impl Ratio for Register {
    #[inline(always)]
    fn ln_1p_ratio(self) -> Self {
        self.ln_1p_ratio_and_slope()[0]
    }
    #[inline(always)]
    fn exp_m1_ratio(self) -> Self {
        self.exp_m1_ratio_and_slope()[0]
    }
}

impl RatioSlope for Register {
    #[inline(always)]
    fn ln_1p_ratio_and_slope(self) -> [Self; 2] {
        both_by_lane(self, NEAR, near_ln_1p_ratio(self), far_ln_1p_ratio)
    }
    #[inline(always)]
    fn exp_m1_ratio_and_slope(self) -> [Self; 2] {
        both_by_lane(self, NEAR_EXPONENTIAL, near_exp_m1_ratio(self), far_exp_m1_ratio)
    }
}

impl Lane for Register {
    #[inline(always)]
    fn kind(self) -> LaneKind {
        LaneKind::Avx2(self.0)
    }
    #[inline(always)]
    fn load(self, values: [f64; WIDTH]) -> Self {
        Self(self.0, cast(values))
    }
    #[inline(always)]
    fn load_single(self, values: [f32; WIDTH]) -> Self {
        Self(self.0, self.0.avx._mm256_cvtps_pd(cast(values)))
    }
    #[inline(always)]
    fn lanes(self) -> [f64; WIDTH] {
        cast(self.1)
    }
    #[inline(always)]
    fn apart<P: LanePart>(self, part: P) -> P::Output {
        self.0.vectorize(Apart(part))
    }
    #[inline(always)]
    fn prefetch<T>(self, values: &[T], at: usize) {
        self.0.sse._mm_prefetch::<_MM_HINT_T0>(values.as_ptr().wrapping_add(at).cast());
    }
    #[inline(always)]
    fn transpose(rows: [Self; WIDTH]) -> [[f64; WIDTH]; WIDTH] {
        let avx = rows[0].0.avx;
        let [a, b, c, d] = rows.map(|row| row.1);
        let (ab_even, ab_odd) = (avx._mm256_unpacklo_pd(a, b), avx._mm256_unpackhi_pd(a, b));
        let (cd_even, cd_odd) = (avx._mm256_unpacklo_pd(c, d), avx._mm256_unpackhi_pd(c, d));
        const LOW: i32 = 0x20;
        const HIGH: i32 = 0x31;
        [
            cast(avx._mm256_permute2f128_pd::<LOW>(ab_even, cd_even)),
            cast(avx._mm256_permute2f128_pd::<LOW>(ab_odd, cd_odd)),
            cast(avx._mm256_permute2f128_pd::<HIGH>(ab_even, cd_even)),
            cast(avx._mm256_permute2f128_pd::<HIGH>(ab_odd, cd_odd)),
        ]
    }
}
