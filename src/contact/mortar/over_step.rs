//! Forces over a step: the discrete gradient of the contact energy, vertex by vertex (theory,
//! section 1.8).
//!
//! Let `Pi = sum_A kappa_A U(g_A)` be the energy and `d` the change of the positions over the step.
//! The force of a vertex is `-kappa_m (dU/dg) Dg - U_m Dkappa`. It consists of the means `kappa_m`,
//! `U_m` of both ends, the quotient of the changes of energy and gap, and discrete gradients `Dq =
//! dq/dx + ((q_1 - q_0 - dq/dx . d) / |e|^2) e` of gap and area, with gradients in the middle of
//! the step.
//!
//! `e` is `d` without the nearest motion that changes no gap. Between bodies this is a rigid
//! motion, over an obstacle a motion that maps the obstacle onto itself. Hence `Dq . d` is the
//! change of `q`, and the work equals the change of energy for any motion. Neither the gradients
//! nor `e` have a resultant or a moment along such motions, so momentum is conserved as well.

use super::candidates::Candidates;
use super::contact::{ContactSink, FrozenVertices, Instant, VertexContact, clear_block};
use super::integrals::{VertexPotential, WantedVariations};
use super::kernel::{VertexRows, VertexSums};
use super::overlap::{StepOverlap, VertexEnds};
use crate::contact::damping::Closing;
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::friction::traction::{Branch, FrictionTraction, Slip};
use crate::contact::history::History;
use crate::contact::nodal::at;
use crate::contact::normal::NormalResponse;
use crate::contact::obstacle::Shape;
use crate::contact::point::joint::Joint;
use crate::contact::point::step::{elastic_slip, friction, stored};
use crate::contact::point::{PointState, Status, TermSelection};
use crate::contact::rigid::{BodyFrame, SeenNode};
use crate::contact::state::ContactState;
use crate::contact::target::ContactTarget;
use crate::tensor::{Tensor, Vector, rotations};
use crate::terms::Terms;

/// A motion whose non-rigid part, relative to the extent of the vertex, is smaller than this is
/// treated as rigid. The error of the gradients in the middle is of third order in that part, besides
/// that of the quadrature, hence below rounding, and would be divided by its square.
const RIGID: f64 = 1e-7;

/// Gap and area of a vertex at both ends. If it has no target at one end, the gap of the other end
/// is used.
#[derive(Clone, Copy)]
struct Change {
    gaps: [f64; 2],
    areas: [f64; 2],
}

/// A vertex that contributes to a step.
struct Active<const D: usize> {
    change: Change,
    normal: NormalResponse,
    /// Pressure at the end \[Pa\].
    last: f64,
    /// Mean of the energies at both ends \[J/m^2\].
    energy: f64,
    by_pressure: Vector<D>,
    friction: FrictionTraction<D>,
    /// [`PointState::carried_traction`].
    carried: Vector<D>,
    /// Traction of damping along the surface \[Pa\].
    viscous: Vector<D>,
    /// Its derivatives by the gap at the end \[Pa/m\] and by the slip velocity [Pa s/m].
    viscous_by_gap: Vector<D>,
    drag: Tensor<D>,
}

impl<const D: usize> VertexEnds<D> {
    /// Change of a vertex that has a target at one end at least.
    fn change(&self, adjusted: f64) -> Change {
        let [start, end] =
            [self.start, self.end].map(|sums| sums.is_covered().then(|| sums.gap() - adjusted));
        let known = start.or(end).unwrap_or(f64::INFINITY);
        Change { gaps: [known, end.unwrap_or(known)], areas: [self.start.area, self.end.area] }
    }
}

impl<const D: usize> VertexEnds<D> {
    /// The normal in the middle of the step; zero if the vertex has no target there.
    fn direction(&self) -> Vector<D> {
        self.middle.normal.try_normalize(0.0).unwrap_or_else(Vector::zeros)
    }
}

impl<const D: usize> Active<D> {
    /// Traction of friction and damping along the surface \[Pa\].
    fn tangential(&self) -> Vector<D> {
        self.friction.traction + self.viscous
    }
}

impl Change {
    fn mean_area(&self) -> f64 {
        0.5 * (self.areas[0] + self.areas[1])
    }
}

