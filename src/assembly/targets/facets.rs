//! Target facets as plain arrays over "local nodes, then foreign nodes".

use crate::contact::target::TargetFacets;
use crate::mesh::{ElementKind, Facet};
use crate::partition::LocalMesh;

/// Nodes of target facets that are not on this rank, in ascending order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ForeignNodes<const D: usize> {
    /// Global numbers.
    pub numbers: Vec<i32>,
    /// Reference points \[m\].
    pub points: Vec<[f64; D]>,
}

/// A facet of another rank.
pub(super) struct ArrivedFacet<'a, const D: usize> {
    pub kind: ElementKind,
    pub body: u16,
    pub at_edge: bool,
    pub identity: u64,
    /// Global nodes.
    pub globals: &'a [u32],
    /// Reference points of the nodes \[m\].
    pub points: &'a [[f64; D]],
}

/// Facets during the gathering.
pub(super) struct GatheredFacets<'a, const D: usize> {
    local: &'a LocalMesh<D>,
    facets: Vec<Entry>,
    /// Global nodes of all facets, facet by facet.
    globals: Vec<i32>,
    foreign: Vec<(i32, [f64; D])>,
}

struct Entry {
    identity: u64,
    kind: ElementKind,
    body: u16,
    at_edge: bool,
    first: usize,
}

impl<'a, const D: usize> GatheredFacets<'a, D> {
    pub fn new(local: &'a LocalMesh<D>) -> Self {
        Self { local, facets: Vec::new(), globals: Vec::new(), foreign: Vec::new() }
    }

    /// Adds one of the rank's own facets.
    pub fn push_own(&mut self, facet: Facet, at_edge: bool) {
        let mesh = &self.local.mesh;
        let element = facet.element as usize;
        let mut nodes = Vec::new();
        mesh.facet_nodes(facet, &mut nodes);
        self.facets.push(Entry {
            identity: TargetFacets::identity(self.local.input_element[element], facet.side),
            kind: mesh.facet_kind(facet),
            body: mesh.body[element],
            at_edge,
            first: self.globals.len(),
        });
        self.globals.extend(nodes.iter().map(|&node| self.local.index.global(node)));
    }

    /// Adds a facet of another rank. Some of its nodes may be on this rank.
    pub fn push(&mut self, facet: &ArrivedFacet<'_, D>) {
        let ArrivedFacet { kind, body, at_edge, identity, globals, points } = *facet;
        self.facets.push(Entry { identity, kind, body, at_edge, first: self.globals.len() });
        for (&global, &point) in globals.iter().zip(points) {
            self.globals.push(global as i32);
            if self.local.index.local(global as i32).is_none() {
                self.foreign.push((global as i32, point));
            }
        }
    }

    /// Returns the facets in ascending order of identity, and the foreign nodes, which are numbered
    /// after the local ones.
    pub fn finish(mut self) -> (TargetFacets, ForeignNodes<D>) {
        self.facets.sort_unstable_by_key(|entry| entry.identity);
        self.foreign.sort_unstable_by_key(|(global, _)| *global);
        self.foreign.dedup_by_key(|(global, _)| *global);
        let (foreign, points): (Vec<i32>, Vec<[f64; D]>) = self.foreign.into_iter().unzip();
        let index = &self.local.index;
        let number = |global: &i32| {
            let beyond = || foreign.partition_point(|other| other < global) + index.local_count();
            index.local(*global).unwrap_or_else(|| beyond() as u32)
        };
        let mut all = TargetFacets { offsets: vec![0], ..TargetFacets::default() };
        let mut nodes = Vec::new();
        for &Entry { identity, kind, body, at_edge, first } in &self.facets {
            nodes.clear();
            nodes.extend(self.globals[first..first + kind.nodes()].iter().map(number));
            all.push(kind, &nodes, identity, body, at_edge);
        }
        (all, ForeignNodes { numbers: foreign, points })
    }
}
