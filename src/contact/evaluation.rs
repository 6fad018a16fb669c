//! Inputs and options of a contact evaluation.

use super::damping::ActiveDamping;
use super::point::TermSelection;
use super::state::{Branches, Hold};

/// Configuration in which the area of a point is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AreaKind {
    /// The deformed facets.
    #[default]
    Current,
    /// The undeformed facets; `K_phi` vanishes.
    Reference,
}

/// Nodal fields, `node * D + component`, for the rank's nodes including ghosts. For deformable
/// targets the foreign nodes follow.
#[derive(Debug, Clone, Copy)]
pub struct ContactFields<'a> {
    /// Displacement \[m\].
    pub u: &'a [f64],
    /// Velocity \[m/s\].
    pub v: &'a [f64],
    /// Displacement at the start of the step \[m\].
    pub u_start: &'a [f64],
}

/// What an evaluation computes.
#[derive(Debug, Clone, Copy, Default)]
pub struct ContactRequest {
    /// Terms of the matrix; `None` if no matrix is needed.
    pub stiffness: Option<TermSelection>,
    /// Quantities that are held fixed.
    pub hold: Hold,
    /// Branches of the friction law.
    pub branches: Branches,
    /// The displacements are those in the middle of a step, and the forces conserve energy and
    /// momentum over it (theory, section 1.8).
    pub over_step: bool,
    /// Length of the step \[s\], which damping over a step needs; damping vanishes if it is zero.
    pub step: f64,
    /// Part of the damping that acts.
    pub damping: ActiveDamping,
}