impl<const D: usize> VertexContact<D> {
    /// Evaluates all vertices like [`evaluate`](Self::evaluate), with forces that act over the step
    /// whose middle the fields describe.
    pub(super) fn evaluate_over_step(
        &self,
        candidates: &Candidates<D>,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        sink: &mut impl ContactSink,
    ) {
        let values = self.values(candidates, &[fields.u, fields.u_start]);
        let overlap = candidates.step.at(values, || self.step_overlap(candidates, fields, state));
        let StepOverlap { ends, rows, active, .. } = &*overlap;
        for (vertex, ends) in ends.iter().enumerate().filter(|(vertex, _)| !active[*vertex]) {
            let touching = state.manner(vertex, request.hold, request.branches).touching;
            state.current[vertex] = self.open(ends, vertex, state, touching);
        }
        let mut steps = Vec::with_capacity(rows.len());
        for row in rows {
            let ends = &ends[row.vertex];
            let motion = Motion::of(row, fields, &self.target);
            let change = ends.change(state.adjusted(row.vertex));
            let (point, active) = self.respond_over_step(row, ends, change, &motion, request, state);
            state.current[row.vertex] = point;
            steps.push(VertexStep { ends: *ends, active, motion });
        }
        let Some(selection) = &request.stiffness else {
            return rows.iter().zip(&steps).for_each(|(row, step)| step.add_force(row, sink));
        };
        if let Some(stiffest) = selection.joint {
            let steps = rows.iter().zip(&steps);
            return steps.for_each(|(row, step)| step.add_springs(row, selection, stiffest, sink));
        }
        let wanted = |vertex: usize| active[vertex];
        let lists = overlap.lists();
        let mut rows_at_end = self.nodes_of(&lists, ends.len(), wanted);
        self.vary(
            &overlap.at_end.pairs,
            fields,
            Instant::Beyond,
            WantedVariations { fixed_places: true, ..WantedVariations::default() },
            &mut rows_at_end,
            None,
        );
        let friction = selection.terms - Terms::NORMAL_GEOMETRY;
        let mut frozen = FrozenVertices::of(&state.current, friction, wanted);
        if selection.terms.contains(Terms::NORMAL_GEOMETRY) {
            for (row, step) in rows.iter().zip(&steps) {
                frozen.potential[row.vertex] = step.potential();
            }
        }
        for (carried, ends) in frozen.carried.iter_mut().zip(ends) {
            match carried {
                // The pressure part is included in the potential.
                Some(carried) if ends.middle.is_covered() => {
                    carried.normal = 0.0;
                    carried.friction *= ends.end.area / ends.middle.area;
                }
                _ => *carried = None,
            }
        }
        self.add_frozen(&overlap.at_middle.pairs, fields, &frozen, sink);
        for ((row, at_end), step) in rows.iter().zip(&mut rows_at_end).zip(&steps) {
            if step.ends.end.is_covered() {
                step.ends.end.normalise(&History::default(), at_end);
            }
            step.add_stiffness(row, at_end, selection, sink);
        }
    }

    /// Geometric quantities of a step for all vertices.
    fn step_overlap(
        &self,
        candidates: &Candidates<D>,
        fields: &ContactFields<'_>,
        state: &ContactState<D>,
    ) -> StepOverlap<D> {
        let couples = candidates.couples();
        let values = self.values(candidates, &[fields.u_start]);
        let at_start = candidates.start.at(values, || self.integrate(couples, fields, Instant::Start));
        let at_end = self.integrate(couples, fields, Instant::Beyond);
        let presses =
            |sums: &VertexSums<D>, vertex: usize| sums.is_covered() && sums.gap() < state.adjusted(vertex);
        let sums = at_start.sums.iter().zip(&at_end.sums).enumerate();
        let active: Vec<bool> =
            sums.map(|(vertex, (start, end))| presses(start, vertex) || presses(end, vertex)).collect();
        let near_active = |&(facet, _): &(u32, u32)| {
            let vertices = self.surface.facets()[facet as usize].vertices;
            vertices.iter().flatten().any(|&vertex| active[vertex as usize])
        };
        let around: Vec<(u32, u32)> = couples.iter().copied().filter(near_active).collect();
        let at_middle = self.integrate(&around, fields, Instant::Iterate);
        let sums = at_start.sums.iter().zip(&at_middle.sums).zip(&at_end.sums);
        let ends: Vec<VertexEnds<D>> = sums
            .map(|((start, middle), end)| VertexEnds { start: *start, middle: *middle, end: *end })
            .collect();
        let mut overlap = StepOverlap { at_start, at_middle, at_end, ends, active, rows: Vec::new() };
        let mut rows = self.nodes_of(&overlap.lists(), overlap.ends.len(), |vertex| overlap.active[vertex]);
        let middle = &overlap.at_middle.pairs;
        self.accumulate(middle, &mut rows);
        let varying = WantedVariations { normal: true, fixed_places: true, ..WantedVariations::default() };
        self.vary(middle, fields, Instant::Iterate, varying, &mut rows, None);
        for row in &mut rows {
            let middle = &overlap.ends[row.vertex].middle;
            if middle.is_covered() {
                middle.normalise(&History::default(), row);
            }
        }
        overlap.rows = rows;
        overlap
    }

