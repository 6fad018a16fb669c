//! Bodies that overlap slightly at the start: points of the surface of one body inside the other,
//! and their depth.

use std::collections::HashMap;

use super::conformity::nearest::distance;
use crate::case::{ALL, Case, SetNames};
use crate::mesh::{Bounds, BoundsTree, Facet, FacetIndex, Mesh};
use crate::space::{facet_normal, facet_tangents, locate, reference};
use crate::tensor::Vector;

/// Maximum number of points of one surface that are located in the other body. 1e5 points take
/// about a second.
const MOST: usize = 100_000;

/// Ratio of depth to facet size up to which surfaces count as touching. Coordinates in mesh files
/// may have as few as four digits. Half of the value gives the same result on all scenes. With
/// twice the value an overlap of a five hundredth of an element is not reported.
const TOUCH: f64 = 1e-3;

/// Facets that meet at a larger angle form an edge instead of a curved surface \[rad\].
const EDGE: f64 = 0.5;

/// Distance of a flat facet from the surface through its corners, divided by its size times the
/// angle to its neighbour. The exact value is 1/8 in the plane and 0.29 for triangles on a sphere.
const SAGITTA: f64 = 0.3;

/// The deepest point of a surface inside another body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Intrusion<const D: usize> {
    /// Position \[m\].
    pub place: [f64; D],
    /// Its distance from the surface of the other body \[m\].
    pub depth: f64,
}

/// A body of the merged mesh.
#[derive(Clone, Copy)]
pub(super) struct MergedBody<'a> {
    pub name: &'a str,
    pub number: usize,
    pub elements: &'a [u32],
}

/// Surfaces of two bodies near the intersection of their bounding boxes.
pub(super) struct Neighbours<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    sides: [Side<'a, D>; 2],
    facing: Vec<[BoxedFacets<'a, D>; 2]>,
}

/// One of the two bodies.
struct Side<'a, const D: usize> {
    elements: Vec<u32>,
    tree: BoundsTree<D>,
    surface: BoxedFacets<'a, D>,
    /// Facets of the surface at each node.
    at_node: HashMap<u32, Vec<u32>>,
}

/// Facets with their bounding boxes.
struct BoxedFacets<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    facets: Vec<Facet>,
    boxes: Vec<Bounds<D>>,
    tree: BoundsTree<D>,
}

/// A point of a surface.
struct Sample<const D: usize> {
    place: [f64; D],
    facet: u32,
    /// Whether it is a node; otherwise it is the centre of a facet.
    is_node: bool,
}

