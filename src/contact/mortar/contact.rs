//! Contact of a surface with a body or an obstacle: sums over pairs of facets, then the laws of the
//! vertices.

use super::candidates::Candidates;
use super::integrals::{
    AcrossPlane, AreaMeasure, Carried, FacetPair, FrozenChanges, FrozenFacet, NormalOf, Opposite, PAIR_NODES,
    PairFields, PairWorkspace, PlacedFacet, Range, VertexPotential, WantedVariations,
};
use super::kernel::{VertexNode, VertexRows, VertexSums, add_stiffness, is_sliver};
use super::obstacle::{PlacedObstacle, is_lumped, rule_of};
use super::overlap::{ActivePair, Overlap};
use super::surface::{VertexFacet, VertexSize, VertexSurface};
use crate::contact::evaluation::{AreaKind, ContactFields, ContactRequest};
use crate::contact::linearised::{GapNode, LinearGaps};
use crate::contact::nodal::at;
use crate::contact::point::{ContactLaw, Manner, PointState, Slopes, TermSelection};
use crate::contact::rigid::BodyFrame;
use crate::contact::state::{Branches, ContactState};
use crate::contact::target::ContactTarget;
use crate::rounding;
use crate::tensor::Vector;
use crate::terms::Terms;

/// Receives the contributions of a contact.
pub trait ContactSink {
    /// Adds `force[a * D + i]` of these nodes to the right-hand side [N, per depth in 2D]. `nodes`
    /// are indices into the field arrays.
    fn force(&mut self, nodes: &[u32], force: &[f64]);

    /// Adds `stiffness[((a * m + b) * D + i) * D + j]` to the left-hand matrix \[N/m\]. All `m`
    /// nodes belong to `vertex`.
    fn stiffness(&mut self, vertex: usize, nodes: &[u32], stiffness: &[f64]);

    /// Adds `force[a * D + i]` of these nodes to the right-hand side of a linear solve for a first
    /// guess: the change of the forces with the prescribed motion of the target [N, per depth in
    /// 2D]. It is ignored unless a first guess is computed.
    fn lift(&mut self, _nodes: &[u32], _force: &[f64]) {}
}

/// One contact, evaluated at the vertices of its contactor.
#[derive(Debug, Clone)]
pub struct VertexContact<const D: usize> {
    /// Contactor: the vertices of this rank.
    pub surface: VertexSurface<D>,
    /// Target.
    pub target: ContactTarget<D>,
    /// Laws.
    pub law: ContactLaw,
    /// Area on which the tractions act.
    pub area: AreaKind,
    /// Points deeper than this below the target lie nearer to its other side and are ignored \[m\].
    /// An obstacle has no other side: `f64::MAX`.
    pub depth: f64,
    /// Part of the tractions that each side carries as the contactor. It is 1/2 in self-contact,
    /// where every facet is both contactor and target, and 1 otherwise.
    pub share: f64,
    /// Gap, relative to the size of a contactor facet, up to which points have their full weight:
    /// [`CLOSABLE`], or zero if forces conserve over a step and no gap is closed at the start. Their matrix is
    /// inaccurate in pairs of facets within which the weight changes steeply.
    pub closed: f64,
    /// The side whose normal is used where the contactor facet lies at an edge and the target facet does
    /// not.
    ///
    /// It is the target: the contactor may be steep beside an edge, and forces along its normals
    /// would drag the edge along a flat target. Forces along the normal of the target have a small
    /// moment. For schemes that conserve momentum it is therefore the contactor.
    pub edge_normal: NormalOf,
}

/// Gap, relative to the size of a contactor facet, from which on a point has no weight. Over a plane all
/// points have weight, so that gaps are linear and tangents symmetric.
pub const OPEN: f64 = 0.25;

/// Largest gap that is closed if surfaces are meant to touch, relative to the size of a facet. Points have
/// their full weight up to this gap.
pub const CLOSABLE: f64 = 0.5 * OPEN;

/// Instant of the step at which the node positions are taken. The given displacements are those of
/// the iterate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Instant {
    /// At the start of the step.
    Start,
    /// At the displacements.
    Iterate,
    /// Extrapolated beyond the iterate by the displacement since the start.
    Beyond,
}

