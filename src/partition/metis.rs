//! METIS: assigns each element to a part.

use std::sync::{Mutex, PoisonError};

use metis::option::{Seed, UFactor};

use super::graph::Graph;
use crate::error::{Error, Result};

/// Fixed seed: the same mesh always gives the same parts.
const SEED: i32 = 20_101;

/// Allowed imbalance in thousandths, so that ties between elements can be kept.
const SLACK: i32 = 30;

/// METIS uses the single random generator of the C library. Calls on several threads would disturb
/// each other's seed.
static TURN: Mutex<()> = Mutex::new(());

/// Up to this number of parts recursive bisection gives better cuts than the k-way scheme.
const RECURSIVE: usize = 8;

/// The part of each vertex of `graph`; all are below `parts` (at least one). Some parts are empty
/// if there are more parts than vertices, and possibly in very small graphs.
///
/// # Errors
/// METIS fails, which happens for lack of memory.
pub fn partition(graph: &Graph, parts: usize) -> Result<Vec<u32>> {
    let vertices = graph.vertices();
    if let Some(part) = graph.parts_without_library(parts) {
        return Ok(part);
    }
    let mut part = vec![0; vertices];
    let constraints = graph.vertex_weights.as_ref().map_or(1, |weights| weights.constraints);
    let task = metis::Graph::new(constraints as i32, parts as i32, &graph.offsets, &graph.neighbours)
        .map_err(|e| Error::internal(format!("METIS rejects the graph of the mesh: {e}")))?
        .set_adjwgt(&graph.edge_weights)
        .set_option(Seed(SEED));
    let task = match &graph.vertex_weights {
        Some(weights) => task.set_vwgt(&weights.loads),
        None => task,
    };
    let tied = graph.edge_weights.iter().any(|&weight| weight > 1);
    let task = if tied { task.set_option(UFactor(SLACK)) } else { task };
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let done = if parts <= RECURSIVE { task.part_recursive(&mut part) } else { task.part_kway(&mut part) };
    drop(turn);
    done.map_err(|e| {
        Error::internal(format!("METIS can not partition {vertices} elements into {parts} parts: {e}"))
    })?;
    Ok(part.into_iter().map(|p| p as u32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::graph::ElementWeights;

    /// A path of `n` vertices.
    fn path(n: i32) -> Graph {
        let mut graph =
            Graph { offsets: vec![0], neighbours: vec![], edge_weights: vec![], vertex_weights: None };
        for v in 0..n {
            graph.neighbours.extend([v - 1, v + 1].into_iter().filter(|w| (0..n).contains(w)));
            graph.offsets.push(graph.neighbours.len() as i32);
        }
        graph.edge_weights = vec![1; graph.neighbours.len()];
        graph
    }

    fn sizes(part: &[u32], parts: usize) -> Vec<usize> {
        (0..parts).map(|p| part.iter().filter(|&&q| q as usize == p).count()).collect()
    }

    /// Any number of parts and vertices: every vertex has a part, and a path is divided evenly.
    #[test]
    fn any_number_of_parts() {
        for n in [0, 1, 2, 3, 5, 8, 40, 200] {
            for parts in [1, 2, 3, 4, 7, 16] {
                let part = partition(&path(n), parts).expect("METIS works");
                assert_eq!(part.len(), n as usize);
                assert!(part.iter().all(|&p| (p as usize) < parts), "{n} {parts}");
                let fair = n as usize / parts;
                let most = *sizes(&part, parts).iter().max().expect("parts");
                assert!(n < 40 || most <= fair + fair / 4 + 1, "{n} {parts}: {most}");
            }
        }
    }

    /// A graph without edges is distributed evenly.
    #[test]
    fn no_edges() {
        let graph =
            Graph { offsets: vec![0; 9], neighbours: vec![], edge_weights: vec![], vertex_weights: None };
        assert_eq!(sizes(&partition(&graph, 3).expect("spread"), 3), [3, 3, 2]);
    }

    /// Two bodies, each a path, face each other along their length. Ties keep facing elements
    /// together; without ties each body would be a part. Repeated calls agree.
    #[test]
    fn ties_keep_facing_bodies_together() {
        let body = path(32);
        let parts = |tie: Option<i32>| {
            let mut graph =
                Graph { offsets: vec![0], neighbours: vec![], edge_weights: vec![], vertex_weights: None };
            for v in 0..64 {
                let shift = v / 32 * 32;
                let own = (v % 32) as usize;
                for &w in &body.neighbours[body.offsets[own] as usize..body.offsets[own + 1] as usize] {
                    graph.neighbours.push(w + shift);
                    graph.edge_weights.push(1);
                }
                if let Some(weight) = tie {
                    graph.neighbours.push((v + 32) % 64);
                    graph.edge_weights.push(weight);
                }
                graph.offsets.push(graph.neighbours.len() as i32);
            }
            let part = partition(&graph, 2).expect("METIS works");
            assert_eq!(part, partition(&graph, 2).expect("METIS works"));
            part
        };
        let parted = |part: &[u32]| (0..32).filter(|&v| part[v] != part[v + 32]).count();
        assert_eq!(parted(&parts(None)), 32);
        assert_eq!(parted(&parts(Some(100))), 0);
        assert_eq!(sizes(&parts(Some(100)), 2), [32, 32]);
    }

    /// Two loads, one on each half of the path: each part has its share of both.
    #[test]
    fn two_loads_are_balanced_each() {
        let mut graph = path(64);
        let loads = (0..64).flat_map(|v| [i32::from(v < 32), i32::from(v >= 32)]).collect();
        graph.vertex_weights = Some(ElementWeights { constraints: 2, loads });
        let part = partition(&graph, 2).expect("METIS works");
        let first = sizes(&part[..32], 2);
        assert!(first.iter().all(|&n| n >= 14), "{first:?}");
    }
}
