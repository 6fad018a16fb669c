//! The frame in which a contact sees a moving body at rest (theory, section 1.12).
//!
//! The shape of a rigid body is constant in the body frame. A point `x` has the position `x' = c +
//! R^T (x - c - d)` in that frame, with the reference point `c`, its displacement `d` and the rotation `R`.
//! The contact is evaluated with the positions, velocities and increments of the nodes in that
//! frame, where the body is an obstacle at rest. Gap, slip and the rotation of the normal are then
//! relative to the body, so that a common motion of both sides is no slip.

use super::free::PoseVariations;
use super::placement::{Placement, rotation_about};
use crate::tensor::{Tensor, Vector, cross};

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

/// Rotation of a body with prescribed motion over a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StepTurn<const D: usize> {
    /// `K` with `K x = axis x x`.
    pub generator: Tensor<D>,
    /// Angles at the start and at the end \[rad\].
    pub angles: [f64; 2],
    /// Length of the step \[s\], if the forces act over it.
    pub over: Option<f64>,
}

/// The frame of a moving rigid body over a step.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyFrame<const D: usize> {
    centre: Vector<D>,
    start: Placement<D>,
    end: Placement<D>,
    kind: FrameKind<D>,
    ahead: Option<(Vector<D>, Tensor<D>)>,
}

/// What determines the position of the body.
#[derive(Debug, Clone, PartialEq)]
enum FrameKind<const D: usize> {
    Prescribed(StepTurn<D>),
    Free(PoseVariations<D>),
}

impl<const D: usize> BodyFrame<D> {
    /// The frame of a body with prescribed motion about `centre` \[m\], placed at both ends.
    pub(super) fn prescribed(centre: Vector<D>, ends: [Placement<D>; 2], turn: StepTurn<D>) -> Self {
        let [start, end] = ends;
        Self { centre, start, end, kind: FrameKind::Prescribed(turn), ahead: None }
    }

    /// The frame of a free body about `centre` \[m\], placed at the start of the step and at the
    /// iterate.
    pub fn free(centre: Vector<D>, ends: [Placement<D>; 2], variations: PoseVariations<D>) -> Self {
        let [start, end] = ends;
        Self { centre, start, end, kind: FrameKind::Free(variations), ahead: None }
    }

    /// The frame of a body that a first guess moves by this displacement in space and this small
    /// rotation in the frame.
    #[must_use]
    pub(super) fn moving_ahead(self, shift: Vector<D>, turn: Tensor<D>) -> Self {
        Self { ahead: Some((shift, turn)), ..self }
    }

    /// Change of the position in the frame of a node at rest in space, at this arm in the frame
    /// \[m\], when a first guess moves the body to the end of the step. `None` if no first guess is
    /// computed.
    pub fn ahead(&self, arm: &Vector<D>) -> Option<Vector<D>> {
        let (shift, turn) = self.ahead?;
        Some(-(self.end.rotation.transpose() * shift + turn * arm))
    }

    /// How the rotation varies with the unknowns of the body; `None` if its motion is prescribed.
    pub fn variations(&self) -> Option<&PoseVariations<D>> {
        match &self.kind {
            FrameKind::Prescribed(_) => None,
            FrameKind::Free(variations) => Some(variations),
        }
    }

    /// Length of the step \[s\], if the forces act over it.
    fn over(&self) -> Option<f64> {
        match &self.kind {
            FrameKind::Prescribed(turn) => turn.over,
            FrameKind::Free(_) => None,
        }
    }

