//! The blocks of a matrix that may be nonzero.

use crate::error::{Error, Result};

/// The block rows that this rank owns, in compressed form. An entry of `columns` is a *slot*.
///
/// Rows are the owned nodes in order; columns are global nodes. The same pattern is used for
/// matrices with `block_size` values per node and with one value per node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlockPattern {
    /// Values per node.
    pub block_size: usize,
    /// Global number of the first owned node.
    pub first_row: i32,
    /// Row `i` has the slots `row_offsets[i]..row_offsets[i + 1]`. There is one more entry than
    /// rows.
    pub row_offsets: Vec<u32>,
    /// Global node of each slot, ascending within a row. The diagonal is always included.
    pub columns: Vec<i32>,
    /// Position of each owned node in an order of all nodes that does not depend on the number of
    /// ranks, for example its number in the input. Incomplete factors eliminate the nodes in this
    /// order.
    pub places: Vec<u32>,
}

impl BlockPattern {
    /// Number of owned block rows.
    pub fn rows(&self) -> usize {
        self.row_offsets.len().saturating_sub(1)
    }

    /// Number of slots on this rank.
    pub fn slots(&self) -> usize {
        self.columns.len()
    }

    /// Global nodes that this rank owns.
    pub fn owned(&self) -> std::ops::Range<i32> {
        self.first_row..self.first_row + self.rows() as i32
    }

    /// Slots of the owned row `row`.
    pub fn row(&self, row: usize) -> std::ops::Range<usize> {
        self.row_offsets[row] as usize..self.row_offsets[row + 1] as usize
    }

    /// Slot of the block (owned row, global column), found by a search in the row.
    pub fn slot(&self, row: usize, column: i32) -> Option<u32> {
        let slots = self.row(row);
        let found = self.columns[slots.clone()].binary_search(&column).ok()?;
        Some((slots.start + found) as u32)
    }

    /// The pattern extended by blocks (owned row, global column), sorted by row. They may include
    /// existing blocks.
    pub fn widened(&self, further: impl Iterator<Item = (u32, i32)>) -> Self {
        let mut further = further.peekable();
        let mut wide =
            Self { row_offsets: vec![0], columns: Vec::with_capacity(self.slots()), ..self.without_rows() };
        for row in 0..self.rows() {
            let start = wide.columns.len();
            wide.columns.extend_from_slice(&self.columns[self.row(row)]);
            while let Some((_, column)) = further.next_if(|&(at, _)| at as usize == row) {
                wide.columns.push(column);
            }
            let new = &mut wide.columns[start..];
            new.sort_unstable();
            let mut kept = start;
            for at in start..wide.columns.len() {
                if kept == start || wide.columns[kept - 1] != wide.columns[at] {
                    wide.columns[kept] = wide.columns[at];
                    kept += 1;
                }
            }
            wide.columns.truncate(kept);
            wide.row_offsets.push(kept as u32);
        }
        wide
    }

    fn without_rows(&self) -> Self {
        let places = self.places.clone();
        Self { places, row_offsets: Vec::new(), columns: Vec::new(), ..*self }
    }

    /// Rejects an invalid pattern before PETSc uses it.
    pub(super) fn check(&self) -> Result<()> {
        let wrong = |what: &str| Err(Error::internal(format!("pattern of a matrix: {what}")));
        if self.row_offsets.first() != Some(&0)
            || self.row_offsets.last() != Some(&(self.columns.len() as u32))
        {
            return wrong("the row offsets do not span the columns");
        }
        if self.row_offsets.windows(2).any(|pair| pair[0] > pair[1]) {
            return wrong("the row offsets descend");
        }
        if self.places.len() != self.rows() {
            return wrong("not every row has its place");
        }
        for row in 0..self.rows() {
            if !self.columns[self.row(row)].is_sorted_by(|a, b| a < b) {
                return wrong(&format!("the columns of row {row} do not ascend"));
            }
            if self.slot(row, self.first_row + row as i32).is_none() {
                return wrong(&format!("row {row} has no diagonal"));
            }
        }
        Ok(())
    }
}
