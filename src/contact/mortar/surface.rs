//! The contactor of a contact on this rank: its own vertices, and all facets around them.

use std::collections::BTreeMap;
use std::ops::Range;

use super::obstacle::is_lumped;
use super::shape::{FacetShape, tangents};
use super::smooth_parts::{FacetCorner, is_at_edge, smooth_parts};
use super::split::linear;
use crate::contact::nodal::at;
use crate::contact::surface::Ownership;
use crate::contact::target::ContactTarget;
use crate::mesh::{ElementKind, Facet, Mesh, PlaneState};
use crate::space::{facet_normal, facet_tangents, reference};
use crate::tensor::Vector;

/// Undeformed sizes around a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexSize {
    /// Area assigned to the vertex [m, m^2].
    pub vertex: f64,
    /// Area of the facets around it [m, m^2].
    pub facets: f64,
    /// Length across the plane: 1 in 2D, that of the circle in axisymmetry, the square root of the
    /// vertex's area in 3D [-, m].
    pub width: f64,
    /// Part of the tractions that each side carries as the contactor.
    pub share: f64,
}

/// A facet with a vertex of this rank.
#[derive(Debug, Clone, PartialEq)]
pub struct VertexFacet {
    /// Local element and side.
    pub facet: Facet,
    /// Kind of the facet.
    pub kind: ElementKind,
    /// The vertex of this rank at each corner; `None` at vertices of other ranks.
    pub vertices: [Option<u32>; 4],
    /// Size \[m\]: the square root of its undeformed area in 3D, its length in 2D.
    pub size: f64,
    /// Undeformed area, in axisymmetry of the whole revolution [m, m^2].
    pub area: f64,
    /// Whether a corner lies on a sharp edge of the surface or on its boundary, see
    /// [`VertexSurface::mark_edges`].
    pub at_edge: bool,
    /// `int Phi_A Phi_B` over the undeformed facet [m, m^2]; for a lumped facet `int Phi_A` on the
    /// diagonal.
    pub shares: [[f64; 4]; 4],
    nodes: Range<usize>,
}

/// Undeformed size of a facet.
struct FacetWeight {
    size: f64,
    area: f64,
    shares: [[f64; 4]; 4],
}

/// How many vertices a node on a sharp edge of the contactor has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SharpEdges {
    /// One, with the mean gap of all facets around it.
    Joined,
    /// One for each smooth part of the surface around it.
    Divided,
}

impl SharpEdges {
    /// An obstacle has one gap for each side of an edge. Over a body the mean is kept, because the
    /// side that dips in beside a corner would push the corner back.
    fn over<const D: usize>(target: &ContactTarget<D>) -> Self {
        if target.has_facets() { Self::Joined } else { Self::Divided }
    }
}

/// Numbers of the vertices of a rank.
struct Numbering {
    /// Local nodes of the vertices.
    vertices: Vec<u32>,
    /// For each vertex its number among those of its node.
    parts: Vec<u32>,
    /// For each facet the vertices at its corners; `None` at nodes of other ranks.
    of_corners: Vec<[Option<u32>; 4]>,
}

impl Numbering {
    /// Numbers the vertices of `facets` at the first `owned` nodes.
    fn new<const D: usize>(mesh: &Mesh<D>, facets: &[Facet], owned: usize, edges: SharpEdges) -> Self {
        let mut numbering =
            Self { vertices: Vec::new(), parts: Vec::new(), of_corners: vec![[None; 4]; facets.len()] };
        for (node, places) in corners_around(mesh, facets, owned) {
            let parts = match edges {
                SharpEdges::Joined => vec![0; places.len()],
                SharpEdges::Divided => {
                    let corners =
                        places.iter().map(|&(number, corner)| corner_of(mesh, facets[number], corner));
                    smooth_parts(&corners.collect::<Vec<_>>())
                }
            };
            let first = numbering.vertices.len() as u32;
            for (part, (number, corner)) in parts.iter().zip(places) {
                numbering.of_corners[number][corner] = Some(first + part);
            }
            let count = parts.iter().max().map_or(0, |last| last + 1);
            numbering.vertices.extend((0..count).map(|_| node));
            numbering.parts.extend(0..count);
        }
        numbering
    }
}

