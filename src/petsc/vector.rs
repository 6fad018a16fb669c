//! A distributed vector of node values: first the owned ones, then copies of other ranks' values
//! (ghosts).

use super::call::petsc;
use super::census::{self, Kind};
use super::session::Session;
use super::values::{Values, ValuesMut};
use crate::error::{Error, Result};
use petsc_sys as sys;
use std::ptr::null_mut;
use std::rc::Rc;

/// A distributed vector with `block_size` values per node.
///
/// Storage of a rank: `[owned blocks | ghost blocks]`, value = block * `block_size` + component.
/// Algebra (`axpy`, `norm`, ...) acts on the owned part; [`Vector::update_ghosts`] updates the
/// ghosts.
pub struct Vector {
    session: Rc<Session>,
    raw: sys::Vec,
    block_size: usize,
    owned: usize,
    local: usize,
}

impl Vector {
    /// A zero vector with `owned_blocks` blocks on this rank and copies of the blocks with the
    /// global numbers `ghosts`. Collective.
    ///
    /// # Errors
    /// PETSc rejects the sizes or has not enough memory.
    pub fn ghosted(
        session: &Rc<Session>,
        owned_blocks: usize,
        block_size: usize,
        ghosts: &[i32],
    ) -> Result<Self> {
        let mut raw = null_mut();
        petsc!(VecCreateGhostBlock(
            session.comm(),
            block_size as i32,
            (owned_blocks * block_size) as i32,
            sys::DETERMINE,
            ghosts.len() as i32,
            ghosts.as_ptr(),
            &mut raw,
        ))?;
        let owned = owned_blocks * block_size;
        let local = owned + ghosts.len() * block_size;
        let mut vector = Self { session: Rc::clone(session), raw, block_size, owned, local };
        census::made(Kind::Vector, local * size_of::<f64>());
        vector.local_mut().fill(0.0);
        Ok(vector)
    }

    /// A zero vector without ghosts. Collective.
    ///
    /// # Errors
    /// The errors of [`Vector::ghosted`].
    pub fn new(session: &Rc<Session>, owned_blocks: usize, block_size: usize) -> Result<Self> {
        Self::ghosted(session, owned_blocks, block_size, &[])
    }

    /// A zero vector with the same layout, including ghosts. Collective.
    ///
    /// # Errors
    /// PETSc has not enough memory.
    pub fn like(&self) -> Result<Self> {
        let mut raw = null_mut();
        petsc!(VecDuplicate(self.raw, &mut raw))?;
        let session = Rc::clone(&self.session);
        let mut twin = Self { session, raw, ..*self };
        census::made(Kind::Vector, self.local * size_of::<f64>());
        twin.local_mut().fill(0.0);
        Ok(twin)
    }

    /// A zero vector with the same layout if it is `wanted`, otherwise one without entries.
    /// Collective.
    ///
    /// # Errors
    /// The errors of [`like`](Self::like).
    pub fn like_if(&self, wanted: bool) -> Result<Self> {
        if wanted { self.like() } else { Self::new(&self.session, 0, self.block_size) }
    }

    /// A second owner of a vector that PETSc passes to a callback, without ghosts.
    pub(super) fn share(session: &Rc<Session>, raw: sys::Vec) -> Result<Self> {
        let (mut owned, mut block_size) = (0, 0);
        petsc!(VecGetLocalSize(raw, &mut owned))?;
        petsc!(VecGetBlockSize(raw, &mut block_size))?;
        petsc!(PetscObjectReference(raw.cast()))?;
        let owned = owned as usize;
        census::made(Kind::Vector, owned * size_of::<f64>());
        Ok(Self { session: Rc::clone(session), raw, block_size: block_size as usize, owned, local: owned })
    }

    /// Values per block.
    pub fn block_size(&self) -> usize {
        self.block_size
    }

    /// Number of owned values.
    pub fn owned_len(&self) -> usize {
        self.owned
    }

