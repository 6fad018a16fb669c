//! Tractions that the stages of a staggered solve hold.

use super::history::History;
use super::point::PointState;
use crate::tensor::Vector;

/// Tractions that [`freeze`](super::state::ContactState::freeze) keeps for the stages to hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Keep {
    /// Bound and friction traction at the end of the last step, no pressure: what is known where a step begins.
    LastStep,
    /// The current pressure and the bound that belongs to it.
    Pressure,
    /// The current friction traction.
    Friction,
    /// Of the way that bound and friction traction went when they were last kept, this part only.
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
    /// Bound and friction traction that were held before these.
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
    /// What is held after these are kept, of a point and what it remembers.
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
