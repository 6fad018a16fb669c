//! A contact of a surface with a deformable body by segments: sums over pairs first, then the laws of the vertices.

use super::integrals::{Carried, FacetPair, Measure, PairFields, PairIntegrals, PlacedFacet, Range};
use super::kernel::{VertexNode, VertexSums, add_stiffness};
use super::split::MOST_CORNERS;
use super::surface::{VertexFacet, VertexSurface};
use crate::contact::evaluation::{AreaKind, ContactFields, ContactRequest};
use crate::contact::point::{ContactLaw, PointState, Selection, Slopes};
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
    /// Part of the tractions that each side carries as the contactor: 1/2 in a contact of a surface with itself, whose facets are contactors
    /// and targets in turn, else 1.
    pub share: f64,
}

/// Gap, over the size of a contactor facet, from which on a segment point has no weight.
pub const OPEN: f64 = 0.25;

/// Where in a step the nodes are taken to be, the displacements being those of the iterate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Instant {
    /// At the start of the step.
    Start,
    /// At the displacements.
    Iterate,
    /// As far beyond them as they are from the start.
    Beyond,
}

impl Instant {
    /// Displacement of a node, given those at the start and of the iterate.
    fn displacement<const D: usize>(self, start: Vector<D>, iterate: Vector<D>) -> Vector<D> {
        match self {
            Self::Start => start,
            Self::Iterate => iterate,
            Self::Beyond => iterate + (iterate - start),
        }
    }
}

/// A pair of facets with common segments.
pub(super) struct ActivePair<const D: usize> {
    pub facet: u32,
    pub target: u32,
    pub integrals: PairIntegrals<D>,
}

/// All pairs with common segments, and the sums over them of all vertices.
pub(super) struct Overlap<const D: usize> {
    /// In the order of the couples.
    pub pairs: Vec<ActivePair<D>>,
    pub sums: Vec<VertexSums<D>>,
}

/// A vertex with the nodes that it depends on.
pub(super) struct VertexRows<const D: usize> {
    pub vertex: usize,
    pub nodes: Vec<VertexNode<D>>,
    /// Undeformed positions of the nodes \[m\].
    pub reference_points: Vec<Vector<D>>,
    pub by_area: Vec<Vector<D>>,
}

/// Positions and fields of the nodes of a pair; refilled for each, so that nothing is allocated anew.
pub(super) struct Gathered<const D: usize> {
    pub nodes: Vec<u32>,
    positions: Vec<Vector<D>>,
    velocities: Vec<Vector<D>>,
    increments: Vec<Vector<D>>,
    contactor: usize,
    instant: Instant,
}

impl<const D: usize> Gathered<D> {
    fn new(instant: Instant) -> Self {
        Self {
            nodes: Vec::new(),
            positions: Vec::new(),
            velocities: Vec::new(),
            increments: Vec::new(),
            contactor: 0,
            instant,
        }
    }

    /// Takes the nodes of a contactor facet. Positions are measured from its first node from now on: far from the origin gaps
    /// would lose digits otherwise.
    fn begin(&mut self, reference: &[Vector<D>], nodes: &[u32], fields: &ContactFields<'_>) {
        self.contactor = 0;
        self.keep_contactor();
        let origin = self.displacement(nodes[0], fields);
        self.append([&reference[0], &origin], reference, nodes, fields);
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
            let u = self.displacement(node, fields);
            self.positions.push((x - origin) + (u - origin_u));
            self.velocities.push(at(fields.v, node));
            self.increments.push(at::<D>(fields.u, node) - at::<D>(fields.u_start, node));
        }
    }

    fn displacement(&self, node: u32, fields: &ContactFields<'_>) -> Vector<D> {
        self.instant.displacement(at(fields.u_start, node), at(fields.u, node))
    }
}