    /// State of a vertex that carries no traction over the step. The energy of its elastic stick
    /// becomes heat. It counts as closed if it touches up to rounding.
    fn open(
        &self,
        ends: &VertexEnds<D>,
        vertex: usize,
        state: &ContactState<D>,
        touching: f64,
    ) -> PointState<D> {
        let held = ends.start.area * stored(&self.law, &state.history[vertex].friction_traction);
        let area = if ends.end.area > 0.0 { ends.end.area } else { ends.start.area };
        let covered = ends.end.is_covered();
        let gap = if covered { ends.end.gap() - state.adjusted(vertex) } else { self.free_gap(&ends.end) };
        let normal = if covered { ends.end.normal.normalize() } else { Vector::zeros() };
        let plastic_work = if held > 0.0 { held / area } else { 0.0 };
        let status = if gap <= touching { Status::Slip } else { Status::Open };
        let sunk = ends.end.sunk(state.adjusted(vertex));
        PointState { gap, normal, area, sunk, status, over_step: true, plastic_work, ..PointState::default() }
    }

    fn respond_over_step(
        &self,
        row: &VertexRows<D>,
        ends: &VertexEnds<D>,
        change: Change,
        motion: &Motion<D>,
        request: &ContactRequest,
        state: &ContactState<D>,
    ) -> (PointState<D>, Active<D>) {
        let law = &self.law;
        let history = &state.history[row.vertex];
        let manner = state.manner(row.vertex, request.hold, request.branches);
        let undamped = law.normal.between(change.gaps);
        let damping = law.damping.only(request.damping);
        let rate = if request.step > 0.0 { 1.0 / request.step } else { 0.0 };
        let [start, end] = change.gaps;
        let closing = Closing { gap: end, start, speed: (start - end) * rate };
        let damped = damping.damped(undamped, &closing);
        let normal =
            NormalResponse { derivative: damped.normal.derivative - damped.by_speed * rate, ..damped.normal };
        let [before, after] = change.gaps.map(|gap| law.normal.evaluate(gap));
        let direction = ends.direction();
        let [velocity, increment] =
            [&motion.velocities, motion.sliding()].map(|field| slip(row, ends, &direction, field));
        // Newly covered area has no stick history. Elastic stick then never stores more energy than
        // before, so that frictional heat is not negative.
        let kept =
            if ends.end.area > ends.start.area { (ends.start.area / ends.end.area).sqrt() } else { 1.0 };
        let old = history.friction_traction * kept;
        let slip = Slip {
            normal: &direction,
            velocity: &velocity,
            increment: &increment,
            old_traction: &old,
            old_normal: &history.normal,
        };
        let (bound, by_pressure, friction) = friction(law, normal.traction, &slip, &manner);
        let (part, part_by_gap) =
            if change.gaps.iter().any(|gap| *gap <= 0.0) { closing.part_in_contact() } else { (0.0, 0.0) };
        let viscosity = damping.tangential_viscosity();
        let viscous = -slip.slip_velocity() * (viscosity * part);
        let viscous_by_gap = -slip.slip_velocity() * (viscosity * part_by_gap);
        let drag = slip.tangential_projector() * (-viscosity * part);
        let area = change.mean_area();
        let traction = friction.traction;
        let work = -ends.end.area * traction.dot(&increment);
        let held = [
            ends.start.area * stored(law, &history.friction_traction),
            ends.end.area * stored(law, &traction),
        ];
        let closed = change.gaps[0] < -manner.touching || change.gaps[1] <= manner.touching;
        let status = match (closed, friction.slips) {
            (false, _) => Status::Open,
            (true, true) => Status::Slip,
            (true, false) => Status::Stick,
        };
        let state = PointState {
            gap: change.gaps[1],
            sunk: ends.end.sunk(state.adjusted(row.vertex)),
            presses: change.gaps.into_iter().any(|gap| gap < -manner.touching),
            normal: direction,
            area,
            flatness: if ends.middle.is_covered() {
                ends.middle.normal.norm() / ends.middle.area
            } else {
                1.0
            },
            normal_traction: normal.traction,
            friction_traction: traction,
            normal_damping: damped.damping,
            viscous_traction: viscous,
            damping_work: damped.damping * (start - end) - ends.end.area * viscous.dot(&increment) / area,
            bound,
            slip_velocity: slip.slip_velocity(),
            slip_increment: increment,
            status,
            potential: change.areas[1] * after.potential / area,
            elastic_slip: elastic_slip(law, &traction),
            traction_at_start: Vector::zeros(),
            recoverable: held[1] / area,
            plastic_work: (work - held[1] + held[0]) / area,
            sticks_elastically: false,
            over_step: true,
            is_beyond_bound: manner.branch == Branch::Stick && friction.exceeds(bound),
        };
        let carried = state.carried_traction();
        let energy = 0.5 * (before.potential + after.potential);
        let last = after.traction;
        let active = Active {
            change,
            normal,
            last,
            energy,
            by_pressure,
            friction,
            carried,
            viscous,
            viscous_by_gap,
            drag,
        };
        (state, active)
    }
}

