//! Values of nodes that other ranks own.

use mpi::traits::CommunicatorCollectives;

use super::owners::Owners;
use super::peers::{Peers, swap_while};
use super::sparse::sparse_all_to_all;
use crate::error::{Error, Result, agree};
use crate::partition::IndexMap;
use crate::petsc::Sends;

/// Communication plan for a list of nodes whose values this rank needs from their owners.
#[derive(Debug, Clone, Default)]
pub struct NodeExchange {
    /// Ranks to which this rank sends values, and the ordered list of owned nodes for each.
    takers: Peers,
    given: Vec<u32>,
    /// Ranks from which this rank receives values, and the position of each received value in the
    /// wanted list.
    owners: Peers,
    places: Vec<u32>,
    leaving: Sends,
    landed: Vec<f64>,
}

/// One of several fields that are sent together.
#[derive(Debug)]
pub struct ExchangedField<'a> {
    /// Values per node.
    pub width: usize,
    /// Values of the owned nodes in local order. More values may follow, for example of ghosts.
    pub owned: &'a [f64],
    /// Values of the wanted nodes in the order of the list.
    pub wanted: &'a mut [f64],
}

/// Communication cost of one exchange on this rank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traffic {
    /// Messages sent, one per neighbour.
    pub messages: usize,
    /// Bytes in them.
    pub bytes: usize,
}

impl NodeExchange {
    /// Sets up the exchange of the `wanted` global nodes, in any order and possibly repeated.
    /// Collective.
    ///
    /// # Errors
    /// A node does not exist. The error is identical on every rank.
    pub fn new(world: &impl CommunicatorCollectives, index: &IndexMap, wanted: &[i32]) -> Result<Self> {
        let table = Owners::gather(world, index);
        let found: Option<Vec<_>> = wanted.iter().map(|&global| table.find(global)).collect();
        let found = found.ok_or_else(|| Error::internal("exchange: a requested node does not exist"));
        let found = agree(world, found)?;
        let mut places: Vec<u32> = (0..wanted.len() as u32).collect();
        places.sort_by_key(|&place| found[place as usize]);
        let sorted: Vec<(i32, u32)> = places.iter().map(|&place| found[place as usize]).collect();
        let requests: Vec<(i32, Vec<u32>)> = sorted
            .chunk_by(|a, b| a.0 == b.0)
            .map(|same| (same[0].0, same.iter().map(|(_, node)| *node).collect()))
            .collect();
        let asked = sparse_all_to_all(world, &requests);
        Ok(Self {
            takers: Peers::new(asked.iter().map(|(rank, nodes)| (*rank, nodes.len()))),
            given: asked.into_iter().flat_map(|(_, nodes)| nodes).collect(),
            owners: Peers::new(requests.iter().map(|(rank, nodes)| (*rank, nodes.len()))),
            places,
            leaving: Sends::default(),
            landed: Vec::new(),
        })
    }

    /// Fills `wanted`, `width` values per node in the order of the list, from the owners' values.
    /// Collective.
    ///
    /// `owned` contains the owned nodes in local order. More values may follow, for example of
    /// ghosts.
    pub fn forward(
        &mut self,
        world: &impl CommunicatorCollectives,
        width: usize,
        owned: &[f64],
        wanted: &mut [f64],
    ) {
        self.forward_many(world, &mut [ExchangedField { width, owned, wanted }]);
    }

    /// Performs [`forward`](Self::forward) for several fields with one message per neighbour.
    /// Collective.
    pub fn forward_many(&mut self, world: &impl CommunicatorCollectives, fields: &mut [ExchangedField<'_>]) {
        let width: usize = fields.iter().map(|field| field.width).sum();
        let room = self.leaving.room();
        for &node in &self.given {
            for field in fields.iter() {
                room.extend_from_slice(&field.owned[node as usize * field.width..][..field.width]);
            }
        }
        self.travel(world, width);
        for (&place, slot) in self.places.iter().zip(self.landed.chunks_exact(width.max(1))) {
            let mut at = 0;
            for field in fields.iter_mut() {
                let to = place as usize * field.width;
                field.wanted[to..to + field.width].copy_from_slice(&slot[at..at + field.width]);
                at += field.width;
            }
        }
    }

    /// Fills `wanted` with the values that `give` writes for each owned node, `width` values per
    /// node. Collective.
    pub fn forward_from(
        &mut self,
        world: &impl CommunicatorCollectives,
        width: usize,
        mut give: impl FnMut(u32, &mut [f64]),
        wanted: &mut [f64],
    ) {
        let room = self.leaving.room();
        for &node in &self.given {
            let start = room.len();
            room.resize(start + width, 0.0);
            give(node, &mut room[start..]);
        }
        self.travel(world, width);
        for (&place, slot) in self.places.iter().zip(self.landed.chunks_exact(width.max(1))) {
            wanted[place as usize * width..][..width].copy_from_slice(slot);
        }
    }

    /// Sends the outgoing values from the owners to the ranks that need them.
    fn travel(&mut self, world: &impl CommunicatorCollectives, width: usize) {
        self.landed.resize(self.places.len() * width, 0.0);
        let lists = self.takers.ranges(width);
        swap_while(world, &mut self.leaving, lists, &self.owners, &mut self.landed, width, || ());
    }

    /// Adds `wanted`, `width` values per node in the order of the list, to the owners' values.
    /// Collective.
    ///
    /// The owner adds in ascending order of the sending ranks, so that the sum is reproducible.
    pub fn reverse_add(
        &mut self,
        world: &impl CommunicatorCollectives,
        width: usize,
        wanted: &[f64],
        owned: &mut [f64],
    ) {
        self.reverse_add_while(world, width, wanted, owned, || ());
    }

    /// Performs [`reverse_add`](Self::reverse_add), and runs `work` while the values are in
    /// transit. Collective.
    pub fn reverse_add_while<R>(
        &mut self,
        world: &impl CommunicatorCollectives,
        width: usize,
        wanted: &[f64],
        owned: &mut [f64],
        work: impl FnOnce() -> R,
    ) -> R {
        let room = self.leaving.room();
        for &place in &self.places {
            room.extend_from_slice(&wanted[place as usize * width..][..width]);
        }
        self.landed.resize(self.given.len() * width, 0.0);
        let lists = self.owners.ranges(width);
        let (_, done) =
            swap_while(world, &mut self.leaving, lists, &self.takers, &mut self.landed, width, work);
        for (&node, slot) in self.given.iter().zip(self.landed.chunks_exact(width.max(1))) {
            let row = &mut owned[node as usize * width..][..width];
            row.iter_mut().zip(slot).for_each(|(sum, value)| *sum += value);
        }
        done
    }

    /// Messages that this rank sends in a [`forward`](Self::forward) of `width` values per node.
    pub fn traffic(&self, width: usize) -> Traffic {
        Traffic { messages: self.takers.count(), bytes: self.takers.items() * width * size_of::<f64>() }
    }

    /// Messages that this rank sends in a [`reverse_add`](Self::reverse_add) of `width` values per
    /// node.
    pub fn reverse_traffic(&self, width: usize) -> Traffic {
        Traffic { messages: self.owners.count(), bytes: self.owners.items() * width * size_of::<f64>() }
    }

    /// Owned nodes that other ranks need, by ascending receiving rank.
    pub fn given(&self) -> &[u32] {
        &self.given
    }
}
