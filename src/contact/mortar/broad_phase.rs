//! Broad phase: finds the pairs of facets that may have common segments.

use super::candidates::{CandidateRange, Candidates};
use super::contact::VertexContact;
use super::facing::FacetNormal;
use super::shape::FacetShape;
use crate::mesh::{Bounds, BoundsTree, ElementKind};
use crate::space::facet_normal;
use crate::tensor::Vector;

impl<const D: usize> VertexContact<D> {
    /// Candidates from these pairs of facets (contactor, target), in ascending order.
    pub fn candidates_of(&self, couples: Vec<(u32, u32)>) -> Candidates<D> {
        let mut facets: Vec<u32> = couples.iter().map(|&(facet, _)| facet).collect();
        facets.dedup();
        let mut targets: Vec<u32> = couples.iter().map(|&(_, target)| target).collect();
        targets.sort_unstable();
        targets.dedup();
        let mut nodes = Vec::new();
        for facet in facets {
            nodes.extend_from_slice(self.surface.facet_nodes(&self.surface.facets()[facet as usize]));
        }
        for target in targets {
            nodes.extend_from_slice(self.target.nodes(target));
        }
        nodes.sort_unstable();
        nodes.dedup();
        Candidates::new(couples, nodes)
    }

    /// Pairs (contactor facet, target facet) that come within `range` of having a common segment at
    /// the displacements `u`. A pair without a segment contributes nothing, so surplus pairs cost
    /// time only. A missing pair would change the result.
    ///
    /// Pairs of facets that share a node are excluded: surfaces of one body that meet at an edge do
    /// not press on each other there. Pairs whose normals are more alike than `range.alike` are excluded too,
    /// for instance neighbours on a surface that is in contact with itself: they have the weight zero. Over
    /// an obstacle every facet is a candidate.
    pub fn candidates(&self, u: &[f64], range: &CandidateRange) -> Candidates<D> {
        let Some(opposite) = self.target.body() else {
            return self
                .candidates_of((0..self.surface.facets().len() as u32).map(|facet| (facet, 0)).collect());
        };
        let mut couples = Vec::new();
        let targets = 0..opposite.count() as u32;
        let mut nodes = Vec::new();
        let mut boxes = Vec::with_capacity(opposite.count());
        let mut normals = Vec::with_capacity(opposite.count());
        for target in targets {
            opposite.current(target, u, &mut nodes);
            normals.push(FacetNormal::of(opposite.kind(target), &nodes));
            boxes.push(Bounds::of_facet(opposite.kind(target), nodes.iter().map(|&x| x.into())));
        }
        let tree = BoundsTree::new(&boxes);
        let mut positions = Vec::new();
        for (index, facet) in self.surface.facets().iter().enumerate() {
            let own = self.surface.facet_nodes(facet);
            positions.clear();
            let placed = self.surface.reference_points(facet).iter().zip(own);
            positions.extend(placed.map(|(x, &n)| x + Vector::from_column_slice(&u[n as usize * D..][..D])));
            let around = Bounds::of_facet(facet.kind, positions.iter().map(|&x: &Vector<D>| x.into()));
            let around = around.inflate(range.farthest::<D>());
            let column = Column::of(facet.kind, &positions, range);
            let normal = FacetNormal::of(facet.kind, &positions);
            let may_reach = |bounds: &Bounds<D>| {
                around.meets(bounds) && column.as_ref().is_none_or(|column| column.may_reach(bounds))
            };
            for target in tree.admitted(may_reach) {
                let others = opposite.nodes(target);
                let is_like = |limit| normal.is_like(&normals[target as usize], limit);
                if range.alike.is_some_and(is_like) || own.iter().any(|node| others.contains(node)) {
                    continue;
                }
                opposite.current(target, u, &mut nodes);
                if column.as_ref().is_none_or(|column| column.reaches(&nodes)) {
                    couples.push((index as u32, target));
                }
            }
        }
        couples.sort_unstable();
        self.candidates_of(couples)
    }
}

/// The surroundings of a facet: its extent along its normal and along its surface, with the range
/// in these directions. At an oblique facet it is much thinner than the axis-aligned box around it.
struct Column<const D: usize> {
    slabs: [Slab<D>; D],
}

impl<const D: usize> Column<D> {
    /// The surroundings of the facet with these nodes; `None` if it has no normal.
    fn of(kind: ElementKind, nodes: &[Vector<D>], range: &CandidateRange) -> Option<Self> {
        let centre = if kind.corners() == 3 { [1.0 / 3.0; 2] } else { [0.0; 2] };
        let shape = FacetShape::at(kind, centre);
        let tangent = |k: usize| nodes.iter().zip(shape.gradient).map(|(x, g)| x * g[k]).sum::<Vector<D>>();
        let first = tangent(0).try_normalize(0.0)?;
        let across = match D {
            2 => facet_normal(&[first, Vector::zeros()]),
            _ => facet_normal(&[first, tangent(1)]).try_normalize(0.0)?,
        };
        let slab = |k: usize| match k {
            0 => Slab::of(across, nodes, range.across),
            1 => Slab::of(first, nodes, range.along),
            _ => Slab::of(facet_normal(&[across, first]), nodes, range.along),
        };
        Some(Self { slabs: std::array::from_fn(slab) })
    }

