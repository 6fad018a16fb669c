//! Prescribed motion of a rigid body: displacement of its reference point, and rotation about an axis
//! of fixed direction.

use super::frame::{BodyFrame, StepTurn};
use super::placement::{Placement, rotation_about};
use crate::error::Result;
use crate::reader::function::{Motion, PlacedFunction};
use crate::tensor::{Tensor, Vector, cross};

/// Prescribed motion of a rigid body as functions of time.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMotion<const D: usize> {
    /// Reference point in the reference configuration \[m\]. The body rotates about it.
    pub centre: Vector<D>,
    /// Unit axis of the rotation; `z` in 2D.
    pub axis: [f64; 3],
    /// Displacement of the reference point \[m\].
    pub translation: [PlacedFunction; D],
    /// Angle of the rotation \[rad\].
    pub angle: PlacedFunction,
}

/// Instant at which a motion is evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionInstant {
    /// Time \[s\]. Before 0 a body moves with the velocity that it has at 0.
    pub time: f64,
    /// Factor on displacement and angle, with which a static start applies them gradually.
    pub factor: f64,
}

/// The step for which a rigid body is placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionStep {
    /// Start of the step.
    pub start: MotionInstant,
    /// The trial state. For forces over a step it is the end of the step.
    pub end: MotionInstant,
    /// Length of the step \[s\], if the forces act over it and the displacements are those of its
    /// midpoint.
    pub over: Option<f64>,
    /// Instant to which a first guess moves the body beyond the trial state, see
    /// [`BodyFrame::ahead`].
    pub ahead: Option<MotionInstant>,
}

/// Position and velocity of a rigid body at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidState<const D: usize> {
    /// Displacement of the reference point \[m\].
    pub translation: Vector<D>,
    /// Angle of the rotation \[rad\].
    pub angle: f64,
    /// Velocity of the reference point \[m/s\].
    pub velocity: Vector<D>,
    /// Rate of the angle \[rad/s\].
    pub rate: f64,
}

impl<const D: usize> BodyMotion<D> {
    /// All functions of time.
    pub fn functions(&self) -> impl Iterator<Item = &PlacedFunction> {
        self.translation.iter().chain([&self.angle])
    }

    /// Whether the body rotates, as far as that is visible without evaluating the angle.
    pub fn rotates(&self) -> bool {
        !self.angle.is_zero()
    }

    /// Position and velocity at an instant.
    ///
    /// # Errors
    /// A value is not finite, at its position in the case.
    pub fn at(&self, instant: MotionInstant) -> Result<RigidState<D>> {
        let since = instant.time.min(0.0);
        let time = instant.time.max(0.0);
        let value = |function: &PlacedFunction| -> Result<[f64; 2]> {
            let motion = function.motion([0.0; 3], time);
            function.require_sound(&motion, self.centre.as_slice(), time)?;
            let Motion { value, rate, .. } = motion;
            Ok([instant.factor * (value + rate * since), instant.factor * rate])
        };
        let mut state = RigidState::default();
        for (i, function) in self.translation.iter().enumerate() {
            [state.translation[i], state.velocity[i]] = value(function)?;
        }
        [state.angle, state.rate] = value(&self.angle)?;
        Ok(state)
    }

    /// Positions at both ends of a step.
    ///
    /// # Errors
    /// A value is not finite, at its position in the case.
    pub fn states(&self, step: &MotionStep) -> Result<[RigidState<D>; 2]> {
        Ok([self.at(step.start)?, self.at(step.end)?])
    }

    /// The frame of the body over a step.
    ///
    /// # Errors
    /// A value is not finite, at its position in the case.
    pub fn frame(&self, step: &MotionStep) -> Result<BodyFrame<D>> {
        let generator = self.generator();
        let states = self.states(step)?;
        // In a first guess the motion itself carries what sticks.
        let moving = if step.ahead.is_some() { 0.0 } else { 1.0 };
        let ends = states.map(|state| Placement {
            translation: state.translation,
            rotation: rotation_about(&generator, state.angle),
            velocity: state.velocity * moving,
            spin: generator * (state.rate * moving),
        });
        let turn = StepTurn { generator, angles: states.map(|state| state.angle), over: step.over };
        let mut frame = BodyFrame::prescribed(self.centre, ends, turn);
        if let Some(instant) = step.ahead {
            let now = states[1];
            let next = self.at(instant)?;
            let turn = generator * (next.angle - now.angle);
            frame = frame.moving_ahead(next.translation - now.translation, turn);
        }
        Ok(frame)
    }

    /// `K` with `K x = axis x x`, so that the spin is `rate K`.
    fn generator(&self) -> Tensor<D> {
        let axis = Vector::<3>::from(self.axis);
        let mut generator = Tensor::zeros();
        for j in 0..D {
            let column = cross(&axis, &Vector::<3>::from_fn(|i, _| f64::from(u8::from(i == j))));
            (0..D).for_each(|i| generator[(i, j)] = column[i]);
        }
        generator
    }
}

impl<const D: usize> Default for RigidState<D> {
    fn default() -> Self {
        Self { translation: Vector::zeros(), angle: 0.0, velocity: Vector::zeros(), rate: 0.0 }
    }
}
