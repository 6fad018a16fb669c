//! Laws with a tangent of the form `C = lam m (x) m + 2 q I_m`, `(I_m)_IJKL = (m_IK m_JL + m_IL m_JK) / 2`, with `m` either
//! the identity or `C^-1`.
//!
//! The element kernel sums such a tangent without a strain operator or a Voigt matrix, in a third of the time of the general one.

use super::{Moduli, Potential};
use crate::lanes::Real;
use crate::square::{Square, double_dot, inner_gram, product};

/// Which metric a law's tangent has; known at compile time, so that what is the identity costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// `m = 1`, `F m F^T = F F^T`.
    Reference,
    /// `m = C^-1`, `F m F^T = 1`.
    Current,
    /// Linear kinematics: both are the identity and the stress does not stiffen.
    Linear,
}

/// A law with such a tangent.
pub trait MetricLaw: Potential<Constants = Moduli<f64>> {
    /// The metric of the tangent.
    const METRIC: Metric;

    /// Stress and tangent at the displacement gradient `grad_u` (row = component, column = reference direction).
    fn respond_with_metric<T: Real, const D: usize>(
        moduli: &Moduli<T>,
        grad_u: &Square<T, D>,
    ) -> MetricResponse<T, D>;
}

/// The answer of a [`MetricLaw`] at one point.
#[derive(Debug, Clone, Copy)]
pub struct MetricResponse<T, const D: usize> {
    /// `S` \[Pa\], symmetric (for linear kinematics the one stress there is).
    pub second_piola: Square<T, D>,
    /// `P = F S` \[Pa\]; row = component, column = reference direction. The paper's `T_R` is its transpose.
    pub first_piola: Square<T, D>,
    /// `F m`: takes the reference gradient of a shape function to `h`, with `h . du` = `m : dE`.
    pub gradient_map: Square<T, D>,
    /// `lam` of the tangent \[Pa\].
    pub lam: T,
    /// `q` of the tangent \[Pa\].
    pub q: T,
    /// `det F`, not positive or NaN where the point is inverted; 1 in linear kinematics (NaN if the gradient is).
    pub det_f: T,
}

/// `lam m (x) m + 2 q I_m`.
#[derive(Debug, Clone, Copy)]
pub struct MetricTangent<T, const D: usize> {
    metric: Square<T, D>,
    lam: T,
    q: T,
}

impl<T: Real, const D: usize> MetricTangent<T, D> {
    /// Of a response with `m = C^-1`, whose gradient map is `F^-T`.
    #[inline(always)]
    pub fn current(response: &MetricResponse<T, D>) -> Self {
        Self { metric: inner_gram(&response.gradient_map), lam: response.lam, q: response.q }
    }

    /// With `m = metric`.
    #[inline(always)]
    pub fn new(metric: Square<T, D>, lam: T, q: T) -> Self {
        Self { metric, lam, q }
    }

    /// `lam (m : dE) m + 2 q m dE m`.
    #[inline(always)]
    pub fn contract(&self, strain: &Square<T, D>) -> Square<T, D> {
        let along = self.lam * double_dot(&self.metric, strain);
        let double = self.q + self.q;
        let mut out = product(&product(&self.metric, strain), &self.metric);
        for i in 0..D {
            for j in 0..D {
                out[i][j] = double.mul_add(out[i][j], along * self.metric[i][j]);
            }
        }
        out
    }
}
