//! Exchange of blocks in matrix rows that other ranks own.

use mpi::traits::CommunicatorCollectives;

use super::nodes::Traffic;
use super::owners::Owners;
use super::peers::{Peers, swap_while};
use super::sparse::sparse_all_to_all;
use crate::error::{Error, Result, agree};
use crate::partition::IndexMap;
use crate::petsc::Sends;

/// Node pairs in rows of other ranks, in compressed form: block `k` has row `rows[i]` and column
/// `columns[k]` with `offsets[i] <= k < offsets[i + 1]`. Rows and the columns of each row are
/// ascending.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ForeignRows {
    rows: Vec<i32>,
    offsets: Vec<u32>,
    columns: Vec<i32>,
}

impl ForeignRows {
    /// Compresses pairs (row, column) of global nodes, which may be unordered and repeated.
    pub fn collect(mut pairs: Vec<(i32, i32)>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        let mut all = Self { rows: Vec::new(), offsets: vec![0], columns: Vec::with_capacity(pairs.len()) };
        for row in pairs.chunk_by(|a, b| a.0 == b.0) {
            all.rows.push(row[0].0);
            all.columns.extend(row.iter().map(|(_, column)| *column));
            all.offsets.push(all.columns.len() as u32);
        }
        all
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.columns.len()
    }

    /// Number of the block of a pair of global nodes; `None` if the pair is not included.
    pub fn slot(&self, row: i32, column: i32) -> Option<u32> {
        let row = self.rows.binary_search(&row).ok()?;
        let from = self.offsets[row];
        let to = self.offsets[row + 1];
        let at = self.columns[from as usize..to as usize].binary_search(&column).ok()?;
        Some(from + at as u32)
    }

    /// Rows with their columns, ascending.
    pub fn iter(&self) -> impl Iterator<Item = (i32, &[i32])> {
        let columns = self.offsets.windows(2).map(|ends| &self.columns[ends[0] as usize..ends[1] as usize]);
        self.rows.iter().copied().zip(columns)
    }
}

/// Communication plan for rows of other ranks to which this rank adds, and own rows to which others
/// add.
#[derive(Debug, Clone, Default)]
pub struct RowExchange {
    /// Ranks to which this rank sends blocks, with their numbers.
    owners: Peers,
    /// Ranks that send blocks, with their numbers.
    senders: Peers,
    /// Received rows as local owned nodes, by sender; columns as global nodes.
    rows: Vec<u32>,
    offsets: Vec<u32>,
    columns: Vec<i32>,
    /// Outgoing and incoming messages, and their received content.
    leaving: Sends,
    landed: Vec<f64>,
    numbers: Vec<u32>,
    arrived: Vec<f64>,
}

/// Received blocks, consecutively, and their numbers among all possible blocks, which are those of
/// [`received`](RowExchange::received). Numbers are ascending and unique for each sender.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrived<'a> {
    /// Number of each block.
    pub numbers: &'a [u32],
    /// Values of the blocks.
    pub blocks: &'a [f64],
}

impl RowExchange {
    /// Announces the blocks to their owners. Collective.
    ///
    /// # Errors
    /// A row does not exist. The error is identical on every rank.
    pub fn new(
        world: &impl CommunicatorCollectives,
        index: &IndexMap,
        foreign: &ForeignRows,
    ) -> Result<Self> {
        let table = Owners::gather(world, index);
        let lists = agree(world, announcements(&table, foreign))?;
        let blocks = |(rank, _, count): &(i32, Vec<u32>, usize)| (*rank, *count);
        let owners = Peers::new(lists.iter().map(blocks));
        let lists: Vec<(i32, Vec<u32>)> = lists.into_iter().map(|(rank, list, _)| (rank, list)).collect();
        let mut exchange = Self { owners, offsets: vec![0], ..Self::default() };
        let mut counts = Vec::new();
        for (rank, list) in sparse_all_to_all(world, &lists) {
            let before = exchange.columns.len();
            exchange.note(&list);
            counts.push((rank, exchange.columns.len() - before));
        }
        exchange.senders = Peers::new(counts);
        Ok(exchange)
    }

    /// Appends the rows of one announcement.
    fn note(&mut self, mut list: &[u32]) {
        while let [row, count, rest @ ..] = list {
            let (columns, after) = rest.split_at((*count as usize).min(rest.len()));
            self.rows.push(*row);
            self.columns.extend(columns.iter().map(|&column| column as i32));
            self.offsets.push(self.columns.len() as u32);
            list = after;
        }
    }

