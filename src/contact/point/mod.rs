//! The laws at one contact point: tractions and their derivatives by gap, slip and normal.

mod elastic_stick;
pub mod joint;
mod state;
pub mod step;

pub use state::{PointState, Status};

use elastic_stick::ElasticStick;

use super::damping::{ActiveDamping, Closing, ContactDamping, DampedNormal};
use super::friction::traction::{Branch, FrictionTraction, Slip};
use super::friction::{Bound, Friction, Pressed};
use super::history::History;
use super::normal::{NormalLaw, NormalResponse};
use crate::tensor::{Tensor, Vector};
use crate::terms::Terms;

/// Terms of the matrix to add, and `dv/du` of the time integrator \[1/s\], which converts damping
/// to stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermSelection {
    /// Selected terms; terms that do not belong to contact are ignored.
    pub terms: Terms,
    /// `c_v`.
    pub velocity_shift: f64,
    /// Replaces the terms by springs no stiffer than this \[Pa/m\], which are suitable for
    /// multigrid.
    pub joint: Option<f64>,
}

/// The laws of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLaw {
    /// Gap to pressure.
    pub normal: NormalLaw,
    /// `None`: no friction. On a plane every contact term is then symmetric except `K_phi`. Over
    /// round obstacles and between bodies the derivative of the gap is not symmetric either.
    pub friction: Option<Friction>,
    /// Damping along the normal and along the surface.
    pub damping: ContactDamping,
}

/// Tractions held fixed by a stage of the two-stage scheme; `None` follows the law.
///
/// A frozen value acts at any gap, so that a stage has no status changes other than its own.
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
    /// Friction switched off, for the static start.
    pub fn frictionless() -> Self {
        Self { friction_traction: Some(Vector::zeros()), ..Self::default() }
    }

    /// Whether a held traction also acts at an open point.
    fn presses(&self) -> bool {
        self.normal_traction.is_some_and(|t| t > 0.0)
            || self.bound.is_some_and(|b| b > 0.0)
            || self.friction_traction.is_some_and(|t| t.amax() > 0.0)
    }
}

/// Options of the evaluation of a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Manner<const D: usize> {
    /// Branch of the friction law.
    pub branch: Branch,
    /// Tractions held fixed.
    pub frozen: Frozen<D>,
    /// Penetration at which the normal law has the pressure of the multiplier \[m\]. The law is
    /// evaluated at `gap - offset`, which for the penalty is `t_n = <lambda - g / eps_n>`.
    pub offset: f64,
    /// Multiplier of friction at the start of the step \[Pa\]; `None` if friction is not augmented.
    pub multiplier: Option<Vector<D>>,
    /// Gaps of this size are rounding \[m\]. A point within this distance is closed, for either
    /// sign of the computed gap. Forces are those of the law at the computed gap.
    pub touching: f64,
    /// No correction has been computed in this solve yet. A touching point then contributes
    /// stiffness for either sign of its gap; otherwise rounding would decide which points support a
    /// resting body. Later iterates use the slope at the computed gap; otherwise a point that
    /// should open would leave by ever smaller corrections.
    pub fresh: bool,
    /// Part of the damping that acts.
    pub damping: ActiveDamping,
}

impl<const D: usize> Manner<D> {
    /// Whether the normal law is open at this gap \[m\]. A gap that is not a number is closed: the forces
    /// then show it.
    pub fn is_apart(&self, gap: f64) -> bool {
        gap - self.offset > self.touching
    }
}

/// Derivatives of the tractions at a closed point, from which the stiffness is assembled.
#[derive(Debug, Clone, Copy)]
pub struct Slopes<const D: usize> {
    /// `dt_n/dg` \[Pa/m\].
    pub normal: f64,
    /// `dt_n/dw` \[Pa s/m\].
    pub normal_by_velocity: Vector<D>,
    /// `dt_n/dn` at fixed `w` \[Pa\].
    pub normal_by_normal: Vector<D>,
    /// `dt_T/dg`, through the bound and of damping \[Pa/m\].
    pub by_gap: Vector<D>,
    /// `dt_T/dt_n` through the bound \[-\]; zero without damping along the normal.
    pub by_pressure: Vector<D>,
    /// `dt_T/dw` at fixed bound, damping included \[Pa s/m\].
    pub by_velocity: Tensor<D>,
    /// `dt_T/dw` through the bound \[Pa s/m\].
    pub through_bound: Tensor<D>,
    /// `dt_T/dd` \[Pa/m\].
    pub by_increment: Tensor<D>,
    /// `dt_T/dn` \[Pa\].
    pub by_normal: Tensor<D>,
}

/// Inputs of the laws at a point: its position relative to the target and its relative motion.
#[derive(Debug, Clone, Copy)]
pub struct Relation<'a, const D: usize> {
    /// `g_n` \[m\].
    pub gap: f64,
    /// `n`, unit, outward from the target.
    pub normal: Vector<D>,
    /// `A` \[m, m^2\].
    pub area: f64,
    /// `w`, contactor minus target, not projected \[m/s\].
    pub velocity: Vector<D>,
    /// `d`, of displacements since the start of the step, without what a rotation of the normal
    /// adds \[m\].
    pub increment: Vector<D>,
    /// Relative displacement since the start of the step, contactor minus target \[m\].
    pub displacement: Vector<D>,
    /// History of the point from the last accepted step.
    pub history: &'a History<D>,
}

