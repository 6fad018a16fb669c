//! Ogden rubber.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Compressibility;
use super::{Invariants, Isotropic, Moduli, Parameters, Part};
use crate::composed::{Composed, PairFunction};
use crate::lanes::isochoric::{Exponent, Logarithmic, Traces};
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};
use crate::reader::up_to::UpTo;

/// Compressible Ogden, sum mu/alpha (l1^alpha + l2^alpha + l3^alpha - 3) + K/4 (J^2 - 1 - 2 ln J): rubber, principal stretches.
///
/// l1, l2, l3 are the principal values of the isochoric stretch, J^(-1/3) times the principal stretches. At small strain the shear modulus
/// is half the sum of mu alpha. Some programs write 2 mu/alpha^2 in place of mu/alpha: multiply their mu by 2/alpha. The bulk modulus
/// K is given, or follows from Poisson's ratio at small strain; one of the two is needed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ogden {
    /// One to three terms, each with `mu` and `alpha`. The sum of mu alpha must be > 0; the law is stable at every stretch if each mu alpha is.
    pub terms: UpTo<OgdenTerm, 3>,
    /// Bulk modulus \[Pa\], > 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bulk_modulus: Option<Pressure>,
    /// Poisson's ratio at small strain, between -1 and 0.5, both excluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<Number>,
}

/// A term of the energy.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OgdenTerm {
    /// Coefficient \[Pa\], negative with a negative exponent.
    pub mu: Pressure,
    /// Exponent of the stretches, not 0.
    pub alpha: Number,
}

/// Coefficients of the energy of Ogden's law.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// Empty for the volumetric part.
    terms: UpTo<Power, 3>,
    bulk: f64,
}

/// A power of the isochoric stretch `J^(-2/3) C`.
#[derive(Debug, Clone, Copy, Default)]
struct Power {
    /// `mu / alpha` \[Pa\].
    factor: f64,
    /// `alpha / 2`.
    exponent: Exponent,
}

/// The energy of the isochoric stretch, a function of its two traces.
impl PairFunction for Coefficients {
    fn of<T: Logarithmic>(&self, [even, odd]: [T; 2]) -> T {
        let logarithm = T::isochoric_logarithm(Traces { even, odd });
        let mut energy = even.constant(0.0);
        for power in self.terms.iter() {
            energy = energy + logarithm.power_trace(&power.exponent).scale(power.factor);
        }
        energy
    }
}

impl Isotropic for Ogden {
    type Coefficients = Coefficients;

    #[inline(always)]
    fn energy_of<T: Composed>(coefficients: &Coefficients, invariants: &Invariants<T>) -> T {
        let mut energy = invariants.volumetric().scale(coefficients.bulk);
        if !coefficients.terms.is_empty() {
            let Traces { even, odd } = invariants.isochoric().traces();
            energy = energy + T::composed(coefficients, [even, odd]);
        }
        energy
    }
}

impl Ogden {
    fn shear_modulus(&self) -> f64 {
        0.5 * self.terms.iter().map(|term| term.mu.value * term.alpha.value).sum::<f64>()
    }

    fn compressibility(&self) -> Compressibility {
        Compressibility { bulk_modulus: self.bulk_modulus, poisson_ratio: self.poisson_ratio }
    }
}

impl Parameters for Ogden {
    fn check(&self, findings: &mut Findings) {
        for term in self.terms.iter().filter(|term| term.alpha.value == 0.0) {
            findings.say(term.alpha.place, "alpha must not be 0");
            findings.cure("a term with exponent 0 is constant: remove it");
        }
        let place = self.terms[0].mu.place;
        let mu = self.shear_modulus();
        if mu.is_nan() || mu <= 0.0 {
            findings.say(place, format!("the sum of mu alpha must be > 0, found {}", 2.0 * mu));
            findings
                .cure("it is twice the shear modulus at small strain; a negative alpha needs a negative mu");
        }
        self.compressibility().check("ogden", place, "half the sum of mu alpha", findings);
    }

    fn moduli(&self) -> Moduli<f64> {
        self.compressibility().moduli(self.shear_modulus())
    }

    fn constants(&self, part: Part) -> Coefficients {
        let bulk = self.moduli().part(part).bulk();
        let mut terms = UpTo::first_of(&[]);
        if part != Part::Volume {
            terms = self.terms.map(|term| Power {
                factor: term.mu.value / term.alpha.value,
                exponent: Exponent::new(0.5 * term.alpha.value),
            });
        }
        Coefficients { terms, bulk }
    }

    fn with_bulk_modulus(&self, bulk: f64) -> Self {
        Self { bulk_modulus: Some(Pressure::new(bulk)), poisson_ratio: None, ..*self }
    }

    fn from_moduli(moduli: Moduli<f64>) -> Self {
        // The exponents of Ogden's fit (1972) to Treloar's data.
        let term = |share: f64, alpha: f64| OgdenTerm {
            mu: Pressure::new(2.0 * share * moduli.mu / alpha),
            alpha: Number::new(alpha),
        };
        Self {
            terms: UpTo::first_of(&[term(0.8, 1.3), term(0.05, 5.0), term(0.15, -2.0)]),
            bulk_modulus: Some(Pressure::new(moduli.bulk())),
            poisson_ratio: None,
        }
    }
}
