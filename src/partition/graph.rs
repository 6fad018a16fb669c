//! The graph that is partitioned: elements, joined if they share a side or if contact ties them
//! together.

use super::lists::Lists;
use crate::error::{Error, Result};
use crate::mesh::{ElementKind, Facet, Mesh};

/// Loads of the elements and ties between them, with numbers of the input mesh.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Weights {
    /// Loads to balance. Without loads, an element of a mixed mesh counts by its nodes.
    pub elements: Option<ElementWeights>,
    /// Ties besides shared sides, such as contact pairs.
    pub pairs: Vec<Pair>,
}

/// Loads of elements. Each kind of load is balanced separately.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ElementWeights {
    /// Number of kinds of load, at least one.
    pub constraints: usize,
    /// `loads[element * constraints + kind]`, not negative.
    pub loads: Vec<i32>,
}

/// Two elements that should be on one rank.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    /// The elements in the input mesh.
    pub elements: [u32; 2],
    /// Weight of a cut between them relative to a cut of a shared side; positive.
    pub weight: i32,
}

/// An undirected graph in compressed rows, each row ascending, with weights in METIS format.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Graph {
    /// Row `v` is `offsets[v]..offsets[v + 1]`.
    pub offsets: Vec<i32>,
    /// Neighbours, each edge from both ends.
    pub neighbours: Vec<i32>,
    /// Weight of each entry of `neighbours`.
    pub edge_weights: Vec<i32>,
    /// Loads of the vertices; all equal one if not given.
    pub vertex_weights: Option<ElementWeights>,
}

impl Graph {
    /// The graph of the elements of `mesh`; a shared side has weight one.
    ///
    /// # Errors
    /// The weights do not match the mesh, or the graph or a sum of weights exceeds 32 bits.
    pub fn dual<const D: usize>(mesh: &Mesh<D>, weights: &Weights) -> Result<Self> {
        let elements = mesh.element_count();
        check(weights, elements)?;
        let mut edges = neighbours(mesh);
        edges.extend(weights.pairs.iter().map(|pair| (pair.elements, pair.weight)));
        edges.retain(|([a, b], _)| a != b);
        let total: i64 = 2 * edges.iter().map(|(_, weight)| i64::from(*weight)).sum::<i64>();
        if total > i64::from(i32::MAX) || elements >= i32::MAX as usize {
            let message = format!(
                "the mesh is too large to partition: {elements} elements, edge weights of {total} in all"
            );
            return Err(Error::case(message));
        }
        let both_ways = edges.iter().flat_map(|&([a, b], weight)| [(a, (b, weight)), (b, (a, weight))]);
        let mut graph = Self::from_rows(Lists::collect(elements, both_ways));
        graph.vertex_weights = weights.elements.clone().or_else(|| by_nodes(mesh));
        Ok(graph)
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The part of each vertex where nothing is to be decided, which the libraries do not support: one
    /// part, no more vertices than parts, or a graph without edges (runs of equal length).
    pub fn parts_without_library(&self, parts: usize) -> Option<Vec<u32>> {
        let vertices = self.vertices();
        if parts <= 1 {
            return Some(vec![0; vertices]);
        }
        if vertices <= parts {
            return Some((0..vertices as u32).collect());
        }
        let runs = || (0..vertices).map(|v| (v * parts / vertices) as u32).collect();
        self.neighbours.is_empty().then(runs)
    }

    /// Total weight of the edges between different parts.
    pub fn cut(&self, part: &[u32]) -> i64 {
        let mut cut = 0;
        for (vertex, row) in self.offsets.windows(2).enumerate() {
            for entry in row[0] as usize..row[1] as usize {
                if part[vertex] != part[self.neighbours[entry] as usize] {
                    cut += i64::from(self.edge_weights[entry]);
                }
            }
        }
        cut / 2
    }

    /// Sorts the rows and merges parallel edges.
    fn from_rows(mut rows: Lists<(u32, i32)>) -> Self {
        let mut graph =
            Self { offsets: vec![0], neighbours: vec![], edge_weights: vec![], vertex_weights: None };
        for vertex in 0..rows.count() as u32 {
            let row = rows.get_mut(vertex);
            row.sort_unstable();
            for same in row.chunk_by(|a, b| a.0 == b.0) {
                graph.neighbours.push(same[0].0 as i32);
                graph.edge_weights.push(same.iter().map(|(_, weight)| weight).sum());
            }
            graph.offsets.push(graph.neighbours.len() as i32);
        }
        graph
    }
}

fn check(weights: &Weights, elements: usize) -> Result<()> {
    let fits = |pair: &Pair| pair.weight > 0 && pair.elements.iter().all(|&e| (e as usize) < elements);
    if !weights.pairs.iter().all(fits) {
        return Err(Error::internal("partition: an edge has no weight, or an element that does not exist"));
    }
    let Some(given) = &weights.elements else { return Ok(()) };
    let whole = given.constraints > 0 && given.loads.len() == elements * given.constraints;
    if !whole || given.loads.iter().any(|&load| load < 0) {
        return Err(Error::internal("partition: element loads are negative or not one for each element"));
    }
    let sum = |kind| {
        given.loads.iter().skip(kind).step_by(given.constraints).map(|&load| i64::from(load)).sum::<i64>()
    };
    if (0..given.constraints).any(|kind| sum(kind) > i64::from(i32::MAX)) {
        return Err(Error::internal("partition: the sum of the element loads is beyond 32 bits"));
    }
    Ok(())
}

/// Elements of a mixed mesh count by their nodes; those of a uniform mesh need no weight.
fn by_nodes<const D: usize>(mesh: &Mesh<D>) -> Option<ElementWeights> {
    let uniform = mesh.kinds.windows(2).all(|pair| pair[0] == pair[1]);
    let loads = || mesh.kinds.iter().map(|kind| kind.nodes() as i32).collect();
    (!uniform && mesh.nodes.len() <= i32::MAX as usize)
        .then(|| ElementWeights { constraints: 1, loads: loads() })
}

/// Pairs of elements that share a side, each once, with weight one.
fn neighbours<const D: usize>(mesh: &Mesh<D>) -> Vec<([u32; 2], i32)> {
    let sides = Lists::collect(mesh.points.len(), sides(mesh));
    let mut pairs = Vec::new();
    let mut keyed: Vec<([u32; 4], u32)> = Vec::new();
    // Sides with the same lowest corner are adjacent, so only these few need to be compared.
    for node in 0..sides.count() as u32 {
        keyed.clear();
        keyed.extend(
            sides.get(node).iter().map(|&(element, side)| (key(mesh, Facet { element, side }), element)),
        );
        keyed.sort_unstable();
        let shared = keyed.windows(2).filter(|two| two[0].0 == two[1].0);
        pairs.extend(shared.map(|two| ([two[0].1, two[1].1], 1)));
    }
    pairs
}

/// All sides of the mesh as (lowest corner, (element, side)).
fn sides<const D: usize>(mesh: &Mesh<D>) -> impl Iterator<Item = (u32, (u32, u8))> + Clone + '_ {
    let of = move |(element, kind): (usize, &ElementKind)| {
        let element = element as u32;
        (0..kind.sides().len() as u8)
            .map(move |side| (key(mesh, Facet { element, side })[0], (element, side)))
    };
    mesh.kinds.iter().enumerate().flat_map(of)
}

