//! Sides on the boundary of the mesh, and lookup of a side by its corner nodes.

use super::{Facet, Mesh};

/// Sorted corner nodes of a facet, padded with `u32::MAX`. The two elements that share a side have
/// equal keys.
type Key = [u32; 4];

/// All sides of a mesh, ordered by their corner nodes.
pub struct FacetIndex {
    entries: Vec<(Key, Facet)>,
}

impl FacetIndex {
    /// The index of all sides of `mesh`.
    pub fn new<const D: usize>(mesh: &Mesh<D>) -> Self {
        Self::of(mesh, 0..mesh.element_count() as u32)
    }

    /// The index of the sides of some elements of `mesh`.
    pub fn of<const D: usize>(mesh: &Mesh<D>, elements: impl Iterator<Item = u32> + Clone) -> Self {
        let sides = |element: u32| mesh.kinds[element as usize].sides().len();
        let mut entries = Vec::with_capacity(elements.clone().map(sides).sum());
        for element in elements {
            for side in 0..sides(element) {
                let facet = Facet { element, side: side as u8 };
                entries.push((key(mesh.facet_corners(facet)), facet));
            }
        }
        entries.sort_unstable();
        Self { entries }
    }

    /// The sides with these corner nodes, given in any order. There is no such side, one on the
    /// boundary, or two in the interior.
    pub fn find(&self, corners: impl IntoIterator<Item = u32>) -> impl Iterator<Item = Facet> + '_ {
        let wanted = key(corners);
        let first = self.entries.partition_point(|(key, _)| *key < wanted);
        self.entries[first..].iter().take_while(move |(key, _)| *key == wanted).map(|(_, facet)| *facet)
    }

    /// The sides that belong to one element only, sorted.
    pub fn boundary(&self) -> Vec<Facet> {
        let alone = self.entries.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1);
        let mut facets: Vec<Facet> = alone.map(|same| same[0].1).collect();
        facets.sort_unstable();
        facets
    }

    /// Both element sides of each interior side.
    pub fn inner(&self) -> impl Iterator<Item = [Facet; 2]> + '_ {
        let both = self.entries.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 2);
        both.map(|same| [same[0].1, same[1].1])
    }

    /// Sides that share all corners with two or more others, which is impossible in a valid body.
    pub fn overcrowded(&self) -> impl Iterator<Item = Vec<Facet>> + '_ {
        let crowds = self.entries.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 2);
        crowds.map(|same| same.iter().map(|(_, facet)| *facet).collect())
    }
}

/// More than four corners are ignored; no facet has them.
fn key(corners: impl IntoIterator<Item = u32>) -> Key {
    let mut key = [u32::MAX; 4];
    for (slot, node) in key.iter_mut().zip(corners) {
        *slot = node;
    }
    key.sort_unstable();
    key
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ElementKind;

    /// Two triangles that share an edge: four sides bound the mesh and the shared edge is found
    /// twice.
    #[test]
    fn shared_edge_is_inside() {
        let mut mesh = Mesh::with_points(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        mesh.push(ElementKind::Tri3, [0, 1, 2]);
        mesh.push(ElementKind::Tri3, [0, 2, 3]);
        let index = FacetIndex::new(&mesh);
        assert_eq!(index.boundary().len(), 4);
        assert_eq!(index.inner().count(), 1);
        let shared: Vec<Facet> = index.find([2, 0]).collect();
        assert_eq!(shared, [Facet { element: 0, side: 2 }, Facet { element: 1, side: 0 }]);
        assert_eq!(index.find([1, 0]).collect::<Vec<_>>(), [Facet { element: 0, side: 0 }]);
        assert_eq!(index.find([1, 3]).count(), 0);
        assert_eq!(index.overcrowded().count(), 0);
    }

    /// Three triangles at one edge are reported.
    #[test]
    fn third_element_at_an_edge_is_reported() {
        let mut mesh = Mesh::with_points(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 1.0]]);
        mesh.push(ElementKind::Tri3, [0, 1, 2]);
        mesh.push(ElementKind::Tri3, [0, 2, 3]);
        mesh.push(ElementKind::Tri3, [0, 4, 2]);
        let crowds: Vec<_> = FacetIndex::new(&mesh).overcrowded().collect();
        assert_eq!(crowds.len(), 1);
        assert_eq!(crowds[0].len(), 3);
    }
}
