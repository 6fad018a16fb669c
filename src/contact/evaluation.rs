//! What the evaluation of a contact is given and asked for.

use super::point::TermSelection;
use super::state::{Branches, Hold};

/// Which configuration gives the area of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AreaKind {
    /// The deformed facets.
    #[default]
    Current,
    /// The undeformed facets; `K_phi` vanishes.
    Reference,
}

/// Nodal fields, `node * D + component`: the rank's nodes, ghosts included; for deformable targets the foreign nodes
/// follow.
#[derive(Debug, Clone, Copy)]
pub struct ContactFields<'a> {
    /// Displacement \[m\].
    pub u: &'a [f64],
    /// Velocity \[m/s\].
    pub v: &'a [f64],
    /// Displacement at the start of the step \[m\].
    pub u_start: &'a [f64],
}

/// What an evaluation is to bring.
#[derive(Debug, Clone, Copy, Default)]
pub struct ContactRequest {
    /// The terms of the matrix, or none.
    pub stiffness: Option<TermSelection>,
    /// What is held fixed.
    pub hold: Hold,
    /// Branches of the friction law.
    pub branches: Branches,
    /// The displacements are those in the middle of a step: forces conserve over it (theory, section 1.8).
    pub over_step: bool,
}
