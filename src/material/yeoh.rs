//! Yeoh rubber.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Compressibility;
use super::{Invariants, Isotropic, Moduli, Parameters, Part, polynomial};
use crate::lanes::Real;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};

/// Compressible Yeoh, c1 (I1 - 3) + c2 (I1 - 3)^2 + c3 (I1 - 3)^3 + K/4 (J^2 - 1 - 2 ln J): rubber that stiffens.
///
/// I1 is the first invariant of the isochoric stretch J^(-2/3) C. At small strain the shear modulus is 2 c1. The bulk modulus K is
/// given, or follows from Poisson's ratio at small strain; one of the two is needed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Yeoh {
    /// Linear coefficient \[Pa\], > 0.
    pub c1: Pressure,
    /// Quadratic coefficient \[Pa\], negative for most rubbers.
    pub c2: Pressure,
    /// Cubic coefficient \[Pa\].
    pub c3: Pressure,
    /// Bulk modulus \[Pa\], > 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bulk_modulus: Option<Pressure>,
    /// Poisson's ratio at small strain, between -1 and 0.5, both excluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<Number>,
}

/// Coefficients of the energy of Yeoh's law.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    powers: [f64; 3],
    bulk: f64,
}

impl Isotropic for Yeoh {
    type Coefficients = Coefficients;

    #[inline(always)]
    fn energy_of<T: Real>(coefficients: &Coefficients, invariants: &Invariants<T>) -> T {
        polynomial(&coefficients.powers, invariants.isochoric().first)
            + invariants.volumetric().scale(coefficients.bulk)
    }
}

impl Yeoh {
    fn compressibility(&self) -> Compressibility {
        Compressibility { bulk_modulus: self.bulk_modulus, poisson_ratio: self.poisson_ratio }
    }
}

impl Parameters for Yeoh {
    fn check(&self, findings: &mut Findings) {
        if self.c1.value.is_nan() || self.c1.value <= 0.0 {
            findings.say(self.c1.place, format!("c1 must be > 0, found {}", self.c1.value));
            findings.cure("half the shear modulus at small strain is c1");
        }
        self.compressibility().check("yeoh", self.c1.place, "2 c1", findings);
    }

    fn moduli(&self) -> Moduli<f64> {
        self.compressibility().moduli(2.0 * self.c1.value)
    }

    fn constants(&self, part: Part) -> Coefficients {
        let bulk = self.moduli().part(part).bulk();
        let powers =
            if part == Part::Volume { [0.0; 3] } else { [self.c1.value, self.c2.value, self.c3.value] };
        Coefficients { powers, bulk }
    }

    fn with_bulk_modulus(&self, bulk: f64) -> Self {
        Self { bulk_modulus: Some(Pressure::new(bulk)), poisson_ratio: None, ..*self }
    }

    fn from_moduli(moduli: Moduli<f64>) -> Self {
        let [c1, c2, c3] = [0.5, -0.02, 0.005].map(|factor| Pressure::new(factor * moduli.mu));
        Self { c1, c2, c3, bulk_modulus: Some(Pressure::new(moduli.bulk())), poisson_ratio: None }
    }
}