/// A vertex over a step, ready to contribute.
struct VertexStep<const D: usize> {
    ends: VertexEnds<D>,
    active: Active<D>,
    motion: Motion<D>,
}

impl<const D: usize> VertexStep<D> {
    fn add_force(&self, row: &VertexRows<D>, sink: &mut impl ContactSink) {
        let Self { ends, active, motion } = self;
        let gradients = Gradients::of(row, ends, active, motion);
        let pressure = active.change.mean_area() * active.normal.traction;
        let mut friction: Vec<Vector<D>> = (0..row.nodes.len())
            .map(|a| test(row, ends, a).transpose() * active.tangential() * ends.end.area)
            .collect();
        if motion.target_moves {
            motion.unfelt.remove(&mut friction);
        }
        let mut force = Vec::with_capacity(row.nodes.len() * D);
        for a in 0..row.nodes.len() {
            let total = gradients.gap[a] * pressure - gradients.area[a] * active.energy + friction[a];
            force.extend(total.iter());
        }
        let nodes: Vec<u32> = row.nodes.iter().map(|node| node.node).collect();
        sink.force(&nodes, &force);
    }

    /// The energy of the vertex as it depends on the weighted gap and the area in the middle.
    fn potential(&self) -> VertexPotential {
        let Self { ends: VertexEnds { middle, .. }, active, .. } = self;
        if !middle.is_covered() {
            return VertexPotential::default();
        }
        VertexPotential {
            pressure: active.change.mean_area() * active.normal.traction * middle.by_mean_gap() / middle.area,
            gap: middle.mean_gap(),
            energy: active.energy,
        }
    }

    /// `dt_T` by the slip in the middle; the end moves twice as far.
    fn by_slip(&self, selection: &TermSelection) -> Tensor<D> {
        let friction = &self.active.friction;
        (friction.by_velocity + self.active.drag) * selection.velocity_shift + friction.by_increment * 2.0
    }

