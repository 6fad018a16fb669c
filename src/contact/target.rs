//! The target side of a contact with a deformable body: the facets that this rank knows of it.

use std::collections::BTreeMap;

use super::evaluation::at;
use super::projection::{Place, Projection};
use crate::mesh::ElementKind;
use crate::tensor::Vector;

/// A point further beyond the end of a target than this many of its facet's longest tangents is off it: half a percent
/// of the length of a quadrilateral. So a node that lies right on the end does not come and go by rounding.
const EXTENSION: f64 = 0.01;

/// Facets of a target as plain arrays, one entry for each facet but in `nodes` and `offsets`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TargetFacets {
    /// Kinds of the facets.
    pub kinds: Vec<ElementKind>,
    /// Where the nodes of each facet begin, and the end of the last: one entry more than facets.
    pub offsets: Vec<u32>,
    /// Nodes in the order of the kinds, normal outward: places in the field arrays (local, then foreign nodes). A node
    /// has one place, whichever facet names it.
    pub nodes: Vec<u32>,
    /// What a facet is called on every rank: input element * 16 + side.
    pub identities: Vec<u64>,
    /// Body of each facet.
    pub bodies: Vec<u16>,
}

impl TargetFacets {
    /// Appends a facet.
    pub fn push(&mut self, kind: ElementKind, nodes: &[u32], identity: u64, body: u16) {
        if self.offsets.is_empty() {
            self.offsets.push(0);
        }
        self.kinds.push(kind);
        self.nodes.extend_from_slice(nodes);
        self.offsets.push(self.nodes.len() as u32);
        self.identities.push(identity);
        self.bodies.push(body);
    }

    /// Number of facets.
    pub fn count(&self) -> usize {
        self.kinds.len()
    }

    /// Nodes of a facet.
    pub fn nodes_of(&self, facet: usize) -> &[u32] {
        &self.nodes[self.range(facet)]
    }

    fn range(&self, facet: usize) -> std::ops::Range<usize> {
        self.offsets[facet] as usize..self.offsets[facet + 1] as usize
    }

    /// The global name of side `side` of element `element` of the whole input mesh.
    pub fn identity(element: u32, side: u8) -> u64 {
        u64::from(element) * 16 + u64::from(side)
    }
}

/// Facets of a deformable target known to this rank.
///
/// Where the surface ends is read off the facets known: wherever a contact point may project, their neighbours have to
/// be known as well.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetSurface<const D: usize> {
    facets: TargetFacets,
    reference_points: Vec<Vector<D>>,
    /// Bits of the edges (0 to 3) and corners (4 to 7) of each facet on which the surface ends.
    ends: Vec<u8>,
    by_identity: Vec<u32>,
}

impl<const D: usize> TargetSurface<D> {
    /// The surface of `facets`; `reference_points` of all nodes \[m\], by place in the field arrays.
    pub fn new(facets: TargetFacets, reference_points: &[[f64; D]]) -> Self {
        let point = |node: &u32| Vector::from(reference_points[*node as usize]);
        let reference_points = facets.nodes.iter().map(point).collect();
        let mut by_identity: Vec<u32> = (0..facets.kinds.len() as u32).collect();
        by_identity.sort_by_key(|&facet| facets.identities[facet as usize]);
        let mut surface = Self { facets, reference_points, ends: Vec::new(), by_identity };
        surface.find_ends();
        surface
    }

    /// An edge of which one facet knows, and its corners, are where the surface ends.
    fn find_ends(&mut self) {
        let mut uses: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for (facet, edge) in self.all_edges() {
            *uses.entry(self.edge(facet, edge)).or_default() += 1;
        }
        let mut last: Vec<u32> = Vec::new();
        for (edge, _) in uses.iter().filter(|(_, uses)| **uses == 1) {
            last.extend(edge);
        }
        last.sort_unstable();
        let mut ends = vec![0; self.len()];
        for (facet, edge) in self.all_edges() {
            let alone = uses.get(&self.edge(facet, edge)) == Some(&1);
            let corner = last.binary_search(&self.nodes(facet)[edge]).is_ok();
            ends[facet as usize] |= u8::from(alone) << edge | u8::from(corner) << (4 + edge);
        }
        self.ends = ends;
    }

    fn all_edges(&self) -> impl Iterator<Item = (u32, usize)> + '_ {
        (0..self.len() as u32)
            .flat_map(|facet| (0..self.kind(facet).corners()).map(move |edge| (facet, edge)))
    }

    /// Ends of an edge in ascending order; in the plane a facet ends in nodes, written twice.
    fn edge(&self, facet: u32, edge: usize) -> [u32; 2] {
        let nodes = self.nodes(facet);
        let first = nodes[edge];
        let second = if D == 2 { first } else { nodes[(edge + 1) % self.kind(facet).corners()] };
        [first.min(second), first.max(second)]
    }

    /// Number of facets.
    pub fn len(&self) -> usize {
        self.facets.count()
    }

    /// Whether the rank knows no facet.
    pub fn is_empty(&self) -> bool {
        self.facets.count() == 0
    }

    /// Kind of a facet.
    pub fn kind(&self, facet: u32) -> ElementKind {
        self.facets.kinds[facet as usize]
    }

    /// Body of a facet.
    pub fn body(&self, facet: u32) -> u16 {
        self.facets.bodies[facet as usize]
    }

    /// Name of a facet on every rank.
    pub fn identity(&self, facet: u32) -> u64 {
        self.facets.identities[facet as usize]
    }

    /// The facet of that name, if the rank knows it.
    pub fn find(&self, identity: u64) -> Option<u32> {
        let place = self.by_identity.binary_search_by_key(&identity, |&facet| self.identity(facet));
        place.ok().map(|place| self.by_identity[place])
    }

    /// Nodes of a facet: places in the field arrays.
    pub fn nodes(&self, facet: u32) -> &[u32] {
        self.facets.nodes_of(facet as usize)
    }

    /// Reference positions of the nodes of a facet \[m\].
    pub fn reference_points(&self, facet: u32) -> &[Vector<D>] {
        &self.reference_points[self.facets.range(facet as usize)]
    }

    /// Fills `points` with the current positions of the nodes of a facet \[m\].
    pub fn current(&self, facet: u32, u: &[f64], points: &mut Vec<Vector<D>>) {
        points.clear();
        let nodes = self.reference_points(facet).iter().zip(self.nodes(facet));
        points.extend(nodes.map(|(reference, &node)| reference + at(u, node)));
    }

    /// Whether a point that projects so onto `facet` is beyond the end of the whole surface.
    pub fn is_off_end(&self, facet: u32, projection: &Projection<D>) -> bool {
        let bit = match projection.place {
            Place::Interior => return false,
            Place::Edge(edge) => edge,
            Place::Corner(corner) => 4 + corner,
        };
        self.ends[facet as usize] >> bit & 1 == 1 && projection.overhang() > EXTENSION
    }

    /// The nodes at the ends of the edge, or the one of the corner, onto which a point projects; none in the interior.
    pub fn border_nodes(&self, facet: u32, place: Place) -> impl Iterator<Item = u32> + '_ {
        let corners = self.kind(facet).corners();
        let (first, count) = match place {
            Place::Interior => (0, 0),
            Place::Edge(edge) => (usize::from(edge), 2),
            Place::Corner(corner) => (usize::from(corner), 1),
        };
        (first..first + count).map(move |corner| self.nodes(facet)[corner % corners])
    }
}
