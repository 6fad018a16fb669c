//! Order of the nodes of one rank. It determines memory locality and the quality of incomplete
//! factorizations.

use super::lists::Lists;
use crate::mesh::Mesh;

/// Order of the nodes of one rank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ordering {
    /// As in the input mesh: suitable for boxes and for generators with a good numbering.
    #[default]
    Input,
    /// Reverse Cuthill-McKee: a small bandwidth for meshes with random numbering.
    ReverseCuthillMckee,
}

impl Ordering {
    /// Sorts the nodes of one rank, given in the order of the input, into this order.
    pub(super) fn arrange<const D: usize>(self, nodes: &mut [u32], mesh: &Mesh<D>, touching: &Lists<u32>) {
        if self == Self::ReverseCuthillMckee {
            let order = Sweep::new(nodes, mesh, touching).reverse_cuthill_mckee();
            nodes.copy_from_slice(&order);
        }
    }
}

/// Breadth-first search over the nodes of one rank, which are joined if they share an element.
struct Sweep<'a, const D: usize> {
    nodes: &'a [u32],
    /// For each node of the mesh: its index in `nodes`, or [`NOWHERE`].
    place: Vec<u32>,
    mesh: &'a Mesh<D>,
    touching: &'a Lists<u32>,
    /// For each of `nodes`: the number of the last search that reached it.
    reached: Vec<u32>,
    search: u32,
}

/// Marks nodes whose position is determined.
const PLACED: u32 = u32::MAX;

/// Marks nodes of other ranks.
const NOWHERE: u32 = u32::MAX;

impl<'a, const D: usize> Sweep<'a, D> {
    fn new(nodes: &'a [u32], mesh: &'a Mesh<D>, touching: &'a Lists<u32>) -> Self {
        let mut place = vec![NOWHERE; mesh.points.len()];
        (0..).zip(nodes).for_each(|(at, &node)| place[node as usize] = at);
        Self { nodes, place, mesh, touching, reached: vec![0; nodes.len()], search: 0 }
    }

    /// Connected components one after the other, each from a peripheral node; then the whole order
    /// reversed.
    fn reverse_cuthill_mckee(mut self) -> Vec<u32> {
        let mut order = Vec::with_capacity(self.nodes.len());
        for seed in 0..self.nodes.len() {
            if self.reached[seed] == PLACED {
                continue;
            }
            // The last node of a search is far from its seed, and the last node of a search from
            // there is peripheral.
            let far = self.from(seed).last().map_or(seed, |&place| place);
            let end = self.from(far).last().map_or(far, |&place| place);
            let piece = self.from(end);
            for &place in &piece {
                self.reached[place] = PLACED;
            }
            order.extend(piece.into_iter().map(|place| self.nodes[place]));
        }
        order.reverse();
        order
    }

    /// Indices in `nodes` of all nodes connected to `seed`, level by level, within a level by
    /// ascending degree.
    fn from(&mut self, seed: usize) -> Vec<usize> {
        self.search += 1;
        self.reached[seed] = self.search;
        let mut found = vec![seed];
        let mut next = 0;
        while next < found.len() {
            let fresh = found.len();
            self.visit_neighbours(found[next], &mut found);
            found[fresh..].sort_by_key(|&place| self.touching.get(self.nodes[place]).len());
            next += 1;
        }
        found
    }

    fn visit_neighbours(&mut self, place: usize, found: &mut Vec<usize>) {
        for &element in self.touching.get(self.nodes[place]) {
            for node in self.mesh.element_nodes(element as usize) {
                // Out of range for nodes of other ranks.
                let neighbour = self.place[*node as usize] as usize;
                let Some(reached) = self.reached.get_mut(neighbour).filter(|reached| **reached < self.search)
                else {
                    continue;
                };
                *reached = self.search;
                found.push(neighbour);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ElementKind;

    /// Largest distance between the positions of two nodes of one element.
    fn bandwidth(order: &[u32], mesh: &Mesh<2>) -> usize {
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(at, &node)| place[node as usize] = at);
        let spread = |e: usize| {
            let places = mesh.element_nodes(e).iter().map(|&n| place[n as usize]);
            places.clone().max().unwrap_or(0) - places.min().unwrap_or(0)
        };
        (0..mesh.element_count()).map(spread).max().unwrap_or(0)
    }

    /// A strip of squares with randomly numbered nodes gets nearly the bandwidth of the ordered
    /// strip.
    #[test]
    fn shuffled_strip_is_put_in_order() {
        let length = 50_u32;
        let shuffle = |n: u32| (n * 37) % (2 * (length + 1));
        let mut mesh = Mesh::<2>::with_points(vec![[0.0, 0.0]; 2 * (length as usize + 1)]);
        for x in 0..length {
            mesh.push(ElementKind::Quad4, [2 * x, 2 * x + 2, 2 * x + 3, 2 * x + 1].map(shuffle));
        }
        let pairs = (0..length).flat_map(|e| mesh.element_nodes(e as usize).iter().map(move |&n| (n, e)));
        let touching = Lists::collect(mesh.points.len(), pairs);
        let mut nodes: Vec<u32> = (0..mesh.points.len() as u32).collect();
        assert!(bandwidth(&nodes, &mesh) > 30);
        Ordering::ReverseCuthillMckee.arrange(&mut nodes, &mesh, &touching);
        assert!(bandwidth(&nodes, &mesh) <= 4);
        nodes.sort_unstable();
        assert!(nodes.iter().copied().eq(0..mesh.points.len() as u32));
    }
}
