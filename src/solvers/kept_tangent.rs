//! Whether the tangent of an earlier correction serves for one more.
//!
//! Where steps are short and Newton's tolerance is what the rest of the run warrants, one correction a step does, and the
//! tangent hardly changes from one step to the next: `|u - u*|` then falls by `|1 - K_old^-1 K|` a correction, which is
//! enough. What is saved is the assembly and the preconditioner; the balance is checked as ever.
//!
//! Rounding does not decide whether a tangent serves: where points press that did not, or the other way round, it is another
//! tangent; and what a correction leaves is measured down to a part of the target, not to its rounding.

use std::rc::Rc;

use crate::dynamics::Shifts;
use crate::petsc::BlockPattern;

/// What a tangent was assembled for.
#[derive(Clone)]
struct Made {
    pattern: Rc<BlockPattern>,
    shifts: Shifts,
    /// Contact points that were closed, and of these those that pressed.
    points: [u64; 2],
}

/// The tangent at hand, and how fast tangents age.
#[derive(Default)]
pub(super) struct KeptTangent {
    made: Option<Made>,
    /// Corrections with it, its own not counted.
    uses: u32,
    /// Reduction of the residual that the first further correction misses; twice as much the second, and so on.
    ageing: f64,
}

impl KeptTangent {
    /// Part of the ageing that is remembered with each tangent that is made: what aged fast may have been an event.
    const MEMORY: f64 = 0.5;
    /// Part of the target below which a residual is taken to be this part: what is less may be rounding. At a target of 1e-9 of the
    /// largest force rounding is some 1e-13 of it.
    const LEAST: f64 = 1e-2;

    /// Whether one more correction with the tangent at hand would bring a residual of `excess` times the target to it, where
    /// as many contact `points` are closed and press.
    pub fn serves(&self, shifts: Shifts, pattern: &Rc<BlockPattern>, points: [u64; 2], excess: f64) -> bool {
        let fits = self.made.as_ref().is_some_and(|made| {
            Rc::ptr_eq(&made.pattern, pattern) && made.shifts == shifts && made.points == points
        });
        fits && self.ageing * f64::from(self.uses + 1) * excess <= 1.0
    }

    /// A correction with the kept tangent took the residual from `before` to `after` times the target.
    pub fn used(&mut self, [before, after]: [f64; 2]) {
        self.uses += 1;
        let reduction = after.max(Self::LEAST) / before;
        self.ageing = if after.is_finite() { reduction / f64::from(self.uses) } else { 1.0 };
        if self.ageing >= 1.0 {
            self.made = None;
        }
    }

    /// A tangent was assembled.
    pub fn made(&mut self, shifts: Shifts, pattern: &Rc<BlockPattern>, points: [u64; 2]) {
        self.made = Some(Made { pattern: Rc::clone(pattern), shifts, points });
        self.uses = 0;
        self.ageing *= Self::MEMORY;
    }

    /// The matrix at hand is no tangent any more.
    pub fn forget(&mut self) {
        self.made = None;
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

    /// What is kept serves the same step and pattern, for as long as it ages by less than the residual has to fall.
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
        kept.forget();
        assert!(!kept.serves(shifts(1.0), &here, [3, 3], 2.0));
    }

    /// How far below the target rounding left a residual, does not matter.
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

    /// One that failed is no longer used, and the next ones not until that is half forgotten often enough.
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
