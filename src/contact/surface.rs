//! The contactor side of one contact on this rank: the facets that it reports.

use std::ops::Range;

use crate::mesh::{ElementKind, Facet, Mesh};
use crate::tensor::Vector;

/// Distribution of the mesh, as seen by one rank.
#[derive(Debug, Clone, Copy)]
pub struct Ownership<'a> {
    /// Local nodes below this number are owned by the rank. It holds every facet that touches them.
    pub owned_nodes: usize,
    /// For each local element whether this rank reports it. Exactly one rank reports each element.
    pub mine: &'a [bool],
    /// For each local element its number in the whole mesh. It gives facets the same order on every
    /// rank.
    pub global_element: &'a [u32],
}

/// A facet of the contactor.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFacet {
    /// Local element and side.
    pub facet: Facet,
    /// Kind of the facet.
    pub kind: ElementKind,
    nodes: Range<usize>,
}

/// Facets of one contactor that this rank reports. Exactly one rank reports each facet.
#[derive(Debug, Clone)]
pub struct ContactSurface<const D: usize> {
    facets: Vec<SurfaceFacet>,
    nodes: Vec<u32>,
    reference_points: Vec<Vector<D>>,
}

impl<const D: usize> ContactSurface<D> {
    /// The facets of `facets` that this rank reports; the result may be empty.
    pub fn new(mesh: &Mesh<D>, facets: &[Facet], ownership: &Ownership<'_>) -> Self {
        let mut surface = Self { facets: Vec::new(), nodes: Vec::new(), reference_points: Vec::new() };
        let mut nodes = Vec::new();
        for &facet in facets.iter().filter(|facet| ownership.mine[facet.element as usize]) {
            mesh.facet_nodes(facet, &mut nodes);
            let first = surface.nodes.len();
            surface.nodes.extend_from_slice(&nodes);
            surface
                .reference_points
                .extend(nodes.iter().map(|&node| Vector::from(mesh.points[node as usize])));
            let kind = mesh.facet_kind(facet);
            let nodes = first..surface.nodes.len();
            surface.facets.push(SurfaceFacet { facet, kind, nodes });
        }
        surface
    }

    /// All facets.
    pub fn facets(&self) -> &[SurfaceFacet] {
        &self.facets
    }

    /// Local nodes of a facet, in the order of its kind.
    pub fn facet_nodes(&self, facet: &SurfaceFacet) -> &[u32] {
        &self.nodes[facet.nodes.clone()]
    }

    /// Reference positions of the nodes of a facet \[m\].
    pub fn reference_points(&self, facet: &SurfaceFacet) -> &[Vector<D>] {
        &self.reference_points[facet.nodes.clone()]
    }
}
