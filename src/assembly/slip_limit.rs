//! The requested limit of the elastic slip.

/// Requested limit of the elastic slip in statics.
#[derive(Debug, Clone, Copy)]
pub struct SlipLimit {
    /// Relative to the largest displacement \[-\].
    pub part: f64,
    /// Largest displacement so far \[m\].
    pub size: f64,
}
