//! Coulomb's bound `b = mu(t_n, |v_T|) t_n` (2.7).

use super::coefficient::Coefficient;
use super::{Bound, Pressed};

/// Coulomb friction with any coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// `mu`.
    pub coefficient: Coefficient,
}

impl Coulomb {
    pub(super) fn bound(&self, at: Pressed) -> Bound {
        let mu = self.coefficient.evaluate(at.normal.traction, at.slip_speed);
        Bound {
            value: mu.value * at.normal.traction,
            by_gap: (mu.value + mu.by_traction) * at.normal.derivative,
            by_speed: mu.by_speed * at.normal.traction,
        }
    }
}
