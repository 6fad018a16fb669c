//! The rows and columns of a matrix that belong to selected nodes, as a separate matrix.

use super::call::petsc;
use super::matrix::Matrix;
use super::operator::Operator;
use super::session::Session;
use super::vector::Vector;
use crate::error::Result;
use petsc_sys as sys;
use std::ptr::null_mut;
use std::rc::Rc;

/// `P^T A P`, where `P` selects nodes. Each rank holds the rows of the selected nodes that it owns.
pub struct SubMatrix {
    session: Rc<Session>,
    raw: sys::Mat,
    rows: sys::IS,
    /// Selected owned nodes, ascending.
    nodes: Vec<u32>,
    block_size: usize,
}

impl SubMatrix {
    /// The part of `whole` on these owned nodes, ascending; a rank may select no nodes. Collective.
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn new(session: &Rc<Session>, whole: &Matrix, nodes: Vec<u32>) -> Result<Self> {
        let size = whole.block_size();
        let first = whole.pattern().first_row;
        let globals: Vec<i32> = nodes.iter().map(|&node| first + node as i32).collect();
        let mut part =
            Self { session: Rc::clone(session), raw: null_mut(), rows: null_mut(), nodes, block_size: size };
        let comm = session.comm();
        let count = globals.len() as i32;
        petsc!(ISCreateBlock(
            comm,
            size as i32,
            count,
            globals.as_ptr(),
            sys::PETSC_COPY_VALUES,
            &mut part.rows
        ))?;
        let rows = part.rows;
        let initial = sys::MAT_INITIAL_MATRIX;
        petsc!(MatCreateSubMatrix(whole.raw(), rows, rows, initial, &mut part.raw))?;
        Ok(part)
    }

    /// Copies the current values of the full matrix. For a solver it remains the same matrix, so
    /// that the solver keeps its ordering. Collective.
    ///
    /// # Errors
    /// The pattern differs.
    pub fn extract(&mut self, whole: &Matrix) -> Result<()> {
        // Via a second matrix: the distributed BAIJ of PETSc 3.18 does not recognize its own
        // submatrix if a rank has no rows in it.
        let mut present = null_mut();
        let initial = sys::MAT_INITIAL_MATRIX;
        petsc!(MatCreateSubMatrix(whole.raw(), self.rows, self.rows, initial, &mut present))?;
        let copied = petsc!(MatCopy(present, self.raw, sys::SAME_NONZERO_PATTERN));
        petsc!(MatDestroy(&mut present))?;
        copied
    }

    /// A zero vector with its layout. Collective.
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn vector(&self) -> Result<Vector> {
        Vector::new(&self.session, self.nodes.len(), self.block_size)
    }

    /// `part = P^T whole`.
    pub fn restrict(&self, whole: &Vector, part: &mut Vector) {
        let (whole, mut part) = (whole.owned(), part.owned_mut());
        let size = self.block_size;
        for (values, &node) in part.chunks_exact_mut(size).zip(&self.nodes) {
            values.copy_from_slice(&whole[node as usize * size..][..size]);
        }
    }

    /// `whole += P part`.
    pub fn add_to(&self, part: &Vector, whole: &mut Vector) {
        let (part, mut whole) = (part.owned(), whole.owned_mut());
        let size = self.block_size;
        for (values, &node) in part.chunks_exact(size).zip(&self.nodes) {
            let sums = &mut whole[node as usize * size..][..size];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
    }
}

impl Operator for SubMatrix {
    fn raw(&self) -> sys::Mat {
        self.raw
    }
}

impl Drop for SubMatrix {
    fn drop(&mut self) {
        // SAFETY: we own the handles, and PETSc is running because we hold the session.
        unsafe {
            sys::MatDestroy(&mut self.raw);
            sys::ISDestroy(&mut self.rows);
        }
    }
}
