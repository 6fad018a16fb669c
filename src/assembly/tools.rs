//! Moving rigid bodies of the case: their placement for an evaluation, and what observers read.

use mpi::collective::SystemOperation;
use nalgebra::{Rotation3, Vector3};

use super::free_bodies::{FreeState, MotionSums, RigidVelocity, TurnDirection, space_of};
use super::system::ContactSystem;
use crate::collective::Collective;
use crate::contact::rigid::{MotionInstant, MotionStep};
use crate::dynamics::{OverStep, RigidInstant, Stage};
use crate::error::Result;
use crate::model::{RigidDrive, RigidModel};
use crate::petsc;
use crate::tensor::Vector;

/// State of a rigid body at the end of a step, with the same values on all ranks.
///
/// If the forces act over the step, force and torque are those of the step.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolState {
    /// Name in the case file.
    pub name: String,
    /// Reference point before any motion \[m\].
    pub reference: [f64; 3],
    /// Reference point \[m\].
    pub position: [f64; 3],
    /// Rotation vector \[rad\].
    pub rotation: [f64; 3],
    /// Velocity of the reference point \[m/s\].
    pub velocity: [f64; 3],
    /// Angular velocity \[rad/s\].
    pub spin: [f64; 3],
    /// Contact force on the body \[N\].
    pub force: [f64; 3],
    /// Contact torque on the body about its reference point \[N m\].
    pub torque: [f64; 3],
    /// Motion over the step whose product with force and torque is the work: displacement of the
    /// reference point \[m\], then rotation vector \[rad\].
    pub moved: [f64; 6],
    /// Whether forces move the body, so that its work is not external work.
    pub free: bool,
    /// Momenta and energy of a free body with mass.
    pub motion: Option<MotionSums>,
}

impl ToolState {
    /// Force, then torque, that the body exerts on the deformable bodies.
    pub fn exerted(&self) -> [f64; 6] {
        std::array::from_fn(|i| if i < 3 { -self.force[i] } else { -self.torque[i - 3] })
    }

    /// Displacement of the point of the body that was at `x` \[m\].
    pub fn displacement_of(&self, x: [f64; 3]) -> [f64; 3] {
        let [reference, position, x] = [self.reference, self.position, x].map(Vector3::from);
        let rotation = Rotation3::from_scaled_axis(Vector3::from(self.rotation));
        (position + rotation * (x - reference) - x).into()
    }
}

impl<const D: usize> ContactSystem<D> {
    /// The step that the trial state of `stage` belongs to.
    fn motion_step(&self, stage: &Stage) -> MotionStep {
        let over = (stage.over_step == OverStep::Middle).then_some(stage.dt);
        // Like prescribed displacements, motions are evaluated at the end of a step over which
        // forces act.
        let end = if over.is_some() { stage.start.time + stage.dt } else { stage.trial.time };
        let start = MotionInstant { time: stage.start.time, factor: self.continuation.start_factor };
        let end = MotionInstant { time: end, factor: self.continuation.load_factor };
        match stage.rigid_at {
            RigidInstant::End => MotionStep { start, end, over, ahead: None },
            RigidInstant::Start => MotionStep { start, end: start, over, ahead: Some(end) },
        }
    }

    /// Places the moving rigid bodies for the evaluation of a stage. A motion that is not finite is
    /// reported with the residual.
    pub(super) fn place_targets(&mut self, stage: &Stage) {
        self.factor = self.continuation.load_factor;
        if self.tools.is_empty() {
            return;
        }
        let step = self.motion_step(stage);
        let free = self.bodies.free.frames(&self.bodies.session, stage);
        let placed = self.contacts.iter_mut().try_for_each(|contact| contact.place(&step, &free));
        self.trouble = self.trouble.take().or_else(|| placed.err());
    }

    /// Whether a body of `rigid` has a prescribed motion that is not zero.
    pub fn has_moving_tools(&self) -> bool {
        let moves = |tool: &RigidModel<D>| {
            tool.prescribed().is_some_and(|motion| motion.functions().any(|function| !function.is_zero()))
        };
        self.tools.iter().any(moves)
    }

    /// Motions of the free rigid bodies in a field of the owned unknowns. Collective.
    pub fn rigid_motion_in(&self, field: &[f64]) -> Vec<RigidVelocity<D>> {
        self.bodies.free.motion_in(&self.bodies.session, field)
    }

