//! A contact of a surface with a deformable body by segments: sums over pairs first, then the laws of the vertices.

use super::integrals::{Carried, FacetPair, Measure, PairFields, PairIntegrals, PlacedFacet, Range};
use super::kernel::{VertexNode, VertexSums, add_stiffness};
use super::split::MOST_CORNERS;
use super::surface::{VertexFacet, VertexSurface};
use crate::contact::evaluation::{AreaKind, ContactFields, ContactRequest};
use crate::contact::point::{ContactLaw, PointState, Slopes};
use crate::contact::state::ContactState;
use crate::contact::target::TargetSurface;
use crate::tensor::Vector;
use crate::terms::Terms;

/// Receives what a contact contributes.
pub trait SegmentSink {
    /// `force[a * D + i]` of these nodes (places in the field arrays), to be added to the right-hand side [N, per depth in 2D].
    fn force(&mut self, nodes: &[u32], force: &[f64]);

    /// `stiffness[((a * m + b) * D + i) * D + j]` of `m` nodes, all of which belong to `vertex`, to be added to the left-hand
    /// matrix \[N/m\].
    fn stiffness(&mut self, vertex: usize, nodes: &[u32], stiffness: &[f64]);
}

/// One contact with a deformable target by segments.
#[derive(Debug, Clone)]
pub struct SegmentContact<const D: usize> {
    /// Contactor: the vertices of this rank.
    pub surface: VertexSurface<D>,
    /// Target.
    pub target: TargetSurface<D>,
    /// Laws.
    pub law: ContactLaw,
    /// Area on which the tractions act.
    pub area: AreaKind,
    /// Points deeper than this below the target come from its other side \[m\].
    pub depth: f64,
}

/// Part of the size of a contactor facet beyond which a segment is open for good.
const OPEN: f64 = 0.5;

/// A pair of facets with common segments.
struct ActivePair<const D: usize> {
    facet: u32,
    target: u32,
    integrals: PairIntegrals<D>,
}

/// A closed vertex with what its stiffness needs.
struct ClosedVertex<const D: usize> {
    vertex: usize,
    slopes: Slopes<D>,
    nodes: Vec<VertexNode<D>>,
    by_area: Vec<Vector<D>>,
}

/// Positions and fields of the nodes of a pair; refilled for each, so that nothing is allocated anew.
struct Gathered<const D: usize> {
    nodes: Vec<u32>,
    positions: Vec<Vector<D>>,
    velocities: Vec<Vector<D>>,
    increments: Vec<Vector<D>>,
    contactor: usize,
}

impl<const D: usize> Gathered<D> {
    fn new() -> Self {
        Self {
            nodes: Vec::new(),
            positions: Vec::new(),
            velocities: Vec::new(),
            increments: Vec::new(),
            contactor: 0,
        }
    }

    /// Takes the nodes of a contactor facet. Positions are measured from its first node from now on: far from the origin gaps
    /// would lose digits otherwise.
    fn begin(&mut self, reference: &[Vector<D>], nodes: &[u32], fields: &ContactFields<'_>) {
        self.contactor = 0;
        self.keep_contactor();
        self.append([&reference[0], &at(fields.u, nodes[0])], reference, nodes, fields);
        self.contactor = nodes.len();
    }

    /// Takes the nodes of a target facet in the place of those of another.
    fn oppose(
        &mut self,
        origin: [&Vector<D>; 2],
        reference: &[Vector<D>],
        nodes: &[u32],
        fields: &ContactFields<'_>,
    ) {
        self.keep_contactor();
        self.append(origin, reference, nodes, fields);
    }

    fn keep_contactor(&mut self) {
        self.nodes.truncate(self.contactor);
        self.positions.truncate(self.contactor);
        self.velocities.truncate(self.contactor);
        self.increments.truncate(self.contactor);
    }

    fn append(
        &mut self,
        [origin, origin_u]: [&Vector<D>; 2],
        reference: &[Vector<D>],
        nodes: &[u32],
        fields: &ContactFields<'_>,
    ) {
        self.nodes.extend_from_slice(nodes);
        for (x, &node) in reference.iter().zip(nodes) {
            let u: Vector<D> = at(fields.u, node);
            self.positions.push((x - origin) + (u - origin_u));
            self.velocities.push(at(fields.v, node));
            self.increments.push(u - at(fields.u_start, node));
        }
    }
}

