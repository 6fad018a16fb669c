//! Multipliers of the points of an augmented normal law.

/// Where the multipliers of an augmented normal law come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Augmentation {
    /// Uzawa's method seeks those that leave no gap: they push, and are not negative.
    #[default]
    Sought,
    /// A penalty that became stiffer in mid-run keeps the tractions of closed points by multipliers that pull, and are not
    /// positive: the contact is stiffer from there on, and nothing jumps.
    Carried,
}

/// Multipliers of the points of one contact on this rank.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Multipliers {
    /// Penetrations at which the normal law alone has the pressures of the multipliers \[m\]; empty where the law is not
    /// augmented.
    pub offsets: Vec<f64>,
    /// Gaps at the end of the last accepted step \[m\]; empty likewise.
    pub gaps: Vec<f64>,
    /// Where they come from.
    pub way: Augmentation,
}