impl Instant {
    /// Displacement of a node at this instant, from those at the start and of the iterate.
    fn displacement<const D: usize>(self, start: Vector<D>, iterate: Vector<D>) -> Vector<D> {
        match self {
            Self::Start => start,
            Self::Iterate => iterate,
            Self::Beyond => iterate + (iterate - start),
        }
    }
}

/// Positions and fields of the nodes of a pair. The buffers are reused for every pair to avoid
/// allocation.
pub(super) struct GatheredPair<const D: usize> {
    pub nodes: Vec<u32>,
    positions: Vec<Vector<D>>,
    velocities: Vec<Vector<D>>,
    increments: Vec<Vector<D>>,
    contactor: usize,
    instant: Instant,
}

impl<const D: usize> GatheredPair<D> {
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

    /// Loads the nodes of a contactor facet.
    fn begin(
        &mut self,
        origin: [&Vector<D>; 2],
        reference: &[Vector<D>],
        nodes: &[u32],
        fields: &ContactFields<'_>,
        frame: Option<&BodyFrame<D>>,
    ) {
        self.contactor = 0;
        self.keep_contactor();
        match frame {
            None => self.append(origin, reference, nodes, fields),
            Some(frame) => self.append_seen(frame, reference, nodes, fields),
        }
        self.contactor = nodes.len();
    }

    /// Loads the nodes of a target facet in place of the previous one.
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

    /// Loads nodes as seen from a moving target.
    fn append_seen(
        &mut self,
        frame: &BodyFrame<D>,
        reference: &[Vector<D>],
        nodes: &[u32],
        fields: &ContactFields<'_>,
    ) {
        self.nodes.extend_from_slice(nodes);
        for (x, &node) in reference.iter().zip(nodes) {
            let seen = frame.see(x, &at(fields.u_start, node), &at(fields.u, node), &at(fields.v, node));
            self.positions.push(match self.instant {
                Instant::Start => seen.start,
                Instant::Iterate => seen.iterate,
                Instant::Beyond => seen.end,
            });
            self.velocities.push(seen.velocity);
            self.increments.push(seen.increment);
        }
    }

    fn displacement(&self, node: u32, fields: &ContactFields<'_>) -> Vector<D> {
        self.instant.displacement(at(fields.u_start, node), at(fields.u, node))
    }
}

impl<const D: usize> VertexContact<D> {
    /// Evaluates all vertices at `fields`, stores their states in `state.current` and passes their
    /// contributions to `sink`.
    pub fn evaluate(
        &self,
        candidates: &Candidates<D>,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        sink: &mut impl ContactSink,
    ) {
        match self.target.frame() {
            None => self.evaluate_at_rest(candidates, fields, request, state, sink),
            Some(frame) => self.evaluate_moving(frame, candidates, fields, request, state, sink),
        }
    }

    /// Evaluates all vertices over a target that is deformable or at rest. In the frame of a moving
    /// target, state and contributions are those of the frame.
    pub(super) fn evaluate_at_rest(
        &self,
        candidates: &Candidates<D>,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        sink: &mut impl ContactSink,
    ) {
        if request.over_step {
            return self.evaluate_over_step(candidates, fields, request, state, sink);
        }
        let values = self.values(candidates, &[fields.u, fields.u_start, fields.v]);
        let overlap =
            candidates.overlap.at(values, || self.integrate(candidates.couples(), fields, Instant::Iterate));
        let slopes = self.respond(&overlap.sums, fields, request, state);
        match &request.stiffness {
            None => self.add_forces(&overlap.pairs, &state.current, sink),
            Some(selection) => self.add_stiffness(&overlap, &slopes, fields, selection, state, sink),
        }
    }

