//! The kernel of one contact point: force and every left-hand-side term of (3.5), each under its name.
//!
//! With `t = t_n n + t_T` a node of coefficient `c_a` receives `A c_a t` (3.9). Minus the variation of that is, by
//! what varies: `A` (`K_phi`), `t_n` (`K_CN`), `n` and the projection under `t_n` (`K_CG`), `t_T` with the bound
//! (`K_nT`) and with the slip (`K_T`, `C_mu`), and slip measure, `n` and projection under `t_T` (`K_CG`, `K_TG`).

use super::friction::traction::{FrictionTraction, Slip, SlipTangent};
use super::friction::{Bound, Friction, Pressed};
use super::geometry::Geometry;
use super::history::History;
use super::normal::{NormalLaw, NormalResponse};
use crate::tensor::{Tensor, Vector};
use crate::terms::Terms;

/// The laws of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLaw {
    /// Gap to pressure.
    pub normal: NormalLaw,
    /// None: no friction, every contact term is symmetric but `K_phi`.
    pub friction: Option<Friction>,
}

/// Open, or closed and stuck or slipping. A frictionless closed point slips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Status {
    /// No contact.
    #[default]
    Open,
    /// Closed, on the stick branch of the regularised law.
    Stick,
    /// Closed, on the slip branch.
    Slip,
}

/// Tractions held by a stage of the two-stage scheme; `None` follows the law.
///
/// A frozen value acts whatever the gap, so that a stage sees no switch that is not its own.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Frozen<const D: usize> {
    /// Stage II: dead pressure \[Pa\] along the current normal.
    pub normal_traction: Option<f64>,
    /// Stages I and II: friction bound \[Pa\].
    pub bound: Option<f64>,
    /// The variant of stage I with known friction: dead traction \[Pa\].
    pub friction_traction: Option<Vector<D>>,
}

impl<const D: usize> Frozen<D> {
    /// Friction switched off: what the static start wants.
    pub fn frictionless() -> Self {
        Self { friction_traction: Some(Vector::zeros()), ..Self::default() }
    }

    /// Whether something is held that acts at an open point too.
    fn presses(&self) -> bool {
        self.normal_traction.is_some_and(|t| t > 0.0)
            || self.bound.is_some_and(|b| b > 0.0)
            || self.friction_traction.is_some_and(|t| t.amax() > 0.0)
    }
}

/// How the nodes of a point move, node by node as in [`Geometry::nodes`].
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a, const D: usize> {
    /// Velocities \[m/s\].
    pub velocity: &'a [Vector<D>],
    /// Displacement since the start of the step \[m\].
    pub increment: &'a [Vector<D>],
    /// What the point remembers from the last accepted step.
    pub history: &'a History<D>,
}

/// How a point is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Manner<const D: usize> {
    /// Tangent on the slip branch.
    pub tangent: SlipTangent,
    /// Tractions held fixed.
    pub frozen: Frozen<D>,
}

/// State of a contact point in one iterate: what is reported, compared and frozen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointState<const D: usize> {
    /// `g_n` \[m\], > 0 open.
    pub gap: f64,
    /// `n`, unit, outward from the target.
    pub normal: Vector<D>,
    /// `t_n >= 0`, pressure on the contactor \[Pa\].
    pub normal_traction: f64,
    /// `t_T` on the contactor \[Pa\].
    pub friction_traction: Vector<D>,
    /// `b` \[Pa\], bound of `|t_T|`.
    pub bound: f64,
    /// `v_T` \[m/s\].
    pub slip_velocity: Vector<D>,
    /// `P d`, slip since the start of the step \[m\].
    pub slip_increment: Vector<D>,
    /// Open, stick or slip.
    pub status: Status,
    /// `A` \[m, m^2\].
    pub area: f64,
    /// `w(g)` \[J/m^2\]: times the reference area, the energy stored by the normal law.
    pub potential: f64,
    /// Energy stored in elastic stick \[J/m^2\]; zero in the velocity form.
    pub recoverable: f64,
    /// Heat of the step by the return map \[J/m^2\]; zero in the velocity form, whose power is [`friction_power`](Self::friction_power).
    pub plastic_work: f64,
}

impl<const D: usize> Default for PointState<D> {
    fn default() -> Self {
        Self {
            gap: f64::INFINITY,
            normal: Vector::zeros(),
            normal_traction: 0.0,
            friction_traction: Vector::zeros(),
            bound: 0.0,
            slip_velocity: Vector::zeros(),
            slip_increment: Vector::zeros(),
            status: Status::Open,
            area: 0.0,
            potential: 0.0,
            recoverable: 0.0,
            plastic_work: 0.0,
        }
    }
}

