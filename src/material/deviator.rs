//! The isochoric part of a law, on which viscous branches act (theory, section 3.15).
//!
//! For finite strain it is `W_iso(C) = W_mu(J^(-2/3) C)` with the terms `W_mu` of the law that remain
//! under [`Part::Shear`](super::Part). With `S_bar = 2 dW_mu/dC` at the isochoric stretch,
//!
//! `S_iso = J^(-2/3) (S_bar - (S_bar : C) C^-1 / 3)`.
//!
//! All is computed in space, because the isochoric stretch of plane strain has a component across the
//! plane.

use super::{PointLaw, Response};
use crate::composed::LaneWise;
use crate::lanes::Real;
use crate::square::{
    Square, diagonal, double_dot, green_strain, inner_gram, plus_one, product, scale_all, small_strain, sum,
    trace, transpose,
};

/// The isochoric part of a law at one point.
pub trait Deviator {
    /// Its second Piola stress `S_iso` \[Pa\].
    fn stress<T: LaneWise>(&self, grad_u: &Square<T, 3>) -> Square<T, 3>;

    /// Its energy [J/m^3].
    fn energy<T: LaneWise>(&self, grad_u: &Square<T, 3>) -> T;

    /// The strain whose work with the stress is that of the forces.
    fn strain<T: Real>(&self, grad_u: &Square<T, 3>) -> Square<T, 3>;

    /// Energy of a branch with the stress `ratio`, which is relative to the shear modulus of the branch,
    /// relative to that modulus.
    fn branch_energy<T: LaneWise>(&self, ratio: &Square<T, 3>, grad_u: &Square<T, 3>) -> T;
}

/// The isochoric part of a law at finite strain, from the law's [`Part::Shear`](super::Part).
#[derive(Debug)]
pub struct FiniteDeviator<'a, K: ?Sized>(pub &'a K);

/// The deviator of Hooke's law.
#[derive(Debug, Clone, Copy)]
pub struct LinearDeviator {
    /// Shear modulus \[Pa\].
    pub mu: f64,
}

/// `dS_iso` for a change of Green's strain.
#[derive(Debug, Clone, Copy)]
pub struct DeviatorTangent<T, C> {
    /// Tangent of the law at the isochoric stretch.
    fictitious: C,
    /// `S_bar`
    bar: Square<T, 3>,
    /// `S_bar : C`
    bar_trace: T,
    /// `S_iso`
    isochoric: Square<T, 3>,
    /// `C`
    stretch: Square<T, 3>,
    /// `C^-1`
    inverse: Square<T, 3>,
    /// `J^(-2/3)`
    shrink: T,
}

/// The stretch at a point and its isochoric part.
struct Stretch<T> {
    /// Displacement gradient of the isochoric motion, `J^(-1/3) F - 1`.
    grad_u: Square<T, 3>,
    /// `C`
    stretch: Square<T, 3>,
    /// `C^-1`
    inverse: Square<T, 3>,
    /// `J^(-2/3)`
    shrink: T,
}

impl<T: Real> Stretch<T> {
    #[inline(always)]
    fn new(grad_u: &Square<T, 3>) -> Self {
        let one = grad_u[0][0].constant(1.0);
        let f = plus_one(grad_u);
        let growth = crate::square::det_minus_one(grad_u);
        // J^(-1/3) - 1, whose digits are kept at small strain.
        let less = growth.ln_1p().scale(-1.0 / 3.0).exp_m1();
        let ratio = less + one;
        let isochoric = sum(grad_u, &scale_all(&f, less));
        let inverse_transpose = scale_all(&crate::square::cofactor(&f), (growth + one).recip());
        let stretch = plus_one(&scale_all(&green_strain(grad_u), one + one));
        Self { grad_u: isochoric, stretch, inverse: inner_gram(&inverse_transpose), shrink: ratio * ratio }
    }

    /// `J^(-2/3) (S_bar - (S_bar : C) C^-1 / 3)` and `S_bar : C`.
    #[inline(always)]
    fn project(&self, bar: &Square<T, 3>) -> (Square<T, 3>, T) {
        let bar_trace = double_dot(bar, &self.stretch);
        let deviator = sum(bar, &scale_all(&self.inverse, bar_trace.scale(-1.0 / 3.0)));
        (scale_all(&deviator, self.shrink), bar_trace)
    }
}

impl<K: PointLaw + ?Sized> FiniteDeviator<'_, K> {
    /// Stress and tangent.
    #[inline(always)]
    pub fn respond<T: LaneWise>(
        &self,
        grad_u: &Square<T, 3>,
    ) -> Response<T, DeviatorTangent<T, K::Tangent<T, 3>>, 3> {
        let at = Stretch::new(grad_u);
        let Response { second_piola: bar, tangent: fictitious } = self.0.respond(&at.grad_u);
        let (isochoric, bar_trace) = at.project(&bar);
        let Stretch { stretch, inverse, shrink, .. } = at;
        let tangent = DeviatorTangent { fictitious, bar, bar_trace, isochoric, stretch, inverse, shrink };
        Response { second_piola: isochoric, tangent }
    }

    /// `dS_iso` for a symmetric change of Green's strain.
    #[inline(always)]
    pub fn contract<T: Real>(
        tangent: &DeviatorTangent<T, K::Tangent<T, 3>>,
        strain: &Square<T, 3>,
    ) -> Square<T, 3> {
        let DeviatorTangent { fictitious, bar, bar_trace, isochoric, stretch, inverse, shrink } = tangent;
        let third = 1.0 / 3.0;
        let volume = double_dot(inverse, strain);
        let isochoric_strain = scale_all(&sum(strain, &scale_all(stretch, volume.scale(-third))), *shrink);
        let change = K::contract(fictitious, &isochoric_strain);
        let change_trace = double_dot(&change, stretch) + double_dot(bar, strain).scale(2.0);
        let turned = product(&product(inverse, strain), inverse);
        let mut out = scale_all(isochoric, volume.scale(-2.0 * third));
        for i in 0..3 {
            for j in 0..3 {
                let pressure = bar_trace.scale(2.0) * turned[i][j] - change_trace * inverse[i][j];
                out[i][j] = shrink.mul_add(change[i][j] + pressure.scale(third), out[i][j]);
            }
        }
        out
    }
}