    /// Everything on which the segments at these fields depend.
    pub(super) fn values(&self, candidates: &Candidates<D>, fields: &[&[f64]]) -> Vec<f64> {
        let mut values = candidates.values(fields);
        values.extend(self.target.frame().into_iter().flat_map(BodyFrame::key));
        values
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
        let mut workspace = PairWorkspace::default();
        let couples = rounding::order(couples.len()).map(|number| couples[number]);
        self.sweep(couples, fields, instant, |facet, target, gathered, pair| {
            if !may_meet(pair) {
                return;
            }
            let Some(integrals) = pair.integrate(&mut workspace) else { return };
            let meets = integrals.cover > 0.0;
            for (vertex, own) in
                self.surface.facets()[facet as usize].vertices.iter().zip(&integrals.vertices)
            {
                let Some(vertex) = vertex else { continue };
                let sum = &mut sums[*vertex as usize];
                sum.area += own.area;
                sum.cover += integrals.cover;
                sum.gap += own.gap;
                sum.normal += own.normal;
                if !self.has_segments() {
                    sum.depth = sum.depth.max(own.depth);
                }
                for (slip, field) in sum.slips.iter_mut().zip([&gathered.velocities, &gathered.increments]) {
                    for (value, coefficient) in field.iter().zip(own.coefficients) {
                        *slip += value * coefficient;
                    }
                }
            }
            if meets {
                pairs.push(ActivePair { facet, target, integrals });
            }
        });
        pairs.sort_by_key(|pair| (pair.facet, pair.target));
        if self.has_segments() {
            self.add_depths(&pairs, &mut sums);
        }
        for (vertex, sums) in sums.iter_mut().enumerate() {
            let mut size = self.surface.size_of(vertex, self.share);
            if !self.has_segments() {
                size = VertexSize { facets: 0.0, ..size };
            }
            sums.finish(&size);
        }
        Overlap { pairs, sums }
    }

    /// Whether each vertex exerts a force only on its own node, as over a plane that is no free body. The
    /// pattern of the elements then has all blocks.
    ///
    /// Forces over a step act on the undeformed area. They have parts at all nodes around the
    /// vertex, which are discrete gradients of the area.
    pub fn acts_on_own_node(&self) -> bool {
        let lumped = |obstacle| {
            let facets = self.surface.facets();
            facets.iter().all(|facet| is_lumped(obstacle, facet.kind, self.surface.plane()))
        };
        self.area == AreaKind::Current
            && self.target.free_body().is_none()
            && self.target.obstacle().is_some_and(lumped)
    }

    /// Distance up to which gaps are known, if `facet` is the largest extent of a facet \[m\].
    pub fn known_gap(&self, facet: f64) -> f64 {
        if self.has_segments() { OPEN * facet } else { f64::MAX }
    }

    /// Whether gaps are means over segments. Otherwise every vertex has the depth of its own points, and no
    /// gap is limited by how much of the facets is covered.
    fn has_segments(&self) -> bool {
        self.target.has_facets()
    }

    /// Adds the depths of facets below a body to their vertices. If the covered
    /// part of a facet is shorter than half of its depth, it lies behind another side of the target. Its
    /// depth is then ignored.
    fn add_depths(&self, pairs: &[ActivePair<D>], sums: &mut [VertexSums<D>]) {
        for pairs in pairs.chunk_by(|a, b| a.facet == b.facet) {
            let facet = &self.surface.facets()[pairs[0].facet as usize];
            let cover = pairs.iter().map(|pair| pair.integrals.cover).sum();
            let depths = pairs.iter().map(|pair| pair.integrals.vertices[0].depth);
            let depth = depths.fold(f64::NEG_INFINITY, f64::max);
            if is_sliver(depth, cover, facet, self.share) {
                continue;
            }
            for vertex in facet.vertices.iter().flatten() {
                let sum = &mut sums[*vertex as usize];
                sum.depth = sum.depth.max(depth);
            }
        }
    }

    /// Gap of an uncovered vertex \[m\]. Over an obstacle it is the distance of the points around
    /// the vertex; for a body it is unknown.
    pub(super) fn free_gap(&self, sums: &VertexSums<D>) -> f64 {
        self.target.obstacle().map_or(f64::INFINITY, |_| -sums.depth)
    }