impl<const D: usize> PointState<D> {
    /// `-t_T . v_T` per area \[W/m^2\]: what friction takes out of the motion, >= 0 in the velocity form.
    pub fn friction_power(&self) -> f64 {
        -self.friction_traction.dot(&self.slip_velocity)
    }

    /// Whether the point is closed.
    pub fn is_closed(&self) -> bool {
        self.status != Status::Open
    }

    /// `t = t_n n + t_T` \[Pa\], on the contactor.
    pub fn traction(&self) -> Vector<D> {
        self.normal * self.normal_traction + self.friction_traction
    }
}

/// Derivatives of the tractions at a closed point: what the stiffness is made of.
#[derive(Debug, Clone, Copy)]
struct Slopes<const D: usize> {
    /// `dt_n/dg`.
    normal: f64,
    /// `dt_T/dg` through the bound.
    by_gap: Vector<D>,
    /// `dt_T/dw`, `dt_T/dw` through the bound, `dt_T/dd`, `dt_T/dn`.
    by_velocity: Tensor<D>,
    through_bound: Tensor<D>,
    by_increment: Tensor<D>,
    by_normal: Tensor<D>,
    /// `dt_T/dxi^k`, as the projection moves along the target.
    by_coordinates: [Vector<D>; 2],
}

/// A point evaluated: its state and, where it is closed, what force and stiffness need.
#[derive(Debug, Clone, Copy)]
pub struct Response<const D: usize> {
    /// The state to report and to remember.
    pub state: PointState<D>,
    slopes: Option<Slopes<D>>,
}

/// Evaluates the laws at a point. Pure.
pub fn respond<const D: usize>(
    law: &ContactLaw,
    geometry: &Geometry<D>,
    motion: &Motion<'_, D>,
    manner: &Manner<D>,
) -> Response<D> {
    let frozen = &manner.frozen;
    let state = PointState {
        gap: geometry.gap,
        normal: geometry.normal,
        area: geometry.area,
        ..PointState::default()
    };
    let velocity = geometry.relative(motion.velocity);
    let increment = geometry.relative(motion.increment);
    let slip = Slip {
        normal: &geometry.normal,
        velocity: &velocity,
        increment: &increment,
        old_traction: &motion.history.friction_traction,
        old_normal: &motion.history.normal,
    };
    let slip_velocity = slip.slip_velocity();
    if geometry.gap > 0.0 && !frozen.presses() {
        return Response { state: PointState { slip_velocity, ..state }, slopes: None };
    }
    let normal = normal_response(law, geometry.gap, frozen);
    let friction = friction_response(law, geometry.gap, normal, &slip, manner);
    let state = PointState {
        normal_traction: normal.traction,
        friction_traction: friction.answer.traction,
        bound: friction.bound.value,
        slip_velocity,
        slip_increment: slip.slip_increment(),
        status: if friction.answer.slips { Status::Slip } else { Status::Stick },
        potential: law.normal.evaluate(geometry.gap).potential,
        recoverable: law
            .friction
            .map_or(0.0, |f| f.regularization.recoverable_energy(&friction.answer.traction)),
        plastic_work: friction.answer.plastic_work,
        ..state
    };
    let answer = friction.answer;
    let by_slip = answer.by_velocity + answer.by_velocity_through_bound;
    let (velocities, increments) =
        (geometry.relative_gradient(motion.velocity), geometry.relative_gradient(motion.increment));
    let along = |k: usize| by_slip * velocities[k] + answer.by_increment * increments[k];
    let slopes = Slopes {
        normal: normal.derivative,
        by_gap: answer.by_bound * friction.bound.by_gap,
        by_velocity: answer.by_velocity,
        through_bound: answer.by_velocity_through_bound,
        by_increment: answer.by_increment,
        by_normal: answer.by_normal,
        by_coordinates: [along(0), along(1)],
    };
    Response { state, slopes: Some(slopes) }
}

fn normal_response<const D: usize>(law: &ContactLaw, gap: f64, frozen: &Frozen<D>) -> NormalResponse {
    match frozen.normal_traction {
        Some(traction) => NormalResponse { traction, derivative: 0.0, potential: 0.0 },
        None => law.normal.evaluate(gap),
    }
}

struct FrictionResponse<const D: usize> {
    bound: Bound,
    answer: FrictionTraction<D>,
}