impl<'a, const D: usize> Neighbours<'a, D> {
    /// The surfaces of `bodies` near the box `common`.
    pub fn new(case: &Case, mesh: &'a Mesh<D>, bodies: [MergedBody<'_>; 2], common: &Bounds<D>) -> Self {
        let box_of = |element: u32| {
            Bounds::of(mesh.element_nodes(element as usize).iter().map(|&node| mesh.points[node as usize]))
        };
        let meets = |elements: &[u32], region: &Bounds<D>| -> Vec<u32> {
            elements.iter().copied().filter(|&element| box_of(element).meets(region)).collect()
        };
        let near = bodies.map(|body| meets(body.elements, common));
        let largest = near.iter().flatten().map(|&element| box_of(element).extent()).fold(0.0, f64::max);
        let region = common.inflate(largest);
        let sides = bodies.map(|body| {
            let elements = meets(body.elements, &region);
            let surface = FacetIndex::of(mesh, elements.iter().copied()).boundary();
            // A side that is shared with an element outside of the region does not intersect the
            // region.
            let surface = BoxedFacets::new(mesh, surface.into_iter(), &region);
            let mut at_node: HashMap<u32, Vec<u32>> = HashMap::new();
            let mut nodes = Vec::new();
            for (number, &facet) in (0..).zip(&surface.facets) {
                mesh.facet_nodes(facet, &mut nodes);
                nodes.iter().for_each(|&node| at_node.entry(node).or_default().push(number));
            }
            let boxes: Vec<Bounds<D>> = elements.iter().map(|&element| box_of(element)).collect();
            Side { tree: BoundsTree::new(&boxes), elements, surface, at_node }
        });
        let facing = facing(case, mesh, bodies, &region);
        Self { mesh, sides, facing }
    }

    /// The deepest point of the surface of one body inside the other that is not covered by a
    /// contact between them.
    pub fn deepest(&self) -> Option<Intrusion<D>> {
        let both = [[0, 1], [1, 0]].into_iter().filter_map(|[inner, outer]| {
            let mut found = self.inside(&self.sides[inner], &self.sides[outer]);
            // Equal depths are ordered so that the result is the same on every machine.
            found.sort_by(|a, b| (b.1.depth as f32).total_cmp(&(a.1.depth as f32)));
            let free = found.into_iter().find(|(reach, found)| !self.is_covered(&found.place, *reach));
            free.map(|(_, found)| found)
        });
        both.reduce(|a, b| if b.depth > a.depth * (1.0 + 1e-9) { b } else { a })
    }

    /// Points of the surface of `inner` that lie inside `outer`, each with the distance at which a
    /// contact detects it \[m\].
    fn inside(&self, inner: &Side<'_, D>, outer: &Side<'_, D>) -> Vec<(f64, Intrusion<D>)> {
        let samples = inner.samples();
        let stride = samples.len().div_ceil(MOST).max(1);
        let depth = |sample: Sample<D>| {
            let at = Bounds::of([sample.place]);
            let candidates = outer.tree.meeting(&at).map(|number| outer.elements[number as usize]);
            let element = locate(self.mesh, candidates, &sample.place)?.element;
            let nodes = self.mesh.element_nodes(element as usize);
            let size = Bounds::of(nodes.iter().map(|&node| self.mesh.points[node as usize])).extent();
            let own = inner.surface.size(sample.facet);
            let touches =
                |&(distance, facet): &(f64, u32)| distance <= TOUCH * own.min(outer.surface.size(facet));
            if outer.surface.nearest(sample.place, TOUCH * own).is_some_and(|near| touches(&near)) {
                return None;
            }
            let nearest = outer.surface.nearest(sample.place, size);
            let depth = nearest.map_or(size, |(depth, _)| depth);
            let other = nearest.map_or(size, |(_, facet)| outer.surface.size(facet));
            let mut tolerance = TOUCH * own.min(other);
            if depth > tolerance {
                tolerance = tolerance.max(nearest.map_or(0.0, |(_, facet)| outer.sagitta(facet)));
                tolerance += if sample.is_node { 0.0 } else { inner.sagitta(sample.facet) };
            }
            (depth > tolerance).then_some((depth + own + other, Intrusion { place: sample.place, depth }))
        };
        samples.into_iter().step_by(stride).filter_map(depth).collect()
    }

    /// Whether surfaces of a contact between the bodies face each other near a point.
    fn is_covered(&self, place: &[f64; D], reach: f64) -> bool {
        let around = Bounds::of([*place]).inflate(reach);
        self.facing.iter().any(|[one, other]| {
            let opposite: Vec<Vector<D>> =
                other.tree.meeting(&around).map(|facet| other.normal(facet)).collect();
            one.tree.meeting(&around).any(|facet| {
                let normal = one.normal(facet);
                opposite.iter().any(|other| normal.dot(other) < 0.0)
            })
        })
    }
}

/// The two surfaces of each contact between the bodies, near a region.
fn facing<'a, const D: usize>(
    case: &Case,
    mesh: &'a Mesh<D>,
    bodies: [MergedBody<'_>; 2],
    region: &Bounds<D>,
) -> Vec<[BoxedFacets<'a, D>; 2]> {
    let mut found = Vec::new();
    for contact in case.contact.values() {
        for [one, other] in [bodies, [bodies[1], bodies[0]]] {
            let of = |side: &SetNames, body: MergedBody<'_>| -> Option<BoxedFacets<'a, D>> {
                if side.value != ALL && !side.bodies().any(|name| name == body.name) {
                    return None;
                }
                let facets = mesh.facet_sets.get(&side.value)?.iter().copied();
                let own =
                    facets.filter(|facet| usize::from(mesh.body[facet.element as usize]) == body.number);
                Some(BoxedFacets::new(mesh, own, region))
            };
            if let (Some(one), Some(other)) = (of(&contact.contactor, one), of(&contact.target, other)) {
                found.push([one, other]);
            }
        }
    }
    found
}