    /// Calls `visit` with each of these pairs at `fields`.
    pub(super) fn sweep(
        &self,
        couples: impl Iterator<Item = (u32, u32)>,
        fields: &ContactFields<'_>,
        instant: Instant,
        mut visit: impl FnMut(u32, u32, &GatheredPair<D>, &FacetPair<'_, D>),
    ) {
        let mut gathered = GatheredPair::new(instant);
        let mut last = None;
        for (index, target) in couples {
            let facet = &self.surface.facets()[index as usize];
            let nodes = self.surface.facet_nodes(facet);
            let reference = self.surface.reference_points(facet);
            // Between bodies, positions are measured from a node; otherwise gaps far from the
            // origin lose digits.
            let origin = match &self.target {
                ContactTarget::Body(_) => [reference[0], gathered.displacement(nodes[0], fields)],
                ContactTarget::Obstacle(_) => [Vector::zeros(); 2],
            };
            let origin = [&origin[0], &origin[1]];
            if last != Some(index) {
                gathered.begin(origin, reference, nodes, fields, self.target.frame());
                last = Some(index);
            }
            gathered.oppose(origin, self.target.reference_points(target), self.target.nodes(target), fields);
            let pair = self.pair(facet, target, &gathered, reference, origin[0][0] + origin[1][0]);
            visit(index, target, &gathered, &pair);
        }
    }

    /// A pair whose positions have an origin at this distance from the y axis \[m\].
    fn pair<'a>(
        &'a self,
        facet: &VertexFacet,
        target: u32,
        gathered: &'a GatheredPair<D>,
        reference: &'a [Vector<D>],
        radius: f64,
    ) -> FacetPair<'a, D> {
        let (contactor, others) = gathered.positions.split_at(gathered.contactor);
        let plane = self.surface.plane();
        let mut open = [self.closed, OPEN].map(|part| part * facet.size);
        let at_edge = facet.at_edge && self.target.body().is_some_and(|surface| !surface.is_at_edge(target));
        let target = match &self.target {
            ContactTarget::Body(surface) => {
                Opposite::Facet(PlacedFacet { kind: surface.kind(target), nodes: others })
            }
            ContactTarget::Obstacle(obstacle) => {
                let obstacle = &*obstacle.shape;
                if obstacle.is_plane() {
                    open[1] = f64::MAX;
                }
                Opposite::Obstacle(PlacedObstacle { obstacle, rule: rule_of(obstacle, facet.kind, plane) })
            }
        };
        FacetPair {
            contactor: PlacedFacet { kind: facet.kind, nodes: contactor },
            target,
            measure: match self.area {
                AreaKind::Current => AreaMeasure::Current,
                AreaKind::Reference => AreaMeasure::Reference(reference),
            },
            range: Range { share: self.share, deep: [0.5 * self.depth, self.depth], open },
            across: AcrossPlane { plane, origin: radius },
            normal_of: if at_edge { self.edge_normal } else { NormalOf::Contactor },
        }
    }

    /// Displacement of a node, or its position as seen from a moving target \[m\].
    fn place(&self, node: u32, reference: &Vector<D>, fields: &ContactFields<'_>) -> Vector<D> {
        let u = at(fields.u, node);
        match self.target.frame() {
            None => u,
            Some(frame) => frame.see(reference, &at(fields.u_start, node), &u, &at(fields.v, node)).iterate,
        }
    }

    /// Evaluates the laws of all vertices.
    fn respond(
        &self,
        sums: &[VertexSums<D>],
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &mut ContactState<D>,
    ) -> Vec<Option<Slopes<D>>> {
        let mut all = Vec::with_capacity(sums.len());
        for (vertex, sums) in sums.iter().enumerate() {
            if !sums.is_covered() {
                let gap = self.free_gap(sums);
                let sunk = sums.sunk(state.adjusted(vertex));
                state.current[vertex] = PointState { gap, sunk, ..PointState::default() };
                state.forget_linear_gap(vertex);
                all.push(None);
                continue;
            }
            let manner = state.manner(vertex, request.hold, request.branches);
            let manner = Manner { damping: request.damping, ..manner };
            let history = state.history[vertex];
            let linear = state.linear_gap(vertex, |node| self.place(node.node, &node.reference, fields));
            let gap = sums.gap() - state.adjusted(vertex);
            let respond = |gap| sums.respond(&self.law, &history, gap, state.adjusted(vertex), &manner);
            let (mut point, slopes) = match (request.branches, linear) {
                (Branches::Predicted, Some(linear)) => {
                    let (point, slopes) = respond(linear);
                    (point.extrapolated(slopes.as_ref(), gap - linear), slopes)
                }
                (Branches::Linearised, Some(linear)) => respond(linear),
                _ => respond(gap),
            };
            match request.branches {
                Branches::Actual => {
                    let closed = |gap| !manner.is_apart(gap);
                    state.note_closed(vertex, closed(gap), linear.map(closed));
                }
                Branches::Linearised if linear.is_none() && !state.was_closed(vertex) => {
                    point = point.without_tractions();
                }
                _ => {}
            }
            state.current[vertex] = point;
            all.push(slopes);
        }
        all
    }

    fn add_forces(&self, pairs: &[ActivePair<D>], points: &[PointState<D>], sink: &mut impl ContactSink) {
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
                let tangential = point.tangential_traction();
                for (a, force) in force.chunks_exact_mut(D).enumerate() {
                    for i in 0..D {
                        force[i] +=
                            own.pushes[a][i] * point.normal_traction + own.coefficients[a] * tangential[i];
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
        selection: &TermSelection,
        state: &mut ContactState<D>,
        sink: &mut impl ContactSink,
    ) {
        let Overlap { pairs, sums } = overlap;
        let mut linear_gaps = LinearGaps::new(slopes.len());
        let wanted = |vertex: usize| slopes[vertex].is_some();
        let mut rows = self.nodes_of(&[pairs], slopes.len(), wanted);
        self.accumulate(pairs, &mut rows);
        if selection.joint.is_none() {
            let frozen = FrozenVertices::of(&state.current, selection.terms, wanted);
            self.vary(pairs, fields, Instant::Iterate, varying(slopes), &mut rows, Some((&frozen, sink)));
        }
        let spin = self.target.frame().and_then(BodyFrame::velocity_by_position);
        let mut block = Vec::new();
        let mut nodes = Vec::new();
        for row in &mut rows {
            let p = row.vertex;
            let Some(slopes) = &slopes[p] else { continue };
            sums[p].normalise(&state.history[p], row);
            if selection.joint.is_none() {
                linear_gaps.set(p, sums[p].gap() - state.adjusted(p), self.gap_nodes(row, fields));
            }
            clear_block::<D>(&mut block, row.nodes.len());
            add_stiffness(&state.current[p], slopes, &row.nodes, selection, spin.as_ref(), &mut block);
            nodes.clear();
            nodes.extend(row.nodes.iter().map(|node| node.node));
            sink.stiffness(p, &nodes, &block);
        }
        if selection.joint.is_none() {
            state.note_linear_gaps(linear_gaps);
        }
    }

    /// The nodes of a vertex with the derivatives of its gap.
    fn gap_nodes(&self, row: &VertexRows<D>, fields: &ContactFields<'_>) -> impl Iterator<Item = GapNode<D>> {
        let of = |(node, reference): (&VertexNode<D>, &Vector<D>)| GapNode {
            node: node.node,
            reference: *reference,
            place: self.place(node.node, reference, fields),
            slope: node.gap,
        };
        row.nodes.iter().zip(&row.reference_points).map(of)
    }

    /// Adds the stiffness of the frozen quantities at the vertices.
    pub(super) fn add_frozen(
        &self,
        pairs: &[ActivePair<D>],
        fields: &ContactFields<'_>,
        frozen: &FrozenVertices<D>,
        sink: &mut impl ContactSink,
    ) {
        let vertices = |facet: u32| &self.surface.facets()[facet as usize].vertices;
        let active = pairs.iter().filter(|pair| frozen.owner(vertices(pair.facet)).is_some());
        let active = active.map(|pair| (pair.facet, pair.target));
        let mut block = Vec::new();
        let mut workspace = PairWorkspace::default();
        self.sweep(active, fields, Instant::Iterate, |index, _, gathered, pair| {
            let Some(owner) = frozen.owner(vertices(index)) else { return };
            clear_block::<D>(&mut block, gathered.nodes.len());
            pair.add_frozen(&frozen.of_facet(vertices(index)), &mut block, &mut workspace);
            sink.stiffness(owner, &gathered.nodes, &block);
        });
    }

    /// The selected ones of `count` vertices with all nodes of their pairs in these lists, each
    /// node once.
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
            let by_cover = by_area.clone();
            rows.push(VertexRows { vertex, nodes, reference_points, by_area, by_cover });
        }
        rows
    }

    /// Adds the coefficients of these pairs to the rows of their vertices.
    pub(super) fn accumulate(&self, pairs: &[ActivePair<D>], rows: &mut [VertexRows<D>]) {
        for pair in pairs {
            let facet = &self.surface.facets()[pair.facet as usize];
            let (own, others) = (self.surface.facet_nodes(facet), self.target.nodes(pair.target));
            for (number, integrals) in
                self.numbers_of(pair.facet, rows).into_iter().zip(&pair.integrals.vertices)
            {
                let Some(number) = number else { continue };
                let row = &mut rows[number];
                for (a, &node) in own.iter().chain(others).enumerate() {
                    let place = row.place(node);
                    row.nodes[place].coefficient += integrals.coefficients[a];
                    row.nodes[place].push += integrals.pushes[a];
                }
            }
        }
    }

    /// Adds the variations of the sums over these pairs to the rows of their vertices, and the
    /// stiffness of the frozen quantities.
    pub(super) fn vary(
        &self,
        pairs: &[ActivePair<D>],
        fields: &ContactFields<'_>,
        instant: Instant,
        varying: WantedVariations,
        rows: &mut [VertexRows<D>],
        mut frozen: Option<(&FrozenVertices<D>, &mut dyn ContactSink)>,
    ) {
        let wanted = |pair: &&ActivePair<D>| self.numbers_of(pair.facet, rows).iter().any(Option::is_some);
        let active: Vec<&ActivePair<D>> = pairs.iter().filter(wanted).collect();
        let couples = active.iter().map(|pair| (pair.facet, pair.target));
        let mut block = Vec::new();
        let mut workspace = PairWorkspace::default();
        self.sweep(couples, fields, instant, |index, _, gathered, pair| {
            let numbers = self.numbers_of(index, rows);
            let both = PairFields { fields: [&gathered.velocities, &gathered.increments] };
            let vertices = &self.surface.facets()[index as usize].vertices;
            clear_block::<D>(&mut block, gathered.nodes.len());
            let held = frozen.as_ref().and_then(|(frozen, _)| {
                frozen.owner(vertices).map(|owner| (owner, frozen.of_facet(vertices)))
            });
            let held_here = held.as_ref().map(|(_, frozen)| (frozen, &mut block[..]));
            let mut places = [[0; PAIR_NODES]; 4];
            for (number, places) in numbers.iter().zip(&mut places) {
                let Some(number) = number else { continue };
                let nodes = gathered.nodes.iter().zip(places);
                nodes.for_each(|(&node, place)| *place = rows[*number].place(node));
            }
            let mut by_cover = [Vector::zeros(); PAIR_NODES];
            pair.vary(&both, varying, held_here, &mut workspace, |corner, a, by| {
                by_cover[a] += by.area;
                let Some(number) = numbers[corner] else { return };
                let row = &mut rows[number];
                let place = places[corner][a];
                row.by_area[place] += by.area;
                let entry = &mut row.nodes[place];
                entry.gap += by.gap;
                entry.normal += by.normal;
                entry.slips[0] += by.slips[0];
                entry.slips[1] += by.slips[1];
            });
            for (number, places) in numbers.iter().zip(&places) {
                let Some(number) = number else { continue };
                for (place, by) in places.iter().zip(&by_cover).take(gathered.nodes.len()) {
                    rows[*number].by_cover[*place] += by;
                }
            }
            if let (Some((owner, _)), Some((_, sink))) = (&held, &mut frozen) {
                sink.stiffness(*owner, &gathered.nodes, &block);
            }
        });
    }

    /// Indices of the rows of the vertices of a facet.
    fn numbers_of(&self, facet: u32, rows: &[VertexRows<D>]) -> [Option<usize>; 4] {
        self.surface.facets()[facet as usize].vertices.map(|vertex| {
            let vertex = vertex? as usize;
            rows.binary_search_by_key(&vertex, |row| row.vertex).ok()
        })
    }
}

