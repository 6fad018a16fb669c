//! Facets of both sides of a contact during the motion of a step.

use crate::assembly::LocalContact;
use crate::assembly::targets::{Reach, Surfaces, TargetGather};
use crate::contact::mortar::obstacle::rule_of;
use crate::contact::mortar::shape::{FacetShape, MOST_NODES};
use crate::contact::obstacle::Shape;
use crate::contact::passage::Path;
use crate::contact::surface::SurfaceFacet;
use crate::error::Result;
use crate::mesh::{Bounds, ElementKind, Facet, PlaneState};
use crate::partition::LocalMesh;
use crate::partition::exchange::{ExchangedField, NodeExchange};
use crate::petsc::Session;
use crate::tensor::Vector as Point;

/// Displacements at the two ends of a step \[m\].
#[derive(Clone, Copy)]
pub(super) struct StepEnds<'a> {
    pub start: &'a [f64],
    pub end: &'a [f64],
}

impl StepEnds<'_> {
    /// Path of a node, given its reference point.
    pub fn path<const D: usize>(&self, reference: &Point<D>, node: u32) -> Path<D> {
        let at = |u: &[f64]| reference + Point::from_fn(|i, _| u[node as usize * D + i]);
        Path { start: at(self.start), end: at(self.end) }
    }
}

/// A point of a body, which does not move with it.
#[derive(Debug, Clone, Copy)]
pub(super) struct BodyPoint<const D: usize> {
    /// Position before the deformation \[m\].
    pub reference: Point<D>,
    /// Index of the body.
    pub body: usize,
}

/// A node of a facet with its path.
#[derive(Clone, Copy)]
struct MovingNode<const D: usize> {
    point: BodyPoint<D>,
    path: Path<D>,
}

/// Facets of a surface with the paths of their nodes.
#[derive(Default)]
pub(super) struct Moving<const D: usize> {
    kinds: Vec<ElementKind>,
    offsets: Vec<usize>,
    /// Numbers that identify shared nodes.
    numbers: Vec<u32>,
    nodes: Vec<MovingNode<D>>,
}

/// A node of a surface, or a point on an edge between two nodes.
pub(super) struct MovingVertex<const D: usize> {
    ends: [u32; 2],
    pub point: BodyPoint<D>,
    pub path: Path<D>,
}

/// Maximum number of pieces of an edge. More are not worth their cost.
const MOST_PIECES: f64 = 100.0;

impl<const D: usize> Moving<D> {
    fn push(
        &mut self,
        kind: ElementKind,
        body: u16,
        numbers: &[u32],
        node: impl Fn(u32) -> (Point<D>, Path<D>),
    ) {
        self.kinds.push(kind);
        self.offsets.push(self.numbers.len());
        self.numbers.extend_from_slice(numbers);
        self.nodes.extend(numbers.iter().map(|&number| {
            let (reference, path) = node(number);
            MovingNode { point: BodyPoint { reference, body: usize::from(body) }, path }
        }));
    }

    /// Collects facets of this rank's part of the mesh.
    pub fn local(local: &LocalMesh<D>, facets: &[Facet], ends: StepEnds<'_>) -> Self {
        let (mut moving, mut nodes) = (Self::default(), Vec::new());
        for &facet in facets {
            local.mesh.facet_nodes(facet, &mut nodes);
            let body = local.mesh.body[facet.element as usize];
            moving.push(local.mesh.facet_kind(facet), body, &nodes, |node| {
                let reference = local.mesh.points[node as usize].into();
                (reference, ends.path(&reference, node))
            });
        }
        moving
    }

    /// Collects facets of the target that are within `radius` \[m\] of the contactor's at the
    /// start. Collective.
    ///
    /// # Errors
    /// If a message is damaged, the same on all ranks.
    pub fn gathered(
        session: &Session,
        surfaces: &Surfaces<'_, D>,
        ends: StepEnds<'_>,
        radius: f64,
    ) -> Result<Self> {
        let world = session.world();
        let local = surfaces.local;
        let positions: Vec<f64> =
            local.mesh.points.as_flattened().iter().zip(ends.start).map(|(x, u)| x + u).collect();
        let reach = Reach { radius, slack: 0.0 };
        let TargetGather { facets, foreign, .. } = TargetGather::new(world, surfaces, &positions, reach)?;
        let mut bring = NodeExchange::new(world, &local.index, &foreign.numbers)?;
        let [mut start, mut end] = [0, 1].map(|_| vec![0.0; foreign.numbers.len() * D]);
        let fields = [(ends.start, &mut start), (ends.end, &mut end)];
        let mut fields =
            fields.map(|(owned, wanted)| ExchangedField { width: D, owned, wanted: &mut wanted[..] });
        bring.forward_many(world, &mut fields);
        let beyond = StepEnds { start: &start, end: &end };
        let node = |number: u32| match (number as usize).checked_sub(local.index.local_count()) {
            None => {
                let reference = local.mesh.points[number as usize].into();
                (reference, ends.path(&reference, number))
            }
            Some(at) => {
                let reference = foreign.points[at].into();
                (reference, beyond.path(&reference, at as u32))
            }
        };
        let mut moving = Self::default();
        for facet in 0..facets.count() {
            moving.push(facets.kinds[facet], facets.bodies[facet], facets.nodes_of(facet), node);
        }
        Ok(moving)
    }

    /// Numbers of the nodes of a facet, and the nodes.
    fn facet(&self, facet: usize) -> (&[u32], &[MovingNode<D>]) {
        let end = self.offsets.get(facet + 1).copied().unwrap_or(self.nodes.len());
        let range = self.offsets[facet]..end;
        (&self.numbers[range.clone()], &self.nodes[range])
    }