/// The corners of `facets` at each of the first `owned` nodes: number of the facet, and of its corner.
fn corners_around<const D: usize>(
    mesh: &Mesh<D>,
    facets: &[Facet],
    owned: usize,
) -> BTreeMap<u32, Vec<(usize, usize)>> {
    let mut around: BTreeMap<u32, Vec<(usize, usize)>> = BTreeMap::new();
    let mut nodes = Vec::new();
    for (number, &facet) in facets.iter().enumerate() {
        mesh.facet_nodes(facet, &mut nodes);
        let corners = mesh.facet_kind(facet).corners();
        for (corner, &node) in nodes[..corners].iter().enumerate() {
            if (node as usize) < owned {
                around.entry(node).or_default().push((number, corner));
            }
        }
    }
    around
}

/// The nodes, among the first `owned` ones, on sharp edges of the surface of these `facets` and on its
/// boundary, in ascending order.
pub fn edge_nodes<const D: usize>(mesh: &Mesh<D>, facets: &[Facet], owned: usize) -> Vec<u32> {
    let at_edge = |(node, places): (u32, Vec<(usize, usize)>)| {
        let corners = places.iter().map(|&(number, corner)| corner_of(mesh, facets[number], corner));
        is_at_edge(&corners.collect::<Vec<_>>()).then_some(node)
    };
    corners_around(mesh, facets, owned).into_iter().filter_map(at_edge).collect()
}

/// The undeformed facet at one of its corners.
fn corner_of<const D: usize>(mesh: &Mesh<D>, facet: Facet, corner: usize) -> FacetCorner<D> {
    let mut nodes = Vec::new();
    mesh.facet_nodes(facet, &mut nodes);
    let kind = mesh.facet_kind(facet);
    let [first, second, _] = reference(kind).node_coordinates()[corner];
    let points: Vec<_> = nodes.iter().map(|&node| Vector::from(mesh.points[node as usize])).collect();
    let tangents = tangents(&FacetShape::at(kind, [first, second]), &points);
    let corners = kind.corners();
    let beside = [nodes[(corner + corners - 1) % corners], nodes[(corner + 1) % corners]];
    FacetCorner { normal: facet_normal(&tangents), beside }
}

/// Extent across the plane where the shape functions of nodes at these positions have these values.
fn depth_at<const D: usize>(plane: PlaneState, points: &[Vector<D>], shape: &[f64]) -> f64 {
    plane.depth(points.iter().zip(shape).map(|(point, n)| point[0] * n).sum())
}

/// Vertices of one contactor that this rank owns, with the facets around them.
///
/// A vertex is a corner of a facet. It carries the laws, the history and the multipliers of the
/// contact. The nodes between corners of quadratic facets carry none of these. A node on a sharp edge
/// has several vertices if the edges are divided. Facets are in the order of the input mesh, which is
/// the same on every rank.
#[derive(Debug, Clone, PartialEq)]
pub struct VertexSurface<const D: usize> {
    facets: Vec<VertexFacet>,
    nodes: Vec<u32>,
    reference_points: Vec<Vector<D>>,
    vertices: Vec<u32>,
    parts: Vec<u32>,
    reference_area: Vec<f64>,
    /// Facets around vertex `p`: `around[first[p]..first[p + 1]]`.
    first: Vec<u32>,
    around: Vec<u32>,
    plane: PlaneState,
}

