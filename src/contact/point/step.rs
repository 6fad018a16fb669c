//! The kernel of a contact point over a step: the discrete gradient of contact (formulation, section 13).
//!
//! Let `w(g)` be the potential of the normal law, `g_0` the gap that counts at the end of the last step. Forces along the gradient
//! `d_a = dg/dx_a` in the middle of the step have neither resultant nor moment about the places there, since the gap does not
//! change as the contactor moves along the obstacle as a rigid body; neither have the forces `(c_a 1 - g dn/dx_a)^T t` of a tangential
//! traction `t`, which belong by virtual work to the slip `s = P (sum_a c_a du_a) - g dn`: its last term, the lever of the gap,
//! takes common rotations out. The work of the one is `t_n delta`, `delta = sum_a d_a . du_a`, of the other `t . s`. So momentum leaves sizes free, and the energy settles them. With `tau` the mean of the law's pressure between
//! `g_0` and `g_1`,
//!
//! `t_n = tau (1 + c delta)`, `q = tau c s`, `g_1 = g_0 + delta + c (delta^2 + |s|^2)`
//!
//! do the work `tau (g_1 - g_0) = -(w(g_1) - w(g_0))`, whatever `c` is. It is chosen so that `g_1` is the gap that the
//! geometry has at the end (`change`): on a plane `c` is zero, on a curved target it
//! tilts the force towards the mean of the normals. Where the gap changes by more than the point moves along the surface it can not be;
//! `g_1` then is the gap that counts, what is left is made up for as the point moves on, and is forgotten once the point is open. No
//! energy is made or lost on the way.
//!
//! The work of friction is `t_T . s`, all of which is heat (less what elastic stick stores).

mod change;
mod stiffness;

pub use stiffness::StepGeometry;

use change::Change;

use super::{ContactLaw, Manner, PointState, Status};
use crate::contact::friction::Pressed;
use crate::contact::friction::traction::{FrictionTraction, Slip};
use crate::contact::geometry::Geometry;
use crate::contact::history::History;
use crate::contact::normal::NormalResponse;
use crate::tensor::Vector;

/// A motion of less than this part of the penetration answers for no change of the gap: what a still point has left over would
/// act as a spring of its own, up to `1 / (4 STILL)` times as stiff as the law.
const STILL: f64 = 0.3;

/// The same for what counts and lags behind the gap that there is: there is no haste to make up for it. By the law's stiffness it would be a spring along the surface, up to `1 / (4 STILL)` times as stiff, which
/// pushes where it should hold; a node without mass has nothing else to hold it but its element, many times softer.
const LAGGING: f64 = 3.0;

/// Motion of the nodes of a point.
#[derive(Debug, Clone, Copy)]
pub struct Fields<'a, const D: usize> {
    /// Velocities in the middle \[m/s\].
    pub velocity: &'a [Vector<D>],
    /// Displacement from the start to the middle \[m\].
    pub increment: &'a [Vector<D>],
}

/// A point over a step: its geometry in the middle and at the end, and the motion of its nodes.
#[derive(Debug, Clone, Copy)]
pub struct StepMotion<'a, const D: usize> {
    /// In the middle of the step; its area is the reference area.
    pub middle: &'a Geometry<D>,
    /// Gap at the end \[m\].
    pub end: f64,
    /// Gap at the start \[m\].
    pub start: f64,
    /// How the nodes move.
    pub fields: Fields<'a, D>,
    /// What the point remembers from the last accepted step.
    pub history: &'a History<D>,
}

/// A field of the nodes as the slip sees it: `sum c_a f_a - g dn`, and the turn `dn`.
#[derive(Debug, Clone, Copy)]
struct Relative<const D: usize> {
    value: Vector<D>,
    turn: Vector<D>,
}

/// A point evaluated over a step.
#[derive(Debug, Clone, Copy)]
pub struct StepResponse<const D: usize> {
    /// The state to report and to remember: gap and potential at the end, tractions as they act over the step.
    pub state: PointState<D>,
    /// `q` \[Pa\], the tangential part of the normal law.
    correction: Vector<D>,
    slopes: Option<Slopes<D>>,
}

#[derive(Debug, Clone, Copy)]
struct Slopes<const D: usize> {
    change: Change,
    /// `tau` and its derivative by the gap at the end.
    mean: NormalResponse,
    /// `dt_T/dt_n`.
    by_pressure: Vector<D>,
    friction: FrictionTraction<D>,
    velocity: Relative<D>,
    increment: Relative<D>,
    /// `sum_a c_a du_a` over the step.
    moved: Vector<D>,
}

/// The state over a step of a point that carries nothing: what its elastic stick held is heat, as nothing takes it.
fn open_over_step<const D: usize>(law: &ContactLaw, history: &History<D>, area: f64) -> PointState<D> {
    PointState {
        over_step: true,
        area,
        plastic_work: stored(law, &history.friction_traction),
        ..PointState::default()
    }
}

