//! Ownership of global nodes: every rank knows the first node of all ranks.

use mpi::traits::CommunicatorCollectives;

use crate::collective::Collective;
use crate::partition::IndexMap;

/// First global node of each rank, followed by the total number of nodes.
pub(super) struct Owners {
    firsts: Vec<i32>,
}

impl Owners {
    /// Gathers the first nodes of all ranks. Collective.
    pub fn gather(world: &impl CommunicatorCollectives, index: &IndexMap) -> Self {
        let mut firsts = vec![0; world.size() as usize];
        world.gather_all(&[index.first], &mut firsts[..]);
        firsts.push(index.total);
        Self { firsts }
    }

    /// The owner of a global node, and its local number there; `None` if there is no such node.
    pub fn find(&self, global: i32) -> Option<(i32, u32)> {
        // The last of the ranks that begin there: those before it own no nodes.
        let rank = self.firsts.partition_point(|&first| first <= global).checked_sub(1)?;
        let known = rank + 1 < self.firsts.len();
        known.then(|| (rank as i32, (global - self.firsts[rank]) as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranks without nodes own nothing, at any position.
    #[test]
    fn empty_ranks_own_nothing() {
        let owners = Owners { firsts: vec![0, 0, 3, 3, 3, 7, 7] };
        let found: Vec<_> = (-1..8).map(|global| owners.find(global)).collect();
        let first = (0..3).map(|k| Some((1, k)));
        let second = (0..4).map(|k| Some((4, k)));
        let expected: Vec<_> = [None].into_iter().chain(first).chain(second).chain([None]).collect();
        assert_eq!(found, expected);
        let nobody = Owners { firsts: vec![0, 0, 0] };
        assert_eq!(nobody.find(0), None);
    }
}