    /// Whether the facet with these nodes reaches into every slab.
    fn reaches(&self, nodes: &[Vector<D>]) -> bool {
        self.slabs.iter().all(|slab| slab.meets(slab.extent(nodes)))
    }

    /// Whether a facet within the box may reach into every slab.
    fn may_reach(&self, bounds: &Bounds<D>) -> bool {
        self.slabs.iter().all(|slab| slab.meets(slab.extent_of_box(bounds)))
    }
}

/// The extent of a facet along a direction, and the range beyond both of its ends.
struct Slab<const D: usize> {
    axis: Vector<D>,
    own: Extent,
    range: f64,
}

/// Smallest and largest coordinate along a direction \[m\].
#[derive(Clone, Copy)]
struct Extent {
    low: f64,
    high: f64,
}

impl Extent {
    const EMPTY: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };
}

impl<const D: usize> Slab<D> {
    fn of(axis: Vector<D>, nodes: &[Vector<D>], range: f64) -> Self {
        let mut slab = Self { axis, own: Extent::EMPTY, range };
        slab.own = slab.extent(nodes);
        slab
    }

    fn extent(&self, nodes: &[Vector<D>]) -> Extent {
        nodes
            .iter()
            .map(|x| x.dot(&self.axis))
            .fold(Extent::EMPTY, |extent, at| Extent { low: extent.low.min(at), high: extent.high.max(at) })
    }

    /// The extent of a box that is not empty.
    ///
    /// It contains the extent of all nodes in the box, also after rounding: products and sums of
    /// larger numbers are never rounded to smaller ones.
    fn extent_of_box(&self, bounds: &Bounds<D>) -> Extent {
        let corner = |ahead: bool| {
            Vector::<D>::from_fn(|k, _| match (self.axis[k] >= 0.0) == ahead {
                true => bounds.high[k],
                false => bounds.low[k],
            })
        };
        Extent { low: corner(false).dot(&self.axis), high: corner(true).dot(&self.axis) }
    }

