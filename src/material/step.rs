//! Laws over a step: the stress whose work is the change of the strain energy, whatever the step
//! (theory, section 4.5).
//!
//! With the displacement gradient linear in the unknown, `dF : P = dE : S` holds exactly for `P = F_middle S`, since
//! `dE = sym(F_middle^T dF)`. So all that a law has to bring is a second Piola stress `S(E_start, E_end)`, symmetric, with
//! `S : (E_end - E_start) = W_end - W_start`; it then keeps energy, and as `F_middle S F_middle^T` is symmetric angular
//! momentum.
//!
//! * Saint Venant-Kirchhoff is quadratic: `S = C : (E_start + E_end) / 2`.
//! * neo-Hookean is not projected on the strain as in Gonzalez' formula, which divides by `dE : dE`, but taken apart: it is
//!   linear in `tr C`, and otherwise a function of `I = det C`, whose difference is exactly `G : dC` with
//!   `G = (cof C_start + 4 cof C_middle + cof C_end) / 6`, `C_middle` the mean (Simpson's rule on a quadratic function;
//!   in the plane the mean alone). Divided differences in one variable remain, and the logarithm's has no digits to lose:
//!   `l = ln(I_end / I_start) / (I_end - I_start)` by a series where the two are near, hence no switch and no guard.
//!   `S = mu (1 - l G) + lambda/2 (ln J_start + ln J_end) l G`.

use super::{Law, Moduli, NeoHookean, SaintVenantKirchhoff};
use crate::lanes::Real;
use crate::square::{
    Square, cofactor_change, cofactor_minus_one, det_minus_one, diagonal, double_dot, green_strain, plus_one,
    product, scale_all, sum, trace, transpose,
};

/// A law that has a stress over a step.
pub trait StepLaw: Law {
    /// Stress and tangent between two displacement gradients, at the start and in the middle of the step; that at its end
    /// is as far from the middle as the start.
    fn step<T: Real, const D: usize>(
        moduli: &Moduli<T>,
        start: &Square<T, D>,
        middle: &Square<T, D>,
    ) -> StepResponse<T, D>;

    /// Change of the stress with the strain at the end of the step.
    fn change<T: Real, const D: usize>(tangent: &StepTangent<T, D>, strain: &Square<T, D>) -> Square<T, D>;
}

/// A law's answer over a step.
#[derive(Debug, Clone, Copy)]
pub struct StepResponse<T, const D: usize> {
    /// `S` \[Pa\], symmetric.
    pub second_piola: Square<T, D>,
    /// `F` in the middle of the step, which the force takes `S` with.
    pub middle: Square<T, D>,
    /// `F` at its end, by which the strain there changes.
    pub end: Square<T, D>,
    /// `det F` at the end of the step, not positive or NaN where the point is inverted.
    pub det_f: T,
    /// What [`StepLaw::change`] needs.
    pub tangent: StepTangent<T, D>,
}

/// `dS = lam tr(dE) 1 + 2 q dE + shape (slope : dE) + volume dG`, of which a law uses its own.
#[derive(Debug, Clone, Copy)]
pub struct StepTangent<T, const D: usize> {
    lam: T,
    double_q: T,
    shape: Square<T, D>,
    slope: Square<T, D>,
    volume: T,
    /// At which the cofactors change.
    stretch: Square<T, D>,
}

/// `F` in the middle and at the end, and the displacement gradient there.
#[inline(always)]
fn motion<T: Real, const D: usize>(
    start: &Square<T, D>,
    middle: &Square<T, D>,
) -> (Square<T, D>, Square<T, D>, Square<T, D>) {
    let two = start[0][0].constant(2.0);
    let end = sum(&scale_all(middle, two), &scale_all(start, -start[0][0].constant(1.0)));
    (plus_one(middle), plus_one(&end), end)
}

impl StepLaw for SaintVenantKirchhoff {
    #[inline(always)]
    fn step<T: Real, const D: usize>(
        moduli: &Moduli<T>,
        start: &Square<T, D>,
        middle: &Square<T, D>,
    ) -> StepResponse<T, D> {
        let half = moduli.mu.constant(0.5);
        let (f_middle, f_end, end) = motion(start, middle);
        let strain = scale_all(&sum(&green_strain(start), &green_strain(&end)), half);
        let nothing = diagonal(half.constant(0.0));
        StepResponse {
            second_piola: super::saint_venant_kirchhoff::isotropic(moduli, &strain),
            middle: f_middle,
            end: f_end,
            det_f: det_minus_one(&end) + half.constant(1.0),
            tangent: StepTangent {
                lam: half * moduli.lambda,
                double_q: moduli.mu,
                shape: nothing,
                slope: nothing,
                volume: half.constant(0.0),
                stretch: nothing,
            },
        }
    }

