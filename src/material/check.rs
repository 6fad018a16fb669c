//! Parameters and checks that several laws share.

use super::Moduli;
use crate::reader::findings::Findings;
use crate::reader::place::Place;
use crate::reader::quantity::{Number, Pressure};

/// Requires Young's modulus to be positive, and Poisson's ratio to be in its range.
pub fn check_engineering(young_modulus: Pressure, poisson_ratio: Number, findings: &mut Findings) {
    findings.positive("Young's modulus", young_modulus);
    check_poisson_ratio(poisson_ratio, findings);
}

/// Requires Poisson's ratio to be between -1 and 0.5.
pub fn check_poisson_ratio(ratio: Number, findings: &mut Findings) {
    if !(ratio.value > -1.0 && ratio.value < 0.5) {
        findings.say(ratio.place, format!("Poisson's ratio must be > -1 and < 0.5, found {}", ratio.value));
        findings.cure("use 0.49 or 0.499 for an almost incompressible solid");
    }
}

/// How a law with an isochoric energy resists a change of volume: one of the two is given.
#[derive(Debug, Clone, Copy)]
pub struct Compressibility {
    /// Bulk modulus \[Pa\].
    pub bulk_modulus: Option<Pressure>,
    /// Poisson's ratio at small strain.
    pub poisson_ratio: Option<Number>,
}

impl Compressibility {
    /// Requires one of the two, in its range. Complaints name the law at `place` and give its shear modulus at small strain in words.
    pub fn check(self, law: &str, place: Place, shear_modulus: &str, findings: &mut Findings) {
        if let Some(bulk) = self.bulk_modulus {
            findings.positive("the bulk modulus", bulk);
        }
        if let Some(ratio) = self.poisson_ratio {
            check_poisson_ratio(ratio, findings);
        }
        let cure =
            format!("at small strain poisson_ratio = (3 K - 2 mu) / (6 K + 2 mu) with mu = {shear_modulus}");
        match (self.bulk_modulus, self.poisson_ratio) {
            (Some(_), Some(ratio)) => {
                findings
                    .say(ratio.place, "bulk_modulus and poisson_ratio are redundant: give only one of them");
                findings.cure(&cure);
            }
            (None, None) => {
                findings.say(place, format!("{law} needs bulk_modulus or poisson_ratio"));
                findings.cure(&cure);
            }
            _ => {}
        }
    }

    /// Moduli at small strain of a law with this shear modulus \[Pa\].
    pub fn moduli(self, mu: f64) -> Moduli<f64> {
        let from_ratio = |ratio: Number| Moduli::of(2.0 * mu * (1.0 + ratio.value), ratio.value);
        let from_bulk = |bulk: Pressure| Moduli::of_shear_and_bulk(mu, bulk.value);
        self.bulk_modulus
            .map(from_bulk)
            .or(self.poisson_ratio.map(from_ratio))
            .unwrap_or(Moduli { lambda: 0.0, mu })
    }
}
