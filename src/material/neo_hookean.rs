//! Compressible neo-Hookean rubber.

use super::{Law, Metric, Moduli, Response};
use crate::lanes::Real;
use crate::square::{
    Square, cofactor, det_minus_one, det_minus_one_minus_trace, dot, green_strain, inner_gram, plus_one,
    product,
};

/// `S = mu (1 - C^-1) + lambda ln J C^-1`, evaluated as `2 mu C^-1 E + lambda ln J C^-1`, which loses no digits at
/// small strain.
#[derive(Debug)]
pub struct NeoHookean;

impl Law for NeoHookean {
    const METRIC: Metric = Metric::Current;

    #[inline(always)]
    fn respond<T: Real, const D: usize>(moduli: &Moduli<T>, grad_u: &Square<T, D>) -> Response<T, D> {
        let f = plus_one(grad_u);
        let growth = det_minus_one(grad_u);
        let det_f = growth + growth.constant(1.0);
        let inverse = det_f.recip();
        let mut inverse_transpose = cofactor(&f);
        for i in 0..D {
            for j in 0..D {
                inverse_transpose[i][j] = inverse_transpose[i][j] * inverse;
            }
        }
        let inverse_stretch = inner_gram(&inverse_transpose);
        // Where locking is cured most samples carry the shear terms alone.
        let vanishes = moduli.lambda.vanishes();
        let pressure = if vanishes { moduli.lambda } else { moduli.lambda * growth.ln_1p() };
        let second_piola = stress(moduli.mu + moduli.mu, pressure, &inverse_stretch, &green_strain(grad_u));
        Response {
            second_piola,
            first_piola: product(&f, &second_piola),
            gradient_map: inverse_transpose,
            lam: moduli.lambda,
            q: moduli.mu - pressure,
            det_f,
        }
    }

    /// `mu/2 (tr C - D - 2 ln J) + lambda/2 (ln J)^2`, arranged so that no first-order terms cancel.
    #[inline(always)]
    fn energy<T: Real, const D: usize>(moduli: &Moduli<T>, grad_u: &Square<T, D>) -> T {
        let half = moduli.mu.constant(0.5);
        let growth = det_minus_one(grad_u);
        let logarithm = growth.ln_1p();
        // (tr C - D) / 2 = tr H + H:H / 2, and tr H = (J - 1) - (terms of second and third order).
        let mut square = moduli.mu.constant(0.0);
        for row in grad_u {
            square = square + dot(row, row);
        }
        let shear = half * square - det_minus_one_minus_trace(grad_u) + (growth - logarithm);
        moduli.mu * shear + half * moduli.lambda * logarithm * logarithm
    }
}

/// `2 mu C^-1 E + p C^-1`; the two factors commute, so the product is symmetric.
#[inline(always)]
fn stress<T: Real, const D: usize>(
    double_mu: T,
    pressure: T,
    inverse_stretch: &Square<T, D>,
    strain: &Square<T, D>,
) -> Square<T, D> {
    let mut out = *strain;
    for i in 0..D {
        for j in i..D {
            let shear = double_mu * dot(&inverse_stretch[i], &strain[j]);
            out[i][j] = pressure.mul_add(inverse_stretch[i][j], shear);
            out[j][i] = out[i][j];
        }
    }
    out
}
