//! Values of nodes that other ranks own.

use mpi::traits::CommunicatorCollectives;

use super::owners::Owners;
use super::peers::{Peers, swap_while};
use super::sparse::sparse_all_to_all;
use crate::error::{Error, Result, agree};
use crate::partition::IndexMap;
use crate::petsc::Sends;

/// A list of nodes that this rank wants values of, agreed with their owners.
#[derive(Debug, Clone, Default)]
pub struct NodeExchange {
    /// Whom this rank gives values to, and which owned nodes in which order.
    takers: Peers,
    given: Vec<u32>,
    /// Whom this rank gets values from, and the place in the wanted list of each that comes.
    owners: Peers,
    places: Vec<u32>,
    leaving: Sends,
    landed: Vec<f64>,
}

/// One of several fields that travel together.
#[derive(Debug)]
pub struct Field<'a> {
    /// Values a node.
    pub width: usize,
    /// Values of the owned nodes in local order; may go on, such as with ghosts.
    pub owned: &'a [f64],
    /// Values of the wanted nodes in the order of the list.
    pub wanted: &'a mut [f64],
}

/// What one exchange costs this rank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traffic {
    /// Messages sent, one a neighbour.
    pub messages: usize,
    /// Bytes in them.
    pub bytes: usize,
}

impl NodeExchange {
    /// Agrees on the list of `wanted` global nodes, in any order, in which a node may stand more than once. Collective.
    ///
    /// # Errors
    /// The same on every rank, when a node does not exist.
    pub fn new(world: &impl CommunicatorCollectives, index: &IndexMap, wanted: &[i32]) -> Result<Self> {
        let table = Owners::gather(world, index);
        let found: Option<Vec<_>> = wanted.iter().map(|&global| table.find(global)).collect();
        let found = found.ok_or_else(|| Error::internal("exchange: a node that does not exist is wanted"));
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

    /// Fills `wanted`, `width` values a node in the order of the list, from the owners' values. Collective.
    ///
    /// `owned` has the owned nodes in local order and may go on, such as with ghosts.
    pub fn forward(
        &mut self,
        world: &impl CommunicatorCollectives,
        width: usize,
        owned: &[f64],
        wanted: &mut [f64],
    ) {
        self.forward_many(world, &mut [Field { width, owned, wanted }]);
    }

    /// The same for several fields in one message a neighbour. Collective.
    pub fn forward_many(&mut self, world: &impl CommunicatorCollectives, fields: &mut [Field<'_>]) {
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

    /// Fills `wanted` with what `give` writes of each owned node, `width` values a node. Collective.
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

    /// Brings what is leaving from the owners to those that want it.
    fn travel(&mut self, world: &impl CommunicatorCollectives, width: usize) {
        self.landed.resize(self.places.len() * width, 0.0);
        let lists = self.takers.ranges(width);
        swap_while(world, &mut self.leaving, lists, &self.owners, &mut self.landed, width, || ());
    }

    /// Adds `wanted`, `width` values a node in the order of the list, to the owners' values. Collective.
    ///
    /// The owner adds by ascending rank of those that send, so that the sum is the same each time.
    pub fn reverse_add(
        &mut self,
        world: &impl CommunicatorCollectives,
        width: usize,
        wanted: &[f64],
        owned: &mut [f64],
    ) {
        self.reverse_add_while(world, width, wanted, owned, || ());
    }

    /// The same, and does `work` while the values are on their way. Collective.
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

    /// What a [`forward`](Self::forward) of `width` values a node makes this rank send.
    pub fn traffic(&self, width: usize) -> Traffic {
        Traffic { messages: self.takers.count(), bytes: self.takers.items() * width * size_of::<f64>() }
    }

    /// What a [`reverse_add`](Self::reverse_add) of `width` values a node makes this rank send.
    pub fn reverse_traffic(&self, width: usize) -> Traffic {
        Traffic { messages: self.owners.count(), bytes: self.owners.items() * width * size_of::<f64>() }
    }

    /// Owned nodes that others want, by ascending taker.
    pub fn given(&self) -> &[u32] {
        &self.given
    }
}
