//! Gent rubber.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Compressibility;
use super::{Invariants, Isotropic, Moduli, Parameters, Part};
use crate::lanes::Real;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};

/// Compressible Gent, -mu/2 J_m ln(1 - (I1 - 3)/J_m) + K/4 (J^2 - 1 - 2 ln J): rubber with a limiting stretch.
///
/// I1 is the first invariant of the isochoric stretch J^(-2/3) C. The stress grows without bound where I1 - 3 comes near J_m, and a
/// trial state beyond is rejected like an inverted element. At small strain the shear modulus is mu. The bulk modulus K is given, or
/// follows from Poisson's ratio at small strain; one of the two is needed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gent {
    /// Shear modulus at small strain \[Pa\], > 0.
    pub mu: Pressure,
    /// Limit of I1 - 3, > 0. A uniaxial stretch l has I1 - 3 = l^2 + 2/l - 3.
    pub j_m: Number,
    /// Bulk modulus \[Pa\], > 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bulk_modulus: Option<Pressure>,
    /// Poisson's ratio at small strain, between -1 and 0.5, both excluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<Number>,
}

/// Coefficients of the energy of Gent's law.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// `-mu J_m / 2` \[Pa\].
    factor: f64,
    /// `-1 / J_m`; zero for the volumetric part.
    inverse_limit: f64,
    bulk: f64,
}

impl Isotropic for Gent {
    type Coefficients = Coefficients;

    #[inline(always)]
    fn energy_of<T: Real>(coefficients: &Coefficients, invariants: &Invariants<T>) -> T {
        let used = invariants.isochoric().first.scale(coefficients.inverse_limit);
        used.ln_1p().scale(coefficients.factor) + invariants.volumetric().scale(coefficients.bulk)
    }

    #[inline(always)]
    fn reserve_of<T: Real>(coefficients: &Coefficients, invariants: &Invariants<T>) -> Option<T> {
        let used = invariants.isochoric().first.scale(coefficients.inverse_limit);
        Some(used + used.constant(1.0))
    }
}

impl Gent {
    fn compressibility(&self) -> Compressibility {
        Compressibility { bulk_modulus: self.bulk_modulus, poisson_ratio: self.poisson_ratio }
    }
}

impl Parameters for Gent {
    fn check(&self, findings: &mut Findings) {
        findings.positive("mu", self.mu);
        if self.j_m.value.is_nan() || self.j_m.value <= 0.0 {
            findings.say(self.j_m.place, format!("j_m must be > 0, found {}", self.j_m.value));
            findings.cure("for a largest uniaxial stretch l give l^2 + 2/l - 3, for example 46.3 for l = 7");
        }
        self.compressibility().check("gent", self.mu.place, "mu of the law", findings);
    }

    fn moduli(&self) -> Moduli<f64> {
        self.compressibility().moduli(self.mu.value)
    }

    fn constants(&self, part: Part) -> Coefficients {
        let bulk = self.moduli().part(part).bulk();
        let limit = self.j_m.value;
        if part == Part::Volume {
            return Coefficients { factor: 0.0, inverse_limit: 0.0, bulk };
        }
        Coefficients { factor: -0.5 * self.mu.value * limit, inverse_limit: -1.0 / limit, bulk }
    }

    fn with_bulk_modulus(&self, bulk: f64) -> Self {
        Self { bulk_modulus: Some(Pressure::new(bulk)), poisson_ratio: None, ..*self }
    }

    fn from_moduli(moduli: Moduli<f64>) -> Self {
        let bulk_modulus = Some(Pressure::new(moduli.bulk()));
        Self { mu: Pressure::new(moduli.mu), j_m: Number::new(20.0), bulk_modulus, poisson_ratio: None }
    }
}