/// Quantities held fixed at every vertex while the geometry varies.
pub(super) struct FrozenVertices<const D: usize> {
    /// Tractions \[Pa\]; `None` for vertices that are not selected.
    pub carried: Vec<Option<Carried<D>>>,
    /// Geometric quantities that vary under these tractions.
    pub changes: FrozenChanges,
    /// How the energy of each vertex depends on its weighted gap and its area.
    pub potential: Vec<VertexPotential>,
}

impl<const D: usize> FrozenVertices<D> {
    /// The tractions of the selected vertices; `terms` selects which geometric quantities vary.
    pub fn of(points: &[PointState<D>], terms: Terms, wanted: impl Fn(usize) -> bool) -> Self {
        let changes = FrozenChanges {
            under_pressure: terms.contains(Terms::NORMAL_GEOMETRY),
            under_friction: terms.contains(Terms::FRICTION_GEOMETRY),
            area: terms.contains(Terms::ZONE_CHANGE),
        };
        let any = changes != FrozenChanges::default();
        let of = |(vertex, point): (usize, &PointState<D>)| {
            let (normal, friction) = (point.normal_traction, point.carried_traction());
            (any && wanted(vertex)).then_some(Carried { normal, friction })
        };
        let carried = points.iter().enumerate().map(of).collect();
        Self { carried, changes, potential: vec![VertexPotential::default(); points.len()] }
    }

