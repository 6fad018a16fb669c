//! Nodes that each vertex couples, and where their blocks go.
//!
//! Rows of the rank's own nodes go to the matrix. Rows of other nodes are *remote*: collected in an agreed order and
//! sent to the ranks that own them.

use super::numbering::Numbering;
use crate::partition::exchange::ForeignRows;
use crate::petsc::{BlockPattern, NO_SLOT};

/// Marks a place among the remote blocks.
const REMOTE: u32 = 1 << 31;

/// Couples of facets of one contact, by contactor facet.
#[derive(Debug, Clone, Default)]
pub struct Couples {
    /// Couples `first[f]..first[f + 1]` belong to contactor facet `f`.
    first: Vec<u32>,
    /// Target facet of each couple.
    targets: Vec<u32>,
    /// Nodes of each couple, contactor's before target's, at `start[c]..start[c + 1]`.
    start: Vec<u32>,
    nodes: Vec<u32>,
    /// Where the block of each node pair goes, row-major; those of couple `c` begin at `places_at[c]`.
    places: Vec<u32>,
    places_at: Vec<u32>,
}

/// Where a block goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// To a slot of the rank's own rows.
    Slot(u32),
    /// To a block of the remote rows.
    Remote(u32),
}

impl Couples {
    /// The couples of a contact with `facets` contactor facets; `nodes` lists the nodes of a couple.
    pub fn new(facets: usize, couples: &[(u32, u32)], nodes: impl Fn(u32, u32, &mut Vec<u32>)) -> Self {
        let mut sorted = couples.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        let mut all = Self { first: vec![0; facets + 1], start: vec![0], ..Self::default() };
        for (contactor, target) in sorted {
            all.first[contactor as usize + 1] += 1;
            all.targets.push(target);
            nodes(contactor, target, &mut all.nodes);
            all.start.push(all.nodes.len() as u32);
        }
        for facet in 0..facets {
            all.first[facet + 1] += all.first[facet];
        }
        all
    }

    /// Nodes of every couple in turn.
    pub fn node_lists(&self) -> impl Iterator<Item = &[u32]> {
        self.start.windows(2).map(|ends| &self.nodes[ends[0] as usize..ends[1] as usize])
    }

    /// Nodes of a couple.
    pub fn nodes_of(&self, couple: usize) -> &[u32] {
        &self.nodes[self.start[couple] as usize..self.start[couple + 1] as usize]
    }

    /// The couple of a contactor and a target facet.
    pub fn find(&self, contactor: usize, target: u32) -> Option<usize> {
        let range = self.first[contactor] as usize..self.first[contactor + 1] as usize;
        let found = self.targets[range.clone()].binary_search(&target).ok()?;
        Some(range.start + found)
    }

    /// Looks up the places of all blocks in a pattern that holds them.
    pub fn locate(&mut self, numbering: &Numbering, pattern: &BlockPattern, remote: &ForeignRows) {
        let mut places = Vec::new();
        let mut places_at = Vec::with_capacity(self.targets.len() + 1);
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

    /// Where the block of nodes `a`, `b` of a couple goes; `width` is the couple's number of nodes.
    pub fn place(&self, couple: usize, pair: usize) -> Option<Place> {
        match self.places[self.places_at[couple] as usize + pair] {
            NO_SLOT => None,
            remote if remote & REMOTE != 0 => Some(Place::Remote(remote & !REMOTE)),
            slot => Some(Place::Slot(slot)),
        }
    }
}

/// Blocks that couples need: in the rank's own rows as (local row, global column), sorted, and in rows of others.
pub fn blocks_of<'a>(
    couples: impl Iterator<Item = &'a Couples>,
    numbering: &Numbering,
) -> (Vec<(u32, i32)>, ForeignRows) {
    let (mut own, mut others) = (Vec::new(), Vec::new());
    for nodes in couples.flat_map(Couples::node_lists) {
        for &row in nodes {
            let columns = nodes.iter().map(|&column| numbering.global(column));
            match numbering.is_owned(row) {
                true => own.extend(columns.map(|column| (row, column))),
                false => others.extend(columns.map(|column| (numbering.global(row), column))),
            }
        }
    }
    own.sort_unstable();
    own.dedup();
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

    /// Own rows go to slots of the widened pattern, rows of ghosts and foreign nodes to remote blocks, all of them.
    #[test]
    fn every_block_has_a_place() {
        let index = IndexMap { first: 4, owned: 2, ghosts: vec![1], total: 20 };
        let foreign = [9, 12];
        let numbering = Numbering { index: &index, foreign: &foreign };
        let nodes = |contactor: u32, target: u32, into: &mut Vec<u32>| {
            into.extend([contactor, contactor + 1]);
            into.push(target + 2);
        };
        let mut couples = Couples::new(2, &[(1, 2), (0, 1), (1, 1), (1, 2)], nodes);
        assert_eq!((couples.find(1, 2), couples.find(0, 2)), (Some(2), None));
        let (own, remote) = blocks_of(std::iter::once(&couples), &numbering);
        let wide = pattern().widened(own.iter().copied());
        couples.locate(&numbering, &wide, &remote);
        assert_eq!(remote.iter().map(|(row, _)| row).collect::<Vec<_>>(), [1, 9, 12]);
        for (couple, nodes) in couples.node_lists().enumerate() {
            for (a, &row) in nodes.iter().enumerate() {
                for (b, &column) in nodes.iter().enumerate() {
                    let column = numbering.global(column);
                    match couples.place(couple, a * nodes.len() + b) {
                        Some(Place::Slot(slot)) => {
                            assert!(
                                numbering.is_owned(row) && wide.row(row as usize).contains(&(slot as usize))
                            );
                            assert_eq!(wide.columns[slot as usize], column);
                        }
                        Some(Place::Remote(block)) => {
                            assert_eq!(remote.slot(numbering.global(row), column), Some(block));
                        }
                        None => panic!("a block without a place"),
                    }
                }
            }
        }
    }
}
