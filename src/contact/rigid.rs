//! Motion of rigid bodies, and the frame in which a contact sees a moving body at rest (theory,
//! section 1.12).
//!
//! The shape of a rigid body is constant in the body frame. A point `x` has the position `x' = c +
//! R^T (x - c - d)` in that frame, with the reference point `c`, its displacement `d` and the rotation `R` about an
//! axis of fixed direction. The contact is evaluated with the positions, velocities and increments
//! of the nodes in that frame, where the body is an obstacle at rest. Gap, slip and the rotation of
//! the normal are then relative to the body, so that a common motion of both sides is no slip.

use std::rc::Rc;

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

/// Position of a rigid body: displacement of its reference point, and rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pose<const D: usize> {
    translation: Vector<D>,
    rotation: Tensor<D>,
}

impl<const D: usize> Pose<D> {
    fn of(state: &RigidState<D>, generator: &Tensor<D>) -> Self {
        Self { translation: state.translation, rotation: rotation(generator, state.angle) }
    }
}

/// The rotation by an angle \[rad\] about the unit axis with this generator.
fn rotation<const D: usize>(generator: &Tensor<D>, angle: f64) -> Tensor<D> {
    // The half angle loses no digits in 1 - cos.
    let half = (0.5 * angle).sin();
    Tensor::identity() + generator * angle.sin() + generator * generator * (2.0 * half * half)
}

/// A node as seen from a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenNode<const D: usize> {
    /// Position at the start of the step \[m\].
    pub start: Vector<D>,
    /// Position at the iterate \[m\]: at its end, or in the middle of a step over which forces act.
    pub iterate: Vector<D>,
    /// Position at the end of the step \[m\].
    pub end: Vector<D>,
    /// `iterate - start` \[m\].
    pub increment: Vector<D>,
    /// Velocity relative to the body \[m/s\].
    pub velocity: Vector<D>,
}

/// Force of bodies on a rigid target, and its torque about the reference point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetLoad<const D: usize> {
    /// Force \[N\].
    pub force: Vector<D>,
    /// Torque \[N m\]; in 2D only the last component is nonzero.
    pub torque: [f64; 3],
}

impl<const D: usize> Default for TargetLoad<D> {
    fn default() -> Self {
        Self { force: Vector::zeros(), torque: [0.0; 3] }
    }
}

impl<const D: usize> TargetLoad<D> {
    /// Subtracts the force on a node at `arm` \[m\] from the reference point, whose reaction acts on
    /// the target.
    pub fn react(&mut self, arm: &Vector<D>, force: &Vector<D>) {
        self.force -= force;
        let [arm, force] =
            [arm, force].map(|v| Vector::<3>::from_fn(|i, _| v.iter().nth(i).copied().unwrap_or(0.0)));
        self.torque.iter_mut().zip(cross(&arm, &force).iter()).for_each(|(sum, part)| *sum -= part);
    }
}

/// The frame of a moving rigid body over a step.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyFrame<const D: usize> {
    motion: Rc<BodyMotion<D>>,
    generator: Tensor<D>,
    states: [RigidState<D>; 2],
    start: Pose<D>,
    end: Pose<D>,
    over: Option<f64>,
}

impl<const D: usize> BodyFrame<D> {
    /// The frame of a body over a step.
    ///
    /// # Errors
    /// A value of the motion is not finite, at its position in the case.
    pub fn new(motion: &Rc<BodyMotion<D>>, step: &MotionStep) -> Result<Self> {
        let generator = motion.generator();
        let states = [motion.at(step.start)?, motion.at(step.end)?];
        let [start, end] = [0, 1].map(|k| Pose::of(&states[k], &generator));
        Ok(Self { motion: Rc::clone(motion), generator, states, start, end, over: step.over })
    }

