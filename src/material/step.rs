//! Laws over a step: the stress whose work is the change of the strain energy, whatever the step
//! (theory, section 4.5).
//!
//! With the displacement gradient linear in the unknown, `dF : P = dE : S` holds exactly for `P = F_middle S`, since
//! `dE = sym(F_middle^T dF)`. So a law needs a second Piola stress `S(E_start, E_end)`, symmetric, with
//! `S : (E_end - E_start) = W_end - W_start`. It then keeps energy and, as `F_middle S F_middle^T` is symmetric, angular
//! momentum.
//!
//! No law here projects on the strain as Gonzalez' formula does, which divides by `dE : dE` and needs a guard where the states are
//! equal. Each takes the energy apart instead:
//!
//! * Saint Venant-Kirchhoff is quadratic: `S = C : (E_start + E_end) / 2`.
//! * Laws of invariants get their slopes between the two states from [`Secant`](crate::derivatives::Secant): see
//!   [`Isotropic`](super::Isotropic).
//! * neo-Hookean does the same by hand. It is linear in `tr C`, and otherwise a function of `I = det C`, whose difference is
//!   exactly `G : dC` with `G` the mean of the cofactors. The logarithm's divided difference
//!   `l = ln(I_end / I_start) / (I_end - I_start)` is a series where the two are near, so no digits are lost.
//!   `S = mu (1 - l G) + lambda/2 (ln J_start + ln J_end) l G`.

use crate::lanes::Real;
use crate::square::{Square, cofactor_minus_one, scale_all, sum};

/// Displacement gradients over a step.
#[derive(Debug, Clone, Copy)]
pub struct StepMotion<T, const D: usize> {
    /// At the start.
    pub start: Square<T, D>,
    /// In the middle, the mean of start and end.
    pub middle: Square<T, D>,
    /// At the end.
    pub end: Square<T, D>,
}

impl<T: Real, const D: usize> StepMotion<T, D> {
    /// From the gradients at the start and in the middle; the end is as far from the middle as the start.
    #[inline(always)]
    pub fn new(start: Square<T, D>, middle: Square<T, D>) -> Self {
        let two = start[0][0].constant(2.0);
        let end = sum(&scale_all(&middle, two), &scale_all(&start, -start[0][0].constant(1.0)));
        Self { start, middle, end }
    }
}

/// The mean over a step of the cofactors of `1 + a`, without the ones, with which the change of the determinant is exactly
/// `G : (a_end - a_start)`. By Simpson's rule, which is exact for a quadratic function; in the plane the one at the mean is.
#[inline(always)]
pub(super) fn mean_cofactor_minus_one<T: Real, const D: usize>(
    start: &Square<T, D>,
    mean: &Square<T, D>,
    end: &Square<T, D>,
) -> Square<T, D> {
    let middle = cofactor_minus_one(mean);
    if D == 2 {
        return middle;
    }
    let ends = sum(&cofactor_minus_one(start), &cofactor_minus_one(end));
    let four = start[0][0].constant(4.0);
    let sixth = start[0][0].constant(1.0 / 6.0);
    scale_all(&sum(&ends, &scale_all(&middle, four)), sixth)
}
