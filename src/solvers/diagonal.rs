//! How much a matrix has changed since a preconditioner was made for it.

use std::rc::Rc;

use mpi::collective::SystemOperation;

use crate::collective::Collective;
use crate::error::Result;
use crate::petsc::{BlockPattern, BlockReader, Matrix, Session};

/// The diagonal blocks of a matrix: one for each owned node.
///
/// They show the changes that matter to a preconditioner, such as a contact that closes, opens or
/// begins to slip, a pressure that grows, or a direction of slip that reverses.
pub(super) struct DiagonalBlocks {
    pattern: Rc<BlockPattern>,
    values: Vec<f64>,
}

impl DiagonalBlocks {
    /// Copies those of `matrix`.
    ///
    /// # Errors
    /// If PETSc does not provide its arrays.
    pub fn of(matrix: &Matrix) -> Result<Self> {
        let pattern = Rc::clone(matrix.pattern());
        let size = pattern.block_size * pattern.block_size;
        let mut values = vec![0.0; pattern.rows() * size];
        matrix.read(|blocks| {
            for (node, block) in values.chunks_exact_mut(size).enumerate() {
                read(blocks, &pattern, node, block);
            }
        })?;
        Ok(Self { pattern, values })
    }

    /// Largest change of an entry of a block in `matrix`, relative to the largest entry that the
    /// block had. Infinite if the pattern is another one. Collective.
    ///
    /// # Errors
    /// If PETSc does not provide its arrays.
    pub fn change(&self, session: &Session, matrix: &Matrix) -> Result<f64> {
        if !Rc::ptr_eq(&self.pattern, matrix.pattern()) {
            return Ok(f64::INFINITY);
        }
        let size = self.pattern.block_size * self.pattern.block_size;
        let mut block = vec![0.0; size];
        let own = matrix.read(|blocks| {
            let change = |(node, before): (usize, &[f64])| {
                read(blocks, &self.pattern, node, &mut block);
                let largest = before.iter().fold(f64::MIN_POSITIVE, |most, entry| most.max(entry.abs()));
                let apart = block.iter().zip(before).map(|(now, before)| (now - before).abs());
                apart.fold(0.0, f64::max) / largest
            };
            self.values.chunks_exact(size).enumerate().map(change).fold(0.0, f64::max)
        })?;
        let mut most = 0.0;
        session.world().reduce_all(&own, &mut most, SystemOperation::max());
        Ok(most)
    }
}

/// Reads the diagonal block of an owned node.
fn read(blocks: &BlockReader, pattern: &BlockPattern, node: usize, block: &mut [f64]) {
    match pattern.slot(node, pattern.first_row + node as i32) {
        Some(slot) => blocks.block(slot, block),
        None => block.fill(0.0),
    }
}
