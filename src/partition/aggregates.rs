//! Groups of neighbouring vertices of a graph.

use super::graph::Graph;
use super::metis;
use crate::error::Result;

/// Assigns the vertices of a graph to groups of about `size`, each within one connected component.
/// The group is `None` for a vertex in a component of fewer than `least`. Also returns the number of
/// groups. The edges weigh the same.
///
/// # Errors
/// METIS fails, which happens for lack of memory.
pub fn aggregates(
    offsets: &[i32],
    neighbours: &[i32],
    size: usize,
    least: usize,
) -> Result<(Vec<Option<u32>>, usize)> {
    let count = offsets.len().saturating_sub(1);
    let row = |vertex: usize| &neighbours[offsets[vertex] as usize..offsets[vertex + 1] as usize];
    let mut groups = vec![None; count];
    let mut total = 0;
    let mut seen = vec![false; count];
    let mut place = vec![0; count];
    for seed in 0..count {
        if std::mem::replace(&mut seen[seed], true) {
            continue;
        }
        let mut component = vec![seed];
        let mut at = 0;
        while at < component.len() {
            for &next in row(component[at]) {
                if !std::mem::replace(&mut seen[next as usize], true) {
                    component.push(next as usize);
                }
            }
            at += 1;
        }
        if component.len() < least {
            continue;
        }
        component.sort_unstable();
        (0..).zip(&component).for_each(|(at, &vertex)| place[vertex] = at);
        let mut part =
            Graph { offsets: vec![0], neighbours: vec![], edge_weights: vec![], vertex_weights: None };
        for &vertex in &component {
            part.neighbours.extend(row(vertex).iter().map(|&next| place[next as usize]));
            part.offsets.push(part.neighbours.len() as i32);
        }
        part.edge_weights = vec![1; part.neighbours.len()];
        let parts = component.len().div_ceil(size);
        // METIS may leave parts empty.
        let mut numbers = vec![None; parts];
        for (&vertex, part) in component.iter().zip(metis::partition(&part, parts)?) {
            groups[vertex] = Some(*numbers[part as usize].get_or_insert_with(|| {
                total += 1;
                total as u32 - 1
            }));
        }
    }
    Ok((groups, total))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two paths and a single vertex: groups of about the size, none over both paths.
    #[test]
    fn groups_stay_within_components() {
        let lengths = [40, 25, 1];
        let mut offsets = vec![0];
        let mut neighbours = vec![];
        let mut first = 0;
        for length in lengths {
            for vertex in first..first + length {
                let range = first..first + length;
                neighbours.extend([vertex - 1, vertex + 1].into_iter().filter(|next| range.contains(next)));
                offsets.push(neighbours.len() as i32);
            }
            first += length;
        }
        let (groups, total) = aggregates(&offsets, &neighbours, 10, 2).unwrap();
        assert_eq!(total, 7);
        assert_eq!(groups[65], None);
        for group in 0..total as u32 {
            let members: Vec<usize> = (0..66).filter(|&vertex| groups[vertex] == Some(group)).collect();
            assert!((5..=15).contains(&members.len()), "{members:?}");
            assert!(members.iter().all(|&vertex| vertex < 40) || members.iter().all(|&vertex| vertex >= 40));
        }
        assert_eq!(aggregates(&[0], &[], 10, 2).unwrap(), (vec![], 0));
    }
}
