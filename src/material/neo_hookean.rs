//! Compressible neo-Hookean rubber.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::check_engineering;
use super::step::mean_cofactor_minus_one;
use super::{
    Law, LawTask, Metric, MetricLaw, MetricResponse, MetricTangent, Moduli, Parameters, Part, Potential,
    Response, StepMotion, Volumetric,
};
use crate::lanes::{RatioSlope, Real};
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};
use crate::square::{
    Square, cofactor, cofactor_change, cofactor_minus_one, det_minus_one, det_minus_one_minus_trace, dot,
    double_dot, green_strain, inner_gram, plus_one, product, scale_all, sum, transpose,
};

/// Compressible neo-Hookean, mu/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2: rubber, large strains.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NeoHookean {
    /// Young's modulus \[Pa\], > 0.
    pub young_modulus: Pressure,
    /// Poisson's ratio, between -1 and 0.5, both excluded.
    pub poisson_ratio: Number,
}

impl Parameters for NeoHookean {
    const VOLUMETRIC: Volumetric = Volumetric::Logarithmic;

    fn check(&self, findings: &mut Findings) {
        check_engineering(self.young_modulus, self.poisson_ratio, findings);
    }

    fn moduli(&self) -> Moduli<f64> {
        Moduli::of(self.young_modulus.value, self.poisson_ratio.value)
    }

    fn constants(&self, part: Part) -> Moduli<f64> {
        self.moduli().part(part)
    }

    fn with_bulk_modulus(&self, bulk: f64) -> Self {
        Self::from_moduli(Moduli::of_shear_and_bulk(self.moduli().mu, bulk))
    }

    fn from_moduli(moduli: Moduli<f64>) -> Self {
        Self {
            young_modulus: Pressure::new(moduli.young_modulus()),
            poisson_ratio: Number::new(moduli.poisson_ratio()),
        }
    }
}

impl Potential for NeoHookean {
    type Constants = Moduli<f64>;

    /// `mu/2 (tr C - D - 2 ln J) + lambda/2 (ln J)^2`, arranged so that no first-order terms cancel.
    #[inline(always)]
    fn energy<T: Real, const D: usize>(moduli: &Moduli<f64>, grad_u: &Square<T, D>) -> T {
        let moduli = moduli.in_lanes(grad_u[0][0]);
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

impl MetricLaw for NeoHookean {
    const METRIC: Metric = Metric::Current;

    /// `S = mu (1 - C^-1) + lambda ln J C^-1`, evaluated as `2 mu C^-1 E + lambda ln J C^-1`, which loses no digits at
    /// small strain.
    #[inline(always)]
    fn respond_with_metric<T: Real, const D: usize>(
        moduli: &Moduli<T>,
        grad_u: &Square<T, D>,
    ) -> MetricResponse<T, D> {
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
        MetricResponse {
            second_piola,
            first_piola: product(&f, &second_piola),
            gradient_map: inverse_transpose,
            lam: moduli.lambda,
            q: moduli.mu - pressure,
            det_f,
        }
    }
}

impl Law for NeoHookean {
    type Tangent<T: Real, const D: usize> = MetricTangent<T, D>;
    type StepTangent<T: Real, const D: usize> = NeoHookeanStep<T, D>;

    #[inline(always)]
    fn respond<T: Real, const D: usize>(
        moduli: &Moduli<f64>,
        grad_u: &Square<T, D>,
    ) -> Response<T, MetricTangent<T, D>, D> {
        let response = Self::respond_with_metric(&moduli.in_lanes(grad_u[0][0]), grad_u);
        Response { second_piola: response.second_piola, tangent: MetricTangent::current(&response) }
    }

    #[inline(always)]
    fn contract<T: Real, const D: usize>(
        tangent: &MetricTangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D> {
        tangent.contract(strain)
    }

    #[inline(always)]
    fn respond_step<T: RatioSlope, const D: usize>(
        moduli: &Moduli<f64>,
        motion: &StepMotion<T, D>,
    ) -> Response<T, NeoHookeanStep<T, D>, D> {
        let StepMotion { start, middle, end } = motion;
        let moduli = moduli.in_lanes(start[0][0]);
        let constant = |x: f64| moduli.mu.constant(x);
        let strain_start = green_strain(start);
        let strain_end = green_strain(end);
        // dE = sym(F_middle^T dF) keeps the digits that E_end - E_start would lose.
        let moved = scale_all(&sum(middle, &scale_all(start, constant(-1.0))), constant(2.0));
        let half_work = scale_all(&product(&transpose(&plus_one(middle)), &moved), constant(0.5));
        let strain_change = sum(&half_work, &transpose(&half_work));
        // Stretches without their ones.
        let both = sum(&strain_start, &strain_end);
        let low = scale_all(&strain_start, constant(2.0));
        let high = scale_all(&strain_end, constant(2.0));
        let bent = mean_cofactor_minus_one(&low, &both, &high);
        let minor_end = cofactor_minus_one(&high);
        let shape = plus_one(&bent);
        let growth_start = det_minus_one(start);
        let growth_end = det_minus_one(end);
        let square_minus_one = growth_start * (growth_start + constant(2.0));
        let inverse = (square_minus_one + constant(1.0)).recip();
        let det_end = growth_end + constant(1.0);
        let volume_change = constant(2.0) * double_dot(&shape, &strain_change);
        let [ratio, ratio_slope] = (volume_change * inverse).ln_1p_ratio_and_slope();
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
        let stretch = plus_one(&scale_all(&third, constant(1.0 / 3.0)));
        Response { second_piola, tangent: NeoHookeanStep { shape, slope, volume, stretch } }
    }

    #[inline(always)]
    fn contract_step<T: Real, const D: usize>(
        tangent: &NeoHookeanStep<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D> {
        let along = scale_all(&tangent.shape, double_dot(&tangent.slope, strain));
        sum(&along, &scale_all(&cofactor_change(&tangent.stretch, strain), tangent.volume))
    }

    #[inline(always)]
    fn accept<K: LawTask>(&self, task: K) -> K::Output {
        task.run_metric(self)
    }
}

/// `dS = shape (slope : dE) + volume dG`, the tangent over a step.
#[derive(Debug, Clone, Copy)]
pub struct NeoHookeanStep<T, const D: usize> {
    shape: Square<T, D>,
    slope: Square<T, D>,
    volume: T,
    /// At which the cofactors change.
    stretch: Square<T, D>,
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
