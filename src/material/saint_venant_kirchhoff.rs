//! Saint Venant-Kirchhoff: the paper's constant `C` between `S` and `E`.

use super::{Law, Metric, Moduli, Response};
use crate::lanes::Real;
use crate::square::{Square, det_minus_one, green_strain, plus_one, product, trace};

/// `S = lambda tr(E) 1 + 2 mu E`.
///
/// Loses its stiffness at a stretch of 1/sqrt(3) in compression; a physics guard must watch `det F`.
#[derive(Debug)]
pub struct SaintVenantKirchhoff;

impl Law for SaintVenantKirchhoff {
    const METRIC: Metric = Metric::Reference;

    #[inline(always)]
    fn respond<T: Real, const D: usize>(moduli: &Moduli<T>, grad_u: &Square<T, D>) -> Response<T, D> {
        let f = plus_one(grad_u);
        let second_piola = isotropic(moduli, &green_strain(grad_u));
        Response {
            second_piola,
            first_piola: product(&f, &second_piola),
            gradient_map: f,
            lam: moduli.lambda,
            q: moduli.mu,
            det_f: det_minus_one(grad_u) + moduli.mu.constant(1.0),
        }
    }

    #[inline(always)]
    fn energy<T: Real, const D: usize>(moduli: &Moduli<T>, grad_u: &Square<T, D>) -> T {
        isotropic_energy(moduli, &green_strain(grad_u))
    }
}

/// `lambda tr(strain) 1 + 2 mu strain` \[Pa\].
#[inline(always)]
pub(super) fn isotropic<T: Real, const D: usize>(moduli: &Moduli<T>, strain: &Square<T, D>) -> Square<T, D> {
    let pressure = moduli.lambda * trace(strain);
    let double = moduli.mu + moduli.mu;
    let mut out = *strain;
    for i in 0..D {
        for j in i..D {
            out[i][j] = if i == j { double.mul_add(strain[i][i], pressure) } else { double * strain[i][j] };
            out[j][i] = out[i][j];
        }
    }
    out
}

/// `lambda/2 tr(strain)^2 + mu strain : strain` [J/m^3].
#[inline(always)]
pub(super) fn isotropic_energy<T: Real, const D: usize>(moduli: &Moduli<T>, strain: &Square<T, D>) -> T {
    let volume = trace(strain);
    let mut square = moduli.mu.constant(0.0);
    for i in 0..D {
        for j in 0..D {
            square = strain[i][j].mul_add(strain[i][j], square);
        }
    }
    moduli.mu * square + moduli.lambda.constant(0.5) * moduli.lambda * volume * volume
}
