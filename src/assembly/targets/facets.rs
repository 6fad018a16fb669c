//! Target facets as plain arrays over "local nodes, then foreign nodes".

use super::parcel::identity;
use crate::mesh::{ElementKind, Facet};
use crate::partition::LocalMesh;

/// Facets of a target by ascending identity, this rank's and those of others.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TargetFacets<const D: usize> {
    /// Kind of each facet.
    pub kinds: Vec<ElementKind>,
    /// Facet `f` has the nodes `nodes[offsets[f]..offsets[f + 1]]`. Length: facets + 1.
    pub offsets: Vec<u32>,
    /// Nodes, outward as in [`facet_nodes`](crate::mesh::Mesh::facet_nodes): local ones, then from the number of local
    /// nodes on those of `foreign`.
    pub nodes: Vec<u32>,
    /// `16 element + side` in the input mesh: the same for a facet on every rank, at every time.
    pub identities: Vec<u64>,
    /// Body of each facet.
    pub bodies: Vec<u16>,
    /// Global numbers of the nodes that this rank does not hold, ascending.
    pub foreign: Vec<i32>,
    /// Reference points of the foreign nodes \[m\].
    pub foreign_points: Vec<[f64; D]>,
}

impl<const D: usize> TargetFacets<D> {
    /// Number of facets.
    pub fn count(&self) -> usize {
        self.kinds.len()
    }

    /// Nodes of a facet.
    pub fn nodes_of(&self, facet: usize) -> &[u32] {
        &self.nodes[self.offsets[facet] as usize..self.offsets[facet + 1] as usize]
    }
}

/// A facet of another rank.
pub(super) struct Arrived<'a, const D: usize> {
    pub kind: ElementKind,
    pub body: u16,
    pub identity: u64,
    /// Global nodes.
    pub globals: &'a [u32],
    /// Reference points of the nodes \[m\].
    pub points: &'a [[f64; D]],
}

/// Facets while they come in.
pub(super) struct Gathered<'a, const D: usize> {
    local: &'a LocalMesh<D>,
    facets: Vec<Entry>,
    /// Global nodes of all facets one after the other.
    globals: Vec<i32>,
    foreign: Vec<(i32, [f64; D])>,
}

struct Entry {
    identity: u64,
    kind: ElementKind,
    body: u16,
    first: usize,
}

impl<'a, const D: usize> Gathered<'a, D> {
    pub fn new(local: &'a LocalMesh<D>) -> Self {
        Self { local, facets: Vec::new(), globals: Vec::new(), foreign: Vec::new() }
    }

    /// Adds one of the rank's own facets.
    pub fn push_own(&mut self, facet: Facet) {
        let (mesh, element) = (&self.local.mesh, facet.element as usize);
        let mut nodes = Vec::new();
        mesh.facet_nodes(facet, &mut nodes);
        self.facets.push(Entry {
            identity: identity(self.local.input_element[element], facet.side.into()),
            kind: mesh.facet_kind(facet),
            body: mesh.body[element],
            first: self.globals.len(),
        });
        self.globals.extend(nodes.iter().map(|&node| self.local.index.global(node)));
    }

    /// Adds a facet of another rank, of which this one may hold some nodes.
    pub fn push(&mut self, facet: &Arrived<'_, D>) {
        let Arrived { kind, body, identity, globals, points } = *facet;
        self.facets.push(Entry { identity, kind, body, first: self.globals.len() });
        for (&global, &point) in globals.iter().zip(points) {
            self.globals.push(global as i32);
            if self.local.index.local(global as i32).is_none() {
                self.foreign.push((global as i32, point));
            }
        }
    }

    /// Orders the facets and numbers the foreign nodes.
    pub fn finish(mut self) -> TargetFacets<D> {
        self.facets.sort_unstable_by_key(|entry| entry.identity);
        self.foreign.sort_unstable_by_key(|(global, _)| *global);
        self.foreign.dedup_by_key(|(global, _)| *global);
        let (foreign, foreign_points): (Vec<i32>, Vec<[f64; D]>) = self.foreign.into_iter().unzip();
        let index = &self.local.index;
        let number = |global: i32| {
            let beyond = || foreign.partition_point(|&other| other < global) + index.local_count();
            index.local(global).unwrap_or_else(|| beyond() as u32)
        };
        let mut all = TargetFacets { offsets: vec![0], ..TargetFacets::default() };
        for entry in &self.facets {
            let globals = &self.globals[entry.first..entry.first + entry.kind.nodes()];
            all.nodes.extend(globals.iter().map(|&global| number(global)));
            all.offsets.push(all.nodes.len() as u32);
            all.kinds.push(entry.kind);
            all.identities.push(entry.identity);
            all.bodies.push(entry.body);
        }
        TargetFacets { foreign, foreign_points, ..all }
    }
}
