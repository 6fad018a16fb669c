//! Tractions that are held fixed in the stages of a staggered solve.

use super::history::History;
use super::point::PointState;
use crate::tensor::Vector;

/// Which tractions [`freeze`](super::state::ContactState::freeze) stores for the stages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Keep {
    /// Bound and friction traction at the end of the last step, without pressure: the known values
    /// at the start of a step.
    LastStep,
    /// The current pressure and the corresponding bound.
    Pressure,
    /// The current friction traction.
    Friction,
    /// Relaxes the last update of bound and friction traction by this factor.
    Part(f64),
}

/// Tractions of a point at the last call of [`freeze`](super::state::ContactState::freeze).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrozenTractions<const D: usize> {
    /// Pressure on the contactor \[Pa\], >= 0.
    pub normal_traction: f64,
    /// Friction bound \[Pa\].
    pub bound: f64,
    /// Friction traction on the contactor \[Pa\].
    pub friction_traction: Vector<D>,
    /// Previously held bound and friction traction.
    before: (f64, Vector<D>),
}

impl<const D: usize> Default for FrozenTractions<D> {
    fn default() -> Self {
        let bound = 0.0;
        let friction_traction = Vector::zeros();
        Self { normal_traction: 0.0, bound, friction_traction, before: (bound, friction_traction) }
    }
}

impl<const D: usize> FrozenTractions<D> {
    /// Tractions that were never updated.
    pub fn held(normal_traction: f64, bound: f64, friction_traction: Vector<D>) -> Self {
        Self { normal_traction, bound, friction_traction, before: (bound, friction_traction) }
    }

    /// The held tractions after this update, from the state and the history of a point.
    pub fn kept(&self, keep: Keep, point: &PointState<D>, history: &History<D>) -> Self {
        match keep {
            Keep::LastStep => Self {
                normal_traction: 0.0,
                bound: history.bound,
                friction_traction: history.friction_traction,
                before: (history.bound, history.friction_traction),
            },
            Keep::Pressure => Self {
                normal_traction: point.normal_traction,
                bound: point.bound,
                before: (self.bound, self.before.1),
                ..*self
            },
            Keep::Friction => Self {
                friction_traction: point.friction_traction,
                before: (self.before.0, self.friction_traction),
                ..*self
            },
            Keep::Part(part) => Self {
                bound: self.before.0 + part * (self.bound - self.before.0),
                friction_traction: self.before.1 + part * (self.friction_traction - self.before.1),
                ..*self
            },
        }
    }
}