impl<const D: usize> Side<'_, D> {
    /// All nodes of the surface, and the centres of its facets.
    fn samples(&self) -> Vec<Sample<D>> {
        let mesh = self.surface.mesh;
        let mut nodes: Vec<(u32, u32)> =
            self.at_node.iter().map(|(&node, facets)| (node, facets[0])).collect();
        nodes.sort_unstable();
        let nodes = nodes.into_iter().map(|(node, facet)| Sample {
            place: mesh.points[node as usize],
            facet,
            is_node: true,
        });
        let centres = (0..).zip(&self.surface.facets).map(|(number, &facet)| {
            let corners: Vec<[f64; D]> =
                mesh.facet_corners(facet).map(|node| mesh.points[node as usize]).collect();
            let mean = |k: usize| corners.iter().map(|corner| corner[k]).sum::<f64>() / corners.len() as f64;
            Sample { place: std::array::from_fn(mean), facet: number, is_node: false }
        });
        nodes.chain(centres).collect()
    }

    /// Maximum distance of a facet from the curved surface that it approximates \[m\]. It is
    /// estimated from the angles between its normals and those of its neighbours at common corners.
    /// For curved facets that join smoothly it is zero.
    fn sagitta(&self, facet: u32) -> f64 {
        let surface = &self.surface;
        let mesh = surface.mesh;
        let corners = |number: u32| mesh.facet_corners(surface.facets[number as usize]);
        let mut angle = 0.0_f64;
        for (corner, node) in corners(facet).enumerate() {
            let normal = surface.corner_normal(facet, corner);
            for &neighbour in self.at_node.get(&node).into_iter().flatten() {
                let Some(corner) = corners(neighbour).position(|other| other == node) else { continue };
                let between = normal.dot(&surface.corner_normal(neighbour, corner)).clamp(-1.0, 1.0).acos();
                angle = if between < EDGE { angle.max(between) } else { angle };
            }
        }
        SAGITTA * angle * surface.size(facet)
    }
}

impl<'a, const D: usize> BoxedFacets<'a, D> {
    /// The facets that intersect a region.
    fn new(mesh: &'a Mesh<D>, facets: impl Iterator<Item = Facet>, region: &Bounds<D>) -> Self {
        let mut nodes = Vec::new();
        let mut boxes = Vec::new();
        let facets = facets.filter(|&facet| {
            mesh.facet_nodes(facet, &mut nodes);
            let places = nodes.iter().map(|&node| mesh.points[node as usize]);
            let around = Bounds::of_facet(mesh.facet_kind(facet), places);
            let meets = around.meets(region);
            boxes.extend(meets.then_some(around));
            meets
        });
        let facets = facets.collect();
        Self { mesh, facets, tree: BoundsTree::new(&boxes), boxes }
    }

    /// The nearest facet within `reach`, and its distance \[m\].
    fn nearest(&self, place: [f64; D], reach: f64) -> Option<(f64, u32)> {
        let around = Bounds::of([place]).inflate(reach);
        let bound = |number: u32| {
            let Bounds { low, high } = &self.boxes[number as usize];
            let beyond = |k: usize| (low[k] - place[k]).max(place[k] - high[k]).max(0.0);
            (0..D).map(|k| beyond(k).powi(2)).sum::<f64>().sqrt()
        };
        let mut near: Vec<(f64, u32)> =
            self.tree.meeting(&around).map(|number| (bound(number), number)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut best: Option<(f64, u32)> = None;
        for (bound, number) in near {
            if best.is_some_and(|(distance, _)| bound >= distance) {
                break;
            }
            let distance = self.distance(number, &Vector::from(place));
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, number));
            }
        }
        best
    }

    fn places(&self, number: u32) -> Vec<Vector<D>> {
        let mut nodes = Vec::new();
        self.mesh.facet_nodes(self.facets[number as usize], &mut nodes);
        nodes.iter().map(|&node| self.mesh.points[node as usize].into()).collect()
    }

    /// Largest distance between two nodes of a facet along an axis \[m\].
    fn size(&self, number: u32) -> f64 {
        Bounds::of(self.places(number).into_iter().map(Into::into)).extent()
    }

    fn distance(&self, number: u32, place: &Vector<D>) -> f64 {
        distance(place, self.mesh.facet_kind(self.facets[number as usize]), &self.places(number))
    }

    /// Outward unit normal at a corner of a facet.
    fn corner_normal(&self, number: u32, corner: usize) -> Vector<D> {
        let kind = reference(self.mesh.facet_kind(self.facets[number as usize]));
        let places = self.places(number);
        let mut gradient = vec![0.0; places.len() * (D - 1)];
        kind.gradient(&kind.node_coordinates()[corner], &mut gradient);
        facet_normal(&facet_tangents(&places, &gradient)).normalize()
    }

    /// Mean of the normals at the corners of a facet.
    fn normal(&self, number: u32) -> Vector<D> {
        let corners = self.mesh.facet_kind(self.facets[number as usize]).corners();
        (0..corners).map(|corner| self.corner_normal(number, corner)).sum()
    }
}
