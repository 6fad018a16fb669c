//! Blocks are added directly to PETSc's value arrays, without search, copy or communication.
//!
//! A rank's rows consist of two sequential matrices, the *diagonal part* (columns that the rank
//! owns) and the *off-diagonal part* (the others). Both store a row's columns in ascending global
//! order, so that the address of a slot follows by counting. AIJ stores scalar rows: the rows of a
//! block are one stride apart. BAIJ stores whole blocks, column-major.

use super::pattern::BlockPattern;
use crate::error::{Error, Result};
use crate::matrix_format::Format;

/// Marks a block that this rank does not own. Adding to it does nothing.
pub const NO_SLOT: u32 = u32::MAX;

/// Marks an address in the off-diagonal part.
const OFF_DIAGONAL: u32 = 1 << 31;

/// Location of each slot of a pattern in the value arrays.
pub(super) struct Scatter {
    format: Format,
    block_size: usize,
    /// Position of a slot's first value. The top bit selects the part.
    addresses: Vec<u32>,
    /// AIJ: distance between two rows of a slot's block.
    strides: Vec<u32>,
    /// Slot of each row's diagonal block.
    diagonal: Vec<u32>,
    /// Number of values in the two parts.
    pub(super) lengths: [usize; 2],
}

impl Scatter {
    pub(super) fn new(pattern: &BlockPattern, block_size: usize, format: Format) -> Result<Self> {
        let mut scatter = Self {
            format,
            block_size,
            addresses: Vec::with_capacity(pattern.slots()),
            strides: Vec::with_capacity(if format == Format::Aij { pattern.slots() } else { 0 }),
            diagonal: Vec::with_capacity(pattern.rows()),
            lengths: [0; 2],
        };
        for row in 0..pattern.rows() {
            scatter.push_row(pattern, row);
        }
        if scatter.lengths.iter().any(|&length| length >= OFF_DIAGONAL as usize) {
            let message = "a rank's part of the matrix has more than 2^31 values";
            return Err(Error::internal(message).hint("use more ranks"));
        }
        Ok(scatter)
    }

    fn push_row(&mut self, pattern: &BlockPattern, row: usize) {
        let owned = pattern.owned();
        let columns = &pattern.columns[pattern.row(row)];
        let part_of = |column: &i32| usize::from(!owned.contains(column));
        let mut counts = [0; 2];
        for column in columns {
            counts[part_of(column)] += 1;
        }
        let step = self.block_size * if self.format == Format::Aij { 1 } else { self.block_size };
        let mut next = self.lengths;
        for column in columns {
            let part = part_of(column);
            if *column == owned.start + row as i32 {
                self.diagonal.push(self.addresses.len() as u32);
            }
            // An address that is too large is detected at the end by the lengths.
            self.addresses.push(next[part] as u32 & !OFF_DIAGONAL | if part == 1 { OFF_DIAGONAL } else { 0 });
            next[part] += step;
            if self.format == Format::Aij {
                self.strides.push((counts[part] * self.block_size) as u32);
            }
        }
        for part in 0..2 {
            self.lengths[part] += counts[part] * self.block_size * self.block_size;
        }
    }

    pub(super) fn bytes(&self) -> usize {
        (self.addresses.len() + self.strides.len() + self.diagonal.len()) * size_of::<u32>()
    }

    fn place(&self, slot: u32) -> (usize, usize) {
        let address = self.addresses[slot as usize];
        ((address >> 31) as usize, (address & !OFF_DIAGONAL) as usize)
    }

    /// Part and position of entry (`i`, `j`) of a slot's block.
    fn entry(&self, slot: u32, i: usize, j: usize) -> (usize, usize) {
        let (part, start) = self.place(slot);
        match self.format {
            Format::Aij => (part, start + i * self.strides[slot as usize] as usize + j),
            Format::Baij => (part, start + j * self.block_size + i),
        }
    }
}

