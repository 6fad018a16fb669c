//! Seams: surfaces between which a contact of a body with itself acts. Surfaces that touch there
//! are separate on purpose.

use std::collections::HashSet;

use crate::mesh::{Facet, Mesh};

use super::Touch;

/// The nodes of the two sets of each contact of the body with itself.
pub(super) struct Seams(Vec<[Vec<u32>; 2]>);

impl Seams {
    /// The seams between the pairs of sets in `meets`.
    pub(super) fn new<const D: usize>(mesh: &Mesh<D>, meets: &[(String, String)]) -> Self {
        let nodes = |set: &str| mesh.set_nodes(set).unwrap_or_default();
        Self(meets.iter().map(|(one, other)| [nodes(one), nodes(other)]).collect())
    }

    /// Whether the touching part belongs to one set of a contact, and the touched part to the
    /// other.
    pub(super) fn explain<const D: usize>(&self, mesh: &Mesh<D>, touch: &Touch) -> bool {
        match *touch {
            Touch::Nodes(one, other) => self.separate(&[one], &[other]),
            Touch::Hanging(node, facet) => self.separate(&[node], &nodes_of(mesh, facet)),
            Touch::Sides(one, other) => self.separate(&nodes_of(mesh, one), &nodes_of(mesh, other)),
        }
    }

    /// Whether a node lies on the rim of a seam: at the edge between a facet of the other set and
    /// the outer surface.
    ///
    /// Such a node lies on the facets of both, and the outer facet is in no set. Nodes in
    /// `in_contact` touch the other set.
    pub(super) fn has_on_rim<const D: usize>(
        &self,
        mesh: &Mesh<D>,
        touch: &Touch,
        in_contact: &HashSet<u32>,
    ) -> bool {
        let Touch::Hanging(node, facet) = *touch else { return false };
        let corners: Vec<u32> = mesh.facet_corners(facet).collect();
        let shares_rim = |set: &[u32]| corners.iter().filter(|corner| has(set, corner)).count() >= D - 1;
        in_contact.contains(&node) && self.pairs().any(|[one, other]| has(one, &node) && shares_rim(other))
    }

    /// Whether a contact acts between nodes that are all in one of its sets and nodes that are all
    /// in the other.
    pub(super) fn separate(&self, these: &[u32], those: &[u32]) -> bool {
        let all = |set: &[u32], nodes: &[u32]| nodes.iter().all(|node| has(set, node));
        self.pairs().any(|[one, other]| all(one, these) && all(other, those))
    }

    /// Whether the body has no contact with itself.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether a node is in a set of a contact.
    pub(super) fn contain(&self, node: u32) -> bool {
        self.0.as_flattened().iter().any(|set| has(set, &node))
    }

    /// Whether two nodes are on different sides of a contact. A node in both sets is on neither
    /// side.
    pub(super) fn part(&self, these: u32, those: u32) -> bool {
        let only = |node: u32, set: &[u32], other: &[u32]| has(set, &node) && !has(other, &node);
        self.pairs().any(|[one, other]| only(these, one, other) && only(those, other, one))
    }

    /// The sets of each contact, in both orders.
    fn pairs(&self) -> impl Iterator<Item = [&[u32]; 2]> {
        self.0.iter().flat_map(|[one, other]| [[&**one, &**other], [&**other, &**one]])
    }
}

fn has(set: &[u32], node: &u32) -> bool {
    set.binary_search(node).is_ok()
}

/// All nodes of a facet.
pub(super) fn nodes_of<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> Vec<u32> {
    let mut nodes = Vec::new();
    mesh.facet_nodes(facet, &mut nodes);
    nodes
}
