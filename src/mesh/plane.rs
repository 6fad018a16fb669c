//! State across the plane of a mesh of two dimensions.

/// State across the plane of elements in two dimensions; of no effect in three.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Plane {
    /// No strain across the plane.
    #[default]
    Strain,
    /// No stress across the plane: the thickness changes (theory, section 3.19).
    Stress,
}

impl Plane {
    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strain => "plane strain",
            Self::Stress => "plane stress",
        }
    }
}
