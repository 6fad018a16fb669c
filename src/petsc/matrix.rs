//! A distributed block matrix with a fixed pattern, filled in place.

use super::call::petsc;
use super::census::{self, Kind};
use super::operator::{Kronecker, Operator, SharedOperator};
use super::pattern::BlockPattern;
use super::scatter::{BlockReader, BlockValues, Scatter};
use super::session::Session;
use super::storage::{PartArray, info, scalar_rows, type_name};
use super::vector::Vector;
use crate::error::{Error, Result};
use crate::matrix_format::Format;
use petsc_sys as sys;
use std::ptr::{null, null_mut};
use std::rc::Rc;

/// Symmetry properties of a matrix, which are kept when its values change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Symmetry {
    /// No symmetry.
    None,
    /// Symmetric, possibly indefinite.
    Symmetric,
    /// Symmetric and positive definite.
    PositiveDefinite,
}

/// A square block matrix, distributed by rows in the same way as vectors.
pub struct Matrix {
    session: Rc<Session>,
    raw: sys::Mat,
    /// Diagonal and off-diagonal part. The latter is null on a single rank. Owned by `raw`.
    parts: [sys::Mat; 2],
    format: Format,
    symmetry: Symmetry,
    block_size: usize,
    pattern: Rc<BlockPattern>,
    scatter: Scatter,
    /// Whether the census counts it.
    counted: bool,
}

impl Matrix {
    /// A zero matrix with this pattern and `pattern.block_size` (1, 2 or 3) values per node.
    /// Collective.
    ///
    /// # Errors
    /// The pattern is malformed, there are more than 2^31 values on a rank, or there is not enough
    /// memory.
    pub fn new(session: &Rc<Session>, pattern: &Rc<BlockPattern>, format: Format) -> Result<Self> {
        Self::build(session, pattern, pattern.block_size, format)
    }

    /// A zero AIJ matrix with this pattern and one value per node, for any block size of the
    /// pattern. Collective.
    ///
    /// # Errors
    /// The errors of [`Matrix::new`].
    pub fn scalar(session: &Rc<Session>, pattern: &Rc<BlockPattern>) -> Result<Self> {
        Self::build(session, pattern, 1, Format::Aij)
    }

    /// A zero matrix with this pattern and storage and the same rigid-body modes. Collective.
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn like(&self) -> Result<Self> {
        self.like_stored_as(self.format)
    }

    /// A zero matrix with this pattern and the same rigid-body modes, but another storage format.
    /// Collective.
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn like_stored_as(&self, format: Format) -> Result<Self> {
        let twin = Self::build(&self.session, &self.pattern, self.block_size, format)?;
        let mut modes = null_mut();
        petsc!(MatGetNearNullSpace(self.raw, &mut modes))?;
        petsc!(MatSetNearNullSpace(twin.raw, modes))?;
        Ok(twin)
    }

    /// Computes products row by row instead of by groups of rows with equal structure, which is
    /// faster for blocks of three. AIJ only.
    ///
    /// # Errors
    /// PETSc rejects the option.
    pub fn ungroup_rows(&mut self) -> Result<()> {
        petsc!(MatSetOption(self.raw, sys::MAT_USE_INODES, sys::PETSC_FALSE))
    }

