//! Multipliers of the points of augmented laws: of the pressure, and of friction.

use crate::tensor::Vector;

/// Source of the multipliers of an augmented normal law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MultiplierSource {
    /// Uzawa's method determines the multipliers for which the gap is zero. They push and are not
    /// negative.
    #[default]
    Sought,
    /// When a penalty is stiffened during a run, multipliers keep the tractions of closed points.
    /// They pull and are not positive. The contact is stiffer from there on, without a jump of the
    /// tractions.
    Carried,
}

/// Multipliers of the points of one contact on this rank.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Multipliers<const D: usize> {
    /// Penetrations at which the normal law alone gives the pressures of the multipliers \[m\];
    /// empty if the law is not augmented.
    pub offsets: Vec<f64>,
    /// Gaps at the end of the last accepted step \[m\]; empty if the law is not augmented.
    pub gaps: Vec<f64>,
    /// Source of the multipliers of the normal law.
    pub way: MultiplierSource,
    /// Multipliers of friction at the start of the step \[Pa\], tangential to the normal there; empty
    /// if friction is not augmented.
    pub friction: Vec<Vector<D>>,
}
