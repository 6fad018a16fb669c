//! Whether the tangent of an earlier correction serves for one more.
//!
//! Where steps are short and Newton's tolerance is what the rest of the run warrants, one correction a step does, and the
//! tangent hardly changes from one step to the next: `|u - u*|` then falls by `|1 - K_old^-1 K|` a correction, which is
//! enough. What is saved is the assembly and the preconditioner; the balance is checked as ever.

use std::rc::Rc;

use crate::dynamics::Shifts;
use crate::petsc::BlockPattern;

/// What a tangent was assembled for.
#[derive(Clone)]
struct Made {
    pattern: Rc<BlockPattern>,
    shifts: Shifts,
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

    /// Whether one more correction with the tangent at hand would bring a residual of `excess` times the target to it.
    pub fn serves(&self, shifts: Shifts, pattern: &Rc<BlockPattern>, excess: f64) -> bool {
        let fits = self
            .made
            .as_ref()
            .is_some_and(|made| Rc::ptr_eq(&made.pattern, pattern) && made.shifts == shifts);
        fits && self.ageing * f64::from(self.uses + 1) * excess <= 1.0
    }

    /// A correction with the kept tangent left this part of the residual.
    pub fn used(&mut self, reduction: f64) {
        self.uses += 1;
        self.ageing = if reduction.is_finite() { reduction / f64::from(self.uses) } else { 1.0 };
        if self.ageing >= 1.0 {
            self.made = None;
        }
    }

    /// A tangent was assembled.
    pub fn made(&mut self, shifts: Shifts, pattern: &Rc<BlockPattern>) {
        self.made = Some(Made { pattern: Rc::clone(pattern), shifts });
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
        let (row_offsets, columns, places) = (vec![0], Vec::new(), Vec::new());
        Rc::new(BlockPattern { block_size: 2, first_row: 0, row_offsets, columns, places })
    }

    fn shifts(dt: f64) -> Shifts {
        Shifts { velocity: 2.0 / dt, acceleration: 4.0 / (dt * dt) }
    }

    /// What is kept serves the same step and pattern, for as long as it ages by less than the residual has to fall.
    #[test]
    fn a_tangent_serves_until_it_is_too_old() {
        let (mut kept, here) = (KeptTangent::default(), pattern());
        assert!(!kept.serves(shifts(1.0), &here, 2.0), "there is none");
        kept.made(shifts(1.0), &here);
        assert!(!kept.serves(shifts(0.5), &here, 2.0));
        assert!(!kept.serves(shifts(1.0), &pattern(), 2.0), "of another pattern");
        let mut uses = 0;
        while kept.serves(shifts(1.0), &here, 100.0) {
            uses += 1;
            kept.used(2e-3 * f64::from(uses));
        }
        assert_eq!(uses, 5);
        assert!(kept.serves(shifts(1.0), &here, 50.0));
        kept.made(shifts(1.0), &here);
        assert!(kept.serves(shifts(1.0), &here, 100.0));
        kept.forget();
        assert!(!kept.serves(shifts(1.0), &here, 2.0));
    }

    /// One that failed is no longer used, and the next ones not until that is half forgotten often enough.
    #[test]
    fn a_failure_is_remembered_for_a_while() {
        let (mut kept, here) = (KeptTangent::default(), pattern());
        kept.made(shifts(1.0), &here);
        kept.used(f64::NAN);
        assert!(!kept.serves(shifts(1.0), &here, 1e-3));
        let made = (1..).find(|_| {
            kept.made(shifts(1.0), &here);
            kept.serves(shifts(1.0), &here, 100.0)
        });
        assert_eq!(made, Some(7));
    }
}
