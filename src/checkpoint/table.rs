//! A table of a checkpoint as one rank has it.

use crate::error::{Error, Result};

/// Rows that a rank gives to a checkpoint, or takes from it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StoredTable {
    /// Name of the section.
    pub name: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Key of each row: a number that it has on every number of ranks.
    pub keys: Vec<u64>,
    /// Rows of as many words as there are columns; numbers as their bits.
    pub words: Vec<u64>,
    /// All rows whose keys lie in a range of this length are in the memory of one rank at a time.
    pub span: u64,
}

impl StoredTable {
    /// A table with keys whose rows are to be filled.
    pub fn keyed(name: &str, columns: Vec<String>, keys: Vec<u64>, span: u64) -> Self {
        let words = vec![0; keys.len() * columns.len()];
        Self { name: name.to_owned(), columns, keys, words, span }
    }

    /// The rows, in the order of the keys.
    pub fn rows(&self) -> impl Iterator<Item = &[u64]> {
        self.words.chunks_exact(self.columns.len().max(1))
    }

    /// The rows, to be filled.
    pub fn rows_mut(&mut self) -> impl Iterator<Item = &mut [u64]> {
        self.words.chunks_exact_mut(self.columns.len().max(1))
    }

    /// Rows by ascending key: places in `keys`.
    pub(super) fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.keys.len()).collect();
        order.sort_unstable_by_key(|&row| self.keys[row]);
        order
    }

    /// Words must be as many as keys and columns ask for.
    pub(super) fn check(&self) -> Result<()> {
        let fits = self.words.len() == self.keys.len() * self.columns.len() && self.span > 0;
        let fault =
            || Error::internal(format!("checkpoint: the table '{}' does not fit its keys", self.name));
        fits.then_some(()).ok_or_else(fault)
    }
}