    /// Numbers that change whenever the frame changes.
    pub fn key(&self) -> impl Iterator<Item = f64> + '_ {
        self.start.numbers().chain(self.end.numbers()).chain(self.over())
    }

    /// A node with this undeformed position and these displacements \[m\] and velocity \[m/s\].
    pub fn see(
        &self,
        reference: &Vector<D>,
        u_start: &Vector<D>,
        u: &Vector<D>,
        v: &Vector<D>,
    ) -> SeenNode<D> {
        let centre = self.centre;
        let over = self.over();
        let arm = reference - centre;
        let last = if over.is_some() { u + (u - u_start) } else { *u };
        let [to_start, to_end] = [self.start, self.end].map(|pose| pose.rotation.transpose());
        let moved_start = to_start * (u_start - self.start.translation);
        let moved_end = to_end * (last - self.end.translation);
        let start = centre + (to_start * arm + moved_start);
        let end = centre + (to_end * arm + moved_end);
        // Not the difference of the positions, which loses digits far from the reference point.
        let whole = (to_end - to_start) * arm + (moved_end - moved_start);
        match over {
            Some(dt) => {
                let increment = whole * 0.5;
                SeenNode { start, iterate: (start + end) * 0.5, end, increment, velocity: whole / dt }
            }
            None => {
                let velocity = to_end * (v - self.end.velocity) - self.end.spin * (end - centre);
                SeenNode { start, iterate: end, end, increment: whole, velocity }
            }
        }
    }

    /// Derivative of the velocity of a node by its position, at fixed velocity in space \[1/s\].
    /// `None` over a step, where the velocity is that of the positions.
    pub fn velocity_by_position(&self) -> Option<Tensor<D>> {
        self.over().is_none().then(|| -self.end.spin)
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
        match &self.kind {
            FrameKind::Prescribed(turn) if turn.over.is_some() => {
                let generator = turn.generator;
                let stretch = generator * generator * (1.0 - 1.0 / turn.half().cos());
                rotation_about(&generator, turn.middle()) * (Tensor::identity() + stretch)
            }
            _ => self.end.rotation,
        }
    }

    /// Vector in space from the reference point to a position in the frame \[m\], at the instant at
    /// which the forces act.
    pub fn arm(&self, seen: &Vector<D>) -> Vector<D> {
        let turned = match &self.kind {
            FrameKind::Prescribed(turn) if turn.over.is_some() => {
                rotation_about(&turn.generator, turn.middle())
            }
            _ => self.end.rotation,
        };
        turned * (seen - self.centre)
    }

    /// Vector in the frame from the reference point to a node at the iterate \[m\].
    pub fn arm_in_frame(&self, seen: &SeenNode<D>) -> Vector<D> {
        seen.iterate - self.centre
    }

    /// Motion of the body over the step at a position in space at its start \[m\].
    pub fn carries(&self, x: &Vector<D>) -> Vector<D> {
        let arm = self.start.rotation.transpose() * (x - self.centre - self.start.translation);
        (self.end.rotation - self.start.rotation) * arm + (self.end.translation - self.start.translation)
    }

    /// Vector in space from the reference point to a position, at the start of the step \[m\].
    pub fn arm_at_start(&self, x: &Vector<D>) -> Vector<D> {
        x - self.centre - self.start.translation
    }

    /// Velocity of the body at a position in space, at the start of the step \[m/s\].
    pub fn velocity_at_start(&self, x: &Vector<D>) -> Vector<D> {
        let Placement { translation, rotation, velocity, spin } = &self.start;
        let arm = rotation.transpose() * (x - self.centre - translation);
        velocity + rotation * (spin * arm)
    }

    /// Displacement of the reference point \[m\] and rotation about the axis \[rad\] of the step,
    /// whose products with force and torque are the work of a body with prescribed motion. The
    /// rotation of a free body is not included.
    pub fn moved(&self) -> (Vector<D>, f64) {
        let turn = match &self.kind {
            FrameKind::Prescribed(turn) if turn.over.is_some() => 2.0 * turn.half().sin(),
            FrameKind::Prescribed(turn) => 2.0 * turn.half(),
            FrameKind::Free(_) => 0.0,
        };
        (self.end.translation - self.start.translation, turn)
    }

    /// A position in space at the start of the step, as seen from the body \[m\].
    pub fn see_start(&self, x: &Vector<D>) -> Vector<D> {
        self.centre + self.start.rotation.transpose() * (x - self.centre - self.start.translation)
    }

    /// A position in space at the end of the step, as seen from the body \[m\].
    pub fn see_end(&self, x: &Vector<D>) -> Vector<D> {
        self.centre + self.end.rotation.transpose() * (x - self.centre - self.end.translation)
    }
}

impl<const D: usize> StepTurn<D> {
    /// Half the angle of the step \[rad\].
    fn half(&self) -> f64 {
        0.5 * (self.angles[1] - self.angles[0])
    }

    /// The angle in the middle of the step \[rad\].
    fn middle(&self) -> f64 {
        0.5 * (self.angles[1] + self.angles[0])
    }
}