    /// Returns the facets as lines or triangles between their corners.
    pub fn simplices(&self) -> Vec<[Path<D>; D]> {
        let mut simplices = Vec::with_capacity(self.kinds.len());
        for (facet, &kind) in self.kinds.iter().enumerate() {
            let (_, nodes) = self.facet(facet);
            parts(kind, |part| simplices.push(std::array::from_fn(|k| nodes[part[k]].path)));
        }
        simplices
    }

    /// Returns each node once. In 3D, it also returns points on each edge, at most `spacing` \[m\]
    /// apart.
    pub fn vertices(&self, spacing: f64) -> Vec<MovingVertex<D>> {
        let nodes = self.numbers.iter().zip(&self.nodes);
        let mut vertices: Vec<MovingVertex<D>> = nodes
            .map(|(&number, &MovingNode { point, path })| MovingVertex { ends: [number; 2], point, path })
            .collect();
        vertices.sort_by_key(|vertex| vertex.ends);
        vertices.dedup_by_key(|vertex| vertex.ends);
        if D == 2 {
            return vertices;
        }
        let mut edges: Vec<[(u32, MovingNode<D>); 2]> = Vec::new();
        for (facet, kind) in self.kinds.iter().enumerate() {
            let (numbers, nodes) = self.facet(facet);
            let node = |k: usize| (numbers[k], nodes[k]);
            let corners = kind.corners();
            for edge in 0..corners {
                let [first, last] = [node(edge), node((edge + 1) % corners)];
                // The nodes within edges follow the corners.
                match numbers.len() >= 2 * corners {
                    true => edges.extend([[first, node(corners + edge)], [node(corners + edge), last]]),
                    false => edges.push([first, last]),
                }
            }
        }
        edges.iter_mut().for_each(|edge| edge.sort_by_key(|(number, _)| *number));
        edges.sort_by_key(|[(a, _), (b, _)]| [*a, *b]);
        edges.dedup_by_key(|[(a, _), (b, _)]| [*a, *b]);
        for [(first, a), (last, b)] in edges {
            // Lengths are often exact multiples of each other by design. Rounding must not add a
            // piece then.
            let ratio = (a.path.end - b.path.end).norm() / spacing * (1.0 - 1e-9);
            let pieces = ratio.ceil().clamp(1.0, MOST_PIECES) as u32;
            vertices.extend((1..pieces).map(|piece| {
                let part = f64::from(piece) / f64::from(pieces);
                let between = |from: Point<D>, to: Point<D>| from + (to - from) * part;
                let path =
                    Path { start: between(a.path.start, b.path.start), end: between(a.path.end, b.path.end) };
                let reference = between(a.point.reference, b.point.reference);
                let point = BodyPoint { reference, body: a.point.body };
                MovingVertex { ends: [first, last], point, path }
            }));
        }
        vertices
    }
}

/// Paths of the nodes of a contactor facet, as the target sees them.
pub(super) fn nodes_of<const D: usize>(
    contact: &LocalContact<D>,
    facet: &SurfaceFacet,
    ends: StepEnds<'_>,
) -> Vec<Path<D>> {
    let surface = contact.surface();
    let nodes = surface.reference_points(facet).iter().zip(surface.facet_nodes(facet));
    nodes.map(|(reference, &node)| contact.target().see(ends.path(reference, node))).collect()
}

/// Paths of the points of a contactor facet over an obstacle, given those of its nodes.
pub(super) fn points_of<const D: usize>(
    obstacle: &dyn Shape<D>,
    kind: ElementKind,
    plane: PlaneState,
    nodes: &[Path<D>],
) -> impl Iterator<Item = Path<D>> {
    shapes_of(obstacle, kind, plane).map(move |shape| {
        let between =
            |at: fn(&Path<D>) -> Point<D>| nodes.iter().zip(shape).map(|(node, n)| at(node) * n).sum();
        Path { start: between(|node| node.start), end: between(|node| node.end) }
    })
}

/// Reference positions of the points of a contactor facet over an obstacle, in the order of
/// [`points_of`], given those of its nodes \[m\].
pub(super) fn reference_of<const D: usize>(
    obstacle: &dyn Shape<D>,
    kind: ElementKind,
    plane: PlaneState,
    nodes: &[Point<D>],
) -> impl Iterator<Item = Point<D>> {
    shapes_of(obstacle, kind, plane).map(move |shape| nodes.iter().zip(shape).map(|(node, n)| node * n).sum())
}

/// Values of the shape functions at the points of a contactor facet over an obstacle.
fn shapes_of<const D: usize>(
    obstacle: &dyn Shape<D>,
    kind: ElementKind,
    plane: PlaneState,
) -> impl Iterator<Item = [f64; MOST_NODES]> {
    let points = rule_of(obstacle, kind, plane).points.iter();
    points.map(move |&[first, second, _]| FacetShape::at(kind, [first, second]).value)
}

/// Corners of the lines or triangles that fill the corners of a facet.
pub(super) fn parts(kind: ElementKind, mut receive: impl FnMut(&[usize])) {
    match (kind.dimension(), kind.corners()) {
        (1, _) => receive(&[0, 1]),
        (_, 3) => receive(&[0, 1, 2]),
        _ => {
            receive(&[0, 1, 2]);
            receive(&[0, 2, 3]);
        }
    }
}

/// A box around everything that moves on these paths.
pub(super) fn around<const D: usize>(paths: &[Path<D>]) -> Bounds<D> {
    Bounds::of(paths.iter().flat_map(|path| [path.start.into(), path.end.into()]))
}