fn at<const D: usize>(field: &[f64], node: u32) -> Vector<D> {
    Vector::from_column_slice(&field[node as usize * D..][..D])
}

impl<const D: usize> SegmentContact<D> {
    /// Evaluates all vertices at `fields`, keeps their states in `state.current` and hands what they contribute to `sink`. `couples`
    /// are the facets that may meet (contactor, target), in ascending order.
    pub fn evaluate(
        &self,
        couples: &[(u32, u32)],
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        sink: &mut impl SegmentSink,
    ) {
        let (pairs, sums) = self.integrate(couples, fields);
        let slopes = self.respond(&sums, request, state);
        match &request.stiffness {
            None => self.add_forces(&pairs, &state.current, sink),
            Some(_) => self.add_stiffness(&pairs, &sums, &slopes, fields, request, state, sink),
        }
    }

    /// Pairs with common segments, and the sums of all vertices.
    fn integrate(
        &self,
        couples: &[(u32, u32)],
        fields: &ContactFields<'_>,
    ) -> (Vec<ActivePair<D>>, Vec<VertexSums<D>>) {
        let mut pairs = Vec::new();
        let mut sums = vec![VertexSums::default(); self.surface.vertices().len()];
        self.sweep(couples.iter().copied(), fields, |facet, target, gathered, pair| {
            if !may_meet(pair) {
                return;
            }
            let Some(integrals) = pair.integrate() else { return };
            for (vertex, own) in
                self.surface.facets()[facet as usize].vertices.iter().zip(&integrals.vertices)
            {
                let Some(vertex) = vertex else { continue };
                let sum = &mut sums[*vertex as usize];
                sum.area += own.area;
                sum.gap += own.gap;
                sum.normal += own.normal;
                sum.depth = sum.depth.max(integrals.depth);
                for (slip, field) in sum.slips.iter_mut().zip([&gathered.velocities, &gathered.increments]) {
                    for (value, coefficient) in field.iter().zip(own.coefficients) {
                        *slip += value * coefficient;
                    }
                }
            }
            pairs.push(ActivePair { facet, target, integrals });
        });
        (pairs, sums)
    }

