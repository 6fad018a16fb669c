//! Nodes that each vertex couples, and the destinations of their blocks.
//!
//! Rows of the rank's own nodes go to the matrix. Rows of other nodes are *remote*: they are
//! collected in an agreed order and sent to the ranks that own them.

use super::numbering::Numbering;
use crate::partition::exchange::ForeignRows;
use crate::petsc::{BlockPattern, NO_SLOT};

/// Marks a position among the remote blocks.
const REMOTE: u32 = 1 << 31;

/// The nodes that each vertex of a contact couples.
#[derive(Debug, Clone)]
pub struct Couplings {
    /// The nodes of vertex `p` are at `start[p]..start[p + 1]`.
    start: Vec<u32>,
    nodes: Vec<u32>,
    /// Destination of the block of each pair of nodes, row-major. Those of vertex `p` begin at
    /// `places_at[p]`.
    places: Vec<u32>,
    places_at: Vec<u32>,
}

impl Default for Couplings {
    /// Creates couplings without vertices.
    fn default() -> Self {
        Self::new(0, |_, _| ())
    }
}

/// Destination of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CouplingSlots {
    /// A slot of the rank's own rows.
    Slot(u32),
    /// A block of the remote rows.
    Remote(u32),
}

impl Couplings {
    /// Creates the couplings of `vertices` vertices. `nodes` appends the nodes of one vertex, or no
    /// nodes if no target is near.
    pub fn new(vertices: usize, mut nodes: impl FnMut(usize, &mut Vec<u32>)) -> Self {
        let mut all =
            Self { start: vec![0], nodes: Vec::new(), places: Vec::new(), places_at: vec![0; vertices] };
        for vertex in 0..vertices {
            nodes(vertex, &mut all.nodes);
            all.start.push(all.nodes.len() as u32);
        }
        all
    }

    /// Lists the nodes of each vertex in turn.
    pub fn node_lists(&self) -> impl Iterator<Item = &[u32]> {
        self.start.windows(2).map(|ends| &self.nodes[ends[0] as usize..ends[1] as usize])
    }

    /// Nodes that a vertex couples.
    pub fn nodes_of(&self, vertex: usize) -> &[u32] {
        &self.nodes[self.start[vertex] as usize..self.start[vertex + 1] as usize]
    }

    /// Finds the positions of all blocks in a pattern that contains them.
    pub fn locate(&mut self, numbering: &Numbering, pattern: &BlockPattern, remote: &ForeignRows) {
        let mut places = Vec::new();
        let mut places_at = Vec::with_capacity(self.places_at.len());
        for nodes in self.node_lists() {
            places_at.push(places.len() as u32);
            for &row in nodes {
                let columns = nodes.iter().map(|&column| numbering.global(column));
                match numbering.is_owned(row) {
                    true => {
                        places.extend(columns.map(|c| pattern.slot(row as usize, c).unwrap_or(NO_SLOT)));
                    }
                    false => {
                        let global = numbering.global(row);
                        places
                            .extend(columns.map(|c| remote.slot(global, c).map_or(NO_SLOT, |b| REMOTE | b)));
                    }
                }
            }
        }
        (self.places, self.places_at) = (places, places_at);
    }

    /// Destination of block number `pair` of a vertex, whose nodes are rows and columns. `None` if
    /// no matrix contains it.
    pub fn place(&self, vertex: usize, pair: usize) -> Option<CouplingSlots> {
        match self.places[self.places_at[vertex] as usize + pair] {
            NO_SLOT => None,
            remote if remote & REMOTE != 0 => Some(CouplingSlots::Remote(remote & !REMOTE)),
            slot => Some(CouplingSlots::Slot(slot)),
        }
    }
}

