//! Storage of a matrix's values on a rank by PETSc, and access to the arrays.

use super::call::petsc;
use super::pattern::BlockPattern;
use crate::error::Result;
use crate::matrix_format::Format;
use petsc_sys as sys;
use std::ffi::CStr;
use std::ptr::null_mut;

/// The value array of one part, returned to PETSc when dropped.
pub(super) struct PartArray {
    part: sys::Mat,
    format: Format,
    pointer: *mut f64,
    length: usize,
}

impl PartArray {
    pub(super) fn open(part: sys::Mat, format: Format, length: usize) -> Result<Self> {
        let mut pointer = null_mut();
        if !part.is_null() {
            match format {
                Format::Aij => petsc!(MatSeqAIJGetArray(part, &mut pointer))?,
                Format::Baij => petsc!(MatSeqBAIJGetArray(part, &mut pointer))?,
            }
        }
        Ok(Self { part, format, pointer, length })
    }

    pub(super) fn values(&mut self) -> &mut [f64] {
        if self.length == 0 {
            return &mut [];
        }
        // SAFETY: `find_parts` has checked the length; there is no other access to the array while
        // the matrix is borrowed.
        unsafe { std::slice::from_raw_parts_mut(self.pointer, self.length) }
    }
}

impl Drop for PartArray {
    fn drop(&mut self) {
        if self.part.is_null() {
            return;
        }
        // SAFETY: returns the array that `open` took.
        unsafe {
            match self.format {
                Format::Aij => sys::MatSeqAIJRestoreArray(self.part, &mut self.pointer),
                Format::Baij => sys::MatSeqBAIJRestoreArray(self.part, &mut self.pointer),
            };
        }
    }
}

/// PETSc's name for a format.
pub(super) fn type_name(format: Format) -> &'static CStr {
    match format {
        Format::Aij => c"aij",
        Format::Baij => c"baij",
    }
}

/// PETSc's information on a sequential matrix.
pub(super) fn info(matrix: sys::Mat) -> Result<sys::MatInfo> {
    let mut info = std::mem::MaybeUninit::<sys::MatInfo>::zeroed();
    petsc!(MatGetInfo(matrix, sys::MAT_LOCAL, info.as_mut_ptr()))?;
    // SAFETY: plain numbers, zero before PETSc fills them in.
    Ok(unsafe { info.assume_init() })
}

/// Offsets and columns of the scalar rows of a block pattern.
pub(super) fn scalar_rows(pattern: &BlockPattern, size: usize) -> (Vec<i32>, Vec<i32>) {
    let mut offsets = Vec::with_capacity(pattern.rows() * size + 1);
    let mut columns = Vec::with_capacity(pattern.slots() * size * size);
    offsets.push(0);
    for row in 0..pattern.rows() {
        let blocks = &pattern.columns[pattern.row(row)];
        for _ in 0..size {
            for &block in blocks {
                columns.extend((0..size as i32).map(|j| block * size as i32 + j));
            }
            offsets.push(columns.len() as i32);
        }
    }
    (offsets, columns)
}