    fn meets(&self, other: Extent) -> bool {
        self.own.low - self.range <= other.high && other.low - self.range <= self.own.high
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::facing::ALIKE;
    use super::super::surface::VertexSurface;
    use super::*;
    use crate::contact::nodal::at;
    use crate::contact::pair_scene::{block, frictionless, target};
    use crate::contact::surface::Ownership;
    use crate::contact::target::ContactTarget;
    use crate::mesh::{Mesh, merge};
    use crate::taylor::scatter;

    /// A shell between these radii, around the whole circle in its first direction. Its outer side
    /// is `top`.
    fn shell<const D: usize>(element: ElementKind, radii: [f64; 2], cells: u32) -> Mesh<D> {
        let mut mesh = block::<D>(element, [-1.0, 1.0], radii, cells);
        for point in &mut mesh.points {
            let radius = point[D - 1];
            let (sine, cosine) = (PI * point[0]).sin_cos();
            let latitude = if D == 3 { 1.2 * point[1] } else { 0.0 };
            point[0] = radius * latitude.cos() * sine;
            point[1] = radius * latitude.sin();
            point[D - 1] = radius * latitude.cos() * cosine;
        }
        mesh
    }

    /// The outer side of one shell opposite the inner side of a wider one.
    fn nested<const D: usize>(element: ElementKind) -> (VertexContact<D>, usize) {
        let cells = if D == 2 { 60 } else { 14 };
        let inner = shell::<D>(element, [0.8, 1.0], cells);
        let outer = shell::<D>(element, [1.02, 1.2], cells - 3);
        let mesh = merge(vec![("inner".to_owned(), inner), ("outer".to_owned(), outer)]).unwrap();
        let mine = vec![true; mesh.element_count()];
        let global: Vec<u32> = (0..mesh.element_count() as u32).collect();
        let ownership = Ownership { owned_nodes: mesh.points.len(), mine: &mine, global_element: &global };
        let contactor = &mesh.facet_sets["inner.top"];
        let target = ContactTarget::Body(target(&mesh, &["outer.bottom"]));
        let surface = VertexSurface::new(&mesh, contactor, &ownership, &target);
        let contact = frictionless(surface, target);
        (contact, mesh.points.len() * D)
    }

    /// The couples by a test of every pair of facets.
    fn all_near<const D: usize>(
        contact: &VertexContact<D>,
        u: &[f64],
        range: &CandidateRange,
    ) -> Vec<(u32, u32)> {
        let opposite = contact.target.body().unwrap();
        let around = |kind: ElementKind, nodes: &[Vector<D>]| {
            Bounds::of_facet(kind, nodes.iter().map(|&x: &Vector<D>| x.into()))
        };
        let mut couples = Vec::new();
        let mut nodes = Vec::new();
        for (index, facet) in contact.surface.facets().iter().enumerate() {
            let reference = contact.surface.reference_points(facet).iter();
            let own: Vec<Vector<D>> =
                reference.zip(contact.surface.facet_nodes(facet)).map(|(x, &n)| x + at(u, n)).collect();
            let bounds = around(facet.kind, &own).inflate(range.farthest::<D>());
            let column = Column::of(facet.kind, &own, range).unwrap();
            for target in 0..opposite.count() as u32 {
                opposite.current(target, u, &mut nodes);
                if bounds.meets(&around(opposite.kind(target), &nodes)) && column.reaches(&nodes) {
                    couples.push((index as u32, target));
                }
            }
        }
        couples
    }

    /// The whole surface of a block against itself: no facet is coupled with one of the same side, and
    /// every other couple remains.
    fn check_facing<const D: usize>(element: ElementKind) {
        let mesh = merge(vec![("block".to_owned(), block::<D>(element, [0.0, 1.0], [0.0, 1.0], 4))]).unwrap();
        let mine = vec![true; mesh.element_count()];
        let global: Vec<u32> = (0..mesh.element_count() as u32).collect();
        let ownership = Ownership { owned_nodes: mesh.points.len(), mine: &mine, global_element: &global };
        let sides = ["block.bottom", "block.top", "block.left", "block.right"];
        let facets: Vec<_> = sides.iter().flat_map(|&side| mesh.facet_sets[side].clone()).collect();
        let opposite = target(&mesh, &sides);
        let target = ContactTarget::Body(opposite);
        let surface = VertexSurface::new(&mesh, &facets, &ownership, &target);
        let contact = frictionless(surface, target);
        let u = vec![0.0; mesh.points.len() * D];
        let couples = |alike| {
            let range = CandidateRange { across: 0.6, along: 0.6, alike };
            contact.candidates(&u, &range).couples().to_vec()
        };
        let opposite = contact.target.body().unwrap();
        let direction = |kind: ElementKind, points: &[Vector<D>]| FacetNormal::of(kind, points);
        let of_target: Vec<_> = (0..opposite.count() as u32)
            .map(|target| direction(opposite.kind(target), opposite.reference_points(target)))
            .collect();
        let surface = &contact.surface;
        let of_contactor = |facet: u32| {
            let facet = &surface.facets()[facet as usize];
            direction(facet.kind, surface.reference_points(facet))
        };
        let alike = |&(facet, target): &(u32, u32)| {
            of_contactor(facet).vector().dot(&of_target[target as usize].vector()) > 0.9
        };
        let (all, facing) = (couples(None), couples(Some(ALIKE)));
        assert!(all.iter().any(alike), "{element}");
        assert_eq!(facing, all.into_iter().filter(|couple| !alike(couple)).collect::<Vec<_>>(), "{element}");
    }

    /// Facets that look in the same direction are left out if asked.
    #[test]
    fn facets_of_one_side_are_no_couples() {
        check_facing::<2>(ElementKind::Quad4);
        check_facing::<2>(ElementKind::Tri3);
        check_facing::<3>(ElementKind::Hex8);
        check_facing::<3>(ElementKind::Tet4);
    }

    fn check<const D: usize>(element: ElementKind) {
        let (contact, size) = nested::<D>(element);
        let facets = contact.surface.facets().len() * contact.target.body().unwrap().count();
        let u: Vec<f64> = scatter(size, 3).iter().map(|u| 0.02 * u).collect();
        for across in [0.0, 0.1, 0.5, 3.0] {
            for along in [0.0, 0.1, 0.4] {
                let range = CandidateRange { across, along, alike: None };
                let expected = all_near(&contact, &u, &range);
                assert!(!expected.is_empty() && expected.len() < facets / 2, "{element}, {range:?}");
                assert_eq!(contact.candidates(&u, &range).couples(), expected, "{element}, {range:?}");
            }
        }
    }

    /// The search through the tree finds the same couples as a test of every pair, for rings and
    /// spherical shells with a range from zero to beyond the opposite side.
    #[test]
    fn curved_shells_have_all_their_couples() {
        for element in [ElementKind::Quad4, ElementKind::Tri3, ElementKind::Quad9] {
            check::<2>(element);
        }
        for element in [ElementKind::Hex8, ElementKind::Tet4, ElementKind::Hex27] {
            check::<3>(element);
        }
    }
}
