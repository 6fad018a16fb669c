//! Sends lists to some ranks without prior knowledge of the senders.

use crate::collective::Collective;
use mpi::datatype::Equivalence;
use mpi::traits::CommunicatorCollectives;

use super::peers::{Cargo, Peers, swap};

/// Sends each list to its rank and returns the received lists, by ascending source. Collective; for
/// setup.
///
/// Lists to the same rank arrive as one, in their order. Lists to the sending rank itself arrive as
/// well; empty lists do not. The cost is one integer for each pair of ranks, and a message for each
/// list.
pub fn sparse_all_to_all<T: Equivalence + Clone + Default>(
    world: &impl CommunicatorCollectives,
    lists: &[(i32, Vec<T>)],
) -> Vec<(i32, Vec<T>)> {
    let mut sorted: Vec<&(i32, Vec<T>)> = lists.iter().collect();
    sorted.sort_by_key(|(rank, _)| *rank);
    let mut counts = vec![0_i32; world.size() as usize];
    sorted.iter().for_each(|(rank, list)| counts[*rank as usize] += list.len() as i32);
    let mut arriving = vec![0_i32; counts.len()];
    world.exchange_all(&counts[..], &mut arriving[..]);

    let peers = |counts: &[i32]| Peers::new((0..).zip(counts.iter().map(|&count| count as usize)));
    let (to, from) = (peers(&counts), peers(&arriving));
    let sent: Vec<T> = sorted.iter().flat_map(|(_, list)| list).cloned().collect();
    let mut received = vec![T::default(); from.items()];
    swap(world, 1, Cargo { peers: &to, items: &sent }, Cargo { peers: &from, items: &mut received });
    from.parts(&received, 1).map(|(rank, part)| (rank, part.to_vec())).collect()
}
