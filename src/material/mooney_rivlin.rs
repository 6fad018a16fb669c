//! Compressible Mooney-Rivlin rubber.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::check_poisson_ratio;
use super::{Invariants, Isotropic, Moduli, Parameters, Part};
use crate::lanes::Real;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};

/// Compressible Mooney-Rivlin, c10 (I1 - 3) + c01 (I2 - 3) + K/4 (J^2 - 1 - 2 ln J): rubber, large strains.
///
/// I1 and I2 are the invariants of the isochoric stretch J^(-2/3) C. At small strain the shear modulus is 2 (c10 + c01). The bulk modulus
/// K is given, or follows from Poisson's ratio at small strain; one of the two is needed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MooneyRivlin {
    /// Coefficient of the first invariant \[Pa\]. May be negative, but c10 + c01 > 0.
    pub c10: Pressure,
    /// Coefficient of the second invariant \[Pa\]. May be negative, but c10 + c01 > 0.
    pub c01: Pressure,
    /// Bulk modulus \[Pa\], > 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bulk_modulus: Option<Pressure>,
    /// Poisson's ratio at small strain, between -1 and 0.5, both excluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<Number>,
}

/// What the energy of [`MooneyRivlin`] is evaluated with.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    c10: f64,
    c01: f64,
    bulk: f64,
}

impl Isotropic for MooneyRivlin {
    type Coefficients = Coefficients;

    #[inline(always)]
    fn energy_of<T: Real>(coefficients: &Coefficients, invariants: &Invariants<T>) -> T {
        let isochoric = invariants.isochoric();
        isochoric.first.scale(coefficients.c10)
            + isochoric.second.scale(coefficients.c01)
            + invariants.volumetric().scale(coefficients.bulk)
    }
}

impl MooneyRivlin {
    fn shear_modulus(&self) -> f64 {
        2.0 * (self.c10.value + self.c01.value)
    }
}

impl Parameters for MooneyRivlin {
    fn check(&self, findings: &mut Findings) {
        let half = 0.5 * self.shear_modulus();
        if half.is_nan() || half <= 0.0 {
            findings.say(self.c10.place, format!("c10 + c01 must be > 0, found {half}"));
            findings.cure("half the shear modulus at small strain is c10 + c01");
        }
        if let Some(bulk) = self.bulk_modulus {
            findings.positive("the bulk modulus", bulk);
        }
        if let Some(ratio) = self.poisson_ratio {
            check_poisson_ratio(ratio, findings);
        }
        let cure = "at small strain poisson_ratio = (3 K - 2 mu) / (6 K + 2 mu) with mu = 2 (c10 + c01)";
        match (self.bulk_modulus, self.poisson_ratio) {
            (Some(_), Some(ratio)) => {
                findings
                    .say(ratio.place, "bulk_modulus and poisson_ratio are redundant: give only one of them");
                findings.cure(cure);
            }
            (None, None) => {
                findings.say(self.c10.place, "mooney_rivlin needs bulk_modulus or poisson_ratio");
                findings.cure(cure);
            }
            _ => {}
        }
    }

    fn moduli(&self) -> Moduli<f64> {
        let mu = self.shear_modulus();
        let from_ratio = |ratio: Number| Moduli::of(2.0 * mu * (1.0 + ratio.value), ratio.value);
        let from_bulk = |bulk: Pressure| Moduli::of_shear_and_bulk(mu, bulk.value);
        self.bulk_modulus
            .map(from_bulk)
            .or(self.poisson_ratio.map(from_ratio))
            .unwrap_or(Moduli { lambda: 0.0, mu })
    }

    fn constants(&self, part: Part) -> Coefficients {
        let moduli = self.moduli().part(part);
        let (c10, c01) = if part == Part::Volume { (0.0, 0.0) } else { (self.c10.value, self.c01.value) };
        Coefficients { c10, c01, bulk: moduli.bulk() }
    }

    fn from_moduli(moduli: Moduli<f64>) -> Self {
        let coefficient = Pressure::new(0.25 * moduli.mu);
        let bulk_modulus = Some(Pressure::new(moduli.bulk()));
        Self { c10: coefficient, c01: coefficient, bulk_modulus, poisson_ratio: None }
    }
}
