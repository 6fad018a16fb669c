//! Compressible Mooney-Rivlin rubber.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Compressibility;
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

/// Coefficients of the energy of the Mooney-Rivlin law.
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

    fn compressibility(&self) -> Compressibility {
        Compressibility { bulk_modulus: self.bulk_modulus, poisson_ratio: self.poisson_ratio }
    }
}

impl Parameters for MooneyRivlin {
    fn check(&self, findings: &mut Findings) {
        let half = 0.5 * self.shear_modulus();
        if half.is_nan() || half <= 0.0 {
            findings.say(self.c10.place, format!("c10 + c01 must be > 0, found {half}"));
            findings.cure("half the shear modulus at small strain is c10 + c01");
        }
        self.compressibility().check("mooney_rivlin", self.c10.place, "2 (c10 + c01)", findings);
    }

    fn moduli(&self) -> Moduli<f64> {
        self.compressibility().moduli(self.shear_modulus())
    }

    fn constants(&self, part: Part) -> Coefficients {
        let moduli = self.moduli().part(part);
        let (c10, c01) = if part == Part::Volume { (0.0, 0.0) } else { (self.c10.value, self.c01.value) };
        Coefficients { c10, c01, bulk: moduli.bulk() }
    }

    fn with_bulk_modulus(&self, bulk: f64) -> Self {
        Self { bulk_modulus: Some(Pressure::new(bulk)), poisson_ratio: None, ..*self }
    }

    fn from_moduli(moduli: Moduli<f64>) -> Self {
        let coefficient = Pressure::new(0.25 * moduli.mu);
        let bulk_modulus = Some(Pressure::new(moduli.bulk()));
        Self { c10: coefficient, c01: coefficient, bulk_modulus, poisson_ratio: None }
    }
}
