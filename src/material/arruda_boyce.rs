//! Arruda-Boyce rubber.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Compressibility;
use super::{Invariants, Isotropic, Moduli, Parameters, Part, polynomial};
use crate::lanes::Real;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Number, Pressure};

/// Compressible Arruda-Boyce, mu sum C_k / lambda_m^(2k - 2) (I1^k - 3^k) + K/4 (J^2 - 1 - 2 ln J): rubber of chains of finite length.
///
/// I1 is the first invariant of the isochoric stretch J^(-2/3) C. The sum is the series of the inverse Langevin function with five terms,
/// C = 1/2, 1/20, 11/1050, 19/7000, 519/673750. It has no limit, and is too soft where the stretch of the chains, sqrt(I1/3), comes near
/// lambda_m: by 2 % in the stress at 0.7 lambda_m, 10 % at 0.8 and 34 % at 0.9. Use `gent` for a rubber that reaches its limit. At
/// small strain the shear modulus is mu (1 + 3/(5 L) + 99/(175 L^2) + 513/(875 L^3) + 42039/(67375 L^4)) with L = lambda_m^2. The bulk
/// modulus K is given, or follows from Poisson's ratio at small strain; one of the two is needed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArrudaBoyce {
    /// Rubbery modulus of the chains \[Pa\], > 0; the shear modulus at small strain is larger.
    pub mu: Pressure,
    /// Limiting stretch of the chains, > 1.
    pub lambda_m: Number,
    /// Bulk modulus \[Pa\], > 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bulk_modulus: Option<Pressure>,
    /// Poisson's ratio at small strain, between -1 and 0.5, both excluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<Number>,
}

/// Coefficients of the series of the inverse Langevin function.
const SERIES: [f64; 5] = [1.0 / 2.0, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0];

/// Coefficients of the energy of the law of Arruda and Boyce.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// Of the powers of `I1 - 3` \[Pa\].
    powers: [f64; 5],
    bulk: f64,
}

impl Isotropic for ArrudaBoyce {
    type Coefficients = Coefficients;

    #[inline(always)]
    fn energy_of<T: Real>(coefficients: &Coefficients, invariants: &Invariants<T>) -> T {
        polynomial(&coefficients.powers, invariants.isochoric().first)
            + invariants.volumetric().scale(coefficients.bulk)
    }
}

/// The series in powers of `I1 - 3` for `mu = 1`, so that no digits cancel at small strain.
fn powers(lambda_m: f64) -> [f64; 5] {
    let mut powers = [0.0; 5];
    for (k, c) in (1..).zip(SERIES) {
        let coefficient = c * lambda_m.powi(2 - 2 * k);
        // I1^k - 3^k = sum binomial(k, j) 3^(k - j) (I1 - 3)^j, j >= 1
        let mut binomial = 1.0;
        for j in 1..=k {
            binomial *= f64::from(k - j + 1) / f64::from(j);
            powers[j as usize - 1] += coefficient * binomial * 3_f64.powi(k - j);
        }
    }
    powers
}

impl ArrudaBoyce {
    fn shear_modulus(&self) -> f64 {
        2.0 * self.mu.value * powers(self.lambda_m.value)[0]
    }

    fn compressibility(&self) -> Compressibility {
        Compressibility { bulk_modulus: self.bulk_modulus, poisson_ratio: self.poisson_ratio }
    }
}

impl Parameters for ArrudaBoyce {
    fn check(&self, findings: &mut Findings) {
        findings.positive("mu", self.mu);
        if self.lambda_m.value.is_nan() || self.lambda_m.value <= 1.0 {
            let found = self.lambda_m.value;
            findings.say(self.lambda_m.place, format!("lambda_m must be > 1, found {found}"));
            findings.cure(
                "the chains of a rubber can be stretched to lambda_m times their length, usually 2 to 8",
            );
        }
        self.compressibility().check(
            "arruda_boyce",
            self.mu.place,
            "the shear modulus at small strain",
            findings,
        );
    }

    fn moduli(&self) -> Moduli<f64> {
        self.compressibility().moduli(self.shear_modulus())
    }

    fn constants(&self, part: Part) -> Coefficients {
        let bulk = self.moduli().part(part).bulk();
        let mu = if part == Part::Volume { 0.0 } else { self.mu.value };
        Coefficients { powers: powers(self.lambda_m.value).map(|power| mu * power), bulk }
    }

    fn with_bulk_modulus(&self, bulk: f64) -> Self {
        Self { bulk_modulus: Some(Pressure::new(bulk)), poisson_ratio: None, ..*self }
    }

    fn from_moduli(moduli: Moduli<f64>) -> Self {
        let lambda_m = 3.0;
        Self {
            mu: Pressure::new(0.5 * moduli.mu / powers(lambda_m)[0]),
            lambda_m: Number::new(lambda_m),
            bulk_modulus: Some(Pressure::new(moduli.bulk())),
            poisson_ratio: None,
        }
    }
}
