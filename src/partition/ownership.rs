//! Node ownership: a node belongs to a part that touches it, chosen so that all parts own about
//! equally many nodes.

use std::collections::BTreeMap;

use super::lists::Lists;

/// Number of times that the borders are shared out. Each sweep uses the shares of the other borders
/// from the previous sweep.
const SWEEPS: usize = 4;

/// The owner of each node, from the elements `touching` it and the `part` of each element (all
/// below `parts`).
///
/// Nodes inside a part belong to it. Nodes on the border of the same parts are shared out in runs,
/// in the order of the input, so that the part with fewer nodes gets more of them. A rank assembles
/// all elements around its nodes. If the nodes alternated between the parts, both would assemble
/// the whole border; runs avoid this.
pub(super) fn owners(touching: &Lists<u32>, part: &[u32], parts: usize) -> Vec<u32> {
    let mut owner = vec![0; touching.count()];
    let mut load = vec![0; parts];
    let mut borders: BTreeMap<Vec<u32>, Vec<u32>> = BTreeMap::new();
    let mut around = Vec::new();
    for node in 0..touching.count() as u32 {
        around.clear();
        around.extend(touching.get(node).iter().map(|&element| part[element as usize]));
        around.sort_unstable();
        around.dedup();
        match around[..] {
            [] => {}
            [only] => {
                owner[node as usize] = only;
                load[only as usize] += 1;
            }
            _ => match borders.get_mut(&around) {
                Some(nodes) => nodes.push(node),
                None => drop(borders.insert(around.clone(), vec![node])),
            },
        }
    }
    for (around, nodes, shares) in share_out(&borders, &mut load) {
        let run = around.iter().zip(shares).flat_map(|(&part, share)| std::iter::repeat_n(part, share));
        for (&node, part) in nodes.iter().zip(run) {
            owner[node as usize] = part;
        }
    }
    owner
}

/// Number of nodes of each border that each of its parts gets.
fn share_out<'a>(
    borders: &'a BTreeMap<Vec<u32>, Vec<u32>>,
    load: &mut [usize],
) -> impl Iterator<Item = (&'a [u32], &'a [u32], Vec<usize>)> {
    let mut all: Vec<_> =
        borders.iter().map(|(around, nodes)| (&around[..], &nodes[..], vec![0; around.len()])).collect();
    for _ in 0..SWEEPS {
        for (around, nodes, before) in &mut all {
            around.iter().zip(before.iter()).for_each(|(&part, share)| load[part as usize] -= share);
            *before = shares(around, nodes.len(), load);
        }
    }
    all.into_iter()
}

/// Number of the `count` nodes that each of `parts` gets; each node goes to the part with the
/// fewest. Adds them to the loads.
fn shares(parts: &[u32], count: usize, load: &mut [usize]) -> Vec<usize> {
    let mut shares = vec![0; parts.len()];
    for _ in 0..count {
        let mut least = 0;
        for candidate in 1..parts.len() {
            if load[parts[candidate] as usize] < load[parts[least] as usize] {
                least = candidate;
            }
        }
        load[parts[least] as usize] += 1;
        shares[least] += 1;
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of elements with two nodes each: element `e` touches nodes `e` and `e + 1`.
    fn chain(elements: u32) -> Lists<u32> {
        let pairs = (0..elements).flat_map(|e| [(e, e), (e + 1, e)]);
        Lists::collect(elements as usize + 1, pairs)
    }

    /// A node belongs to a part that touches it, and the part with fewer nodes gets the shared one.
    #[test]
    fn smaller_part_takes_the_border() {
        assert_eq!(owners(&chain(4), &[0, 0, 0, 1], 2), [0, 0, 0, 1, 1]);
        assert_eq!(owners(&chain(4), &[0, 1, 1, 1], 2), [0, 0, 1, 1, 1]);
    }

    /// A long border between equal parts is divided into two runs.
    #[test]
    fn border_is_shared_out_in_runs() {
        // Elements 0 and 1 share all their ten nodes.
        let pairs = (0..10).flat_map(|node| [(node, 0), (node, 1)]);
        let owner = owners(&Lists::collect(10, pairs), &[0, 1], 2);
        assert_eq!(owner, [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
    }
}