impl<const D: usize> VertexSurface<D> {
    /// The surface of local `facets`, which may be empty, opposite a target. Over a plane a
    /// vertex uses only its own position, see [`is_lumped`]. Facets of a target may be unknown.
    pub fn new(
        mesh: &Mesh<D>,
        facets: &[Facet],
        ownership: &Ownership<'_>,
        target: &ContactTarget<D>,
    ) -> Self {
        let edges = SharpEdges::over(target);
        let lumped = |kind| target.obstacle().is_some_and(|obstacle| is_lumped(obstacle, kind, mesh.plane));
        let mut sorted = facets.to_vec();
        sorted.sort_by_key(|facet| (ownership.global_element[facet.element as usize], facet.side));
        let numbering = Numbering::new(mesh, &sorted, ownership.owned_nodes, edges);
        let mut surface = Self {
            facets: Vec::new(),
            nodes: Vec::new(),
            reference_points: Vec::new(),
            reference_area: vec![0.0; numbering.vertices.len()],
            vertices: numbering.vertices,
            parts: numbering.parts,
            first: Vec::new(),
            around: Vec::new(),
            plane: mesh.plane,
        };
        let mut nodes = Vec::new();
        for (facet, vertices) in sorted.into_iter().zip(numbering.of_corners) {
            if vertices.iter().all(Option::is_none) {
                continue;
            }
            mesh.facet_nodes(facet, &mut nodes);
            let kind = mesh.facet_kind(facet);
            let first = surface.nodes.len();
            surface.nodes.extend_from_slice(&nodes);
            surface
                .reference_points
                .extend(nodes.iter().map(|&node| Vector::from(mesh.points[node as usize])));
            let FacetWeight { size, area, mut shares } = surface.weigh(kind, first, &vertices);
            if lumped(kind) {
                shares = std::array::from_fn(|a| {
                    std::array::from_fn(|b| if a == b { shares[a].iter().sum() } else { 0.0 })
                });
            }
            let nodes = first..surface.nodes.len();
            let at_edge = false;
            surface.facets.push(VertexFacet { facet, kind, vertices, size, area, at_edge, shares, nodes });
        }
        surface.link();
        surface
    }

    /// Adds the undeformed area of a facet to its vertices.
    fn weigh(&mut self, kind: ElementKind, first: usize, vertices: &[Option<u32>; 4]) -> FacetWeight {
        let points = &self.reference_points[first..];
        let element = reference(kind);
        let rule = element.rule(5);
        let table = element.tabulate(&rule);
        let width = table.nodes * (D - 1);
        let mut per_depth = 0.0;
        let mut whole = 0.0;
        let mut shares = [[0.0; 4]; 4];
        for (q, at) in rule.points.iter().enumerate() {
            let tangents = facet_tangents(points, &table.dn[q * width..(q + 1) * width]);
            let part = table.weights[q] * facet_normal(&tangents).norm();
            let area = part * depth_at(self.plane, points, &table.n[q * table.nodes..(q + 1) * table.nodes]);
            per_depth += part;
            whole += area;
            let weights = FacetShape::at(linear(kind), [at[0], at[1]]);
            for (row, a) in shares.iter_mut().zip(weights.value) {
                row.iter_mut().zip(weights.value).for_each(|(share, b)| *share += area * a * b);
            }
            for (vertex, weight) in vertices.iter().zip(weights.value) {
                if let Some(vertex) = vertex {
                    self.reference_area[*vertex as usize] += area * weight;
                }
            }
        }
        FacetWeight { size: per_depth.powf(1.0 / (D as f64 - 1.0)), area: whole, shares }
    }

    fn link(&mut self) {
        let mut lists = vec![Vec::new(); self.vertices.len()];
        for (index, facet) in self.facets.iter().enumerate() {
            facet.vertices.iter().flatten().for_each(|&vertex| lists[vertex as usize].push(index as u32));
        }
        self.first = std::iter::once(0)
            .chain(lists.iter().scan(0, |sum, list| {
                *sum += list.len() as u32;
                Some(*sum)
            }))
            .collect();
        self.around = lists.concat();
    }

    /// State across the plane, in two dimensions.
    pub fn plane(&self) -> PlaneState {
        self.plane
    }

    /// Facets with a vertex of this rank, in the order of the input mesh.
    pub fn facets(&self) -> &[VertexFacet] {
        &self.facets
    }

    /// Local nodes of a facet, in the order of its kind.
    pub fn facet_nodes(&self, facet: &VertexFacet) -> &[u32] {
        &self.nodes[facet.nodes.clone()]
    }