    /// Rows to which others add, as (local owned node, global columns), in the order in which their
    /// blocks arrive: by ascending sender, then row, then column. A row is listed once for each
    /// sender.
    pub fn received(&self) -> impl Iterator<Item = (u32, &[i32])> {
        let columns = self.offsets.windows(2).map(|ends| &self.columns[ends[0] as usize..ends[1] as usize]);
        self.rows.iter().copied().zip(columns)
    }

    /// Number of blocks that arrive.
    pub fn received_blocks(&self) -> usize {
        self.columns.len()
    }

    /// Sends the nonzero blocks of [`ForeignRows`], `size` values each in its order. Returns the
    /// received blocks, to be added in their order. Collective.
    pub fn send_values(
        &mut self,
        world: &impl CommunicatorCollectives,
        size: usize,
        blocks: &[f64],
    ) -> Arrived<'_> {
        self.send_values_while(world, size, blocks, || ()).0
    }

    /// Performs [`send_values`](Self::send_values), and runs `work` while the blocks are in
    /// transit. Collective.
    pub fn send_values_while<R>(
        &mut self,
        world: &impl CommunicatorCollectives,
        size: usize,
        blocks: &[f64],
        work: impl FnOnce() -> R,
    ) -> (Arrived<'_>, R) {
        let Self { leaving, landed, numbers, arrived, .. } = self;
        // A block follows its number. Few pairs are in contact, and short messages arrive quickly.
        let room = leaving.room();
        let mut lists = Vec::with_capacity(self.owners.count());
        for (rank, part) in self.owners.parts(blocks, size) {
            let first = room.len();
            for (number, block) in part.chunks_exact(size).enumerate() {
                if block.iter().any(|value| *value != 0.0) {
                    room.push(number as f64);
                    room.extend_from_slice(block);
                }
            }
            lists.push((rank, first..room.len()));
        }
        landed.resize(self.columns.len() * (size + 1), 0.0);
        let lists = lists.into_iter();
        let (counts, done) =
            swap_while(world, leaving, lists, &self.senders, &mut landed[..], size + 1, work);
        numbers.clear();
        arrived.clear();
        let mut first = 0;
        for ((_, list), count) in self.senders.parts(landed, size + 1).zip(counts) {
            for block in list[..count].chunks_exact(size + 1) {
                numbers.push(first + block[0] as u32);
                arrived.extend_from_slice(&block[1..]);
            }
            first += (list.len() / (size + 1)) as u32;
        }
        (Arrived { numbers, blocks: arrived }, done)
    }

    /// Messages that this rank sends in [`send_values`](Self::send_values) with `size` values per
    /// block if no block is zero.
    pub fn traffic(&self, size: usize) -> Traffic {
        Traffic { messages: self.owners.count(), bytes: self.owners.items() * (size + 1) * size_of::<f64>() }
    }
}

/// For each owner, ascending: its rows, each as local node, number of columns and columns; then the
/// number of blocks.
fn announcements(table: &Owners, foreign: &ForeignRows) -> Result<Vec<(i32, Vec<u32>, usize)>> {
    let mut lists: Vec<(i32, Vec<u32>, usize)> = Vec::new();
    for (row, columns) in foreign.iter() {
        let Some((owner, local)) = table.find(row) else {
            return Err(Error::internal(format!("exchange: row {row} of the matrix does not exist")));
        };
        if lists.last().is_none_or(|last| last.0 != owner) {
            lists.push((owner, Vec::new(), 0));
        }
        if let Some((_, list, blocks)) = lists.last_mut() {
            list.extend([local, columns.len() as u32]);
            list.extend(columns.iter().map(|&column| column as u32));
            *blocks += columns.len();
        }
    }
    Ok(lists)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs are sorted and unique, and each is found again.
    #[test]
    fn pairs_are_compressed() {
        let rows = ForeignRows::collect(vec![(9, 4), (3, 8), (9, 1), (3, 8), (9, 4), (3, 2)]);
        let all: Vec<_> = rows.iter().collect();
        assert_eq!(all, [(3, &[2, 8][..]), (9, &[1, 4])]);
        assert_eq!([(3, 2), (3, 8), (9, 1), (9, 4)].map(|(r, c)| rows.slot(r, c)), [0, 1, 2, 3].map(Some));
        assert_eq!([(3, 1), (4, 2), (9, 8)].map(|(r, c)| rows.slot(r, c)), [None; 3]);
        assert_eq!(rows.blocks(), 4);
        assert_eq!(ForeignRows::collect(vec![]).blocks(), 0);
    }
}