    /// The first of these vertices with frozen quantities.
    fn owner(&self, vertices: &[Option<u32>; 4]) -> Option<usize> {
        let has = |vertex: &usize| {
            self.carried[*vertex].as_ref().is_some_and(Carried::acts)
                || self.potential[*vertex].pressure != 0.0
        };
        vertices.iter().flatten().map(|&vertex| vertex as usize).find(has)
    }

    fn of_facet(&self, vertices: &[Option<u32>; 4]) -> FrozenFacet<D> {
        let mut frozen = FrozenFacet { changes: self.changes, ..FrozenFacet::default() };
        for (corner, vertex) in vertices.iter().enumerate() {
            let Some(vertex) = vertex else { continue };
            if let Some(carried) = self.carried[*vertex as usize] {
                frozen.carried[corner] = carried;
            }
            frozen.potential[corner] = self.potential[*vertex as usize];
        }
        frozen
    }
}

/// Variations that the laws of these vertices need.
fn varying<const D: usize>(slopes: &[Option<Slopes<D>>]) -> WantedVariations {
    let any = |of: &dyn Fn(&Slopes<D>) -> f64| slopes.iter().flatten().any(|slopes| of(slopes) != 0.0);
    let damped = any(&|slopes| slopes.normal_by_velocity.amax());
    let slip_velocity = damped || any(&|slopes| slopes.by_velocity.amax() + slopes.through_bound.amax());
    let slip_increment = any(&|slopes| slopes.by_increment.amax());
    let normal = damped || slip_increment || any(&|slopes| slopes.by_normal.amax());
    WantedVariations { normal, slip_velocity, slip_increment, fixed_places: false }
}

