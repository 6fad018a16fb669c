//! Motions that no support resists: a static solve has to hold them.

use super::{Equations, Stage};
use crate::error::Result;
use crate::petsc::Vector;

/// A strain-free motion that the supports allow: a rigid motion of a body, or a motion of pieces
/// that are hinged to each other.
pub struct RigidMotion {
    /// Index of the group of pieces that moves.
    pub group: usize,
    /// The motion, with 2-norm 1. It is zero on other groups and at prescribed unknowns.
    pub field: Vector,
    /// How each piece of the group moves.
    pub parts: Vec<MovingPart>,
}

/// Contribution of a piece of a body to a [`RigidMotion`].
pub struct MovingPart {
    /// Name in messages, `'block'`.
    pub name: String,
    /// Number of its nodes.
    pub nodes: f64,
    /// Sum of the squared displacements of its nodes under a unit rotation, averaged over the axes
    /// \[m2\].
    pub spread: f64,
    /// Translation of the centre of its nodes, x, y, z.
    pub shift: [f64; 3],
    /// Rotation about that centre, about x, y, z \[1/m\].
    pub spin: [f64; 3],
}

/// Bodies that supports do not hold. By default there are none.
pub trait FloatingBodies: Equations {
    /// Returns the rigid motions of bodies that supports allow at the trial positions, ignoring
    /// contact. They are orthonormal. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn rigid_motions(&self, _stage: &Stage) -> Result<Vec<RigidMotion>> {
        Ok(Vec::new())
    }

    /// Computes `M n` of a motion `n`, or `n` in systems without mass. Prescribed rows are zero.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn weigh_motion(&self, motion: &Vector, out: &mut Vector) -> Result<()> {
        out.copy_from(motion)
    }

    /// A typical diagonal entry of the stiffness \[N/m\]. It is the unit of [`Continuation::spring`](super::Continuation::spring).
    fn unit(&self) -> f64 {
        1.0
    }
}