    #[inline(always)]
    fn change<T: Real, const D: usize>(tangent: &StepTangent<T, D>, strain: &Square<T, D>) -> Square<T, D> {
        let mut out = scale_all(strain, tangent.double_q);
        let pressure = tangent.lam * trace(strain);
        for i in 0..D {
            out[i][i] = out[i][i] + pressure;
        }
        out
    }
}

impl StepLaw for NeoHookean {
    #[inline(always)]
    fn step<T: Real, const D: usize>(
        moduli: &Moduli<T>,
        start: &Square<T, D>,
        middle: &Square<T, D>,
    ) -> StepResponse<T, D> {
        let constant = |x: f64| moduli.mu.constant(x);
        let (f_middle, f_end, end) = motion(start, middle);
        let strain_start = green_strain(start);
        let strain_end = green_strain(&end);
        // dE = sym(F_middle^T dF) keeps the digits that E_end - E_start would lose.
        let moved = scale_all(&sum(middle, &scale_all(start, constant(-1.0))), constant(2.0));
        let half_work = scale_all(&product(&transpose(&f_middle), &moved), constant(0.5));
        let strain_change = sum(&half_work, &transpose(&half_work));
        // Stretches without their ones.
        let both = sum(&strain_start, &strain_end);
        let (low, high) = (scale_all(&strain_start, constant(2.0)), scale_all(&strain_end, constant(2.0)));
        let mean = cofactor_minus_one(&both);
        let minor_end = cofactor_minus_one(&high);
        let bent = match D {
            2 => mean,
            _ => {
                let ends = sum(&cofactor_minus_one(&low), &minor_end);
                scale_all(&sum(&ends, &scale_all(&mean, constant(4.0))), constant(1.0 / 6.0))
            }
        };
        let shape = plus_one(&bent);
        let [growth_start, growth_end] = [det_minus_one(start), det_minus_one(&end)];
        let square_minus_one = growth_start * (growth_start + constant(2.0));
        let inverse = (square_minus_one + constant(1.0)).recip();
        let det_end = growth_end + constant(1.0);
        let volume_change = constant(2.0) * double_dot(&shape, &strain_change);
        let [ratio, ratio_slope] = (volume_change * inverse).ln_1p_ratio();
        let quotient = (ratio + constant(1.0)) * inverse;
        let quotient_minus_one = (ratio - square_minus_one) * inverse;
        let logarithms = growth_start.ln_1p() + growth_end.ln_1p();
        let pressure = constant(0.5) * moduli.lambda * logarithms;
        // mu (1 - l G) + pressure l G, the ones of the first cancelled by hand.
        let mut second_piola = scale_all(&bent, -moduli.mu * quotient);
        for i in 0..D {
            second_piola[i][i] = second_piola[i][i] - moduli.mu * quotient_minus_one;
        }
        let second_piola = sum(&second_piola, &scale_all(&shape, pressure * quotient));
        let volume = (pressure - moduli.mu) * quotient;
        let by_quotient = (pressure - moduli.mu) * ratio_slope * inverse * inverse;
        let by_logarithm = constant(0.25) * moduli.lambda * quotient * (det_end * det_end).recip();
        // dI_end = 2 cof(C_end) : dE.
        let slope = scale_all(&plus_one(&minor_end), constant(2.0) * (by_quotient + by_logarithm));
        let third = sum(&low, &scale_all(&high, constant(2.0)));
        StepResponse {
            second_piola,
            middle: f_middle,
            end: f_end,
            det_f: det_end,
            tangent: StepTangent {
                lam: constant(0.0),
                double_q: constant(0.0),
                shape,
                slope,
                volume,
                stretch: plus_one(&scale_all(&third, constant(1.0 / 3.0))),
            },
        }
    }

    #[inline(always)]
    fn change<T: Real, const D: usize>(tangent: &StepTangent<T, D>, strain: &Square<T, D>) -> Square<T, D> {
        let along = scale_all(&tangent.shape, double_dot(&tangent.slope, strain));
        sum(&along, &scale_all(&cofactor_change(&tangent.stretch, strain), tangent.volume))
    }
}