fn friction_response<const D: usize>(
    law: &ContactLaw,
    gap: f64,
    normal: NormalResponse,
    slip: &Slip<'_, D>,
    manner: &Manner<D>,
) -> FrictionResponse<D> {
    let frozen = &manner.frozen;
    let Some(friction) = law.friction else {
        return FrictionResponse { bound: Bound::default(), answer: FrictionTraction::dead(Vector::zeros()) };
    };
    if let Some(traction) = frozen.friction_traction {
        let bound = Bound { value: traction.norm(), ..Bound::default() };
        return FrictionResponse { bound, answer: FrictionTraction::dead(traction) };
    }
    let bound = match frozen.bound {
        Some(value) => Bound { value, ..Bound::default() },
        None => {
            let slip_speed = slip.direction().0;
            let bound = friction.law.bound(Pressed { normal, gap, slip_speed });
            let by_gap = if frozen.normal_traction.is_some() { 0.0 } else { bound.by_gap };
            Bound { by_gap, ..bound }
        }
    };
    FrictionResponse { bound, answer: friction.regularization.traction(&bound, slip, manner.tangent) }
}

/// Which terms of the matrix to add, and `dv/du` of the time integrator \[1/s\], by which damping becomes stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Selection {
    /// Terms wanted; those that are not contact's are ignored.
    pub terms: Terms,
    /// `c_v`.
    pub velocity_shift: f64,
}

impl<const D: usize> Response<D> {
    /// Adds the force `A c_a t` to `force[a * D + i]` \[N, per depth in 2D\].
    pub fn add_force(&self, geometry: &Geometry<D>, force: &mut [f64]) {
        if self.slopes.is_none() {
            return;
        }
        let resultant = self.state.traction() * geometry.area;
        for (node, force) in geometry.nodes.iter().zip(force.chunks_exact_mut(D)) {
            for (f, r) in force.iter_mut().zip(resultant.iter()) {
                *f += node.coefficient * r;
            }
        }
    }

    /// Adds the chosen left-hand-side terms to `stiffness[((a * m + b) * D + i) * D + j]`, `m` nodes \[N/m\].
    pub fn add_stiffness(&self, geometry: &Geometry<D>, selection: &Selection, stiffness: &mut [f64]) {
        let Some(slopes) = &self.slopes else {
            return;
        };
        let terms = selection.terms;
        let count = geometry.nodes.len();
        // What a change of the test coefficient along the target multiplies.
        let carried = self.carried(terms) * geometry.area;
        for (b, node) in geometry.nodes.iter().enumerate() {
            let column = self.column(geometry, slopes, selection, b);
            let moves = node.coordinates.iter().any(|c| c.amax() > 0.0);
            for (a, test) in geometry.nodes.iter().enumerate() {
                let mut block = column * test.coefficient;
                if moves {
                    let [first, second] = test.coefficient_gradient;
                    block -=
                        carried * (node.coordinates[0] * first + node.coordinates[1] * second).transpose();
                }
                let start = (a * count + b) * D * D;
                for (i, row) in stiffness[start..start + D * D].chunks_exact_mut(D).enumerate() {
                    for (j, entry) in row.iter_mut().enumerate() {
                        *entry += block[(i, j)];
                    }
                }
            }
        }
    }

    /// Traction whose geometric terms are wanted.
    fn carried(&self, terms: Terms) -> Vector<D> {
        let mut carried = Vector::zeros();
        if terms.contains(Terms::NORMAL_GEOMETRY) {
            carried += self.state.normal * self.state.normal_traction;
        }
        if terms.contains(Terms::FRICTION_GEOMETRY) {
            carried += self.state.friction_traction;
        }
        carried
    }

    /// Minus the derivative of `A t` by the position of node `b`, the chosen terms of it.
    fn column(
        &self,
        geometry: &Geometry<D>,
        slopes: &Slopes<D>,
        selection: &Selection,
        b: usize,
    ) -> Tensor<D> {
        let (node, terms, shift) = (&geometry.nodes[b], selection.terms, selection.velocity_shift);
        let mut by_traction = Tensor::zeros();
        if terms.contains(Terms::NORMAL_CONTACT) {
            by_traction += geometry.normal * (node.gap * slopes.normal).transpose();
        }
        if terms.contains(Terms::NORMAL_GEOMETRY) {
            by_traction += node.normal * self.state.normal_traction;
        }
        if terms.contains(Terms::FRICTION_NORMAL_COUPLING) {
            by_traction += slopes.by_gap * node.gap.transpose();
        }
        if terms.contains(Terms::FRICTION_DAMPING) {
            by_traction += (slopes.by_velocity * shift + slopes.by_increment) * node.coefficient;
        }
        if terms.contains(Terms::COEFFICIENT_CHANGE) {
            by_traction += slopes.through_bound * (shift * node.coefficient);
        }
        if terms.contains(Terms::FRICTION_GEOMETRY) {
            by_traction += slopes.by_normal * node.normal;
            for (slope, coordinate) in slopes.by_coordinates.iter().zip(&node.coordinates) {
                by_traction += slope * coordinate.transpose();
            }
        }
        let mut column = by_traction * -geometry.area;
        if terms.contains(Terms::ZONE_CHANGE) {
            column -= self.state.traction() * node.area.transpose();
        }
        column
    }
}