pub(super) fn at<const D: usize>(field: &[f64], node: u32) -> Vector<D> {
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
        if request.over_step {
            return self.evaluate_over_step(couples, fields, request, state, sink);
        }
        let overlap = self.integrate(couples, fields, Instant::Iterate);
        let slopes = self.respond(&overlap.sums, request, state);
        match &request.stiffness {
            None => self.add_forces(&overlap.pairs, &state.current, sink),
            Some(selection) => self.add_stiffness(&overlap, &slopes, fields, selection, state, sink),
        }
    }

    /// Pairs with common segments, and the sums of all vertices.
    pub(super) fn integrate(
        &self,
        couples: &[(u32, u32)],
        fields: &ContactFields<'_>,
        instant: Instant,
    ) -> Overlap<D> {
        let mut pairs = Vec::new();
        let mut sums = vec![VertexSums::default(); self.surface.vertices().len()];
        self.sweep(couples.iter().copied(), fields, instant, |facet, target, gathered, pair| {
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
        let vertices = sums.iter_mut().enumerate();
        vertices.for_each(|(vertex, sums)| sums.drop_sliver(self.surface.reference_area(vertex)));
        Overlap { pairs, sums }
    }

    /// Calls `visit` with each of these couples at `fields`.
    pub(super) fn sweep(
        &self,
        couples: impl Iterator<Item = (u32, u32)>,
        fields: &ContactFields<'_>,
        instant: Instant,
        mut visit: impl FnMut(u32, u32, &Gathered<D>, &FacetPair<'_, D>),
    ) {
        let mut gathered = Gathered::new(instant);
        let mut last = None;
        for (index, target) in couples {
            let facet = &self.surface.facets()[index as usize];
            let nodes = self.surface.facet_nodes(facet);
            let reference = self.surface.reference_points(facet);
            if last != Some(index) {
                gathered.begin(reference, nodes, fields);
                last = Some(index);
            }
            let origin = gathered.displacement(nodes[0], fields);
            let origin = [&reference[0], &origin];
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
            range: Range { share: self.share, depth: self.depth, open: OPEN * facet.size },
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
            if !sums.is_covered() {
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

    fn add_stiffness(
        &self,
        overlap: &Overlap<D>,
        slopes: &[Option<Slopes<D>>],
        fields: &ContactFields<'_>,
        selection: &Selection,
        state: &ContactState<D>,
        sink: &mut impl SegmentSink,
    ) {
        let Overlap { pairs, sums } = overlap;
        let wanted = |vertex: usize| slopes[vertex].is_some();
        let mut rows = self.nodes_of(&[pairs], slopes.len(), wanted);
        let varies = if selection.joint.is_some() { Varies::Nothing } else { Varies::Everything };
        self.accumulate(pairs, fields, Instant::Iterate, varies, &mut rows);
        self.add_geometry(pairs, fields, selection, &state.current, wanted, sink);
        let mut block = Vec::new();
        let mut nodes = Vec::new();
        for row in &mut rows {
            let p = row.vertex;
            let Some(slopes) = &slopes[p] else { continue };
            sums[p].normalise(&state.history[p], &row.by_area, &mut row.nodes);
            clear_block::<D>(&mut block, row.nodes.len());
            add_stiffness(&state.current[p], slopes, &row.nodes, selection, &mut block);
            nodes.clear();
            nodes.extend(row.nodes.iter().map(|node| node.node));
            sink.stiffness(p, &nodes, &block);
        }
    }

    /// Adds the stiffness of frozen tractions of the wanted vertices.
    pub(super) fn add_geometry(
        &self,
        pairs: &[ActivePair<D>],
        fields: &ContactFields<'_>,
        selection: &Selection,
        points: &[PointState<D>],
        wanted: impl Fn(usize) -> bool,
        sink: &mut impl SegmentSink,
    ) {
        let [pressure, friction] =
            [Terms::NORMAL_GEOMETRY, Terms::FRICTION_GEOMETRY].map(|term| selection.terms.contains(term));
        if selection.joint.is_some() || !(pressure || friction) {
            return;
        }
        let is_wanted = |vertex: &u32| wanted(*vertex as usize);
        let has_wanted = |pair: &&ActivePair<D>| {
            self.surface.facets()[pair.facet as usize].vertices.iter().flatten().any(is_wanted)
        };
        let active = pairs.iter().filter(has_wanted).map(|pair| (pair.facet, pair.target));
        let mut block = Vec::new();
        self.sweep(active, fields, Instant::Iterate, |index, _, gathered, pair| {
            let mut carried = [Carried { normal: 0.0, friction: Vector::zeros() }; MOST_CORNERS];
            let mut owner = None;
            for (carried, vertex) in carried.iter_mut().zip(self.surface.facets()[index as usize].vertices) {
                let Some(vertex) = vertex.filter(is_wanted) else { continue };
                let point = &points[vertex as usize];
                owner.get_or_insert(vertex as usize);
                carried.normal = if pressure { point.normal_traction } else { 0.0 };
                carried.friction = if friction { point.friction_traction } else { Vector::zeros() };
            }
            let Some(owner) = owner else { return };
            clear_block::<D>(&mut block, gathered.nodes.len());
            pair.add_geometry(&carried, selection.terms.contains(Terms::ZONE_CHANGE), &mut block);
            sink.stiffness(owner, &gathered.nodes, &block);
        });
    }

    /// The wanted ones of `count` vertices with all nodes of their pairs in these lists, each once.
    pub(super) fn nodes_of(
        &self,
        lists: &[&[ActivePair<D>]],
        count: usize,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<VertexRows<D>> {
        let mut rows = Vec::new();
        for vertex in (0..count).filter(|&vertex| wanted(vertex)) {
            let mut nodes: Vec<VertexNode<D>> = Vec::new();
            let mut reference_points = Vec::new();
            let around = self.surface.around(vertex);
            for (pairs, &facet) in lists.iter().flat_map(|list| around.iter().map(move |facet| (list, facet)))
            {
                let contactor = &self.surface.facets()[facet as usize];
                let own =
                    self.surface.facet_nodes(contactor).iter().zip(self.surface.reference_points(contactor));
                let first = pairs.partition_point(|pair| pair.facet < facet);
                for pair in pairs[first..].iter().take_while(|pair| pair.facet == facet) {
                    let others =
                        self.target.nodes(pair.target).iter().zip(self.target.reference_points(pair.target));
                    for (&node, place) in own.clone().chain(others) {
                        if nodes.iter().all(|known| known.node != node) {
                            nodes.push(VertexNode::of(node));
                            reference_points.push(*place);
                        }
                    }
                }
            }
            let by_area = vec![Vector::zeros(); nodes.len()];
            rows.push(VertexRows { vertex, nodes, reference_points, by_area });
        }
        rows
    }

    /// Adds the coefficients and, if they are wanted, the variations of the sums over these pairs to the rows of the vertices.
    pub(super) fn accumulate(
        &self,
        pairs: &[ActivePair<D>],
        fields: &ContactFields<'_>,
        instant: Instant,
        varies: Varies,
        rows: &mut [VertexRows<D>],
    ) {
        let numbers_of = |facet: u32, rows: &[VertexRows<D>]| {
            self.surface.facets()[facet as usize].vertices.map(|vertex| {
                let vertex = vertex? as usize;
                rows.binary_search_by_key(&vertex, |row| row.vertex).ok()
            })
        };
        let has_row = |pair: &&ActivePair<D>| numbers_of(pair.facet, rows).iter().any(Option::is_some);
        let active: Vec<&ActivePair<D>> = pairs.iter().filter(has_row).collect();
        let mut known = active.iter();
        let couples = active.iter().map(|pair| (pair.facet, pair.target));
        self.sweep(couples, fields, instant, |index, _, gathered, pair| {
            let Some(known) = known.next() else { return };
            let numbers = numbers_of(index, rows);
            for (number, own) in numbers.into_iter().zip(&known.integrals.vertices) {
                let Some(number) = number else { continue };
                let row = &mut rows[number];
                for (a, &node) in gathered.nodes.iter().enumerate() {
                    let place = row.place(node);
                    row.nodes[place].coefficient += own.coefficients[a];
                    row.nodes[place].push += own.pushes[a];
                }
            }
            if varies == Varies::Nothing {
                return;
            }
            let both = PairFields { fields: [&gathered.velocities, &gathered.increments] };
            pair.vary(&both, |corner, a, by| {
                let Some(number) = numbers[corner] else { return };
                let row = &mut rows[number];
                let place = row.place(gathered.nodes[a]);
                row.by_area[place] += by.area;
                let entry = &mut row.nodes[place];
                entry.gap += by.gap;
                entry.normal += by.normal;
                entry.slips[0] += by.slips[0];
                entry.slips[1] += by.slips[1];
            });
        });
    }
}

/// What of the sums of vertices is brought beside their coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Varies {
    /// Nothing.
    Nothing,
    /// How they vary with all nodes.
    Everything,
}

/// A block of zeros of so many nodes.
pub(super) fn clear_block<const D: usize>(block: &mut Vec<f64>, nodes: usize) {
    block.clear();
    block.resize(nodes * nodes * D * D, 0.0);
}

impl<const D: usize> VertexRows<D> {
    /// The place of a node, which is one of the vertex.
    pub fn place(&self, node: u32) -> usize {
        self.nodes.iter().position(|known| known.node == node).unwrap_or(0)
    }
}

/// Whether the boxes of the two facets come within the range of gaps. Far cheaper than to find that there is no segment.
fn may_meet<const D: usize>(pair: &FacetPair<'_, D>) -> bool {
    let range = pair.range.open + pair.range.depth;
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