/// Energy that elastic stick holds under a traction \[J/m^2\].
pub fn stored<const D: usize>(law: &ContactLaw, traction: &Vector<D>) -> f64 {
    law.friction.map_or(0.0, |f| f.regularization.recoverable_energy(traction))
}

/// Evaluates the laws over a step. Pure.
pub fn respond_over_step<const D: usize>(
    law: &ContactLaw,
    motion: &StepMotion<'_, D>,
    manner: &Manner<D>,
) -> StepResponse<D> {
    let (middle, history, fields) = (motion.middle, motion.history, &motion.fields);
    let velocity = relative(middle, fields.velocity);
    let half = relative(middle, fields.increment);
    let increment = Relative { value: half.value * 2.0, turn: half.turn * 2.0 };
    let project = |field: &Vector<D>| field - middle.normal * middle.normal.dot(field);
    // A point that was open holds no energy, so that its gap is free.
    let was_open = history.counted >= 0.0;
    let start = if was_open { motion.start.max(0.0) } else { history.counted };
    let along = 2.0 * fields.increment.iter().zip(&middle.nodes).map(|(u, a)| a.gap.dot(u)).sum::<f64>();
    let slipped = project(&increment.value);
    let lag = motion.start - start;
    let still = [STILL, LAGGING].map(|part| part * (-start).max(0.0));
    let change = Change::new([start, lag], motion.end, [along, slipped.norm()], still);
    let closed = start < -manner.touching || motion.end <= manner.touching;
    let state = PointState {
        gap: motion.end,
        presses: start < -manner.touching || motion.end < -manner.touching,
        counted: if change.end < 0.0 { change.end } else { motion.end.max(0.0) },
        normal: middle.normal,
        ..open_over_step(law, history, middle.area)
    };
    let mean = if was_open && motion.end >= 0.0 {
        NormalResponse::default()
    } else {
        law.normal.between([start, change.end])
    };
    if mean.traction <= 0.0 {
        let slip_velocity = project(&velocity.value);
        let status = if closed { Status::Slip } else { Status::Open };
        let state = PointState { slip_velocity, counted: motion.end.max(0.0), status, ..state };
        return StepResponse { state, correction: Vector::zeros(), slopes: None };
    }
    let pressure = mean.traction * (1.0 + change.missed.value * along);
    let slip = Slip {
        normal: &middle.normal,
        velocity: &velocity.value,
        increment: &increment.value,
        old_traction: &history.friction_traction,
        old_normal: &history.normal,
    };
    let (bound, by_pressure, friction) = friction(law, pressure, &slip, manner);
    let work = -friction.traction.dot(&slipped);
    let recoverable = stored(law, &friction.traction);
    let state = PointState {
        normal_traction: pressure,
        friction_traction: friction.traction,
        bound,
        slip_velocity: slip.slip_velocity(),
        slip_increment: slipped,
        status: match (closed, friction.slips) {
            (false, _) => Status::Open,
            (true, true) => Status::Slip,
            (true, false) => Status::Stick,
        },
        potential: mean.potential,
        recoverable,
        plastic_work: work - (recoverable - stored(law, &history.friction_traction)),
        ..state
    };
    let moved = middle.relative(fields.increment) * 2.0;
    let correction = slipped * (mean.traction * change.missed.value);
    let slopes = Slopes { change, mean, by_pressure, friction, velocity, increment, moved };
    StepResponse { state, correction, slopes: Some(slopes) }
}

fn relative<const D: usize>(geometry: &Geometry<D>, field: &[Vector<D>]) -> Relative<D> {
    let turn: Vector<D> = geometry.nodes.iter().zip(field).map(|(node, value)| node.normal * value).sum();
    Relative { value: geometry.relative(field) - turn * geometry.gap, turn }
}

/// Bound, `dt_T/dt_n` and the traction: the bound is that of the penetration under the mean pressure.
pub fn friction<const D: usize>(
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

    /// Adds `A (t_n d_a + (c_a 1 - g dn/dx_a)^T (q + t_T))` to `force[a * D + i]` \[N, per depth in 2D\].
    pub fn add_force(&self, middle: &Geometry<D>, force: &mut [f64]) {
        if self.slopes.is_none() {
            return;
        }
        let (pressure, tangential) =
            (self.state.normal_traction, self.correction + self.state.friction_traction);
        for (node, force) in middle.nodes.iter().zip(force.chunks_exact_mut(D)) {
            let lever = node.normal.transpose() * tangential * middle.gap;
            let nodal = (node.gap * pressure + tangential * node.coefficient - lever) * middle.area;
            force.iter_mut().zip(nodal.iter()).for_each(|(f, r)| *f += r);
        }
    }
}