    /// An additional owner of the matrix, for multiplications.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn share(&self) -> Result<SharedOperator> {
        SharedOperator::new(&self.session, self.raw)
    }

    /// Adds `factor` times the largest diagonal entry of each node in the directions of `normals`,
    /// which are unit vectors or zero at the owned nodes. Solutions then have almost no component
    /// in these directions. Collective.
    ///
    /// # Errors
    /// PETSc rejects its arrays or the assembly.
    pub fn hold_directions(&mut self, normals: &Vector, factor: f64) -> Result<()> {
        let (size, first) = (self.block_size, self.pattern.first_row);
        let mut diagonal = normals.like()?;
        self.diagonal(&mut diagonal)?;
        let (diagonal, normals) = (diagonal.owned(), normals.owned());
        let pattern = Rc::clone(&self.pattern);
        self.fill(|values| {
            let nodes = normals.chunks_exact(size).zip(diagonal.chunks_exact(size)).enumerate();
            for (row, (normal, entries)) in nodes.filter(|(_, (normal, _))| normal.iter().any(|n| *n != 0.0))
            {
                let Some(slot) = pattern.slot(row, first + row as i32) else { continue };
                let stiffness = factor * entries.iter().copied().fold(0.0, f64::max);
                let block: Vec<f64> =
                    normal.iter().flat_map(|a| normal.iter().map(move |b| stiffness * a * b)).collect();
                values.add(slot, &block);
            }
        })
    }

    fn build(session: &Rc<Session>, pattern: &Rc<BlockPattern>, size: usize, format: Format) -> Result<Self> {
        pattern.check()?;
        if !(1..=3).contains(&size) {
            return Err(Error::internal(format!("a matrix has blocks of size 1 to 3, not {size}")));
        }
        let scatter = Scatter::new(pattern, size, format)?;
        let mut raw = null_mut();
        petsc!(MatCreate(session.comm(), &mut raw))?;
        let mut matrix = Self {
            session: Rc::clone(session),
            raw,
            parts: [raw, null_mut()],
            format,
            symmetry: Symmetry::None,
            block_size: size,
            pattern: Rc::clone(pattern),
            scatter,
            counted: false,
        };
        matrix.allocate()?;
        matrix.find_parts()?;
        census::made(Kind::Matrix, matrix.bytes());
        matrix.counted = true;
        Ok(matrix)
    }

    fn allocate(&mut self) -> Result<()> {
        let raw = self.raw;
        let size = self.block_size as i32;
        let rows = self.pattern.rows() as i32 * size;
        petsc!(MatSetSizes(raw, rows, rows, sys::DETERMINE, sys::DETERMINE))?;
        petsc!(MatSetBlockSize(raw, size))?;
        petsc!(MatSetType(raw, type_name(self.format).as_ptr()))?;
        // In each pair, the call for the other case (one or several ranks) does nothing.
        match self.format {
            Format::Aij => {
                let (offsets, columns) = scalar_rows(&self.pattern, self.block_size);
                petsc!(MatSeqAIJSetPreallocationCSR(raw, offsets.as_ptr(), columns.as_ptr(), null()))?;
                petsc!(MatMPIAIJSetPreallocationCSR(raw, offsets.as_ptr(), columns.as_ptr(), null()))?;
            }
            Format::Baij => {
                let offsets: Vec<i32> = self.pattern.row_offsets.iter().map(|&at| at as i32).collect();
                let columns = self.pattern.columns.as_ptr();
                petsc!(MatSeqBAIJSetPreallocationCSR(raw, size, offsets.as_ptr(), columns, null()))?;
                petsc!(MatMPIBAIJSetPreallocationCSR(raw, size, offsets.as_ptr(), columns, null()))?;
            }
        }
        // A block outside the pattern is an error; every rank fills only its own rows.
        for option in
            [sys::MAT_NEW_NONZERO_LOCATION_ERR, sys::MAT_KEEP_NONZERO_PATTERN, sys::MAT_NO_OFF_PROC_ENTRIES]
        {
            petsc!(MatSetOption(raw, option, sys::PETSC_TRUE))?;
        }
        Ok(())
    }

    /// Finds the two sequential matrices and checks the structure on which the scatter relies.
    fn find_parts(&mut self) -> Result<()> {
        if self.session.size() > 1 {
            let [diagonal, off_diagonal] = &mut self.parts;
            match self.format {
                Format::Aij => petsc!(MatMPIAIJGetSeqAIJ(self.raw, diagonal, off_diagonal, null_mut()))?,
                Format::Baij => petsc!(MatMPIBAIJGetSeqBAIJ(self.raw, diagonal, off_diagonal, null_mut()))?,
            }
        }
        for (part, expected) in self.parts.into_iter().zip(self.scatter.lengths) {
            let stored = if part.is_null() { 0 } else { info(part)?.nz_used as usize };
            if stored != expected {
                let message = format!("PETSc stores {stored} values of a matrix's part, not {expected}");
                return Err(Error::internal(message));
            }
        }
        Ok(())
    }

    /// Changes the values in place and then notifies PETSc. Collective: all ranks call it, each
    /// with its own closure.
    ///
    /// # Errors
    /// PETSc rejects its arrays or the assembly. The result of the closure is returned unchanged.
    pub fn fill<R>(&mut self, change: impl FnOnce(&mut BlockValues) -> R) -> Result<R> {
        let answer = {
            let [diagonal, off_diagonal] = &mut self.arrays()?;
            let parts = [diagonal.values(), off_diagonal.values()];
            change(&mut BlockValues { parts, scatter: &self.scatter, pattern: &self.pattern })
        };
        self.assemble()?;
        Ok(answer)
    }

    /// Reads this rank's values.
    ///
    /// # Errors
    /// PETSc rejects its arrays.
    pub fn read<R>(&self, look: impl FnOnce(&BlockReader) -> R) -> Result<R> {
        let [diagonal, off_diagonal] = &mut self.arrays()?;
        let parts = [&*diagonal.values(), &*off_diagonal.values()];
        Ok(look(&BlockReader { parts, scatter: &self.scatter }))
    }

    /// Copies all values of a matrix with the same pattern, block size and format. Collective.
    ///
    /// # Errors
    /// The matrices do not match.
    pub fn copy_values_from(&mut self, other: &Self) -> Result<()> {
        self.combine(other, <[f64]>::copy_from_slice)
    }

    /// `self += alpha other` for a matrix with the same pattern, block size and format. Collective.
    ///
    /// # Errors
    /// The matrices do not match.
    pub fn axpy_same_pattern(&mut self, alpha: f64, other: &Self) -> Result<()> {
        self.combine(other, |mine, theirs| mine.iter_mut().zip(theirs).for_each(|(y, x)| *y += alpha * x))
    }

    fn combine(&mut self, other: &Self, with: impl Fn(&mut [f64], &[f64])) -> Result<()> {
        let same = Rc::ptr_eq(&self.pattern, &other.pattern) || self.pattern == other.pattern;
        if !same || self.format != other.format || self.block_size != other.block_size {
            return Err(Error::internal("two matrices of different patterns were combined"));
        }
        {
            let (mut mine, mut theirs) = (self.arrays()?, other.arrays()?);
            for (mine, theirs) in mine.iter_mut().zip(&mut theirs) {
                with(mine.values(), theirs.values());
            }
        }
        self.assemble()
    }

    fn assemble(&mut self) -> Result<()> {
        petsc!(MatAssemblyBegin(self.raw, sys::MAT_FINAL_ASSEMBLY))?;
        petsc!(MatAssemblyEnd(self.raw, sys::MAT_FINAL_ASSEMBLY))
    }

    fn arrays(&self) -> Result<[PartArray; 2]> {
        let [diagonal, off_diagonal] = self.scatter.lengths;
        let diagonal = PartArray::open(self.parts[0], self.format, diagonal)?;
        Ok([diagonal, PartArray::open(self.parts[1], self.format, off_diagonal)?])
    }

    /// `y = A^T x` on the owned parts. Collective.
    ///
    /// # Errors
    /// The layouts do not match, or communication fails.
    pub fn multiply_transpose(&self, x: &Vector, y: &mut Vector) -> Result<()> {
        petsc!(MatMultTranspose(self.raw, x.raw(), y.raw()))
    }

    /// Copies the diagonal into a vector. Collective.
    ///
    /// # Errors
    /// The layouts do not match.
    pub fn diagonal(&self, into: &mut Vector) -> Result<()> {
        petsc!(MatGetDiagonal(self.raw, into.raw()))
    }

    /// Frobenius norm: square root of the sum of squares of all values. Collective.
    ///
    /// # Errors
    /// Communication fails.
    pub fn norm_frobenius(&self) -> Result<f64> {
        let mut norm = 0.0;
        petsc!(MatNorm(self.raw, sys::NORM_FROBENIUS, &mut norm))?;
        Ok(norm)
    }

    /// Deviation of the matrix from symmetry: `|y.Ax - x.Ay| / (|y||Ax|)`, the maximum over three
    /// pseudorandom pairs. Collective.
    ///
    /// About 1e-15 for a symmetric matrix. It is a test for solvers that need symmetry, not a
    /// proof.
    ///
    /// # Errors
    /// Communication fails.
    pub fn asymmetry(&self) -> Result<f64> {
        let mut worst = 0.0_f64;
        for pair in 0..3 {
            let x = self.irregular(2 * pair)?;
            let y = self.irregular(2 * pair + 1)?;
            let (mut ax, mut ay) = (x.like()?, x.like()?);
            self.multiply(&x, &mut ax)?;
            self.multiply(&y, &mut ay)?;
            let scale = (y.norm()? * ax.norm()?).max(f64::MIN_POSITIVE);
            worst = worst.max((y.dot(&ax)? - x.dot(&ay)?).abs() / scale);
        }
        Ok(worst)
    }

    /// A vector of pseudorandom values in [-1, 1) that depend only on the seed and the global
    /// position.
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn irregular(&self, seed: u64) -> Result<Vector> {
        let mut vector = Vector::new(&self.session, self.pattern.rows(), self.block_size)?;
        let first = self.pattern.first_row as u64 * self.block_size as u64;
        for (i, value) in vector.owned_mut().iter_mut().enumerate() {
            let mut bits =
                (first + i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(seed << 17);
            bits = (bits ^ (bits >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            bits ^= bits >> 27;
            *value = (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
        }
        Ok(vector)
    }

    /// Declares a symmetry to PETSc, also for future values. Cholesky and ICC rely on it.
    /// Collective.
    ///
    /// # Errors
    /// PETSc rejects the option.
    pub fn set_symmetry(&mut self, symmetry: Symmetry) -> Result<()> {
        let truth = |yes: bool| if yes { sys::PETSC_TRUE } else { sys::PETSC_FALSE };
        let symmetric = truth(symmetry != Symmetry::None);
        let definite = truth(symmetry == Symmetry::PositiveDefinite);
        // PETSc must know a property before it accepts that the property is permanent. Distributed
        // BAIJ has no option for definiteness and no method that needs it.
        if self.format == Format::Aij {
            petsc!(MatSetOption(self.raw, sys::MAT_SPD, definite))?;
            petsc!(MatSetOption(self.raw, sys::MAT_SPD_ETERNAL, definite))?;
        }
        petsc!(MatSetOption(self.raw, sys::MAT_SYMMETRIC, symmetric))?;
        petsc!(MatSetOption(self.raw, sys::MAT_SYMMETRY_ETERNAL, symmetric))?;
        self.symmetry = symmetry;
        Ok(())
    }

    /// The symmetry that was declared last.
    pub fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// Provides the rigid-body modes of nodes at `coordinates` (owned nodes, D values each) to
    /// multigrid. Collective.
    ///
    /// # Errors
    /// The vector's block size is not 2 or 3, or PETSc fails.
    pub fn set_near_null_space(&mut self, coordinates: &Vector) -> Result<()> {
        let mut modes = null_mut();
        petsc!(MatNullSpaceCreateRigidBody(coordinates.raw(), &mut modes))?;
        let set = petsc!(MatSetNearNullSpace(self.raw, modes));
        petsc!(MatNullSpaceDestroy(&mut modes))?;
        set
    }

    /// The matrix `A (x) 1_D` of a scalar matrix A. It shares A and so follows later changes of its
    /// values. Collective.
    ///
    /// # Errors
    /// The matrix is not scalar, or PETSc fails.
    pub fn kronecker_identity(&self, dimension: usize) -> Result<Kronecker> {
        if self.block_size != 1 {
            return Err(Error::internal(
                "only a matrix with one value per node can be expanded to components",
            ));
        }
        Kronecker::new(&self.session, self.raw, dimension)
    }

    /// Memory of values and indices on this rank, including the map of the scatter \[bytes\]; the
    /// pattern is shared.
    pub fn bytes(&self) -> usize {
        let values: usize = self.scatter.lengths.iter().sum();
        let indices = match self.format {
            Format::Aij => values + self.pattern.rows() * self.block_size,
            Format::Baij => self.pattern.slots() + self.pattern.rows(),
        };
        values * size_of::<f64>() + indices * size_of::<i32>() + self.scatter.bytes()
    }

    /// The pattern, for slots.
    pub fn pattern(&self) -> &Rc<BlockPattern> {
        &self.pattern
    }

    /// Storage format of the values.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Values per node.
    pub fn block_size(&self) -> usize {
        self.block_size
    }
}

impl Operator for Matrix {
    fn raw(&self) -> sys::Mat {
        self.raw
    }
}

impl Drop for Matrix {
    fn drop(&mut self) {
        if self.counted {
            census::gone(Kind::Matrix, self.bytes());
        }
        // SAFETY: we own the handle, and PETSc is running because we hold the session.
        unsafe { sys::MatDestroy(&mut self.raw) };
    }
}
