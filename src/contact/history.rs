//! What a contact point remembers between steps.

use super::point::PointState;
use crate::tensor::Vector;

/// Memory of a point, changed only when a step is accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct History<const D: usize> {
    /// `t_T` at the end of the last step \[Pa\]; zero where the point was open.
    pub friction_traction: Vector<D>,
    /// Friction bound at the end of the last step \[Pa\]; zero where the point was open.
    pub bound: f64,
    /// Normal at the end of the last step, to which that traction is tangential.
    pub normal: Vector<D>,
    /// Length of the path slid in contact \[m\].
    pub slip: f64,
    /// Work per area that friction turned into heat \[J/m^2\], never falling.
    pub friction_work: f64,
    /// Gap at the end of the last step \[m\]; infinite where there was none.
    pub gap: f64,
    /// `-t_T . v_T` at the end of the last step \[W/m^2\].
    pub friction_power: f64,
}

impl<const D: usize> Default for History<D> {
    fn default() -> Self {
        Self {
            friction_traction: Vector::zeros(),
            bound: 0.0,
            normal: Vector::zeros(),
            slip: 0.0,
            friction_work: 0.0,
            gap: f64::INFINITY,
            friction_power: 0.0,
        }
    }
}

impl<const D: usize> History<D> {
    /// Work per area that friction turns into heat over a step of length `dt` \[s\] that ends in `state` \[J/m^2\], >= 0.
    ///
    /// Velocity form: power by the trapezoidal rule, exact where friction and deceleration are constant.
    /// Return map: the plastic work of the step.
    pub fn work_of_step(&self, state: &PointState<D>, dt: f64) -> f64 {
        if heat_is_known(state) {
            return state.plastic_work;
        }
        0.5 * dt * (self.friction_power + state.friction_power().max(0.0))
    }

    /// The memory after a step of length `dt` \[s\] that ended in `state`. Pure.
    #[must_use]
    pub fn advance(&self, state: &PointState<D>, dt: f64) -> Self {
        let power = if heat_is_known(state) { 0.0 } else { state.friction_power().max(0.0) };
        let path = if state.is_closed() { state.slip_increment.norm() } else { 0.0 };
        Self {
            friction_traction: state.friction_traction,
            bound: state.bound,
            normal: state.normal,
            slip: self.slip + path,
            friction_work: self.friction_work + self.work_of_step(state, dt),
            gap: state.gap,
            friction_power: power,
        }
    }

    /// The memory of a start in `state`: its tractions, no work yet.
    #[must_use]
    pub fn start(state: &PointState<D>) -> Self {
        let begun = Self::default().advance(state, 0.0);
        Self { slip: 0.0, friction_work: 0.0, ..begun }
    }
}

/// Whether the heat of the step is known: the return map's power is not heat, since elastic stick gives it back, and over
/// a step the work of the tractions is known as a whole.
fn heat_is_known<const D: usize>(state: &PointState<D>) -> bool {
    state.over_step || state.recoverable > 0.0 || state.plastic_work > 0.0
}
