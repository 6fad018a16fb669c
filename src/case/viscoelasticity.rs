//! `viscoelasticity`: relaxation of the deviator of a body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::{GivenModuli, PronySeries};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Duration, Number};

/// Linear viscoelasticity of the isochoric stress; the volumetric stress stays elastic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Viscoelasticity {
    /// State that the parameters of `material` describe: `long_term` after infinitely slow loading,
    /// `instantaneous` after sudden loading.
    #[serde(default)]
    pub moduli: ViscousModuli,
    /// Terms of the Prony series, at least one. Each has a `share` of the instantaneous shear modulus
    /// and a relaxation `time` in s, both above zero. The sum of the shares is below 1. The shear
    /// modulus at the time t after a sudden shear, relative to the instantaneous one, is 1 minus the sum
    /// of share * (1 - exp(-t / time)).
    pub prony: At<Vec<PronyTerm>>,
}

/// State that the parameters of a law describe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ViscousModuli {
    /// The relaxed body.
    #[default]
    LongTerm,
    /// The body right after a sudden deformation.
    Instantaneous,
}

/// A term of a Prony series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PronyTerm {
    /// Share of the instantaneous shear modulus that relaxes, > 0. The sum of all shares is below 1.
    pub share: Number,
    /// Relaxation time \[s\], > 0.
    pub time: Duration,
}

impl Viscoelasticity {
    /// The series.
    pub fn series(&self) -> PronySeries {
        let moduli = match self.moduli {
            ViscousModuli::LongTerm => GivenModuli::LongTerm,
            ViscousModuli::Instantaneous => GivenModuli::Instantaneous,
        };
        let terms: Vec<_> = self.prony.iter().map(|term| (term.share.value, term.time.value)).collect();
        PronySeries::new(&terms, moduli)
    }

    /// Reports invalid terms.
    pub(super) fn check(&self, findings: &mut Findings) {
        findings.require(!self.prony.is_empty(), self.prony.place, "a Prony series needs at least one term");
        for PronyTerm { share, time } in self.prony.iter() {
            findings.positive("the share of a Prony term", *share);
            findings.positive("a relaxation time", *time);
        }
        let sum: f64 = self.prony.iter().map(|term| term.share.value).sum();
        if sum >= 1.0 {
            findings.say(
                self.prony.place,
                format!("the shares of a Prony series must sum to less than 1, found {sum}"),
            );
            findings.cure(
                "a share is relative to the instantaneous shear modulus; divide moduli of branches by the sum \
                 of all moduli, the long-term one included",
            );
        }
    }
}
