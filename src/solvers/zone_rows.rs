//! Rows of a matrix on selected nodes, for products that need no other row.

use std::rc::Rc;

use mpi::collective::SystemOperation;

use crate::collective::Collective;
use crate::error::{Result, agree};
use crate::partition::IndexMap;
use crate::partition::exchange::NodeExchange;
use crate::petsc::{Matrix, Session, Vector};

/// The rows of `A` on selected owned nodes, as they were when it was made, without the blocks that
/// are zero.
pub(super) struct ZoneRows {
    session: Rc<Session>,
    block_size: usize,
    /// End of each row in `columns`.
    ends: Vec<u32>,
    /// Nodes: the owned ones, then those that other ranks own.
    columns: Vec<u32>,
    /// The blocks of all rows, each row-major.
    blocks: Vec<f64>,
    exchange: NodeExchange,
    /// Values of the nodes of other ranks.
    halo: Vec<f64>,
}

impl ZoneRows {
    /// Copies the rows of `matrix` on these owned nodes, ascending. A rank may select none.
    /// Collective.
    ///
    /// # Errors
    /// If the pattern names a node that does not exist, or PETSc does not provide its arrays.
    pub fn new(session: &Rc<Session>, matrix: &Matrix, nodes: &[u32]) -> Result<Self> {
        let pattern = matrix.pattern();
        let block_size = matrix.block_size();
        let mut global = Vec::new();
        let mut ends = Vec::with_capacity(nodes.len());
        let mut blocks = Vec::new();
        let read = matrix.read(|values| {
            let mut block = vec![0.0; block_size * block_size];
            for &node in nodes {
                for slot in pattern.row(node as usize) {
                    values.block(slot as u32, &mut block);
                    if block.iter().any(|entry| *entry != 0.0) {
                        global.push(pattern.columns[slot]);
                        blocks.extend_from_slice(&block);
                    }
                }
                ends.push(global.len() as u32);
            }
        });
        agree(session.world(), read)?;
        let owned = pattern.owned();
        let mut ghosts: Vec<i32> = global.iter().copied().filter(|node| !owned.contains(node)).collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        let place = |node: i32| match owned.contains(&node) {
            true => (node - owned.start) as u32,
            false => (pattern.rows() + ghosts.partition_point(|ghost| *ghost < node)) as u32,
        };
        let columns = global.into_iter().map(place).collect();
        let mut total = 0;
        session.world().reduce_all(&(pattern.rows() as i32), &mut total, SystemOperation::sum());
        let index = IndexMap { first: owned.start, owned: pattern.rows(), ghosts: Vec::new(), total };
        let exchange = NodeExchange::new(session.world(), &index, &ghosts)?;
        let halo = vec![0.0; ghosts.len() * block_size];
        Ok(Self { session: Rc::clone(session), block_size, ends, columns, blocks, exchange, halo })
    }

    /// Receives the values of `x` on the nodes of other ranks. Collective.
    pub fn receive(&mut self, x: &Vector) {
        self.exchange.forward(self.session.world(), self.block_size, &x.owned(), &mut self.halo);
    }

    /// Computes `y -= A x` on the selected nodes, one after the other in `y`, after `x` was
    /// [received](Self::receive).
    pub fn subtract_product(&self, x: &Vector, y: &mut [f64]) {
        match self.block_size {
            1 => self.subtract::<1>(&x.owned(), y),
            2 => self.subtract::<2>(&x.owned(), y),
            _ => self.subtract::<3>(&x.owned(), y),
        }
    }

    fn subtract<const D: usize>(&self, x: &[f64], y: &mut [f64]) {
        let (owned, halo) = (x.as_chunks::<D>().0, self.halo.as_chunks::<D>().0);
        let blocks = self.blocks.as_chunks::<D>().0;
        let mut start = 0;
        for (y, &end) in y.as_chunks_mut::<D>().0.iter_mut().zip(&self.ends) {
            for at in start..end as usize {
                let node = self.columns[at] as usize;
                let x = owned.get(node).unwrap_or_else(|| &halo[node - owned.len()]);
                for (i, row) in blocks[at * D..][..D].iter().enumerate() {
                    for j in 0..D {
                        y[i] -= row[j] * x[j];
                    }
                }
            }
            start = end as usize;
        }
    }
}