    /// Undeformed positions of the nodes of a facet \[m\].
    pub fn reference_points(&self, facet: &VertexFacet) -> &[Vector<D>] {
        &self.reference_points[facet.nodes.clone()]
    }

    /// Local nodes of the vertices of this rank. The vertices of one node follow each other.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// For each vertex its number among those of its node, the same on every rank.
    pub fn parts(&self) -> &[u32] {
        &self.parts
    }

    /// Marks the facets with a corner at an edge, given by its local nodes.
    pub fn mark_edges(&mut self, is_at_edge: impl Fn(u32) -> bool) {
        for facet in &mut self.facets {
            let corners = &self.nodes[facet.nodes.clone()][..facet.kind.corners()];
            facet.at_edge = corners.iter().any(|&node| is_at_edge(node));
        }
    }

    /// Numbers of the facets around a vertex.
    pub fn around(&self, vertex: usize) -> &[u32] {
        &self.around[self.first[vertex] as usize..self.first[vertex + 1] as usize]
    }

    /// Local nodes of the facets around a vertex, those of several facets several times.
    pub fn nodes_around(&self, vertex: usize) -> impl Iterator<Item = u32> + '_ {
        let facets = self.around(vertex).iter().map(|&facet| &self.facets[facet as usize]);
        facets.flat_map(|facet| self.facet_nodes(facet).iter().copied())
    }

    /// Undeformed area assigned to a vertex, regardless of the extent of its target [m, m^2].
    pub fn reference_area(&self, vertex: usize) -> f64 {
        self.reference_area[vertex]
    }

    /// Area assigned to each vertex at the displacements `u` \[m\] of the local nodes, divided by its
    /// undeformed area.
    pub fn stretches(&self, u: &[f64]) -> Vec<f64> {
        let mut areas = vec![0.0; self.vertices.len()];
        let mut points = Vec::new();
        for facet in &self.facets {
            let element = reference(facet.kind);
            let rule = element.rule(5);
            let table = element.tabulate(&rule);
            let width = table.nodes * (D - 1);
            points.clear();
            let nodes = self.facet_nodes(facet).iter().zip(self.reference_points(facet));
            points.extend(nodes.map(|(&node, place)| place + at::<D>(u, node)));
            for (q, place) in rule.points.iter().enumerate() {
                let tangents = facet_tangents(&points, &table.dn[q * width..(q + 1) * width]);
                let depth = depth_at(self.plane, &points, &table.n[q * table.nodes..(q + 1) * table.nodes]);
                let area = table.weights[q] * facet_normal(&tangents).norm() * depth;
                let weights = FacetShape::at(linear(facet.kind), [place[0], place[1]]);
                for (vertex, weight) in facet.vertices.iter().zip(weights.value) {
                    if let Some(vertex) = vertex {
                        areas[*vertex as usize] += area * weight;
                    }
                }
            }
        }
        // A vertex between facets on the axis of revolution has no area.
        let stretch = |(now, before): (&f64, &f64)| if *before > 0.0 { now / before } else { 1.0 };
        areas.iter().zip(&self.reference_area).map(stretch).collect()
    }

    /// Undeformed sizes around a vertex whose contact carries this share of the tractions.
    pub fn size_of(&self, vertex: usize, share: f64) -> VertexSize {
        let around = || self.around(vertex).iter().map(|&facet| &self.facets[facet as usize]);
        let facets: f64 = around().map(|facet| facet.area).sum();
        let own = self.reference_area[vertex];
        let width = if D == 2 { facets / around().map(|facet| facet.size).sum::<f64>() } else { own.sqrt() };
        VertexSize { vertex: own, facets, width, share }
    }

    /// Undeformed position of a vertex \[m\].
    pub fn reference_point(&self, vertex: usize) -> Vector<D> {
        let facet = &self.facets[self.around(vertex)[0] as usize];
        let corner = facet.vertices.iter().position(|&number| number == Some(vertex as u32)).unwrap_or(0);
        self.reference_points(facet)[corner]
    }
}
