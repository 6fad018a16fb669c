//! One rank's part of a table of a checkpoint.

use crate::error::{Error, Result};

/// Rows that a rank writes to a checkpoint or reads from it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StoredTable {
    /// Name of the section.
    pub name: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Key of each row, which does not depend on the number of ranks.
    pub keys: Vec<u64>,
    /// The rows, one word for each column. Numbers are stored as their bits.
    pub words: Vec<u64>,
    /// Length of the key ranges. All rows with keys in one such range are in the memory of one rank
    /// at a time.
    pub span: u64,
}

impl StoredTable {
    /// A table with the given keys, whose rows are to be filled.
    pub fn keyed(name: &str, columns: Vec<String>, keys: Vec<u64>, span: u64) -> Self {
        let words = vec![0; keys.len() * columns.len()];
        Self { name: name.to_owned(), columns, keys, words, span }
    }

    /// A table of numbers: blocks of columns, each with its rows one after the other.
    pub fn of_blocks(name: &str, keys: Vec<u64>, span: u64, blocks: &[(Vec<String>, Vec<f64>)]) -> Self {
        let columns = blocks.iter().flat_map(|(names, _)| names.iter().cloned()).collect();
        let mut table = Self::keyed(name, columns, keys, span);
        for (row, words) in table.rows_mut().enumerate() {
            let of_row = |(names, values): &'_ (Vec<String>, Vec<f64>)| -> Vec<u64> {
                let values = values.iter().skip(row * names.len()).take(names.len());
                values.map(|value| value.to_bits()).collect()
            };
            words.iter_mut().zip(blocks.iter().flat_map(of_row)).for_each(|(word, value)| *word = value);
        }
        table
    }

    /// The block with these columns, which follow each other.
    ///
    /// # Errors
    /// The table has no such columns.
    pub fn block(&self, columns: &[String]) -> Result<Vec<f64>> {
        let found = self.columns.windows(columns.len().max(1)).position(|window| window == columns);
        let name = columns.first().map_or("", String::as_str);
        let lacks = || Error::file(format!("a checkpoint without the columns '{name}' of '{}'", self.name));
        let first = found.ok_or_else(lacks)?;
        let of_row = |row: &[u64]| row[first..first + columns.len()].to_vec();
        Ok(self.rows().flat_map(of_row).map(f64::from_bits).collect())
    }

    /// The rows, in the order of the keys.
    pub fn rows(&self) -> impl Iterator<Item = &[u64]> {
        self.words.chunks_exact(self.columns.len().max(1))
    }

    /// The rows, for writing.
    pub fn rows_mut(&mut self) -> impl Iterator<Item = &mut [u64]> {
        self.words.chunks_exact_mut(self.columns.len().max(1))
    }

    /// Positions in `keys`, by ascending key.
    pub(super) fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.keys.len()).collect();
        order.sort_unstable_by_key(|&row| self.keys[row]);
        order
    }

    /// Checks that the number of words fits the numbers of keys and columns.
    pub(super) fn check(&self) -> Result<()> {
        let fits = self.words.len() == self.keys.len() * self.columns.len() && self.span > 0;
        let fault =
            || Error::internal(format!("checkpoint: the table '{}' does not fit its keys", self.name));
        fits.then_some(()).ok_or_else(fault)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of columns come back under their names, and a block that is not there is an error.
    #[test]
    fn blocks_come_back() {
        let names = |names: &[&str]| -> Vec<String> { names.iter().map(|name| (*name).to_owned()).collect() };
        let blocks = [
            (names(&["u_x", "u_y"]), vec![1.0, 2.0, 3.0, f64::INFINITY]),
            (names(&["mark"]), vec![5.0, 6.0]),
        ];
        let table = StoredTable::of_blocks("nodes", vec![7, 3], 4, &blocks);
        assert_eq!(table.columns, names(&["u_x", "u_y", "mark"]));
        assert!(table.check().is_ok());
        for (names, values) in &blocks {
            assert_eq!(table.block(names).unwrap(), *values);
        }
        assert!(table.block(&names(&["v_x"])).unwrap_err().message.contains("columns 'v_x' of 'nodes'"));
    }
}
