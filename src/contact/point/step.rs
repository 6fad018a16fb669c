//! The kernel of a contact point over a step: the discrete gradient of contact (formulation, section 13).
//!
//! Let `w(g)` be the potential of the normal law, `g_0` the gap at the end of the last step and `g_1` the one at the end of
//! this step. Forces that act along the gradient `d_a = dg/dx_a` at the middle of the step have neither resultant nor
//! moment about the places there, since the gap does not change as contactor and target move together as a rigid body. So
//! momentum leaves their size free, and their work over the step, `A t_n (sum_a d_a . du_a)`, settles it:
//!
//! `t_n = -(w(g_1) - w(g_0)) / delta`, `delta = sum_a d_a . du_a`.
//!
//! It is written as `t_n = tau r`, `tau` the mean of the law's pressure between `g_0` and `g_1`, which always is one, and
//! `r = (g_1 - g_0) / delta`, which is 1 on a plane and `1 + O(du^2)` on a curved target. Where the gap hardly changes
//! the quotient says nothing, and is led to 1: with `m = g_1 - g_0 - delta`, what the motion misses of the change,
//! `r = 1 + m delta^7 / (delta^8 + (0.7 m)^8 + eps^8)`, `eps` a thousandth of the penetration. That is the quotient but for
//! a part `(0.7 m / delta)^8` of `m`, smooth in all that moves, and between 0 and 2 whatever a change of facet does to the gap;
//! where it is not the quotient, the ledger shows what the work misses.
//!
//! Friction does the same with the slip `s = P (sum_a c_a du_a) - g dn`, which has no part of a common rotation either:
//! its last term is the lever of the gap. The force on a node is `(c_a 1 - g dn/dx_a)^T t_T`, its work over the step
//! `t_T . s`, all of which is heat (less what elastic stick stores).

use super::{ContactLaw, Manner, PointState, Selection, Status};
use crate::contact::friction::Pressed;
use crate::contact::friction::traction::{FrictionTraction, Slip};
use crate::contact::geometry::Geometry;
use crate::contact::history::History;
use crate::contact::normal::{NormalLaw, NormalResponse};
use crate::tensor::{Tensor, Vector};
use crate::terms::Terms;

/// A gap that changes by less than this part of the penetration is not asked what its change did.
const STILL: f64 = 1e-3;

/// Eighth power of 0.7: keeps the ratio of gap change and motion between 0 and 2.
const MISS: f64 = 0.057_648_01;

/// A point over a step: its geometry in the middle and at the end, and the motion of its nodes.
#[derive(Debug, Clone, Copy)]
pub struct StepMotion<'a, const D: usize> {
    /// In the middle of the step; its area is the reference area.
    pub middle: &'a Geometry<D>,
    /// At its end.
    pub end: &'a Geometry<D>,
    /// Velocities in the middle \[m/s\].
    pub velocity: &'a [Vector<D>],
    /// Displacement from the start to the middle \[m\].
    pub increment: &'a [Vector<D>],
    /// What the point remembers from the last accepted step.
    pub history: &'a History<D>,
}

/// How the pressure changes with the gap at the end and with the motion `delta`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Pressure {
    value: f64,
    by_end: f64,
    by_motion: f64,
}

/// A field of the nodes as the slip sees it: `sum c_a f_a - g dn`, and what its derivative needs.
#[derive(Debug, Clone, Copy)]
struct Relative<const D: usize> {
    value: Vector<D>,
    turn: Vector<D>,
    along: [Vector<D>; 2],
}

/// A point evaluated over a step.
#[derive(Debug, Clone, Copy)]
pub struct StepResponse<const D: usize> {
    /// The state to report and to remember: gap and potential at the end, tractions as they act over the step.
    pub state: PointState<D>,
    slopes: Option<Slopes<D>>,
}

#[derive(Debug, Clone, Copy)]
struct Slopes<const D: usize> {
    pressure: Pressure,
    /// `dt_T/dt_n`.
    by_pressure: Vector<D>,
    friction: FrictionTraction<D>,
    velocity: Relative<D>,
    increment: Relative<D>,
    /// `sum_a c_a du_a` over the step and its change with the projection.
    moved: Vector<D>,
    moved_along: [Vector<D>; 2],
}