    /// Numbers that change whenever the frame changes.
    pub fn key(&self) -> impl Iterator<Item = f64> + '_ {
        let numbers = |state: &'_ RigidState<D>| {
            let RigidState { translation, angle, velocity, rate } = *state;
            let vectors = [translation, velocity].into_iter().flat_map(|v| (0..D).map(move |i| v[i]));
            vectors.chain([angle, rate])
        };
        self.states.iter().flat_map(numbers).chain(self.over)
    }

    /// A node with this undeformed position and these displacements \[m\] and velocity \[m/s\].
    pub fn see(
        &self,
        reference: &Vector<D>,
        u_start: &Vector<D>,
        u: &Vector<D>,
        v: &Vector<D>,
    ) -> SeenNode<D> {
        let centre = self.motion.centre;
        let arm = reference - centre;
        let last = if self.over.is_some() { u + (u - u_start) } else { *u };
        let [to_start, to_end] = [self.start, self.end].map(|pose| pose.rotation.transpose());
        let moved_start = to_start * (u_start - self.start.translation);
        let moved_end = to_end * (last - self.end.translation);
        let start = centre + (to_start * arm + moved_start);
        let end = centre + (to_end * arm + moved_end);
        // Not the difference of the positions, which loses digits far from the reference point.
        let whole = (to_end - to_start) * arm + (moved_end - moved_start);
        match self.over {
            Some(dt) => {
                let increment = whole * 0.5;
                SeenNode { start, iterate: (start + end) * 0.5, end, increment, velocity: whole / dt }
            }
            None => {
                let now = &self.states[1];
                let turning = self.generator * (end - centre) * now.rate;
                let velocity = to_end * (v - now.velocity) - turning;
                SeenNode { start, iterate: end, end, increment: whole, velocity }
            }
        }
    }

    /// Derivative of the velocity of a node by its position, at fixed velocity in space \[1/s\].
    /// `None` over a step, where the velocity is that of the positions.
    pub fn velocity_by_position(&self) -> Option<Tensor<D>> {
        self.over.is_none().then(|| self.generator * -self.states[1].rate)
    }

    /// Takes vectors from the frame at the start of the step to space.
    pub fn at_start(&self) -> &Tensor<D> {
        &self.start.rotation
    }

    /// Takes vectors from the frame at the end of the step to space.
    pub fn at_end(&self) -> &Tensor<D> {
        &self.end.rotation
    }

    /// Takes forces from the frame to space.
    ///
    /// Over a step, displacements in space are `A` times those in the frame, plus the motion of the
    /// body at the mean position in the frame, with the mean `A` of the rotations at both ends.
    /// Forces are multiplied by `A^-T`, so that their work in space is the work in the frame plus
    /// the work of the body.
    pub fn forces(&self) -> Tensor<D> {
        if self.over.is_none() {
            return self.end.rotation;
        }
        let [half, middle] = self.half_turn();
        let stretch = self.generator * self.generator * (1.0 - 1.0 / half.cos());
        rotation(&self.generator, middle) * (Tensor::identity() + stretch)
    }

    /// Half the angle of the step, and the angle in its middle \[rad\].
    fn half_turn(&self) -> [f64; 2] {
        let [start, end] = [self.states[0].angle, self.states[1].angle];
        [0.5 * (end - start), 0.5 * (end + start)]
    }

    /// Vector in space from the reference point to a position in the frame \[m\], at the instant at
    /// which the forces act.
    pub fn arm(&self, seen: &Vector<D>) -> Vector<D> {
        let turned = match self.over {
            Some(_) => rotation(&self.generator, self.half_turn()[1]),
            None => self.end.rotation,
        };
        turned * (seen - self.motion.centre)
    }

    /// Motion of the body over the step at a position in space at its start \[m\].
    pub fn carries(&self, x: &Vector<D>) -> Vector<D> {
        let arm = self.start.rotation.transpose() * (x - self.motion.centre - self.start.translation);
        (self.end.rotation - self.start.rotation) * arm + (self.end.translation - self.start.translation)
    }

    /// Velocity of the body at a position in space, at the start of the step \[m/s\].
    pub fn velocity_at_start(&self, x: &Vector<D>) -> Vector<D> {
        let RigidState { translation, velocity, rate, .. } = &self.states[0];
        velocity + self.generator * (x - self.motion.centre - translation) * *rate
    }

    /// Displacement of the reference point \[m\] and rotation \[rad\] of the step, whose products
    /// with force and torque are the work of the body.
    pub fn moved(&self) -> (Vector<D>, f64) {
        let half = self.half_turn()[0];
        let turn = if self.over.is_some() { 2.0 * half.sin() } else { 2.0 * half };
        (self.end.translation - self.start.translation, turn)
    }

    /// Position and velocity of the body at the end of the step.
    pub fn state_at_end(&self) -> &RigidState<D> {
        &self.states[1]
    }

    /// A position in space at the start of the step, as seen from the body \[m\].
    pub fn see_start(&self, x: &Vector<D>) -> Vector<D> {
        self.motion.centre
            + self.start.rotation.transpose() * (x - self.motion.centre - self.start.translation)
    }

    /// A position in space at the end of the step, as seen from the body \[m\].
    pub fn see_end(&self, x: &Vector<D>) -> Vector<D> {
        self.motion.centre + self.end.rotation.transpose() * (x - self.motion.centre - self.end.translation)
    }
}
