//! Ties of two surfaces whose meshes need not match (theory, section 3.16).

use super::integrals::{
    AcrossPlane, AreaMeasure, FacetPair, NormalOf, Opposite, PairWorkspace, PlacedFacet, Range,
};
use super::surface::VertexSurface;
use crate::contact::surface::Ownership;
use crate::contact::target::ContactTarget;
use crate::mesh::{Bounds, BoundsTree, Facet, Mesh, Tie};
use crate::tensor::Vector;

/// Part of the undeformed area of a vertex below which it counts as not tied. A tie has the mean
/// jump over its area, which is a quotient of rounding errors when the area is. A value ten times
/// larger or smaller changes nothing, because the force is that part of the traction.
const COVERED: f64 = 1e-10;

/// Two surfaces that are tied in the reference configuration.
#[derive(Debug, Clone, Copy)]
pub struct TiedSurfaces<'a, const D: usize> {
    /// Number of the pair.
    pub pair: u32,
    /// Facets of the contactor, whose vertices carry the ties.
    pub contactor: &'a [Facet],
    /// Facets of the target.
    pub target: &'a [Facet],
    /// Points up to this distance apart are tied; the weight of points farther apart falls to zero
    /// at twice the distance \[m\].
    pub within: f64,
    /// Vector from the contactor to the target in the reference configuration \[m\]; zero if they touch.
    pub offset: Vector<D>,
    /// Stiffness per reference area [Pa/m].
    pub stiffness: f64,
    /// Stiffness per area of an element beneath the contactor [Pa/m].
    pub element_stiffness: f64,
}

/// The ties of two surfaces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceTies {
    /// One for each vertex that is tied.
    pub ties: Vec<Tie>,
    /// Tied area [m, m^2].
    pub area: f64,
    /// Area of the contactor [m, m^2].
    pub whole: f64,
}

/// Sums of a vertex.
#[derive(Debug, Clone, Default)]
struct Sum {
    area: f64,
    own: Vec<(u32, f64)>,
    others: Vec<(u32, f64)>,
}

fn add(list: &mut Vec<(u32, f64)>, node: u32, weight: f64) {
    match list.iter_mut().find(|(known, _)| *known == node) {
        Some((_, sum)) => *sum += weight,
        None => list.push((node, weight)),
    }
}

impl<const D: usize> TiedSurfaces<'_, D> {
    /// Integrates over the segments that the two surfaces share in the reference configuration of
    /// the whole mesh. Facets that share a node, as at the tip of a crack, are not tied.
    pub fn ties(&self, mesh: &Mesh<D>) -> SurfaceTies {
        let number: Vec<u32> = (0..mesh.element_count() as u32).collect();
        let mine = vec![true; number.len()];
        let all = Ownership { owned_nodes: mesh.points.len(), mine: &mine, global_element: &number };
        // Vertices as opposite a body, whose facets do not matter here.
        let surface = VertexSurface::new(mesh, self.contactor, &all, &ContactTarget::unknown_body());
        let mut sums = vec![Sum::default(); surface.vertices().len()];
        let mut nodes = Vec::new();
        let mut around_target = |&facet: &Facet| {
            mesh.facet_nodes(facet, &mut nodes);
            Bounds::of_facet(mesh.facet_kind(facet), nodes.iter().map(|&node| mesh.points[node as usize]))
        };
        let boxes: Vec<Bounds<D>> = self.target.iter().map(&mut around_target).collect();
        let tree = BoundsTree::new(&boxes);
        let near = [self.within, 2.0 * self.within];
        let range = Range { share: 1.0, deep: near, open: near };
        let mut workspace = PairWorkspace::default();
        let mut placed = Vec::new();
        let mut others = Vec::new();
        for facet in surface.facets() {
            let own = surface.facet_nodes(facet);
            let reference = surface.reference_points(facet);
            let origin = reference[0];
            placed.clear();
            placed.extend(reference.iter().map(|x| x - origin));
            let around = Bounds::of_facet(facet.kind, reference.iter().map(|&x| (x + self.offset).into()));
            let mut near: Vec<u32> = tree.meeting(&around.inflate(2.0 * self.within)).collect();
            near.sort_unstable();
            for target in near {
                let target = self.target[target as usize];
                mesh.facet_nodes(target, &mut nodes);
                if own.iter().any(|node| nodes.contains(node)) {
                    continue;
                }
                others.clear();
                let back = origin + self.offset;
                others.extend(nodes.iter().map(|&node| Vector::from(mesh.points[node as usize]) - back));
                let pair = FacetPair {
                    contactor: PlacedFacet { kind: facet.kind, nodes: &placed },
                    target: Opposite::Facet(PlacedFacet { kind: mesh.facet_kind(target), nodes: &others }),
                    measure: AreaMeasure::Reference(reference),
                    range,
                    across: AcrossPlane { plane: mesh.plane, origin: origin[0] },
                    normal_of: NormalOf::Contactor,
                };
                let Some(integrals) = pair.integrate(&mut workspace) else { continue };
                for (vertex, part) in facet.vertices.iter().zip(&integrals.vertices) {
                    let Some(sum) = vertex.and_then(|vertex| sums.get_mut(vertex as usize)) else { continue };
                    sum.area += part.area;
                    let (of_own, of_others) = part.coefficients.split_at(own.len());
                    own.iter().zip(of_own).for_each(|(&node, &weight)| add(&mut sum.own, node, weight));
                    nodes
                        .iter()
                        .zip(of_others)
                        .for_each(|(&node, &weight)| add(&mut sum.others, node, weight));
                }
            }
        }
        let mut found = SurfaceTies::default();
        for (vertex, sum) in sums.into_iter().enumerate() {
            let whole = surface.reference_area(vertex);
            found.whole += whole;
            if sum.area <= COVERED * whole {
                continue;
            }
            found.area += sum.area;
            let contactor = sum.own.len() as u32;
            let (nodes, weights) = sum.own.into_iter().chain(sum.others).unzip();
            found.ties.push(Tie {
                pair: self.pair,
                nodes,
                weights,
                contactor,
                area: sum.area,
                stiffness: self.stiffness,
                element_stiffness: self.element_stiffness,
            });
        }
        found
    }
}