/// Evaluates the laws over a step. Pure.
pub fn respond_over_step<const D: usize>(
    law: &ContactLaw,
    motion: &StepMotion<'_, D>,
    manner: &Manner<D>,
) -> StepResponse<D> {
    let (middle, history) = (motion.middle, motion.history);
    let change = 2.0 * motion.increment.iter().zip(&middle.nodes).map(|(u, a)| a.gap.dot(u)).sum::<f64>();
    let end = motion.end.gap;
    let start = if history.gap.is_finite() { history.gap } else { (end - change).max(0.0) };
    let state = PointState {
        gap: end,
        normal: middle.normal,
        area: middle.area,
        over_step: true,
        potential: law.normal.evaluate(end).potential,
        ..PointState::default()
    };
    let velocity = relative(middle, motion.velocity);
    let slip_of = |field: &Vector<D>| field - middle.normal * middle.normal.dot(field);
    let pressure = pressure(&law.normal, [start, end], change);
    if pressure.value <= 0.0 {
        let state = PointState { slip_velocity: slip_of(&velocity.value), ..state };
        return StepResponse { state, slopes: None };
    }
    let half = relative(middle, motion.increment);
    let increment =
        Relative { value: half.value * 2.0, turn: half.turn * 2.0, along: half.along.map(|v| v * 2.0) };
    let slip = Slip {
        normal: &middle.normal,
        velocity: &velocity.value,
        increment: &increment.value,
        old_traction: &history.friction_traction,
        old_normal: &history.normal,
    };
    let (bound, by_pressure, friction) = friction(law, pressure.value, &slip, manner);
    let work = -friction.traction.dot(&slip.slip_increment());
    let stored = |traction| law.friction.map_or(0.0, |f| f.regularization.recoverable_energy(traction));
    let recoverable = stored(&friction.traction);
    let state = PointState {
        normal_traction: pressure.value,
        friction_traction: friction.traction,
        bound,
        slip_velocity: slip.slip_velocity(),
        slip_increment: slip.slip_increment(),
        status: if friction.slips { Status::Slip } else { Status::Stick },
        recoverable,
        plastic_work: work - (recoverable - stored(&history.friction_traction)),
        ..state
    };
    let moved = middle.relative(motion.increment) * 2.0;
    let moved_along = middle.relative_gradient(motion.increment).map(|v| v * 2.0);
    let slopes = Slopes { pressure, by_pressure, friction, velocity, increment, moved, moved_along };
    StepResponse { state, slopes: Some(slopes) }
}

fn relative<const D: usize>(geometry: &Geometry<D>, field: &[Vector<D>]) -> Relative<D> {
    let turn: Vector<D> = geometry.nodes.iter().zip(field).map(|(node, value)| node.normal * value).sum();
    let value = geometry.relative(field) - turn * geometry.gap;
    Relative { value, turn, along: geometry.relative_gradient(field) }
}

/// `tau r` with its derivatives; `gaps` at the start and the end, `change` the motion `delta`.
fn pressure(law: &NormalLaw, gaps: [f64; 2], change: f64) -> Pressure {
    let NormalResponse { traction: mean, derivative, .. } = law.between(gaps);
    if mean <= 0.0 {
        return Pressure::default();
    }
    let [start, end] = gaps;
    let miss = end - start - change;
    let [ratio, by_miss, by_change] = ratio(miss, change, STILL * (-start).max(0.0));
    Pressure {
        value: mean * ratio,
        by_end: derivative * ratio + mean * by_miss,
        by_motion: mean * (by_change - by_miss),
    }
}

/// `r = 1 + miss change^7 / (change^8 + (k miss)^8 + still^8)`, between 0 and 2, and its derivatives by `miss` and `change`.
pub(super) fn ratio(miss: f64, change: f64, still: f64) -> [f64; 3] {
    // Scaled first: eighth powers of small lengths underflow.
    let largest = miss.abs().max(change.abs()).max(still);
    if largest < f64::MIN_POSITIVE {
        return [1.0, 0.0, 0.0];
    }
    let (m, c, s) = (miss / largest, change / largest, still / largest);
    let size = c.powi(8) + MISS * m.powi(8) + s.powi(8);
    let part = m * c.powi(7) / size;
    let by_miss = (c.powi(7) - part * 8.0 * MISS * m.powi(7)) / size;
    let by_change = (7.0 * m * c.powi(6) - part * 8.0 * c.powi(7)) / size;
    [1.0 + part, by_miss / largest, by_change / largest]
}

/// Bound, `dt_T/dt_n` and the traction: the bound is that of the penetration under the mean pressure.
fn friction<const D: usize>(
    law: &ContactLaw,
    pressure: f64,
    slip: &Slip<'_, D>,
    manner: &Manner<D>,
) -> (f64, Vector<D>, FrictionTraction<D>) {
    let nothing = || FrictionTraction::dead(Vector::zeros());
    let Some(friction) = law.friction.filter(|_| manner.frozen.friction_traction.is_none()) else {
        return (0.0, Vector::zeros(), nothing());
    };
    let gap = -law.normal.penetration(pressure);
    let normal = law.normal.evaluate(gap);
    let bound = friction.law.bound(Pressed { normal, gap, slip_speed: slip.direction().0 });
    let answer = friction.regularization.traction(&bound, slip, manner.branch);
    let by_pressure = if normal.derivative < 0.0 { bound.by_gap / normal.derivative } else { 0.0 };
    (bound.value, answer.by_bound * by_pressure, answer)
}

impl<const D: usize> StepResponse<D> {
    /// Whether the point takes part.
    pub fn is_closed(&self) -> bool {
        self.slopes.is_some()
    }

