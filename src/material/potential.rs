//! The stored energy of a law.

use crate::composed::Composed;
use crate::square::Square;

/// A stored energy.
pub trait Potential {
    /// Numbers that the law is evaluated with, in SI units or those of the case.
    type Constants: Copy + 'static;

    /// Energy per reference volume [J/m^3] at the displacement gradient `grad_u` (row = component, column = reference direction).
    /// Its derivative is the first Piola stress.
    fn energy<T: Composed, const D: usize>(constants: &Self::Constants, grad_u: &Square<T, D>) -> T;
}
