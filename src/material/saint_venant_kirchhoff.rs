//! Saint Venant-Kirchhoff: the paper's constant `C` between `S` and `E`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::check_engineering;
use super::{
    Law, LawTask, Metric, MetricLaw, MetricResponse, Moduli, Parameters, Part, Potential, Response,
    StepMotion, Volumetric,
};
use crate::lanes::{RatioSlope, Real};
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};
use crate::square::{Square, det_minus_one, green_strain, plus_one, product, scale_all, sum, trace};

/// Saint Venant-Kirchhoff, S = lambda tr(E) 1 + 2 mu E: large rotations, small strains.
///
/// It loses its stiffness at a stretch of 0.58 in compression.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SaintVenantKirchhoff {
    /// Young's modulus \[Pa\], > 0.
    pub young_modulus: Pressure,
    /// Poisson's ratio, between -1 and 0.5, both excluded.
    pub poisson_ratio: Number,
}

impl Parameters for SaintVenantKirchhoff {
    const VOLUMETRIC: Volumetric = Volumetric::GreenTrace;

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

impl Potential for SaintVenantKirchhoff {
    type Constants = Moduli<f64>;

    #[inline(always)]
    fn energy<T: Real, const D: usize>(moduli: &Moduli<f64>, grad_u: &Square<T, D>) -> T {
        isotropic_energy(&moduli.in_lanes(grad_u[0][0]), &green_strain(grad_u))
    }
}

impl MetricLaw for SaintVenantKirchhoff {
    const METRIC: Metric = Metric::Reference;

    #[inline(always)]
    fn respond_with_metric<T: Real, const D: usize>(
        moduli: &Moduli<T>,
        grad_u: &Square<T, D>,
    ) -> MetricResponse<T, D> {
        let f = plus_one(grad_u);
        let second_piola = isotropic(moduli, &green_strain(grad_u));
        MetricResponse {
            second_piola,
            first_piola: product(&f, &second_piola),
            gradient_map: f,
            lam: moduli.lambda,
            q: moduli.mu,
            det_f: det_minus_one(grad_u) + moduli.mu.constant(1.0),
        }
    }
}

impl Law for SaintVenantKirchhoff {
    type Tangent<T: Real, const D: usize> = Moduli<T>;
    type StepTangent<T: Real, const D: usize> = Moduli<T>;

    #[inline(always)]
    fn respond<T: Real, const D: usize>(
        moduli: &Moduli<f64>,
        grad_u: &Square<T, D>,
    ) -> Response<T, Moduli<T>, D> {
        let moduli = moduli.in_lanes(grad_u[0][0]);
        Response { second_piola: isotropic(&moduli, &green_strain(grad_u)), tangent: moduli }
    }

    #[inline(always)]
    fn contract<T: Real, const D: usize>(tangent: &Moduli<T>, strain: &Square<T, D>) -> Square<T, D> {
        isotropic(tangent, strain)
    }

    #[inline(always)]
    fn respond_step<T: RatioSlope, const D: usize>(
        moduli: &Moduli<f64>,
        motion: &StepMotion<T, D>,
    ) -> Response<T, Moduli<T>, D> {
        let moduli = moduli.in_lanes(motion.start[0][0]);
        let half = moduli.mu.constant(0.5);
        let strain = scale_all(&sum(&green_strain(&motion.start), &green_strain(&motion.end)), half);
        // The mean changes by half as much as the end.
        let tangent = Moduli { lambda: half * moduli.lambda, mu: half * moduli.mu };
        Response { second_piola: isotropic(&moduli, &strain), tangent }
    }

    #[inline(always)]
    fn contract_step<T: Real, const D: usize>(tangent: &Moduli<T>, strain: &Square<T, D>) -> Square<T, D> {
        isotropic(tangent, strain)
    }

    #[inline(always)]
    fn accept<K: LawTask>(&self, task: K) -> K::Output {
        task.run_metric(self)
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