/// Blocks that couplings need: in the rank's own rows as (local row, global column), sorted, and in
/// rows of other ranks.
pub fn blocks_of<'a>(
    couplings: impl Iterator<Item = &'a Couplings>,
    numbering: &Numbering,
) -> (Vec<(u32, i32)>, ForeignRows) {
    let lists: Vec<&[u32]> = couplings.flat_map(Couplings::node_lists).collect();
    // Rows in ascending order, each with the lists that contain it.
    let mut rows: Vec<(u32, u32)> = Vec::new();
    for (list, nodes) in (0..).zip(&lists) {
        rows.extend(nodes.iter().map(|&row| (row, list)));
    }
    rows.sort_unstable();
    let (mut own, mut others) = (Vec::new(), Vec::new());
    let mut nodes = Vec::new();
    let mut columns = Vec::new();
    for same in rows.chunk_by(|a, b| a.0 == b.0) {
        let row = same[0].0;
        nodes.clear();
        same.iter().for_each(|&(_, list)| nodes.extend_from_slice(lists[list as usize]));
        nodes.sort_unstable();
        nodes.dedup();
        columns.clear();
        columns.extend(nodes.iter().map(|&column| numbering.global(column)));
        columns.sort_unstable();
        match numbering.is_owned(row) {
            true => own.extend(columns.iter().map(|&column| (row, column))),
            false => others.extend(columns.iter().map(|&column| (numbering.global(row), column))),
        }
    }
    (own, ForeignRows::collect(others))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::IndexMap;

    fn pattern() -> BlockPattern {
        BlockPattern {
            block_size: 2,
            first_row: 4,
            row_offsets: vec![0, 2, 4],
            columns: vec![4, 5, 4, 5],
            places: vec![0, 1],
        }
    }

    /// The blocks are all pairs of nodes of every list, each once, in own rows and in those of ghosts
    /// and foreign nodes.
    #[test]
    fn blocks_are_all_pairs_of_nodes() {
        let index = IndexMap { first: 4, owned: 3, ghosts: vec![9, 1], total: 20 };
        let numbering = Numbering { index: &index, foreign: &[2, 12] };
        let lists: [&[u32]; 4] = [&[0, 2, 3, 6], &[1, 2, 4, 5], &[], &[0, 3, 4, 6]];
        // The lists belong to two contacts.
        let contacts = [&lists[..2], &lists[2..]]
            .map(|lists| Couplings::new(lists.len(), |vertex, into| into.extend_from_slice(lists[vertex])));
        let mut own = std::collections::BTreeSet::new();
        let mut others = std::collections::BTreeSet::new();
        for (row, column) in
            lists.iter().flat_map(|&list| list.iter().flat_map(|&a| list.iter().map(move |&b| (a, b))))
        {
            match numbering.is_owned(row) {
                true => own.insert((row, numbering.global(column))),
                false => others.insert((numbering.global(row), numbering.global(column))),
            };
        }
        let (found, remote) = blocks_of(contacts.iter(), &numbering);
        assert!(found.into_iter().eq(own));
        let remote =
            remote.iter().flat_map(|(row, columns)| columns.iter().map(move |&column| (row, column)));
        assert!(remote.eq(others));
    }

    /// Own rows go to slots of the widened pattern. All rows of ghosts and foreign nodes go to
    /// remote blocks.
    #[test]
    fn every_block_has_a_place() {
        let index = IndexMap { first: 4, owned: 2, ghosts: vec![1], total: 20 };
        let foreign = [9, 12];
        let numbering = Numbering { index: &index, foreign: &foreign };
        let mut couplings = Couplings::new(3, |vertex, into| {
            if vertex != 1 {
                into.extend([vertex as u32 / 2, vertex as u32 / 2 + 1, vertex as u32 / 2 + 3]);
            }
        });
        assert!(couplings.nodes_of(1).is_empty());
        let (own, remote) = blocks_of(std::iter::once(&couplings), &numbering);
        let wide = pattern().widened(own.iter().copied());
        couplings.locate(&numbering, &wide, &remote);
        assert_eq!(remote.iter().map(|(row, _)| row).collect::<Vec<_>>(), [1, 9, 12]);
        for (vertex, nodes) in couplings.node_lists().enumerate() {
            for (a, &row) in nodes.iter().enumerate() {
                for (b, &column) in nodes.iter().enumerate() {
                    let column = numbering.global(column);
                    match couplings.place(vertex, a * nodes.len() + b) {
                        Some(CouplingSlots::Slot(slot)) => {
                            assert!(
                                numbering.is_owned(row) && wide.row(row as usize).contains(&(slot as usize))
                            );
                            assert_eq!(wide.columns[slot as usize], column);
                        }
                        Some(CouplingSlots::Remote(block)) => {
                            assert_eq!(remote.slot(numbering.global(row), column), Some(block));
                        }
                        None => panic!("a block has no slot"),
                    }
                }
            }
        }
    }
}
