//! Whether the tangent of an earlier correction can be reused for another one.
//!
//! If steps are short and Newton's tolerance matches the accuracy of the run, one correction per
//! step is sufficient, and the tangent hardly changes from one step to the next. Each correction
//! then reduces `|u - u*|` by `|1 - K_old^-1 K|`, which is enough. This saves the assembly and the
//! preconditioner. The balance is still checked.
//!
//! Rounding does not decide whether a tangent is reused. A change in the points that press makes a
//! different tangent. The residual after a correction is measured only down to a part of the
//! target, not to its rounding.

use std::rc::Rc;

use serde::{Deserialize, Serialize};

use crate::dynamics::Shifts;
use crate::petsc::BlockPattern;

/// State for which a tangent was assembled.
#[derive(Clone)]
struct Made {
    pattern: Rc<BlockPattern>,
    shifts: Shifts,
    /// Number of contact points that were closed, and number of these that pressed.
    points: [u64; 2],
}

/// The current tangent, and how fast tangents age.
#[derive(Default)]
pub(super) struct KeptTangent {
    made: Option<Made>,
    /// Number of corrections with it, except the one it was assembled for.
    uses: u32,
    /// Loss in the reduction of the residual at the first further correction. The second one loses
    /// twice as much, and so on.
    ageing: f64,
}

/// The state of a [`KeptTangent`] that outlives a step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct KeptTangentState {
    /// Shifts and contact points of the tangent, if the matrix is one.
    made: Option<(Shifts, [u64; 2])>,
    uses: u32,
    ageing: f64,
}

impl KeptTangent {
    /// Part of the ageing that is kept with each new tangent. Fast ageing may have been due to an
    /// event.
    const MEMORY: f64 = 0.5;
    /// Part of the target to which smaller residuals are raised, because they may be rounding. At a
    /// target of 1e-9 of the largest force, rounding is some 1e-13 of it.
    const LEAST: f64 = 1e-2;

    /// Whether another correction with the current tangent would reduce a residual of `excess`
    /// times the target to the target. This requires that the same numbers of contact `points` are
    /// closed and press.
    pub fn serves(&self, shifts: Shifts, pattern: &Rc<BlockPattern>, points: [u64; 2], excess: f64) -> bool {
        let fits = self.made.as_ref().is_some_and(|made| {
            Rc::ptr_eq(&made.pattern, pattern) && made.shifts == shifts && made.points == points
        });
        fits && self.ageing * f64::from(self.uses + 1) * excess <= 1.0
    }

    /// Records that a correction with the kept tangent changed the residual from `before` to
    /// `after` times the target.
    pub fn used(&mut self, [before, after]: [f64; 2]) {
        self.uses += 1;
        let reduction = after.max(Self::LEAST) / before;
        self.ageing = if after.is_finite() { reduction / f64::from(self.uses) } else { 1.0 };
        if self.ageing >= 1.0 {
            self.made = None;
        }
    }

    /// Records that a tangent was assembled.
    pub fn made(&mut self, shifts: Shifts, pattern: &Rc<BlockPattern>, points: [u64; 2]) {
        self.made = Some(Made { pattern: Rc::clone(pattern), shifts, points });
        self.uses = 0;
        self.ageing *= Self::MEMORY;
    }

    /// Records that the current matrix is no longer a tangent.
    pub fn discard(&mut self) {
        self.made = None;
    }

    /// State that outlives a step, when the system's matrix has this `pattern`.
    pub fn state(&self, pattern: &Rc<BlockPattern>) -> KeptTangentState {
        let made = self.made.as_ref().filter(|made| Rc::ptr_eq(&made.pattern, pattern));
        KeptTangentState {
            made: made.map(|made| (made.shifts, made.points)),
            uses: self.uses,
            ageing: self.ageing,
        }
    }

    /// Restores the state. The system's matrix, of this `pattern`, is the tangent.
    pub fn resume(&mut self, state: KeptTangentState, pattern: &Rc<BlockPattern>) {
        let KeptTangentState { made, uses, ageing } = state;
        let made = made.map(|(shifts, points)| Made { pattern: Rc::clone(pattern), shifts, points });
        *self = Self { made, uses, ageing };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern() -> Rc<BlockPattern> {
        let row_offsets = vec![0];
        let columns = Vec::new();
        let places = Vec::new();
        Rc::new(BlockPattern { block_size: 2, first_row: 0, row_offsets, columns, places })
    }

    fn shifts(dt: f64) -> Shifts {
        Shifts { velocity: 2.0 / dt, acceleration: 4.0 / (dt * dt) }
    }

    /// A kept tangent serves the same step and pattern, as long as it ages by less than the
    /// residual has to fall.
    #[test]
    fn a_tangent_serves_until_it_is_too_old() {
        let mut kept = KeptTangent::default();
        let here = pattern();
        assert!(!kept.serves(shifts(1.0), &here, [3, 3], 2.0), "there is none");
        kept.made(shifts(1.0), &here, [3, 3]);
        assert!(!kept.serves(shifts(0.5), &here, [3, 3], 2.0));
        assert!(!kept.serves(shifts(1.0), &pattern(), [3, 3], 2.0), "of another pattern");
        assert!(!kept.serves(shifts(1.0), &here, [3, 2], 2.0), "of other points");
        let mut uses = 0;
        while kept.serves(shifts(1.0), &here, [3, 3], 100.0) {
            uses += 1;
            kept.used([100.0, 0.2 * f64::from(uses)]);
        }
        assert_eq!(uses, 5);
        assert!(kept.serves(shifts(1.0), &here, [3, 3], 50.0));
        kept.made(shifts(1.0), &here, [3, 3]);
        assert!(kept.serves(shifts(1.0), &here, [3, 3], 100.0));
        kept.discard();
        assert!(!kept.serves(shifts(1.0), &here, [3, 3], 2.0));
    }

    /// The amount by which rounding left a residual below the target does not matter.
    #[test]
    fn rounding_is_no_age() {
        let here = pattern();
        for excess in [10.0, 49.0, 51.0, 1e3] {
            let serves = [0.0, 1e-6, 1e-3].map(|after| {
                let mut kept = KeptTangent::default();
                kept.made(shifts(1.0), &here, [3, 3]);
                kept.used([1.0, after]);
                kept.serves(shifts(1.0), &here, [3, 3], excess)
            });
            assert_eq!(serves, [excess < 50.0; 3], "{excess}");
        }
    }

    /// A tangent that failed is not reused. The next ones are not reused either until repeated
    /// halving has reduced the remembered ageing.
    #[test]
    fn a_failure_is_remembered_for_a_while() {
        let mut kept = KeptTangent::default();
        let here = pattern();
        kept.made(shifts(1.0), &here, [3, 3]);
        kept.used([100.0, f64::NAN]);
        assert!(!kept.serves(shifts(1.0), &here, [3, 3], 1e-3));
        let made = (1..).find(|_| {
            kept.made(shifts(1.0), &here, [3, 3]);
            kept.serves(shifts(1.0), &here, [3, 3], 100.0)
        });
        assert_eq!(made, Some(7));
    }
}