    fn add_springs(
        &self,
        row: &VertexRows<D>,
        selection: &TermSelection,
        stiffest: f64,
        sink: &mut impl ContactSink,
    ) {
        let nodes: Vec<u32> = row.nodes.iter().map(|node| node.node).collect();
        let mut block = Vec::new();
        clear_block::<D>(&mut block, nodes.len());
        let joint =
            Joint { normal: -2.0 * self.active.normal.derivative, tangential: -self.by_slip(selection) };
        let coefficients = row.nodes.iter().map(|node| node.coefficient);
        let direction = self.ends.direction();
        joint.add_springs(&direction, self.active.change.mean_area(), coefficients, stiffest, &mut block);
        sink.stiffness(row.vertex, &nodes, &block);
    }

    fn add_stiffness(
        &self,
        row: &VertexRows<D>,
        at_end: &VertexRows<D>,
        selection: &TermSelection,
        sink: &mut impl ContactSink,
    ) {
        let Self { ends, active, motion } = self;
        let nodes: Vec<u32> = row.nodes.iter().map(|node| node.node).collect();
        let count = nodes.len();
        let mut block = Vec::new();
        clear_block::<D>(&mut block, count);
        let gradients = Gradients::of(row, ends, active, motion);
        let tests: Vec<Tensor<D>> = (0..count).map(|a| test(row, ends, a).transpose()).collect();
        let switch = |term| if selection.terms.contains(term) { 1.0 } else { 0.0 };
        let normal = switch(Terms::NORMAL_CONTACT);
        let coupling = switch(Terms::FRICTION_NORMAL_COUPLING);
        let through = active.friction.by_velocity_through_bound
            * (selection.velocity_shift * switch(Terms::COEFFICIENT_CHANGE));
        let by_slip = self.by_slip(selection) * switch(Terms::FRICTION_DAMPING) + through;
        let mean = active.change.mean_area();
        let pressure = self.potential().pressure * switch(Terms::NORMAL_GEOMETRY);
        let friction = active.carried * switch(Terms::FRICTION_GEOMETRY);
        let middle = ends.middle.area;
        let part = if ends.middle.is_covered() { ends.end.area / middle } else { 0.0 };
        for (b, node) in row.nodes.iter().enumerate() {
            let by_gap = at_end.nodes[b].gap * 2.0;
            let by_area = at_end.by_area[b] * 2.0;
            let by_pressure =
                by_gap * (mean * active.normal.derivative) + by_area * (0.5 * active.normal.traction);
            let by_energy = by_gap * (-0.5 * active.last);
            let coupled = active.by_pressure * active.normal.derivative + active.viscous_by_gap;
            let by_friction = coupled * by_gap.transpose() * coupling + by_slip * tests[b].transpose();
            let tested = by_friction * ends.end.area + friction * by_area.transpose();
            let with_gradient = by_pressure * normal;
            let with_area_gradient = by_energy * normal;
            let with_area = node.gap * pressure;
            let with_gap = row.by_area[b] * pressure;
            let with_friction = row.by_area[b] * part;
            for a in 0..count {
                let entry = gradients.gap[a] * with_gradient.transpose()
                    - gradients.area[a] * with_area_gradient.transpose()
                    + tests[a] * tested
                    - row.by_area[a] * with_area.transpose()
                    - row.nodes[a].gap * with_gap.transpose()
                    - friction * (with_friction * row.nodes[a].coefficient).transpose();
                let start = (a * count + b) * D * D;
                for i in 0..D {
                    for j in 0..D {
                        block[start + i * D + j] -= entry[(i, j)];
                    }
                }
            }
        }
        sink.stiffness(row.vertex, &nodes, &block);
    }
}

/// `c_a P - g dn/dx_a`: contribution of the motion of one node to the slip of the vertex.
fn test<const D: usize>(row: &VertexRows<D>, ends: &VertexEnds<D>, a: usize) -> Tensor<D> {
    let node = &row.nodes[a];
    if !ends.middle.is_covered() {
        return Tensor::zeros();
    }
    let direction = ends.direction();
    let projector = Tensor::identity() - direction * direction.transpose();
    projector * node.coefficient - node.normal * ends.middle.mean_gap()
}

fn slip<const D: usize>(
    row: &VertexRows<D>,
    ends: &VertexEnds<D>,
    direction: &Vector<D>,
    field: &[Vector<D>],
) -> Vector<D> {
    let slip: Vector<D> = field.iter().enumerate().map(|(a, value)| test(row, ends, a) * value).sum();
    slip - direction * direction.dot(&slip)
}