/// State of a point under the laws and, if it is closed, the derivatives of its tractions. Pure
/// function.
pub fn tractions<const D: usize>(
    law: &ContactLaw,
    relation: &Relation<'_, D>,
    manner: &Manner<D>,
) -> (PointState<D>, Option<Slopes<D>>) {
    let frozen = &manner.frozen;
    let state = PointState {
        gap: relation.gap,
        normal: relation.normal,
        area: relation.area,
        ..PointState::default()
    };
    let stick = ElasticStick::new(law, relation.history, manner);
    let old_traction = stick.old_traction(relation.history);
    let slip = Slip {
        normal: &relation.normal,
        velocity: &relation.velocity,
        increment: &relation.increment,
        old_traction: &old_traction,
        old_normal: &relation.history.normal,
    };
    let slip_velocity = slip.slip_velocity();
    let slip_increment = slip.slip_increment();
    let shifted = relation.gap - manner.offset;
    // Work of damping by the trapezoidal rule, like the integrators.
    let damping_work =
        |now: Vector<D>| -0.5 * (relation.history.damping_traction + now).dot(&relation.displacement);
    if manner.is_apart(relation.gap) && !frozen.presses() {
        let damping_work = damping_work(Vector::zeros());
        return (PointState { slip_velocity, slip_increment, damping_work, ..state }, None);
    }
    let met = if manner.fresh && shifted <= manner.touching { shifted.min(0.0) } else { shifted };
    let damping = law.damping.only(manner.damping);
    let speed = -relation.normal.dot(&relation.velocity);
    let closing = Closing { gap: met, start: relation.history.gap - manner.offset, speed };
    let damped = damping.damped(law.normal.evaluate(met), &closing);
    let normal = normal_response(damped, frozen);
    let by_speed = if frozen.normal_traction.is_some() { 0.0 } else { damped.by_speed };
    let friction = friction_response(law, met, normal, &slip, manner);
    let answer = friction.answer;
    let (part, part_by_gap) = closing.part_in_contact();
    let viscosity = damping.tangential_viscosity();
    let viscous_traction = -slip_velocity * (viscosity * part);
    let drag = slip.tangential_projector() * (-viscosity * part);
    let [elastic_slip, traction_at_start] = stick.ends(&answer.traction, &slip);
    let state = PointState {
        normal_traction: normal.traction,
        friction_traction: answer.traction,
        normal_damping: damped.damping,
        viscous_traction,
        damping_work: damping_work(relation.normal * damped.damping + viscous_traction),
        bound: friction.bound.value,
        slip_velocity,
        slip_increment,
        status: if answer.slips { Status::Slip } else { Status::Stick },
        presses: shifted < -manner.touching,
        potential: potential(law, relation.gap, manner),
        elastic_slip,
        traction_at_start,
        recoverable: 0.5 * answer.traction.norm() * elastic_slip.norm(),
        plastic_work: answer.plastic_work,
        sticks_elastically: stick.compliance > 0.0,
        is_beyond_bound: manner.branch == Branch::Stick && answer.exceeds(friction.bound.value),
        ..state
    };
    let slopes = Slopes {
        normal: normal.derivative,
        normal_by_velocity: -relation.normal * by_speed,
        normal_by_normal: -relation.velocity * by_speed,
        by_gap: answer.by_bound * friction.bound.by_gap - slip_velocity * (viscosity * part_by_gap),
        by_pressure: answer.by_bound * if by_speed > 0.0 { friction.by_pressure } else { 0.0 },
        by_velocity: answer.by_velocity + drag,
        through_bound: answer.by_velocity_through_bound,
        by_increment: answer.by_increment,
        by_normal: answer.by_normal + slip.projected_velocity_by_normal() * (-viscosity * part),
    };
    (state, Some(slopes))
}

/// Energy stored at a closed point. A pushing multiplier does no work if the gap is exactly zero.
/// The stored energy is then half the pressure times the remaining penetration, which without a
/// multiplier is the potential of the penalty.
fn potential<const D: usize>(law: &ContactLaw, gap: f64, manner: &Manner<D>) -> f64 {
    let shifted = law.normal.evaluate(gap - manner.offset);
    if manner.offset > 0.0 { 0.5 * shifted.traction * (-gap).max(0.0) } else { shifted.potential }
}

fn normal_response<const D: usize>(damped: DampedNormal, frozen: &Frozen<D>) -> NormalResponse {
    match frozen.normal_traction {
        Some(traction) => NormalResponse { traction, derivative: 0.0, potential: 0.0 },
        None => damped.normal,
    }
}

struct FrictionResponse<const D: usize> {
    bound: Bound,
    /// `db/dt_n` \[-\].
    by_pressure: f64,
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
        let answer = FrictionTraction::dead(Vector::zeros());
        return FrictionResponse { bound: Bound::default(), by_pressure: 0.0, answer };
    };
    if let Some(traction) = frozen.friction_traction {
        let bound = Bound { value: traction.norm(), ..Bound::default() };
        return FrictionResponse { bound, by_pressure: 0.0, answer: FrictionTraction::dead(traction) };
    }
    let mut by_pressure = 0.0;
    let bound = match frozen.bound {
        Some(value) => Bound { value, ..Bound::default() },
        None => {
            let slip_speed = slip.direction().0;
            let pressed = Pressed { normal, gap, slip_speed };
            let bound = friction.law.bound(pressed);
            let by_gap = if frozen.normal_traction.is_some() { 0.0 } else { bound.by_gap };
            if law.damping.normal.is_some() {
                by_pressure = friction.law.by_pressure(pressed);
            }
            Bound { by_gap, ..bound }
        }
    };
    let answer = friction.regularization.traction(&bound, slip, manner.branch);
    FrictionResponse { bound, by_pressure, answer }
}
