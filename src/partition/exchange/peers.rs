//! The ranks on one end of an exchange, and the only place where messages are sent.

use std::ops::Range;

use mpi::datatype::Equivalence;
use mpi::request::{Request, scope};
use mpi::traits::{CommunicatorCollectives, Destination, Source};

use crate::petsc::Sends;

/// Ranks, ascending, with the number of items sent to or received from each.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Peers {
    ranks: Vec<i32>,
    offsets: Vec<usize>,
}

impl Peers {
    /// Peers with their counts, ascending. Ranks without items are omitted.
    pub fn new(counts: impl IntoIterator<Item = (i32, usize)>) -> Self {
        let mut peers = Self { ranks: Vec::new(), offsets: vec![0] };
        let mut end = 0;
        for (rank, count) in counts.into_iter().filter(|(_, count)| *count > 0) {
            end += count;
            peers.ranks.push(rank);
            peers.offsets.push(end);
        }
        peers
    }

    /// Number of peers.
    pub fn count(&self) -> usize {
        self.ranks.len()
    }

    /// Number of items of all peers.
    pub fn items(&self) -> usize {
        self.offsets.last().copied().unwrap_or(0)
    }

    /// Each peer with its part of `all`, which has `width` entries per item.
    pub fn parts<'a, T>(&'a self, all: &'a [T], width: usize) -> impl Iterator<Item = (i32, &'a [T])> {
        self.ranges(width).map(|(rank, range)| (rank, &all[range]))
    }

    /// Each peer with the range of its entries; an item has `width` entries.
    pub fn ranges(&self, width: usize) -> impl Iterator<Item = (i32, Range<usize>)> {
        let ranges = self.offsets.windows(2).map(move |ends| ends[0] * width..ends[1] * width);
        self.ranks.iter().copied().zip(ranges)
    }

    /// Each peer with its mutable part.
    fn parts_mut<'a, T>(&self, mut all: &'a mut [T], width: usize) -> Vec<(i32, &'a mut [T])> {
        let mut parts = Vec::with_capacity(self.count());
        for (&rank, ends) in self.ranks.iter().zip(self.offsets.windows(2)) {
            let (part, rest) = std::mem::take(&mut all).split_at_mut((ends[1] - ends[0]) * width);
            parts.push((rank, part));
            all = rest;
        }
        parts
    }
}

/// One direction of an exchange: peers and a buffer with their consecutive items.
pub(super) struct Cargo<'a, B> {
    /// The ranks at the other end.
    pub peers: &'a Peers,
    /// Items of all peers, `width` entries each.
    pub items: B,
}

/// Sends and receives one message per peer and waits for all of them. `width` is the number of
/// entries per item. Both ends know all lengths.
pub(super) fn swap<T: Equivalence>(
    world: &impl CommunicatorCollectives,
    width: usize,
    out: Cargo<'_, &[T]>,
    into: Cargo<'_, &mut [T]>,
) {
    if width == 0 {
        return;
    }
    scope(|scope| {
        // Post receives first: an expected message needs no copy.
        let arriving: Vec<Request<'_, [T], _>> = into
            .peers
            .parts_mut(into.items, width)
            .into_iter()
            .map(|(rank, part)| world.process_at_rank(rank).immediate_receive_into(scope, part))
            .collect();
        let leaving: Vec<Request<'_, [T], _>> = out
            .peers
            .parts(out.items, width)
            .map(|(rank, part)| world.process_at_rank(rank).immediate_send(scope, part))
            .collect();
        arriving.into_iter().chain(leaving).for_each(Request::wait_without_status);
    });
}

/// Sends the `lists` of the buffer `out`, each to its rank, and receives into `items` of the peers
/// `from`, with room for `width` entries per item. Runs `work` while the messages are in transit;
/// `work` must not wait for another rank. Returns the number of entries received from each peer,
/// and the result of `work`.
pub(super) fn swap_while<R>(
    world: &impl CommunicatorCollectives,
    out: &mut Sends,
    lists: impl Iterator<Item = (i32, Range<usize>)>,
    from: &Peers,
    items: &mut [f64],
    width: usize,
    work: impl FnOnce() -> R,
) -> (Vec<usize>, R) {
    scope(|scope| {
        let parts = from.parts_mut(items, width).into_iter();
        let arriving: Vec<Request<'_, [f64], _>> = parts
            .map(|(rank, part)| world.process_at_rank(rank).immediate_receive_into(scope, part))
            .collect();
        out.post(world, lists);
        let done = work();
        let mut counts = Vec::with_capacity(arriving.len());
        for request in arriving {
            counts.push(request.wait().count(f64::equivalent_datatype()) as usize);
        }
        (counts, done)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each peer has its part; ranks without items have no part.
    #[test]
    fn parts_follow_each_other() {
        let peers = Peers::new([(0, 2), (3, 0), (4, 1)]);
        let mut all = [1, 2, 3, 4, 5, 6];
        let parts: Vec<(i32, &[i32])> = peers.parts(&all, 2).collect();
        assert_eq!(parts, [(0, &[1, 2, 3, 4][..]), (4, &[5, 6])]);
        let written = peers.parts_mut(&mut all, 2);
        assert_eq!(
            written.iter().map(|(rank, part)| (*rank, part.len())).collect::<Vec<_>>(),
            [(0, 4), (4, 2)]
        );
        assert_eq!((peers.count(), peers.items()), (2, 3));
        assert_eq!(Peers::default().items(), 0);
        assert_eq!(Peers::default().parts(&all, 1).count(), 0);
    }
}