/// Motion of the nodes of a vertex over the step.
struct Motion<const D: usize> {
    unfelt: UnfeltMotions<D>,
    /// Whether the target moves as well. A common motion of both sides is then not slip.
    target_moves: bool,
    /// `d` \[m\].
    whole: Vec<Vector<D>>,
    /// `e` \[m\].
    changes: Vec<Vector<D>>,
    /// Velocities \[m/s\], without their rigid part if the target moves.
    velocities: Vec<Vector<D>>,
    square: f64,
}

impl<const D: usize> Motion<D> {
    fn of(row: &VertexRows<D>, fields: &ContactFields<'_>, target: &ContactTarget<D>) -> Self {
        if let (Some(frame), Some(obstacle)) = (target.frame(), target.obstacle()) {
            return Self::seen(row, fields, frame, obstacle);
        }
        let origin = row.reference_points[0];
        let origin_u: Vector<D> = at(fields.u, row.nodes[0].node);
        let placed = row.nodes.iter().zip(&row.reference_points);
        let mut places: Vec<Vector<D>> = placed
            .map(|(node, place)| (place - origin) + (at::<D>(fields.u, node.node) - origin_u))
            .collect();
        let centre = centred(&mut places);
        let unfelt = match target {
            ContactTarget::Body(_) => UnfeltMotions::new(&places, rigid_motions),
            ContactTarget::Obstacle(obstacle) => {
                let centre = centre + origin + origin_u;
                UnfeltMotions::new(&places, |x| obstacle.shape.motions_along(&(centre + x)))
            }
        };
        let target_moves = target.body().is_some();
        let whole: Vec<Vector<D>> = row
            .nodes
            .iter()
            .map(|node| (at::<D>(fields.u, node.node) - at::<D>(fields.u_start, node.node)) * 2.0)
            .collect();
        let mut velocities: Vec<Vector<D>> = row.nodes.iter().map(|node| at(fields.v, node.node)).collect();
        if target_moves {
            unfelt.remove(&mut velocities);
        }
        Self::new(&places, unfelt, target_moves, whole, velocities)
    }

    /// The motion of nodes as seen from a moving obstacle.
    fn seen(
        row: &VertexRows<D>,
        fields: &ContactFields<'_>,
        frame: &BodyFrame<D>,
        obstacle: &dyn Shape<D>,
    ) -> Self {
        let placed = row.nodes.iter().zip(&row.reference_points);
        let seen = placed.map(|(node, place)| {
            let [u_start, u, v] = [fields.u_start, fields.u, fields.v].map(|field| at(field, node.node));
            frame.see(place, &u_start, &u, &v)
        });
        let seen: Vec<SeenNode<D>> = seen.collect();
        let origin = seen[0].iterate;
        let mut places: Vec<Vector<D>> = seen.iter().map(|node| node.iterate - origin).collect();
        let centre = centred(&mut places) + origin;
        let unfelt = UnfeltMotions::new(&places, |x| obstacle.motions_along(&(centre + x)));
        let whole = seen.iter().map(|node| node.increment * 2.0).collect();
        let velocities = seen.iter().map(|node| node.velocity).collect();
        Self::new(&places, unfelt, false, whole, velocities)
    }

    /// From the positions relative to their mean.
    fn new(
        places: &[Vector<D>],
        unfelt: UnfeltMotions<D>,
        target_moves: bool,
        whole: Vec<Vector<D>>,
        velocities: Vec<Vector<D>>,
    ) -> Self {
        let mut changes = whole.clone();
        unfelt.remove(&mut changes);
        let extent = places.iter().map(|x| x.norm()).fold(0.0, f64::max);
        let size: f64 = changes.iter().map(|e| e.norm_squared()).sum();
        let square = if size > (RIGID * extent).powi(2) { size } else { 0.0 };
        Self { unfelt, target_moves, whole, changes, velocities, square }
    }

    /// The part of `d` that can be slip \[m\].
    fn sliding(&self) -> &Vec<Vector<D>> {
        if self.target_moves { &self.changes } else { &self.whole }
    }
}

