//! State across the plane of a mesh of two dimensions.

/// State across the plane of elements in two dimensions; of no effect in three.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PlaneState {
    /// No strain across the plane.
    #[default]
    Strain,
    /// No stress across the plane: the thickness changes (theory, section 3.19).
    Stress,
    /// The plane is the meridian of a body of revolution about the y axis, and x is the radius
    /// (theory, section 3.20).
    Axisymmetric,
}

impl PlaneState {
    /// All states, in the order of their discriminants.
    pub const ALL: [Self; 3] = [Self::Strain, Self::Stress, Self::Axisymmetric];

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strain => "plane strain",
            Self::Stress => "plane stress",
            Self::Axisymmetric => "axisymmetry",
        }
    }

    /// Whether points of the plane stand for circles around the y axis.
    pub fn is_revolved(self) -> bool {
        self == Self::Axisymmetric
    }

    /// Extent across the plane at a distance from the y axis \[m\]: that of the circle, otherwise one unit.
    pub fn depth(self, radius: f64) -> f64 {
        match self {
            Self::Strain | Self::Stress => 1.0,
            Self::Axisymmetric => std::f64::consts::TAU * radius,
        }
    }

    /// Derivative of [`depth`](Self::depth) by the radius \[-\].
    pub fn depth_slope(self) -> f64 {
        match self {
            Self::Strain | Self::Stress => 0.0,
            Self::Axisymmetric => std::f64::consts::TAU,
        }
    }
}