/// The values of a matrix on this rank, for modification within
/// [`Matrix::fill`](super::Matrix::fill).
///
/// Blocks are row-major, `block[i * D + j]`, where D is the matrix's block size.
pub struct BlockValues<'a> {
    pub(super) parts: [&'a mut [f64]; 2],
    pub(super) scatter: &'a Scatter,
    pub(super) pattern: &'a BlockPattern,
}

impl BlockValues<'_> {
    /// Sets every stored value to zero.
    pub fn zero(&mut self) {
        self.parts.iter_mut().for_each(|part| part.fill(0.0));
    }

    /// Multiplies every stored value by `alpha`.
    pub fn scale(&mut self, alpha: f64) {
        self.parts.iter_mut().flat_map(|part| part.iter_mut()).for_each(|value| *value *= alpha);
    }

    /// Adds one block; [`NO_SLOT`] is skipped.
    #[inline]
    pub fn add(&mut self, slot: u32, block: &[f64]) {
        self.add_blocks(&[slot], block);
    }

    /// Adds one block per slot, for example of an element matrix. Each [`NO_SLOT`] is skipped.
    ///
    /// `blocks` contains them consecutively in the order of `slots`. This is the fast path.
    #[inline]
    pub fn add_blocks(&mut self, slots: &[u32], blocks: &[f64]) {
        match (self.scatter.format, self.scatter.block_size) {
            (Format::Aij, 1) => self.add_rows::<1>(slots, blocks),
            (Format::Aij, 2) => self.add_rows::<2>(slots, blocks),
            (Format::Aij, _) => self.add_rows::<3>(slots, blocks),
            (Format::Baij, 1) => self.add_columns::<1, 1>(slots, blocks),
            (Format::Baij, 2) => self.add_columns::<2, 4>(slots, blocks),
            (Format::Baij, _) => self.add_columns::<3, 9>(slots, blocks),
        }
    }

    fn add_rows<const D: usize>(&mut self, slots: &[u32], blocks: &[f64]) {
        for (&slot, block) in slots.iter().zip(blocks.chunks_exact(D * D)) {
            if slot == NO_SLOT {
                continue;
            }
            let (part, start) = self.scatter.place(slot);
            let stride = self.scatter.strides[slot as usize] as usize;
            let values = &mut self.parts[part][start..];
            for i in 0..D {
                let row = &mut values[i * stride..][..D];
                for j in 0..D {
                    row[j] += block[i * D + j];
                }
            }
        }
    }

    /// Blocks as arrays of `SIZE = D * D`: lengths known at compile time avoid a bounds check per
    /// entry.
    fn add_columns<const D: usize, const SIZE: usize>(&mut self, slots: &[u32], blocks: &[f64]) {
        for (&slot, block) in slots.iter().zip(blocks.as_chunks::<SIZE>().0) {
            if slot == NO_SLOT {
                continue;
            }
            let Some(values) = self.whole_block::<SIZE>(slot) else { continue };
            for j in 0..D {
                for i in 0..D {
                    values[j * D + i] += block[i * D + j];
                }
            }
        }
    }

    /// The values of a block that BAIJ stores contiguously.
    #[inline]
    fn whole_block<const SIZE: usize>(&mut self, slot: u32) -> Option<&mut [f64; SIZE]> {
        let (part, start) = self.scatter.place(slot);
        self.parts[part].get_mut(start..)?.first_chunk_mut()
    }

    /// Sets each block to `factor * values[slot]` times the unit block, for example for a mass
    /// matrix. It does in one pass what [`zero`](Self::zero) and
    /// [`add_isotropic`](Self::add_isotropic) do in two.
    pub fn set_isotropic(&mut self, factor: f64, values: &[f64]) {
        match (self.scatter.format, self.scatter.block_size) {
            (Format::Baij, 2) => self.set_units::<2, 4>(factor, values),
            (Format::Baij, 3) => self.set_units::<3, 9>(factor, values),
            _ => {
                self.zero();
                for (slot, value) in values.iter().enumerate() {
                    self.add_isotropic(slot as u32, factor * value);
                }
            }
        }
    }

    fn set_units<const D: usize, const SIZE: usize>(&mut self, factor: f64, values: &[f64]) {
        for (slot, value) in values.iter().enumerate() {
            let Some(block) = self.whole_block::<SIZE>(slot as u32) else { continue };
            *block = [0.0; SIZE];
            for i in 0..D {
                block[i * (D + 1)] = factor * value;
            }
        }
    }

    /// Adds `value` times the unit block, for example for a mass or an isotropic contact spring.
    #[inline]
    pub fn add_isotropic(&mut self, slot: u32, value: f64) {
        if slot == NO_SLOT {
            return;
        }
        for i in 0..self.scatter.block_size {
            let (part, at) = self.scatter.entry(slot, i, i);
            self.parts[part][at] += value;
        }
    }

    /// Adds to the diagonal entry of the owned unknown `dof` (= owned node * D + component).
    pub fn add_diagonal(&mut self, dof: usize, value: f64) {
        let row = dof / self.scatter.block_size;
        let i = dof % self.scatter.block_size;
        let (part, at) = self.scatter.entry(self.scatter.diagonal[row], i, i);
        self.parts[part][at] += value;
    }

    /// Adds to the diagonal block of an owned node, row-major.
    pub fn add_diagonal_block(&mut self, node: usize, block: &[f64]) {
        self.add(self.scatter.diagonal[node], block);
    }

    /// Sets the row of the owned unknown `dof` to zero, except for `value` on the diagonal.
    pub fn set_identity_row(&mut self, dof: usize, value: f64) {
        let row = dof / self.scatter.block_size;
        let i = dof % self.scatter.block_size;
        for slot in self.pattern.row(row) {
            self.mask(slot as u32, 1 << i, 0);
        }
        self.add_diagonal(dof, value);
    }

    /// Sets rows and columns of one block to zero; bit `i` of `rows` or `columns` refers to
    /// component `i`.
    ///
    /// If it is applied to all slots that touch prescribed unknowns, a symmetric matrix remains
    /// symmetric.
    pub fn mask(&mut self, slot: u32, rows: u8, columns: u8) {
        if slot == NO_SLOT {
            return;
        }
        let size = self.scatter.block_size;
        for i in 0..size {
            for j in (0..size).filter(|j| rows >> i & 1 == 1 || columns >> j & 1 == 1) {
                let (part, at) = self.scatter.entry(slot, i, j);
                self.parts[part][at] = 0.0;
            }
        }
    }

    /// Copies one block out, row-major.
    pub fn block(&self, slot: u32, block: &mut [f64]) {
        let [diagonal, off_diagonal] = &self.parts;
        BlockReader { parts: [diagonal, off_diagonal], scatter: self.scatter }.block(slot, block);
    }
}