    /// Turns the stored rotations of free rigid bodies by the rotation of the step in `stage`.
    /// Collective.
    pub fn turn_rigid(&mut self, stage: &Stage, turn: TurnDirection) {
        let session = self.bodies.session.clone();
        self.bodies.free.turn(&session, stage, turn);
    }

    /// Largest displacement of the surfaces of moving rigid bodies where bodies touch them at the
    /// displacements `u` \[m\]; zero without rigid bodies. Collective.
    pub fn travel_of_tools(&self, u: &petsc::Vector) -> f64 {
        if self.tools.is_empty() {
            return 0.0;
        }
        let u = u.local();
        let mut own = 0.0_f64;
        for contact in &self.contacts {
            let Some(frame) = contact.target().frame() else { continue };
            let points = contact.state.current.iter().enumerate().filter(|(_, point)| point.is_closed());
            for (vertex, _) in points {
                let first = contact.vertices()[vertex] as usize * D;
                let place = contact.reference_point(vertex) + Vector::from_fn(|i, _| u[first + i]);
                own = own.max((place - frame.see_end(&place)).norm());
            }
        }
        let mut most = 0.0;
        self.bodies.session.world().reduce_all(&own, &mut most, SystemOperation::max());
        most
    }

    /// States of the moving rigid bodies at the trial state of `stage`, with the loads of the last
    /// evaluation of the forces. Collective.
    ///
    /// # Errors
    /// A value of a motion is not finite, at its position in the case.
    pub fn tools(&self, stage: &Stage) -> Result<Vec<ToolState>> {
        if self.tools.is_empty() {
            return Ok(Vec::new());
        }
        let over = (stage.over_step != OverStep::No).then_some(stage.dt);
        let step = self.motion_step(stage);
        // The state at which the contact was evaluated: statics begins with the factor 0.
        let end = MotionInstant { factor: self.factor, ..step.end };
        let step = MotionStep { end, over, ..step };
        let mut own = vec![0.0_f64; 6 * self.tools.len()];
        for (sums, tool) in own.chunks_exact_mut(6).zip(&self.tools) {
            for contact in self.contacts.iter().filter(|contact| contact.target_name == tool.name) {
                let load = &contact.state.load;
                (0..D).for_each(|i| sums[i] += load.force[i]);
                (0..3).for_each(|i| sums[3 + i] += load.torque[i]);
            }
        }
        let mut loads = vec![0.0; own.len()];
        self.bodies.session.world().reduce_all(&own[..], &mut loads[..], SystemOperation::sum());
        let free = self.bodies.free.states(&self.bodies.session, stage);
        let state = |(tool, load): (&RigidModel<D>, &[f64])| {
            let load = |k: usize| std::array::from_fn(|i| load[k + i]);
            let motion = match &tool.drive {
                RigidDrive::Prescribed(motion) => motion,
                RigidDrive::Free(index, body) => {
                    return Ok(free_tool(&tool.name, &body.centre, &free[*index], load(0), load(3)));
                }
            };
            let [_, state] = motion.states(&step)?;
            let (shift, turn) = motion.frame(&step)?.moved();
            let along = |size: f64| motion.axis.map(|axis| axis * size);
            let shift: [f64; 3] = space_of(&shift);
            let turn = along(turn);
            Ok(ToolState {
                name: tool.name.clone(),
                reference: space_of(&motion.centre),
                position: space_of(&(motion.centre + state.translation)),
                rotation: along(state.angle),
                velocity: space_of(&state.velocity),
                spin: along(state.rate),
                force: load(0),
                torque: load(3),
                moved: std::array::from_fn(|i| if i < 3 { shift[i] } else { turn[i - 3] }),
                free: false,
                motion: None,
            })
        };
        self.tools.iter().zip(loads.chunks_exact(6)).map(state).collect()
    }
}

/// State of a free rigid body with the centre of mass `reference` before any motion \[m\], under this
/// contact force \[N\] and torque \[N m\].
fn free_tool<const D: usize>(
    name: &str,
    reference: &Vector<D>,
    state: &FreeState<D>,
    force: [f64; 3],
    torque: [f64; 3],
) -> ToolState {
    let (shift, turn) = (space_of(&state.moved.0), state.moved.1);
    ToolState {
        name: name.to_owned(),
        reference: space_of(reference),
        position: space_of(&state.position),
        rotation: state.rotation,
        velocity: space_of(&state.velocity),
        spin: state.spin,
        force,
        torque,
        moved: std::array::from_fn(|i| if i < 3 { shift[i] } else { turn[i - 3] }),
        free: true,
        motion: state.motion,
    }
}