    /// Adds `A (t_n d_a + (c_a 1 - g dn/dx_a)^T t_T)` to `force[a * D + i]` \[N, per depth in 2D\].
    pub fn add_force(&self, middle: &Geometry<D>, force: &mut [f64]) {
        if self.slopes.is_none() {
            return;
        }
        let (pressure, friction) = (self.state.normal_traction, self.state.friction_traction);
        for (node, force) in middle.nodes.iter().zip(force.chunks_exact_mut(D)) {
            let lever = node.normal.transpose() * friction * middle.gap;
            let nodal = (node.gap * pressure + friction * node.coefficient - lever) * middle.area;
            force.iter_mut().zip(nodal.iter()).for_each(|(f, r)| *f += r);
        }
    }

    /// Adds the chosen left-hand-side terms to `stiffness[((a * m + b) * D + i) * D + j]`, `m` nodes \[N/m\].
    ///
    /// All of the derivative by the middle of the step but the change of `dn/dx_a` itself in the lever of friction and,
    /// beyond an edge of the target, in `d_a`: both come with the gap or the overhang.
    pub fn add_stiffness(
        &self,
        (middle, end): (&Geometry<D>, &Geometry<D>),
        selection: &Selection,
        stiffness: &mut [f64],
    ) {
        let Some(slopes) = &self.slopes else { return };
        let (terms, count) = (selection.terms, middle.nodes.len());
        let switch = |term| if terms.contains(term) { 1.0 } else { 0.0 };
        let geometric = [switch(Terms::NORMAL_GEOMETRY), switch(Terms::FRICTION_GEOMETRY)];
        let carried = middle.normal * (geometric[0] * self.state.normal_traction)
            + self.state.friction_traction * geometric[1];
        for (b, node) in middle.nodes.iter().enumerate() {
            let by_pressure = slopes.pressure_by(middle, end, b);
            let normal = by_pressure * switch(Terms::NORMAL_CONTACT);
            let turn = node.normal * (geometric[0] * self.state.normal_traction);
            let friction = slopes.friction_by(middle, selection, b, &by_pressure);
            for (a, test) in middle.nodes.iter().enumerate() {
                let [first, second] = test.coefficient_gradient;
                let along = node.coordinates[0] * first + node.coordinates[1] * second;
                let lever = test.normal.transpose();
                let mut block = test.gap * normal.transpose()
                    + turn * test.coefficient
                    + carried * along.transpose()
                    + friction * test.coefficient
                    - lever * friction * middle.gap;
                block -= lever * self.state.friction_traction * node.gap.transpose() * geometric[1];
                block *= -middle.area;
                let start = (a * count + b) * D * D;
                for (i, row) in stiffness[start..start + D * D].chunks_exact_mut(D).enumerate() {
                    row.iter_mut().enumerate().for_each(|(j, entry)| *entry += block[(i, j)]);
                }
            }
        }
    }
}

impl<const D: usize> Slopes<D> {
    /// `dt_n/dx_b`.
    fn pressure_by(&self, middle: &Geometry<D>, end: &Geometry<D>, b: usize) -> Vector<D> {
        let node = &middle.nodes[b];
        let mut motion = node.gap * 2.0 + node.normal.transpose() * self.moved;
        for (moved, coordinate) in self.moved_along.iter().zip(&node.coordinates) {
            motion += coordinate * middle.normal.dot(moved);
        }
        end.nodes[b].gap * (2.0 * self.pressure.by_end) + motion * self.pressure.by_motion
    }

    /// `dt_T/dx_b`, the chosen terms of it.
    fn friction_by(
        &self,
        middle: &Geometry<D>,
        selection: &Selection,
        b: usize,
        by_pressure: &Vector<D>,
    ) -> Tensor<D> {
        let (node, terms, answer) = (&middle.nodes[b], selection.terms, &self.friction);
        let slip = Tensor::identity() * node.coefficient - node.normal * middle.gap;
        let by_velocity = answer.by_velocity + answer.by_velocity_through_bound;
        let mut sum = Tensor::zeros();
        if terms.contains(Terms::FRICTION_NORMAL_COUPLING) {
            sum += self.by_pressure * by_pressure.transpose();
        }
        if terms.contains(Terms::FRICTION_DAMPING) {
            sum += (answer.by_velocity * selection.velocity_shift + answer.by_increment * 2.0) * slip;
        }
        if terms.contains(Terms::COEFFICIENT_CHANGE) {
            sum += answer.by_velocity_through_bound * slip * selection.velocity_shift;
        }
        if terms.contains(Terms::FRICTION_GEOMETRY) {
            sum += answer.by_normal * node.normal;
            for (slope, field) in [(&by_velocity, &self.velocity), (&answer.by_increment, &self.increment)] {
                let mut moved = -field.turn * node.gap.transpose();
                for (along, coordinate) in field.along.iter().zip(&node.coordinates) {
                    moved += along * coordinate.transpose();
                }
                sum += slope * moved;
            }
        }
        sum
    }
}