/// The values of a matrix on this rank, for reading within [`Matrix::read`](super::Matrix::read).
pub struct BlockReader<'a> {
    pub(super) parts: [&'a [f64]; 2],
    pub(super) scatter: &'a Scatter,
}

impl BlockReader<'_> {
    /// Copies one block out, row-major: `block[i * D + j]`, where D is the matrix's block size.
    pub fn block(&self, slot: u32, block: &mut [f64]) {
        let size = self.scatter.block_size;
        for (k, value) in block.iter_mut().enumerate().take(size * size) {
            let (part, at) = self.scatter.entry(slot, k / size, k % size);
            *value = self.parts[part][at];
        }
    }

    /// One block as `[j][i]`, where `i` is the row: by columns, as BAIJ stores it. D must be the
    /// matrix's block size.
    #[inline]
    pub fn columns<const D: usize>(&self, slot: u32) -> [[f64; D]; D] {
        let (part, start) = self.scatter.place(slot);
        if self.scatter.format == Format::Baij
            && let Some(whole) =
                self.parts[part].get(start..).and_then(|rest| rest.as_chunks::<D>().0.first_chunk())
        {
            return *whole;
        }
        std::array::from_fn(|j| {
            std::array::from_fn(|i| {
                let (part, at) = self.scatter.entry(slot, i, j);
                self.parts[part][at]
            })
        })
    }
}