/// Resizes a block for this number of nodes and sets it to zero.
pub(super) fn clear_block<const D: usize>(block: &mut Vec<f64>, nodes: usize) {
    block.clear();
    block.resize(nodes * nodes * D * D, 0.0);
}

/// Whether the bounding boxes of the two facets come within the range of gaps. This test is much
/// cheaper than a failed segment search.
fn may_meet<const D: usize>(pair: &FacetPair<'_, D>) -> bool {
    let Opposite::Facet(target) = &pair.target else { return true };
    let range = pair.range.open[1] + pair.range.deep[1];
    let bounds = |nodes: &[Vector<D>]| {
        let first = nodes[0];
        nodes.iter().fold((first, first), |(low, high), x| (low.inf(x), high.sup(x)))
    };
    let (low, high) = bounds(pair.contactor.nodes);
    let (other_low, other_high) = bounds(target.nodes);
    (0..D).all(|i| low[i] - range <= other_high[i] && other_low[i] - range <= high[i])
}

#[cfg(test)]
#[path = "contact_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "obstacle_tests.rs"]
mod obstacle_tests;

#[cfg(test)]
#[path = "moving_tests.rs"]
mod moving_tests;

#[cfg(test)]
#[path = "damping_tests.rs"]
mod damping_tests;

#[cfg(test)]
#[path = "free_tests.rs"]
mod free_tests;
