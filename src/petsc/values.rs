//! Access to the values of a vector on a rank.

use super::call::petsc;
use super::session::fault;
use petsc_sys as sys;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};
use std::ptr::null_mut;

/// Values of a vector on this rank, to be read.
///
/// The ghosts lie behind the owned values in one array: that is how PETSc documents a ghosted vector.
pub struct Values<'a> {
    vector: sys::Vec,
    pointer: *const f64,
    length: usize,
    life: PhantomData<&'a ()>,
}

impl Values<'_> {
    /// # Safety
    /// The vector is borrowed as long as the values live, and `length` is at most that of its owned and ghost values.
    pub(super) unsafe fn new(vector: sys::Vec, length: usize) -> Self {
        let mut pointer = std::ptr::null();
        petsc!(VecGetArrayRead(vector, &mut pointer)).unwrap_or_else(|error| fault(&error));
        Self { vector, pointer, length, life: PhantomData }
    }
}

impl Deref for Values<'_> {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        if self.length == 0 {
            return &[];
        }
        // SAFETY: PETSc's array has this length and lives until it is given back in `drop`.
        unsafe { std::slice::from_raw_parts(self.pointer, self.length) }
    }
}

impl Drop for Values<'_> {
    fn drop(&mut self) {
        // SAFETY: gives back what `new` took; the vector is still borrowed.
        unsafe { sys::VecRestoreArrayRead(self.vector, &mut self.pointer) };
    }
}

/// Values of a vector on this rank, to be changed.
pub struct ValuesMut<'a> {
    vector: sys::Vec,
    pointer: *mut f64,
    length: usize,
    life: PhantomData<&'a mut ()>,
}

impl ValuesMut<'_> {
    /// # Safety
    /// The vector is borrowed as long as the values live, and `length` is at most that of its owned and ghost values.
    pub(super) unsafe fn new(vector: sys::Vec, length: usize) -> Self {
        let mut pointer = null_mut();
        petsc!(VecGetArray(vector, &mut pointer)).unwrap_or_else(|error| fault(&error));
        Self { vector, pointer, length, life: PhantomData }
    }
}

impl Deref for ValuesMut<'_> {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        if self.length == 0 {
            return &[];
        }
        // SAFETY: as in `Values`.
        unsafe { std::slice::from_raw_parts(self.pointer, self.length) }
    }
}

impl DerefMut for ValuesMut<'_> {
    fn deref_mut(&mut self) -> &mut [f64] {
        if self.length == 0 {
            return &mut [];
        }
        // SAFETY: as in `Values`; the vector is borrowed for us alone.
        unsafe { std::slice::from_raw_parts_mut(self.pointer, self.length) }
    }
}

impl Drop for ValuesMut<'_> {
    fn drop(&mut self) {
        // SAFETY: gives back what `new` took, by which PETSc learns that the values changed.
        unsafe { sys::VecRestoreArray(self.vector, &mut self.pointer) };
    }
}