impl<K: PointLaw + ?Sized> Deviator for FiniteDeviator<'_, K> {
    #[inline(always)]
    fn stress<T: LaneWise>(&self, grad_u: &Square<T, 3>) -> Square<T, 3> {
        let at = Stretch::new(grad_u);
        at.project(&self.0.stress(&at.grad_u)).0
    }

    #[inline(always)]
    fn energy<T: LaneWise>(&self, grad_u: &Square<T, 3>) -> T {
        self.0.energy(&Stretch::new(grad_u).grad_u)
    }

    #[inline(always)]
    fn strain<T: Real>(&self, grad_u: &Square<T, 3>) -> Square<T, 3> {
        green_strain(grad_u)
    }

    /// The energy of a neo-Hookean spring with the Kirchhoff stress `F ratio F^T`, less its mean: the
    /// spring's isochoric stretch `b` has the deviator of that stress and `det b = 1`.
    #[inline(always)]
    fn branch_energy<T: LaneWise>(&self, ratio: &Square<T, 3>, grad_u: &Square<T, 3>) -> T {
        let f = plus_one(grad_u);
        let stress = deviator(&product(&product(&f, ratio), &transpose(&f)));
        let second = double_dot(&stress, &stress).scale(0.5);
        let cofactors = crate::square::cofactor(&stress);
        let third = crate::square::dot(&stress[0], &cofactors[0]);
        let [mean] = T::lane_wise([second, third], |[second, third]| [mean_stretch(second, third)]);
        mean.scale(1.5)
    }
}

impl Deviator for LinearDeviator {
    #[inline(always)]
    fn stress<T: LaneWise>(&self, grad_u: &Square<T, 3>) -> Square<T, 3> {
        scale_all(&deviator(&small_strain(grad_u)), grad_u[0][0].constant(2.0 * self.mu))
    }

    #[inline(always)]
    fn energy<T: LaneWise>(&self, grad_u: &Square<T, 3>) -> T {
        let strain = deviator(&small_strain(grad_u));
        double_dot(&strain, &strain).scale(self.mu)
    }

    #[inline(always)]
    fn strain<T: Real>(&self, grad_u: &Square<T, 3>) -> Square<T, 3> {
        small_strain(grad_u)
    }

    #[inline(always)]
    fn branch_energy<T: LaneWise>(&self, ratio: &Square<T, 3>, _: &Square<T, 3>) -> T {
        double_dot(ratio, ratio).scale(0.25)
    }
}

/// `a` less its mean on the diagonal.
#[inline(always)]
fn deviator<T: Real>(a: &Square<T, 3>) -> Square<T, 3> {
    sum(a, &diagonal(trace(a).scale(-1.0 / 3.0)))
}

/// `q = tr(b) / 3 - 1` of the stretch `b` with `det b = 1` whose deviator `a` has `second = a : a / 2`
/// and `third = det a`: the largest root of `q^3 + 3 q^2 + (3 - second) q + third - second`.
///
/// Newton's method starts above the root, where the polynomial is convex, and therefore falls until
/// rounding ends it.
fn mean_stretch(second: f64, third: f64) -> f64 {
    let mut q = 2.0 * (second / 3.0).sqrt();
    loop {
        let value = ((q + 3.0) * q + (3.0 - second)) * q + (third - second);
        let slope = (3.0 * q + 6.0) * q + (3.0 - second);
        let next = q - value / slope;
        if next.is_nan() {
            return next;
        }
        if next >= q || next <= 0.0 {
            return next.clamp(0.0, q);
        }
        q = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The root belongs to the stretch from whose deviator it was computed.
    #[test]
    fn the_mean_stretch_is_found() {
        for [a, b] in [[1.0, 1.0], [2.0, 0.7], [1.0 + 1e-7, 1.0], [0.1, 5.0], [30.0, 0.2], [1.001, 0.9995]] {
            let b = [a, b, 1.0 / (a * b)];
            let mean = b.iter().sum::<f64>() / 3.0;
            let [x, y, z] = b.map(|b| b - mean);
            let found = mean_stretch(0.5 * (x * x + y * y + z * z), x * y * z);
            let expected = mean - 1.0;
            assert!((found - expected).abs() < 1e-13 * mean.max(1.0), "{b:?}: {found} {expected}");
        }
        assert!(mean_stretch(f64::NAN, 0.0).is_nan());
    }
}