    /// Calls `visit` with each of these couples at `fields`.
    fn sweep(
        &self,
        couples: impl Iterator<Item = (u32, u32)>,
        fields: &ContactFields<'_>,
        mut visit: impl FnMut(u32, u32, &Gathered<D>, &FacetPair<'_, D>),
    ) {
        let mut gathered = Gathered::new();
        let mut last = None;
        for (index, target) in couples {
            let facet = &self.surface.facets()[index as usize];
            let nodes = self.surface.facet_nodes(facet);
            let reference = self.surface.reference_points(facet);
            if last != Some(index) {
                gathered.begin(reference, nodes, fields);
                last = Some(index);
            }
            let origin = [&reference[0], &at(fields.u, nodes[0])];
            gathered.oppose(origin, self.target.reference_points(target), self.target.nodes(target), fields);
            let pair = self.pair(facet, target, &gathered, reference);
            visit(index, target, &gathered, &pair);
        }
    }

    fn pair<'a>(
        &self,
        facet: &VertexFacet,
        target: u32,
        gathered: &'a Gathered<D>,
        reference: &'a [Vector<D>],
    ) -> FacetPair<'a, D> {
        let (contactor, others) = gathered.positions.split_at(gathered.contactor);
        FacetPair {
            contactor: PlacedFacet { kind: facet.kind, nodes: contactor },
            target: PlacedFacet { kind: self.target.kind(target), nodes: others },
            measure: match self.area {
                AreaKind::Current => Measure::Current,
                AreaKind::Reference => Measure::Reference(reference),
            },
            range: Range { depth: self.depth, open: OPEN * facet.size },
        }
    }

    /// Evaluates the laws of all vertices.
    fn respond(
        &self,
        sums: &[VertexSums<D>],
        request: &ContactRequest,
        state: &mut ContactState<D>,
    ) -> Vec<Option<Slopes<D>>> {
        let mut all = Vec::with_capacity(sums.len());
        for (vertex, sums) in sums.iter().enumerate() {
            if !sums.is_covered(self.surface.reference_area(vertex)) {
                state.current[vertex] = PointState::default();
                all.push(None);
                continue;
            }
            let manner = state.manner(vertex, request.hold, request.branches);
            let (point, slopes) =
                sums.respond(&self.law, &state.history[vertex], state.adjusted(vertex), &manner);
            state.current[vertex] = point;
            all.push(slopes);
        }
        all
    }

    fn add_forces(&self, pairs: &[ActivePair<D>], points: &[PointState<D>], sink: &mut impl SegmentSink) {
        let mut force = Vec::new();
        let mut nodes = Vec::new();
        for pair in pairs {
            let facet = &self.surface.facets()[pair.facet as usize];
            let contactor = self.surface.facet_nodes(facet);
            force.clear();
            force.resize((contactor.len() + self.target.nodes(pair.target).len()) * D, 0.0);
            let mut closed = false;
            for (vertex, own) in facet.vertices.iter().zip(&pair.integrals.vertices) {
                let Some(vertex) = vertex else { continue };
                let point = &points[*vertex as usize];
                if !point.is_closed() {
                    continue;
                }
                closed = true;
                for (a, force) in force.chunks_exact_mut(D).enumerate() {
                    for i in 0..D {
                        force[i] += own.pushes[a][i] * point.normal_traction
                            + own.coefficients[a] * point.friction_traction[i];
                    }
                }
            }
            if closed {
                nodes.clear();
                nodes.extend_from_slice(contactor);
                nodes.extend_from_slice(self.target.nodes(pair.target));
                sink.force(&nodes, &force);
            }
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn add_stiffness(
        &self,
        pairs: &[ActivePair<D>],
        sums: &[VertexSums<D>],
        slopes: &[Option<Slopes<D>>],
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &ContactState<D>,
        sink: &mut impl SegmentSink,
    ) {
        let Some(selection) = &request.stiffness else { return };
        let mut closed = self.closed(pairs, slopes);
        let number = {
            let mut number = vec![None; slopes.len()];
            closed.iter().enumerate().for_each(|(k, vertex)| number[vertex.vertex] = Some(k));
            number
        };
        let has_closed = |pair: &&ActivePair<D>| {
            let facet = &self.surface.facets()[pair.facet as usize];
            facet.vertices.iter().flatten().any(|&vertex| number[vertex as usize].is_some())
        };
        let active: Vec<&ActivePair<D>> = pairs.iter().filter(has_closed).collect();
        let couples = active.iter().map(|pair| (pair.facet, pair.target));
        let geometry = Terms::NORMAL_GEOMETRY | Terms::FRICTION_GEOMETRY;
        let carries = selection.joint.is_none() && selection.terms.intersects(geometry);
        let mut block = Vec::new();
        let mut visited = active.iter();
        self.sweep(couples, fields, |index, _, gathered, pair| {
            let Some(known) = visited.next() else { return };
            let facet = &self.surface.facets()[index as usize];
            for (vertex, own) in facet.vertices.iter().zip(&known.integrals.vertices) {
                let Some(k) = vertex.and_then(|vertex| number[vertex as usize]) else { continue };
                for (a, &node) in gathered.nodes.iter().enumerate() {
                    let entry = closed[k].entry(node);
                    entry.coefficient += own.coefficients[a];
                    entry.push += own.pushes[a];
                }
            }
            if selection.joint.is_some() {
                return;
            }
            let both = PairFields { fields: [&gathered.velocities, &gathered.increments] };
            pair.vary(&both, |corner, a, by| {
                let Some(k) = facet.vertices[corner].and_then(|vertex| number[vertex as usize]) else {
                    return;
                };
                let place = closed[k].place(gathered.nodes[a]);
                closed[k].by_area[place] += by.area;
                let entry = &mut closed[k].nodes[place];
                entry.gap += by.gap;
                entry.normal += by.normal;
                entry.slips[0] += by.slips[0];
                entry.slips[1] += by.slips[1];
            });
            if !carries {
                return;
            }
            let mut carried = [Carried { normal: 0.0, friction: Vector::zeros() }; MOST_CORNERS];
            let mut owner = None;
            for (carried, vertex) in carried.iter_mut().zip(facet.vertices) {
                let Some(vertex) = vertex.filter(|&vertex| number[vertex as usize].is_some()) else {
                    continue;
                };
                let point = &state.current[vertex as usize];
                owner.get_or_insert(vertex as usize);
                if selection.terms.contains(Terms::NORMAL_GEOMETRY) {
                    carried.normal = point.normal_traction;
                }
                if selection.terms.contains(Terms::FRICTION_GEOMETRY) {
                    carried.friction = point.friction_traction;
                }
            }
            let Some(owner) = owner else { return };
            let count = gathered.nodes.len();
            block.clear();
            block.resize(count * count * D * D, 0.0);
            pair.add_geometry(&carried, selection.terms.contains(Terms::ZONE_CHANGE), &mut block);
            sink.stiffness(owner, &gathered.nodes, &block);
        });
        let mut nodes = Vec::new();
        for vertex in &mut closed {
            let p = vertex.vertex;
            sums[p].normalise(&state.history[p], &vertex.by_area, &mut vertex.nodes);
            let count = vertex.nodes.len();
            block.clear();
            block.resize(count * count * D * D, 0.0);
            add_stiffness(&state.current[p], &vertex.slopes, &vertex.nodes, selection, &mut block);
            nodes.clear();
            nodes.extend(vertex.nodes.iter().map(|node| node.node));
            sink.stiffness(p, &nodes, &block);
        }
    }

    /// Closed vertices with all nodes of their pairs.
    fn closed(&self, pairs: &[ActivePair<D>], slopes: &[Option<Slopes<D>>]) -> Vec<ClosedVertex<D>> {
        let mut closed = Vec::new();
        for (vertex, slopes) in slopes.iter().enumerate() {
            let Some(slopes) = slopes else { continue };
            let mut nodes: Vec<VertexNode<D>> = Vec::new();
            for &facet in self.surface.around(vertex) {
                let first = pairs.partition_point(|pair| pair.facet < facet);
                for pair in pairs[first..].iter().take_while(|pair| pair.facet == facet) {
                    let contactor = self.surface.facet_nodes(&self.surface.facets()[facet as usize]);
                    for &node in contactor.iter().chain(self.target.nodes(pair.target)) {
                        if nodes.iter().all(|known| known.node != node) {
                            nodes.push(VertexNode::of(node));
                        }
                    }
                }
            }
            let by_area = vec![Vector::zeros(); nodes.len()];
            closed.push(ClosedVertex { vertex, slopes: *slopes, nodes, by_area });
        }
        closed
    }
}

impl<const D: usize> ClosedVertex<D> {
    fn place(&self, node: u32) -> usize {
        self.nodes.iter().position(|known| known.node == node).unwrap_or(0)
    }

    fn entry(&mut self, node: u32) -> &mut VertexNode<D> {
        let place = self.place(node);
        &mut self.nodes[place]
    }
}

/// Over the range in which gaps are open: boxes of facets further apart than this have no segment that counts.
const NEAR: f64 = 4.0;

/// Whether the boxes of the two facets are near each other. Far cheaper than to find that there is no segment.
fn may_meet<const D: usize>(pair: &FacetPair<'_, D>) -> bool {
    let range = NEAR * pair.range.open;
    let bounds = |nodes: &[Vector<D>]| {
        let first = nodes[0];
        nodes.iter().fold((first, first), |(low, high), x| (low.inf(x), high.sup(x)))
    };
    let (low, high) = bounds(pair.contactor.nodes);
    let (other_low, other_high) = bounds(pair.target.nodes);
    (0..D).all(|i| low[i] - range <= other_high[i] && other_low[i] - range <= high[i])
}

#[cfg(test)]
#[path = "contact_tests.rs"]
mod tests;
