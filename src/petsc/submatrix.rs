//! The rows and columns of a matrix that belong to selected nodes, as a separate matrix.

use super::matrix::Matrix;
use super::operator::Operator;
use super::pattern::BlockPattern;
use super::session::Session;
use super::vector::Vector;
use crate::collective::Collective;
use crate::error::Result;
use mpi::collective::SystemOperation;
use std::rc::Rc;

/// `P^T A P`, where `P` selects nodes, without the blocks off the diagonal that are zero.
///
/// It exists on the ranks that own a selected node, and each of them holds the rows of those that it
/// owns. The other ranks take no part in its products and solves.
pub struct SubMatrix {
    session: Rc<Session>,
    matrix: Matrix,
    /// Selected owned nodes, ascending.
    nodes: Vec<u32>,
}

impl SubMatrix {
    /// The part of `whole` on these owned nodes, ascending, with its values. It is `None` on a rank
    /// that selects no nodes. Collective.
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn new(session: &Rc<Session>, whole: &Matrix, nodes: Vec<u32>) -> Result<Option<Self>> {
        let (pattern, slots) = Self::selected(session, whole, &nodes)?;
        let Some(members) = session.of_members(!nodes.is_empty()) else { return Ok(None) };
        let mut matrix = Matrix::new(&members, &Rc::new(pattern), whole.format())?;
        let mut block = vec![0.0; whole.block_size() * whole.block_size()];
        whole.read(|values| {
            matrix.fill(|part| {
                part.zero();
                for (to, &from) in (0..).zip(&slots) {
                    values.block(from, &mut block);
                    part.add(to, &block);
                }
            })
        })??;
        Ok(Some(Self { session: members, matrix, nodes }))
    }

    /// The pattern of the part, and the slot in `whole` of each of its slots. The selected nodes are
    /// numbered in the order of the full matrix. Blocks off the diagonal that are zero are left out.
    /// Collective.
    fn selected(session: &Rc<Session>, matrix: &Matrix, nodes: &[u32]) -> Result<(BlockPattern, Vec<u32>)> {
        let whole: &BlockPattern = matrix.pattern();
        let mut through = 0;
        session.world().reduce_up_to(&(nodes.len() as i32), &mut through, SystemOperation::sum());
        let first_row = through - nodes.len() as i32;
        let owned = whole.owned();
        let rows = || nodes.iter().flat_map(|&node| whole.row(node as usize));
        let mut ghosts: Vec<i32> =
            rows().map(|slot| whole.columns[slot]).filter(|column| !owned.contains(column)).collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        // One more than the number of a selected node in the part, zero for the other nodes.
        let mut numbers = Vector::ghosted(session, whole.rows(), 1, &ghosts)?;
        for (number, &node) in (first_row + 1..).zip(nodes) {
            numbers.owned_mut()[node as usize] = f64::from(number);
        }
        numbers.update_ghosts()?;
        let numbers = numbers.local();
        let number_of = |column: i32| {
            let ghost = || ghosts.binary_search(&column).ok().map(|ghost| whole.rows() + ghost);
            let at = if owned.contains(&column) { Some((column - owned.start) as usize) } else { ghost() };
            at.map(|at| numbers[at] as i32 - 1).filter(|number| *number >= 0)
        };
        let mut pattern = BlockPattern {
            block_size: whole.block_size,
            first_row,
            row_offsets: vec![0],
            columns: Vec::new(),
            places: nodes.iter().map(|&node| whole.places[node as usize]).collect(),
        };
        let mut slots = Vec::new();
        let mut block = vec![0.0; whole.block_size * whole.block_size];
        matrix.read(|values| {
            for &node in nodes {
                let own = owned.start + node as i32;
                for slot in whole.row(node as usize) {
                    let column = whole.columns[slot];
                    let Some(number) = number_of(column) else { continue };
                    values.block(slot as u32, &mut block);
                    if column == own || block.iter().any(|entry| *entry != 0.0) {
                        pattern.columns.push(number);
                        slots.push(slot as u32);
                    }
                }
                pattern.row_offsets.push(slots.len() as u32);
            }
        })?;
        Ok((pattern, slots))
    }

    /// The ranks of the part.
    pub fn session(&self) -> &Rc<Session> {
        &self.session
    }

    /// A zero vector with its layout. Collective among the ranks of the part.
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn vector(&self) -> Result<Vector> {
        Vector::new(&self.session, self.nodes.len(), self.matrix.block_size())
    }

    /// `part = P^T whole`.
    pub fn restrict(&self, whole: &Vector, part: &mut Vector) {
        let (whole, mut part) = (whole.owned(), part.owned_mut());
        let size = self.matrix.block_size();
        for (values, &node) in part.chunks_exact_mut(size).zip(&self.nodes) {
            values.copy_from_slice(&whole[node as usize * size..][..size]);
        }
    }

    /// `whole += P part`.
    pub fn add_to(&self, part: &Vector, whole: &mut Vector) {
        let (part, mut whole) = (part.owned(), whole.owned_mut());
        let size = self.matrix.block_size();
        for (values, &node) in part.chunks_exact(size).zip(&self.nodes) {
            let sums = &mut whole[node as usize * size..][..size];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
    }
}

impl Operator for SubMatrix {
    fn raw(&self) -> petsc_sys::Mat {
        self.matrix.raw()
    }
}
