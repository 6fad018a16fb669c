//! Meshes: points, elements of any kind, bodies, and named sets of elements, facets and points.

pub mod abaqus;
mod boundary;
mod bounds;
mod compact;
mod disjoint;
mod file;
mod generate;
pub mod gmsh;
mod kind;
mod lines;
#[cfg(test)]
mod measure;
mod merge;
mod numbering;
mod patch;
mod plane_state;
mod room;
mod source;
mod spelling;
pub mod stl;
mod surface_mesh;
mod tie;
mod tree;
pub mod validate;

pub use boundary::FacetIndex;
pub use bounds::{Bounds, stretch};
pub use disjoint::DisjointSets;
pub use file::read_file;
pub use generate::BoxShape;
pub use kind::ElementKind;
pub use lines::Edge;
pub use merge::merge;
pub use patch::{ElementPatch, element_patches, patches_with};
pub use plane_state::PlaneState;
pub use room::require_room;
pub use source::MeshFile;
pub use spelling::{digits, spelled};
pub use surface_mesh::SurfaceMesh;
pub use tie::Tie;
pub use tree::BoundsTree;

use std::collections::BTreeMap;

/// A side of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Facet {
    /// The element that the facet bounds.
    pub element: u32,
    /// Index into [`ElementKind::sides`].
    pub side: u8,
}

/// Type of the members of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SetKind {
    /// Elements: a region or a whole body.
    Elements,
    /// Sides of elements.
    Facets,
    /// Nodes.
    Points,
}

/// Elements of one or more bodies in `D` dimensions. Bodies share no nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh<const D: usize> {
    /// Reference position of each node \[m\].
    pub points: Vec<[f64; D]>,
    /// Kind of each element.
    pub kinds: Vec<ElementKind>,
    /// Element `e` has the nodes `nodes[offsets[e]..offsets[e + 1]]`. Length: elements + 1.
    pub offsets: Vec<u32>,
    /// Node lists of all elements, each in the order of [`ElementKind`].
    pub nodes: Vec<u32>,
    /// Body of each element, an index into the names passed to [`merge()`]; 0 before the merge.
    pub body: Vec<u16>,
    /// Piece of each element. Elements of one piece cannot move against each other without strain.
    /// Numbers ascend over the bodies. A body whose elements all share sides is one piece.
    pub piece: Vec<u32>,
    /// Named sets of sides, each sorted.
    pub facet_sets: BTreeMap<String, Vec<Facet>>,
    /// Named sets of nodes, each sorted.
    pub point_sets: BTreeMap<String, Vec<u32>>,
    /// Named sets of elements, each sorted.
    pub element_sets: BTreeMap<String, Vec<u32>>,
    /// Ties of its surfaces.
    pub ties: Vec<Tie>,
    /// Patches of elements that share a pressure.
    pub patches: Vec<ElementPatch>,
    /// State across the plane, in two dimensions.
    pub plane: PlaneState,
}

impl<const D: usize> Default for Mesh<D> {
    fn default() -> Self {
        Self::with_points(Vec::new())
    }
}

impl<const D: usize> Mesh<D> {
    /// A mesh with these points and no elements.
    pub fn with_points(points: Vec<[f64; D]>) -> Self {
        Self {
            points,
            kinds: Vec::new(),
            offsets: vec![0],
            nodes: Vec::new(),
            body: Vec::new(),
            piece: Vec::new(),
            facet_sets: BTreeMap::new(),
            point_sets: BTreeMap::new(),
            element_sets: BTreeMap::new(),
            ties: Vec::new(),
            patches: Vec::new(),
            plane: PlaneState::default(),
        }
    }

    /// Appends an element of body 0 and returns its number. `nodes` has the length and order of
    /// `kind`.
    pub fn push(&mut self, kind: ElementKind, nodes: impl IntoIterator<Item = u32>) -> u32 {
        let element = self.kinds.len() as u32;
        self.kinds.push(kind);
        self.body.push(0);
        self.piece.push(0);
        self.nodes.extend(nodes);
        self.offsets.push(self.nodes.len() as u32);
        element
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.kinds.len()
    }

    /// Nodes of an element in the order of its kind.
    pub fn element_nodes(&self, element: usize) -> &[u32] {
        &self.nodes[self.offsets[element] as usize..self.offsets[element + 1] as usize]
    }

    /// Kind of a facet.
    pub fn facet_kind(&self, facet: Facet) -> ElementKind {
        self.kinds[facet.element as usize].side_kind(facet.side as usize)
    }

    /// Fills `nodes` with the nodes of a facet, in the order of its kind, oriented outward.
    pub fn facet_nodes(&self, facet: Facet, nodes: &mut Vec<u32>) {
        let of_element = self.element_nodes(facet.element as usize);
        let side = self.kinds[facet.element as usize].sides()[facet.side as usize];
        nodes.clear();
        nodes.extend(side.iter().map(|&local| of_element[local as usize]));
    }

    /// Corner nodes of a facet in outward order.
    pub fn facet_corners(&self, facet: Facet) -> impl Iterator<Item = u32> + '_ {
        let of_element = self.element_nodes(facet.element as usize);
        let kind = self.kinds[facet.element as usize];
        let side = kind.sides()[facet.side as usize];
        side[..kind.side_kind(facet.side as usize).corners()].iter().map(|&local| of_element[local as usize])
    }

    /// Mean of an element's corners \[m\], used as its position in messages.
    pub fn element_centre(&self, element: usize) -> [f64; D] {
        let corners = &self.element_nodes(element)[..self.kinds[element].corners()];
        std::array::from_fn(|k| {
            corners.iter().map(|&n| self.points[n as usize][k]).sum::<f64>() / corners.len() as f64
        })
    }

    /// Lowest and highest coordinates of all points \[m\]; `None` without points.
    pub fn bounding_box(&self) -> Option<([f64; D], [f64; D])> {
        let first = *self.points.first()?;
        Some(self.points.iter().fold((first, first), |(low, high), x| {
            (std::array::from_fn(|k| low[k].min(x[k])), std::array::from_fn(|k| high[k].max(x[k])))
        }))
    }

    /// Name and kind of every set, sorted by name; for messages.
    pub fn sets(&self) -> Vec<(&str, SetKind)> {
        let elements = self.element_sets.keys().map(|name| (name.as_str(), SetKind::Elements));
        let facets = self.facet_sets.keys().map(|name| (name.as_str(), SetKind::Facets));
        let points = self.point_sets.keys().map(|name| (name.as_str(), SetKind::Points));
        let mut all: Vec<_> = elements.chain(facets).chain(points).collect();
        all.sort_unstable();
        all
    }

    /// Nodes of the set of points, facets or elements with this name, sorted and unique; `None` if
    /// there is no such set.
    pub fn set_nodes(&self, name: &str) -> Option<Vec<u32>> {
        let mut nodes = if let Some(points) = self.point_sets.get(name) {
            points.clone()
        } else if let Some(facets) = self.facet_sets.get(name) {
            self.nodes_of_facets(facets)
        } else {
            let elements = self.element_sets.get(name)?;
            elements.iter().flat_map(|&e| self.element_nodes(e as usize)).copied().collect()
        };
        nodes.sort_unstable();
        nodes.dedup();
        Some(nodes)
    }

    fn nodes_of_facets(&self, facets: &[Facet]) -> Vec<u32> {
        let mut all = Vec::new();
        let mut nodes = Vec::new();
        for &facet in facets {
            self.facet_nodes(facet, &mut nodes);
            all.extend_from_slice(&nodes);
        }
        all
    }
}
