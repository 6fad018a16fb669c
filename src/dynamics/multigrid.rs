//! What preconditioners may know of bodies and contact beside the matrix.

use std::rc::Rc;

use super::{Resumption, Stage};
use crate::error::Result;
use crate::petsc::{BlockPattern, Matrix, Vector};
use crate::terms::Terms;

/// The sides of contacts and ties whose nodes are selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    /// Contactor and target.
    Both,
    /// The contactor alone.
    Contactor,
}

/// The owned nodes of the bodies.
#[derive(Debug, Clone)]
pub struct BodyNodes {
    /// The blocks that elements, patches and ties couple, without contact.
    pub pattern: Rc<BlockPattern>,
    /// Coordinates before the deformation, as many of each node as its block has rows.
    pub coordinates: Vec<f64>,
}

/// Knowledge of bodies and contact for preconditioners. The defaults are those of a system without
/// contact whose bodies are held.
pub trait MultigridHints: Resumption {
    /// Assembles [`Terms::BODIES`] with springs at closed contact points into a matrix with the
    /// system's pattern. Symmetric. Collective.
    ///
    /// The springs have the stiffness of `K_CN` and `K_T`, but are at most as stiff as the elements
    /// beneath them. They are softer at points without friction. Ties are at most as stiff as well. Nearly
    /// incompressible bodies have a smaller bulk modulus
    /// ([`Formulation::SOFTENED`](crate::element::Formulation::SOFTENED)).
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn joined_bodies_into(&mut self, stage: &Stage, matrix: &mut Matrix) -> Result<()> {
        self.jacobian_into(stage, Terms::BODIES, matrix)
    }

    /// Marks the owned nodes of these sides that closed contact points couple at the last residual,
    /// and those of ties. Collective.
    fn contact_nodes(&mut self, _: Sides) -> Vec<bool> {
        vec![false; self.matrix().pattern().rows()]
    }

    /// The nodes of the bodies, from which coarse spaces are built.
    fn body_nodes(&self) -> Option<BodyNodes> {
        None
    }

    /// Marks the owned nodes of bodies that no support holds in some direction.
    fn floating_nodes(&self) -> Vec<bool> {
        vec![false; self.matrix().pattern().rows()]
    }

    /// Computes unit normals at the owned nodes in contact at the last residual, zero elsewhere.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn contact_normals(&mut self, out: &mut Vector) -> Result<()> {
        out.set(0.0);
        Ok(())
    }
}