/// Sorted corners of a side, padded with the highest number.
fn key<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> [u32; 4] {
    let mut key = [u32::MAX; 4];
    for (slot, node) in key.iter_mut().zip(mesh.facet_corners(facet)) {
        *slot = node;
    }
    key.sort_unstable();
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of three squares: the middle one has two neighbours.
    pub fn row() -> Mesh<2> {
        let mut mesh = Mesh::with_points((0..8).map(|n| [f64::from(n % 4), f64::from(n / 4)]).collect());
        for x in 0..3 {
            mesh.push(ElementKind::Quad4, [x, x + 1, x + 5, x + 4]);
        }
        mesh
    }

    /// Elements are joined over shared sides, not over shared corners, in both directions.
    #[test]
    fn neighbours_share_a_side() {
        let graph = Graph::dual(&row(), &Weights::default()).expect("small");
        assert_eq!(graph.offsets, [0, 1, 3, 4]);
        assert_eq!(graph.neighbours, [1, 0, 2, 1]);
        assert_eq!(graph.edge_weights, [1; 4]);
        assert_eq!(graph.vertex_weights, None);
        assert_eq!(graph.cut(&[0, 0, 1]), 1);
    }

    /// A tie adds an edge, or increases the weight of an existing one.
    #[test]
    fn ties_are_added_to_shared_sides() {
        let pairs = vec![
            Pair { elements: [0, 2], weight: 7 },
            Pair { elements: [1, 0], weight: 5 },
            Pair { elements: [2, 0], weight: 1 },
        ];
        let graph = Graph::dual(&row(), &Weights { elements: None, pairs }).expect("small");
        assert_eq!(graph.neighbours, [1, 2, 0, 2, 0, 1]);
        assert_eq!(graph.edge_weights, [6, 8, 6, 1, 8, 1]);
        assert_eq!(graph.cut(&[0, 1, 0]), 7);
    }

    /// Elements of different kinds are neighbours over a common side and are weighted by their
    /// nodes.
    #[test]
    fn mixed_meshes_weigh_by_nodes() {
        let mut mesh = Mesh::with_points(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.5]]);
        mesh.push(ElementKind::Quad4, [0, 1, 2, 3]);
        mesh.push(ElementKind::Tri3, [1, 4, 2]);
        let graph = Graph::dual(&mesh, &Weights::default()).expect("small");
        assert_eq!(graph.neighbours, [1, 0]);
        assert_eq!(graph.vertex_weights.map(|w| w.loads), Some(vec![4, 3]));
    }

    /// Weights of another mesh are rejected.
    #[test]
    fn weights_must_fit_the_mesh() {
        let outside = Weights { elements: None, pairs: vec![Pair { elements: [0, 3], weight: 1 }] };
        assert!(Graph::dual(&row(), &outside).is_err());
        let short =
            Weights { elements: Some(ElementWeights { constraints: 2, loads: vec![1; 3] }), pairs: vec![] };
        assert!(Graph::dual(&row(), &short).is_err());
    }
}
