//! Operators that can be applied to a vector.

use super::call::petsc;
use super::session::Session;
use super::vector::Vector;
use crate::error::Result;
use petsc_sys as sys;
use std::ptr::null_mut;
use std::rc::Rc;

/// An operator that a Krylov solver can apply.
pub trait Operator {
    /// PETSc's handle, valid as long as `self`.
    fn raw(&self) -> sys::Mat;

    /// `y = A x` on the owned parts. Collective.
    ///
    /// # Errors
    /// The layouts do not match, or communication fails.
    fn multiply(&self, x: &Vector, y: &mut Vector) -> Result<()> {
        petsc!(MatMult(self.raw(), x.raw(), y.raw()))
    }
}

/// The true residual `|b - A x|` (Euclidean), with `work` as scratch space. Collective.
///
/// # Errors
/// The layouts do not match.
pub fn residual_norm(operator: &impl Operator, b: &Vector, x: &Vector, work: &mut Vector) -> Result<f64> {
    operator.multiply(x, work)?;
    work.aypx(-1.0, b)?;
    work.norm()
}

/// An additional owner of an operator, for a closure that outlives the borrow. It follows later
/// changes of the values.
pub struct SharedOperator {
    _session: Rc<Session>,
    raw: sys::Mat,
}

impl SharedOperator {
    pub(super) fn new(session: &Rc<Session>, raw: sys::Mat) -> Result<Self> {
        petsc!(PetscObjectReference(raw.cast()))?;
        Ok(Self { _session: Rc::clone(session), raw })
    }
}

impl Operator for SharedOperator {
    fn raw(&self) -> sys::Mat {
        self.raw
    }
}

impl Drop for SharedOperator {
    fn drop(&mut self) {
        // SAFETY: releases the reference that `new` took.
        unsafe { sys::MatDestroy(&mut self.raw) };
    }
}

/// A scalar matrix that acts on every component in the same way, see
/// [`Matrix::kronecker_identity`](super::Matrix::kronecker_identity).
pub struct Kronecker {
    _session: Rc<Session>,
    raw: sys::Mat,
}

impl Kronecker {
    pub(super) fn new(session: &Rc<Session>, scalar: sys::Mat, dimension: usize) -> Result<Self> {
        let mut raw = null_mut();
        petsc!(MatCreateMAIJ(scalar, dimension as i32, &mut raw))?;
        Ok(Self { _session: Rc::clone(session), raw })
    }
}

impl Operator for Kronecker {
    fn raw(&self) -> sys::Mat {
        self.raw
    }
}

impl Drop for Kronecker {
    fn drop(&mut self) {
        // SAFETY: we own the handle, and PETSc is running because we hold the session.
        unsafe { sys::MatDestroy(&mut self.raw) };
    }
}