    /// The owned values.
    pub fn owned(&self) -> Values<'_> {
        // SAFETY: PETSc made the vector with this many values.
        unsafe { Values::new(self.raw(), self.owned) }
    }

    /// The owned values, followed by the ghost values.
    pub fn local(&self) -> Values<'_> {
        // SAFETY: PETSc made the vector with this many values.
        unsafe { Values::new(self.raw(), self.local) }
    }

    /// The owned values, for modification.
    pub fn owned_mut(&mut self) -> ValuesMut<'_> {
        // SAFETY: PETSc made the vector with this many values.
        unsafe { ValuesMut::new(self.raw(), self.owned) }
    }

    /// The owned values, followed by the ghost values, for modification.
    pub fn local_mut(&mut self) -> ValuesMut<'_> {
        // SAFETY: PETSc made the vector with this many values.
        unsafe { ValuesMut::new(self.raw(), self.local) }
    }

    /// Sets every ghost to the value of its owner. Collective.
    ///
    /// # Errors
    /// Communication fails.
    pub fn update_ghosts(&mut self) -> Result<()> {
        self.ghosts(sys::INSERT_VALUES, sys::SCATTER_FORWARD)
    }

    /// Adds every ghost to its owner; the ghosts keep their values. Collective.
    ///
    /// # Errors
    /// Communication fails.
    pub fn add_ghosts_to_owners(&mut self) -> Result<()> {
        self.ghosts(sys::ADD_VALUES, sys::SCATTER_REVERSE)
    }

    fn ghosts(&mut self, insert: sys::InsertMode, direction: sys::ScatterMode) -> Result<()> {
        if self.session.size() == 1 && self.local == self.owned {
            return Ok(());
        }
        petsc!(VecGhostUpdateBegin(self.raw, insert, direction))?;
        petsc!(VecGhostUpdateEnd(self.raw, insert, direction))
    }

    /// `self += alpha x`, owned part.
    ///
    /// # Errors
    /// The layouts differ.
    pub fn axpy(&mut self, alpha: f64, x: &Self) -> Result<()> {
        petsc!(VecAXPY(self.raw, alpha, x.raw))
    }

    /// `self = x + alpha self`, owned part.
    ///
    /// # Errors
    /// The layouts differ.
    pub fn aypx(&mut self, alpha: f64, x: &Self) -> Result<()> {
        petsc!(VecAYPX(self.raw, alpha, x.raw))
    }

    /// `self = alpha x + beta self`, owned part.
    ///
    /// # Errors
    /// The layouts differ.
    pub fn axpby(&mut self, alpha: f64, beta: f64, x: &Self) -> Result<()> {
        petsc!(VecAXPBY(self.raw, alpha, beta, x.raw))
    }

    /// `self = alpha x + y`, owned part.
    ///
    /// # Errors
    /// The layouts differ.
    pub fn waxpy(&mut self, alpha: f64, x: &Self, y: &Self) -> Result<()> {
        petsc!(VecWAXPY(self.raw, alpha, x.raw, y.raw))
    }

    /// `self = alpha self`, owned part.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn scale(&mut self, alpha: f64) -> Result<()> {
        petsc!(VecScale(self.raw, alpha))
    }

    /// Sets every value, including ghosts, to `value`.
    pub fn set(&mut self, value: f64) {
        self.local_mut().fill(value);
    }

    /// Copies all values of a vector with the same layout, including ghosts.
    ///
    /// # Errors
    /// The layouts differ.
    pub fn copy_from(&mut self, x: &Self) -> Result<()> {
        if (self.owned, self.local) != (x.owned, x.local) {
            return Err(Error::internal("a vector was copied into one of another layout"));
        }
        self.local_mut().copy_from_slice(&x.local());
        Ok(())
    }

    /// Euclidean norm over all ranks. Collective.
    ///
    /// # Errors
    /// Communication fails.
    pub fn norm(&self) -> Result<f64> {
        let mut norm = 0.0;
        petsc!(VecNorm(self.raw, sys::NORM_2, &mut norm))?;
        Ok(norm)
    }

    /// Largest magnitude over all ranks. Collective.
    ///
    /// # Errors
    /// Communication fails.
    pub fn max_norm(&self) -> Result<f64> {
        let mut norm = 0.0;
        petsc!(VecNorm(self.raw, sys::NORM_INFINITY, &mut norm))?;
        Ok(norm)
    }

    /// Scalar product over all ranks. Collective.
    ///
    /// # Errors
    /// The layouts differ, or communication fails.
    pub fn dot(&self, x: &Self) -> Result<f64> {
        let mut product = 0.0;
        petsc!(VecDot(self.raw, x.raw, &mut product))?;
        Ok(product)
    }

    /// `self_i = x_i y_i`, owned part.
    ///
    /// # Errors
    /// The layouts differ.
    pub fn pointwise_multiply(&mut self, x: &Self, y: &Self) -> Result<()> {
        petsc!(VecPointwiseMult(self.raw, x.raw, y.raw))
    }

    /// `self_i = x_i / y_i`, owned part; 0 if `y_i` is 0.
    ///
    /// # Errors
    /// The layouts differ.
    pub fn pointwise_divide(&mut self, x: &Self, y: &Self) -> Result<()> {
        petsc!(VecPointwiseDivide(self.raw, x.raw, y.raw))
    }

    /// PETSc's handle, valid as long as `self`.
    pub fn raw(&self) -> sys::Vec {
        self.raw
    }

    /// The session that the vector keeps alive.
    pub fn session(&self) -> &Rc<Session> {
        &self.session
    }
}

impl Drop for Vector {
    fn drop(&mut self) {
        census::gone(Kind::Vector, self.local * size_of::<f64>());
        // SAFETY: we own the handle, and PETSc is running because we hold the session.
        unsafe { sys::VecDestroy(&mut self.raw) };
    }
}
