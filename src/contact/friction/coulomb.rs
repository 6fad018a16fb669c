//! Coulomb's bound `b = mu(t_n, |v_T|) t_n` (2.7).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::coefficient::{COEFFICIENTS, Coefficient};
use super::{Bound, FrictionBound, Pressed, Regularization};
use crate::reader::at::At;
use crate::reader::findings::Findings;

/// The bound is coefficient * t_n, (2.7).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Coulomb {
    /// Coefficient of friction, >= 0: a number, or a law of normal traction or slip speed.
    pub coefficient: At<Coefficient>,
    /// How stick is approximated.
    pub regularization: Regularization,
}

impl Coulomb {
    /// Friction with this coefficient.
    pub fn of(coefficient: impl Into<Coefficient>, regularization: Regularization) -> Self {
        Self { coefficient: coefficient.into().into(), regularization }
    }

    pub(super) fn samples() -> Vec<Self> {
        let coefficients = COEFFICIENTS.iter().flat_map(|entry| (entry.samples)());
        coefficients.map(|coefficient| Self::of(coefficient, Regularization::stick_stiffness(1e9))).collect()
    }
}

impl FrictionBound for Coulomb {
    fn bound(&self, at: Pressed) -> Bound {
        let mu = self.coefficient.evaluate(at.normal.traction, at.slip_speed);
        Bound {
            value: mu.value * at.normal.traction,
            by_gap: (mu.value + mu.by_traction) * at.normal.derivative,
            by_speed: mu.by_speed * at.normal.traction,
        }
    }

    fn depends_on_speed(&self) -> bool {
        self.coefficient.law().depends_on_speed()
    }

    fn coefficient_depends_on_pressure(&self) -> bool {
        self.coefficient.law().depends_on_pressure()
    }

    fn regularization(&self) -> Option<Regularization> {
        Some(self.regularization)
    }

    fn check(&self, findings: &mut Findings) {
        self.coefficient.law().check(self.coefficient.place, findings);
    }
}