/// Subtracts the mean of positions from them, and returns it.
fn centred<const D: usize>(places: &mut [Vector<D>]) -> Vector<D> {
    let centre = places.iter().sum::<Vector<D>>() / places.len() as f64;
    places.iter_mut().for_each(|place| *place -= centre);
    centre
}

/// Motions of all nodes together that change neither gap nor area, as an orthonormal basis.
struct UnfeltMotions<const D: usize> {
    basis: Vec<Vec<Vector<D>>>,
}

/// Maximum number of motions that change no gap: those of a rigid body in space.
const MOTIONS: usize = 6;

/// A motion is linearly dependent on the previous ones if no more than this fraction of it remains
/// after orthogonalization.
const DEPENDENT: f64 = 1e-8;

impl<const D: usize> UnfeltMotions<D> {
    /// `motions` gives the velocities of the motions at a point; velocities of unused motions are
    /// zero.
    fn new(places: &[Vector<D>], motions: impl Fn(&Vector<D>) -> [Vector<D>; MOTIONS]) -> Self {
        let fields: Vec<[Vector<D>; MOTIONS]> = places.iter().map(motions).collect();
        let mut all = Self { basis: Vec::with_capacity(MOTIONS) };
        for k in 0..MOTIONS {
            let mut field: Vec<Vector<D>> = fields.iter().map(|at| at[k]).collect();
            let whole = size(&field);
            // Orthogonalize twice to remove rounding residuals.
            all.remove(&mut field);
            all.remove(&mut field);
            let left = size(&field);
            if left > DEPENDENT * whole {
                field.iter_mut().for_each(|value| *value /= left);
                all.basis.push(field);
            }
        }
        all
    }

    /// Removes the nearest such motion from a field. The remainder has no resultant along any of
    /// them.
    fn remove(&self, field: &mut [Vector<D>]) {
        for motion in &self.basis {
            let part: f64 = motion.iter().zip(field.iter()).map(|(m, f)| m.dot(f)).sum();
            field.iter_mut().zip(motion).for_each(|(f, m)| *f -= m * part);
        }
    }
}

fn size<const D: usize>(field: &[Vector<D>]) -> f64 {
    field.iter().map(|value| value.norm_squared()).sum::<f64>().sqrt()
}

/// Velocities of the rigid motions at a point: translations along the axes and rotations.
fn rigid_motions<const D: usize>(x: &Vector<D>) -> [Vector<D>; MOTIONS] {
    let mut motions = [Vector::zeros(); MOTIONS];
    for i in 0..D {
        motions[i][i] = 1.0;
    }
    let turns = rotations(x);
    motions[D..].iter_mut().zip(turns).for_each(|(motion, turn)| *motion = turn);
    motions
}

/// Discrete gradients of gap and area by all nodes.
struct Gradients<const D: usize> {
    gap: Vec<Vector<D>>,
    area: Vec<Vector<D>>,
}

impl<const D: usize> Gradients<D> {
    fn of(row: &VertexRows<D>, ends: &VertexEnds<D>, active: &Active<D>, motion: &Motion<D>) -> Self {
        let covered = ends.middle.is_covered();
        let gradient = |of: &dyn Fn(usize) -> Vector<D>, change: f64| -> Vec<Vector<D>> {
            let at = |a: usize| if covered { of(a) } else { Vector::zeros() };
            let mut gradient: Vec<Vector<D>> = (0..row.nodes.len()).map(at).collect();
            if D == 3 && motion.target_moves {
                // The error of the quadrature, see `Want::FixedPlaces`.
                motion.unfelt.remove(&mut gradient);
            }
            let foreseen: f64 = gradient.iter().zip(&motion.whole).map(|(by, d)| by.dot(d)).sum();
            let missing = if motion.square > 0.0 { (change - foreseen) / motion.square } else { 0.0 };
            gradient.iter_mut().zip(&motion.changes).for_each(|(by, e)| *by += e * missing);
            gradient
        };
        let Change { gaps, areas } = active.change;
        Self {
            gap: gradient(&|a| row.nodes[a].gap, gaps[1] - gaps[0]),
            area: gradient(&|a| row.by_area[a], areas[1] - areas[0]),
        }
    }
}
