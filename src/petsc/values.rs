//! Access to the values of a vector on a rank.

use super::call::petsc;
use super::session::fault;
use petsc_sys as sys;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};
use std::ptr::null_mut;

/// Values of a vector on this rank, for reading.
///
/// The ghosts follow the owned values in one array, as PETSc documents for a ghosted vector.
pub struct Values<'a> {
    vector: sys::Vec,
    pointer: *const f64,
    length: usize,
    life: PhantomData<&'a ()>,
}

impl Values<'_> {
    /// # Safety
    /// The vector is borrowed as long as the values live, and `length` is at most that of its owned
    /// and ghost values.
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
        // SAFETY: PETSc's array has this length and lives until it is returned in `drop`.
        unsafe { std::slice::from_raw_parts(self.pointer, self.length) }
    }
}

impl Drop for Values<'_> {
    fn drop(&mut self) {
        // SAFETY: returns what `new` took; the vector is still borrowed.
        unsafe { sys::VecRestoreArrayRead(self.vector, &mut self.pointer) };
    }
}

/// Values of a vector on this rank, for modification.
pub struct ValuesMut<'a> {
    vector: sys::Vec,
    pointer: *mut f64,
    length: usize,
    life: PhantomData<&'a mut ()>,
}

impl ValuesMut<'_> {
    /// # Safety
    /// The vector is borrowed as long as the values live, and `length` is at most that of its owned
    /// and ghost values.
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
        // SAFETY: PETSc's array has this length and lives until it is returned in `drop`.
        unsafe { std::slice::from_raw_parts(self.pointer, self.length) }
    }
}

impl DerefMut for ValuesMut<'_> {
    fn deref_mut(&mut self) -> &mut [f64] {
        if self.length == 0 {
            return &mut [];
        }
        // SAFETY: PETSc's array has this length and lives until it is returned in `drop`; the
        // vector is borrowed exclusively.
        unsafe { std::slice::from_raw_parts_mut(self.pointer, self.length) }
    }
}

impl Drop for ValuesMut<'_> {
    fn drop(&mut self) {
        // SAFETY: returns what `new` took, which notifies PETSc that the values changed.
        unsafe { sys::VecRestoreArray(self.vector, &mut self.pointer) };
    }
}
