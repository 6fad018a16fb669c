//! Hooke's law of linear kinematics: the small-strain limit of every law in the table.

use super::saint_venant_kirchhoff::{isotropic, isotropic_energy};
use super::{Metric, MetricLaw, MetricResponse, Moduli, Potential};
use crate::lanes::Real;
use crate::square::{Square, diagonal, small_strain, trace};

/// `sigma = lambda tr(eps) 1 + 2 mu eps`, `eps` the symmetric part of the displacement gradient.
#[derive(Debug)]
pub struct Hooke;

impl Potential for Hooke {
    type Constants = Moduli<f64>;

    #[inline(always)]
    fn energy<T: Real, const D: usize>(moduli: &Moduli<f64>, grad_u: &Square<T, D>) -> T {
        isotropic_energy(&moduli.in_lanes(grad_u[0][0]), &small_strain(grad_u))
    }
}

impl MetricLaw for Hooke {
    const METRIC: Metric = Metric::Linear;

    #[inline(always)]
    fn respond_with_metric<T: Real, const D: usize>(
        moduli: &Moduli<T>,
        grad_u: &Square<T, D>,
    ) -> MetricResponse<T, D> {
        let one = moduli.mu.constant(1.0);
        let cauchy = isotropic(moduli, &small_strain(grad_u));
        // Geometry does not change here, so nothing can invert; a gradient that is not a number must still show.
        let sound = trace(&cauchy) * one.constant(0.0) + one;
        MetricResponse {
            second_piola: cauchy,
            first_piola: cauchy,
            gradient_map: diagonal(one),
            lam: moduli.lambda,
            q: moduli.mu,
            det_f: sound,
        }
    }
}
