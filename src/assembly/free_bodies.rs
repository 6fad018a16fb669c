//! Free rigid bodies: their nodes in the system, their position, loads and inertia (theory, section
//! 1.13).
//!
//! Each has two nodes without elements, which rank 0 owns: the displacement of the centre of mass
//! and the rotation. All ranks know the position of every free body, which a broadcast of a few
//! numbers per evaluation provides.

use std::rc::Rc;

use mpi::traits::{Communicator, Root};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::contact::rigid::{BodyFrame, FreeRigid, MassProperties, principal_axes};
use crate::contact::target::ContactTarget;
use crate::dynamics::{MovingPart, RigidMotion, Stage};
use crate::error::Result;
use crate::model::{FreeBodyModel, Model};
use crate::partition::LocalMesh;
use crate::petsc::{BlockPattern, BlockValues, Session, Values, Vector as PetscVector};
use crate::reader::function::PlacedFunction;
use crate::space::PrescribedFields;
use crate::tensor::{Tensor, Vector};
use crate::terms::Terms;

/// The free rigid bodies of a case, on every rank.
pub(super) struct FreeBodies<const D: usize> {
    bodies: Vec<FreeBody<D>>,
}

/// A free rigid body.
pub(super) struct FreeBody<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Global numbers of its nodes: displacement, then rotation.
    pub globals: [i32; 2],
    model: Rc<FreeBodyModel<D>>,
    rigid: FreeRigid<D>,
    /// Local nodes; `None` on ranks that do not own them.
    nodes: Option<[u32; 2]>,
    /// Rotation at the start of the step.
    orientation: UnitQuaternion<f64>,
}

/// An unknown that rotates a free body about an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FreeRotation {
    /// Local node; `None` on ranks that do not own it.
    pub node: Option<u32>,
    /// Component of the unknown.
    pub component: usize,
    /// Rotation vector of a unit of the unknown [rad/m].
    pub turn: [f64; 3],
}

/// Whether stored rotations move from the start of a step to its end, or back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnDirection {
    /// To the end.
    Forwards,
    /// From the end to the start.
    Backwards,
}

/// A small motion of a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidVelocity<const D: usize> {
    /// Displacement of the centre of mass.
    pub shift: Vector<D>,
    /// Rotation about the centre of mass, as a vector in space.
    pub turn: [f64; 3],
}

impl<const D: usize> RigidVelocity<D> {
    /// Displacement at this arm from the centre of mass.
    pub fn at(&self, arm: &Vector<D>) -> Vector<D> {
        let whole = |v: &Vector<D>| Vector3::from_fn(|i, _| v.iter().nth(i).copied().unwrap_or(0.0));
        let turned = Vector3::from(self.turn).cross(&whole(arm));
        Vector::from_fn(|i, _| self.shift[i] + turned[i])
    }
}

/// Values of the unknowns of a free body at the start of the step and at the iterate.
#[derive(Debug, Clone, Copy)]
struct PoseFields<const D: usize> {
    /// Displacement and rotation \[m\].
    u: [[Vector<D>; 2]; 2],
    /// Their rates \[m/s\].
    v: [[Vector<D>; 2]; 2],
}

/// Position and velocity of a free body for results.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FreeState<const D: usize> {
    /// Centre of mass \[m\].
    pub position: Vector<D>,
    /// Rotation vector \[rad\]. In 2D it counts full turns; in 3D its length is at most pi.
    pub rotation: [f64; 3],
    /// Velocity of the centre of mass \[m/s\].
    pub velocity: Vector<D>,
    /// Angular velocity in space \[rad/s\].
    pub spin: [f64; 3],
    /// Displacement \[m\] and rotation vector \[rad\] of the step.
    pub moved: (Vector<D>, [f64; 3]),
    /// Momenta and energy; `None` without mass.
    pub motion: Option<MotionSums>,
}

/// Momenta and kinetic energy of a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionSums {
    /// Linear momentum \[N s\].
    pub linear: [f64; 3],
    /// Angular momentum about the centre of mass [N m s].
    pub angular: [f64; 3],
    /// Kinetic energy \[J\].
    pub kinetic: f64,
}

impl<const D: usize> FreeBody<D> {
    /// Whether an unknown is prescribed: `node` 0 is the displacement and 1 the rotation.
    fn is_held(&self, node: usize, component: usize) -> bool {
        if node == 0 {
            return self.model.translation[component].is_some();
        }
        let rotates = component < FreeRigid::<D>::ROTATIONS
            && self.model.rotation.is_none()
            && !self.model.fixed_rotations[FreeRigid::<D>::axis(component)];
        !rotates
    }

    /// Whether nothing but contact resists an unknown: it is not prescribed, and has no spring.
    fn is_loose(&self, node: usize, component: usize) -> bool {
        let directions = self.model.stiffness.directions(&self.rigid.centre.into(), &Vector::zeros());
        // A coefficient that is not valid has been reported.
        let sprung = match node {
            0 => directions.is_ok_and(|matrix| matrix[(component, component)] > 0.0),
            _ => self.model.has_torsion_spring,
        };
        !self.is_held(node, component) && !sprung
    }

    /// Prescribed value of an unknown as a function of time and a factor; `None` for zero.
    fn drive(&self, node: usize, component: usize) -> Option<(&PlacedFunction, f64)> {
        if node == 0 {
            return self.model.translation[component].as_ref().map(|function| (function, 1.0));
        }
        let (axis, angle) = self.model.rotation.as_ref()?;
        let change = self.rigid.change(&Vector3::from(*axis));
        (component < FreeRigid::<D>::ROTATIONS).then(|| (angle, change[component]))
    }

    /// Orientation at the end of the step.
    fn orientation_at(&self, fields: &PoseFields<D>) -> UnitQuaternion<f64> {
        self.rigid.turned(&self.orientation, &fields.change())
    }

    fn frame(&self, fields: &PoseFields<D>) -> BodyFrame<D> {
        let orientations = [self.orientation, self.orientation_at(fields)];
        let at = |k: usize| {
            let [translation, s] = fields.u[k];
            let [velocity, rate] = fields.v[k];
            self.rigid.placement(&orientations[k], translation, &s, velocity, &rate)
        };
        BodyFrame::free(self.rigid.centre, [at(0), at(1)], self.rigid.variations(&fields.change()))
    }

    /// Force and torque in space at a time, without the weight.
    fn loads(&self, time: f64) -> Result<(Vector<D>, Vector3<f64>)> {
        let value = |function: &PlacedFunction| -> Result<f64> {
            let motion = function.motion([0.0; 3], time);
            function.require_sound(&motion, self.rigid.centre.as_slice(), time)?;
            Ok(motion.value)
        };
        let mut force = Vector::zeros();
        let mut torque = Vector3::zeros();
        for (i, function) in self.model.force.iter().enumerate() {
            force[i] = function.as_ref().map_or(Ok(0.0), value)?;
        }
        for (i, function) in self.model.torque.iter().enumerate() {
            torque[i] = function.as_ref().map_or(Ok(0.0), value)?;
        }
        let mass = self.model.mass.map_or(0.0, |mass| mass.mass);
        for (i, function) in self.model.gravity.iter().enumerate() {
            force[i] += mass * value(function)?;
        }
        Ok((force, torque))
    }

    /// A torque or an angular velocity in space as seen from the body.
    fn seen_from_body(&self, orientation: &UnitQuaternion<f64>, torque: &Vector3<f64>) -> Vector3<f64> {
        if D == 2 { *torque } else { orientation.inverse() * torque }
    }
}

impl<const D: usize> PoseFields<D> {
    /// Change of the rotation unknown over the step \[m\].
    fn change(&self) -> Vector<D> {
        self.u[1][1] - self.u[0][1]
    }
}

/// A vector in space; missing components are 0.
pub(super) fn space_of<const D: usize>(vector: &Vector<D>) -> [f64; 3] {
    std::array::from_fn(|i| if i < D { vector[i] } else { 0.0 })
}

/// Mass and inertia of a body that has mass.
fn massive<const D: usize>(body: &FreeBody<D>) -> Option<MassProperties> {
    body.model.mass
}

impl<const D: usize> FreeBodies<D> {
    /// Finds the nodes of the free bodies of the model. `size` is the extent of all bodies \[m\].
    /// Collective.
    pub fn new(session: &Session, local: &LocalMesh<D>, model: &Model<D>, size: f64) -> Self {
        let world = session.world();
        let count = model.free_bodies().count() as u32;
        let first = local.index.total as u32 - 2 * count;
        let mut bodies = Vec::with_capacity(count as usize);
        for (number, (name, body)) in (0u32..).zip(model.free_bodies()) {
            let node = |k: u32| {
                let owned = local.input_node[..local.index.owned].iter();
                owned.zip(0u32..).find(|(input, _)| **input == first + 2 * number + k).map(|(_, node)| node)
            };
            let nodes = node(0).zip(node(1)).map(|(position, rotation)| [position, rotation]);
            let mut globals = nodes.map_or([0; 2], |nodes| nodes.map(|node| local.index.global(node)));
            world.process_at_rank(0).broadcast_into(&mut globals[..]);
            let axes = match body.mass {
                Some(mass) if D == 3 => principal_axes(&mass.inertia, body.fixed_rotations),
                _ => Tensor::<3>::identity(),
            };
            let radii = body.mass.map_or([0.0; D], |mass| FreeRigid::<D>::radii_of_gyration(&mass, &axes));
            // The length of a rotation without inertia is only a scale.
            let lengths = radii.map(|radius| if radius > 0.0 { radius } else { 0.5 * size });
            bodies.push(FreeBody {
                name: name.to_owned(),
                globals,
                model: Rc::clone(body),
                rigid: FreeRigid { centre: body.centre, lengths, axes },
                nodes,
                orientation: UnitQuaternion::identity(),
            });
        }
        Self { bodies }
    }

    /// Whether there are no free bodies.
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// All free bodies, in the order of their indices.
    pub fn all(&self) -> &[FreeBody<D>] {
        &self.bodies
    }

    /// Marks the prescribed unknowns of this rank.
    pub fn mark_held(&self, held: &mut [bool]) {
        for (body, nodes) in self.own() {
            for (k, node) in nodes.iter().enumerate() {
                for i in 0..D {
                    held[*node as usize * D + i] = body.is_held(k, i);
                }
            }
        }
    }

    /// Local nodes of each body, displacement and rotation; `None` on ranks that do not own them.
    pub fn nodes(&self) -> Vec<Option<[u32; 2]>> {
        self.bodies.iter().map(|body| body.nodes).collect()
    }

    /// The first free rotation of each body; `None` for a body without any.
    pub fn rotations(&self) -> Vec<Option<FreeRotation>> {
        let of = |body: &FreeBody<D>| {
            let component = (0..FreeRigid::<D>::ROTATIONS).find(|&i| !body.is_held(1, i))?;
            let unit = Vector::from_fn(|i, _| f64::from(u8::from(i == component)));
            let turn = body.rigid.step_vector(&unit);
            Some(FreeRotation { node: body.nodes.map(|[_, rotation]| rotation), component, turn })
        };
        self.bodies.iter().map(of).collect()
    }

    /// The bodies whose nodes this rank owns.
    fn own(&self) -> impl Iterator<Item = (&FreeBody<D>, [u32; 2])> {
        self.bodies.iter().filter_map(|body| Some((body, body.nodes?)))
    }

    /// Masses of this rank's nodes \[kg\].
    pub fn masses(&self) -> Vec<(u32, f64)> {
        let of = |(body, nodes): (&FreeBody<D>, [u32; 2])| {
            let mass = massive(body).map_or(0.0, |mass| mass.mass);
            nodes.map(|node| (node, mass))
        };
        self.own().flat_map(of).collect()
    }

    /// Mass of each body \[kg\]; 0 without mass.
    pub fn mass_of_each(&self) -> Vec<f64> {
        self.bodies.iter().map(|body| massive(body).map_or(0.0, |mass| mass.mass)).collect()
    }

    /// Rotation nodes of this rank.
    pub fn rotation_nodes(&self) -> impl Iterator<Item = usize> + '_ {
        self.own().map(|(_, [_, rotation])| rotation as usize)
    }

    /// Motion of the bodies at the start of the step in `field`: displacement of the centre of mass,
    /// and small rotation in space. Collective.
    pub fn motion_in(&self, session: &Session, field: &[f64]) -> Vec<RigidVelocity<D>> {
        let mut numbers = vec![0.0; self.bodies.len() * 2 * D];
        for (body, numbers) in self.bodies.iter().zip(numbers.chunks_exact_mut(2 * D)) {
            let Some(nodes) = body.nodes else { continue };
            for (node, into) in nodes.iter().zip(numbers.chunks_exact_mut(D)) {
                into.copy_from_slice(&field[*node as usize * D..][..D]);
            }
        }
        if !numbers.is_empty() {
            session.world().process_at_rank(0).broadcast_into(&mut numbers[..]);
        }
        let of = |(body, numbers): (&FreeBody<D>, &[f64])| {
            let seen = Vector3::from(body.rigid.step_vector(&Vector::from_column_slice(&numbers[D..])));
            let turn = if D == 2 { seen } else { body.orientation * seen };
            RigidVelocity { shift: Vector::from_column_slice(&numbers[..D]), turn: turn.into() }
        };
        self.bodies.iter().zip(numbers.chunks_exact(2 * D)).map(of).collect()
    }

    /// Writes the prescribed motion.
    ///
    /// # Errors
    /// A value is not finite, at its position in the case.
    pub fn prescribe(&self, time: f64, factor: f64, fields: PrescribedFields) -> Result<()> {
        for (body, nodes) in self.own() {
            for (k, node) in nodes.iter().enumerate() {
                for i in (0..D).filter(|&i| body.is_held(k, i)) {
                    let mut values = [0.0; 3];
                    if let Some((function, share)) = body.drive(k, i) {
                        let motion = function.motion([0.0; 3], time);
                        function.require_sound(&motion, body.rigid.centre.as_slice(), time)?;
                        values =
                            [motion.value, motion.rate, motion.second].map(|value| factor * share * value);
                    }
                    let dof = *node as usize * D + i;
                    fields.u[dof] = values[0];
                    fields.v[dof] = values[1];
                    if let Some(a) = fields.a.get_mut(dof) {
                        *a = values[2];
                    }
                }
            }
        }
        Ok(())
    }

    /// Writes the initial velocities of this rank's nodes.
    pub fn start(&self, v: &mut [f64]) {
        for (body, nodes) in self.own() {
            let spin = Vector3::from(body.model.initial_spin);
            let spin = body.seen_from_body(&body.orientation, &spin);
            let rate = body.rigid.change(&spin);
            for i in 0..D {
                v[nodes[0] as usize * D + i] = body.model.initial_velocity[i];
                v[nodes[1] as usize * D + i] = rate[i];
            }
        }
    }

    /// The unknowns of all bodies at both ends of the step, on every rank. Collective.
    fn fields(&self, session: &Session, stage: &Stage) -> Vec<PoseFields<D>> {
        let mut numbers = vec![0.0; self.bodies.len() * 8 * D];
        {
            let [u_start, u] = [stage.start.u.local(), stage.trial.u.local()];
            let [v_start, v] = [stage.start.v.local(), stage.trial.v.local()];
            let all: [&Values; 4] = [&u_start, &u, &v_start, &v];
            for (body, numbers) in self.bodies.iter().zip(numbers.chunks_exact_mut(8 * D)) {
                let Some(nodes) = body.nodes else { continue };
                let sources = all.iter().flat_map(|field| nodes.map(|node| (field, node)));
                for ((field, node), into) in sources.zip(numbers.chunks_exact_mut(D)) {
                    into.copy_from_slice(&field[node as usize * D..][..D]);
                }
            }
        }
        session.world().process_at_rank(0).broadcast_into(&mut numbers[..]);
        let vector = |numbers: &[f64], k: usize| Vector::<D>::from_column_slice(&numbers[k * D..][..D]);
        let of = |numbers: &[f64]| PoseFields {
            u: [0, 2].map(|k| [vector(numbers, k), vector(numbers, k + 1)]),
            v: [4, 6].map(|k| [vector(numbers, k), vector(numbers, k + 1)]),
        };
        numbers.chunks_exact(8 * D).map(of).collect()
    }

    /// Frames of all bodies for the step of this stage. Collective.
    pub fn frames(&self, session: &Session, stage: &Stage) -> Vec<BodyFrame<D>> {
        if self.is_empty() {
            return Vec::new();
        }
        let fields = self.fields(session, stage);
        self.bodies.iter().zip(&fields).map(|(body, fields)| body.frame(fields)).collect()
    }

    /// States at the trial state of this stage. Collective.
    pub fn states(&self, session: &Session, stage: &Stage) -> Vec<FreeState<D>> {
        if self.is_empty() {
            return Vec::new();
        }
        let fields = self.fields(session, stage);
        let state = |(body, fields): (&FreeBody<D>, &PoseFields<D>)| {
            let orientation = body.orientation_at(fields);
            let [translation, s] = fields.u[1];
            let [velocity, rate] = fields.v[1];
            let seen_spin = Vector3::from(body.rigid.angular_velocity(&rate));
            let in_plane = D == 2;
            let in_space =
                |seen: Vector3<f64>| if in_plane { seen.into() } else { (orientation * seen).into() };
            let motion = massive(body).map(|mass| {
                let angular = mass.inertia * seen_spin;
                MotionSums {
                    linear: space_of(&(velocity * mass.mass)),
                    angular: in_space(angular),
                    kinetic: 0.5 * (mass.mass * velocity.norm_squared() + seen_spin.dot(&angular)),
                }
            });
            let step = Vector3::from(body.rigid.step_vector(&fields.change()));
            FreeState {
                position: body.rigid.centre + translation,
                rotation: match in_plane {
                    true => body.rigid.step_vector(&s),
                    false => orientation.scaled_axis().into(),
                },
                velocity,
                spin: in_space(seen_spin),
                motion,
                moved: (
                    translation - fields.u[0][0],
                    if in_plane { step.into() } else { (body.orientation * step).into() },
                ),
            }
        };
        self.bodies.iter().zip(&fields).map(state).collect()
    }

    /// Adds loads and gyroscopic moments of this rank's nodes \[N\]. Gyroscopic moments count as
    /// internal forces.
    ///
    /// # Errors
    /// A load is not finite, at its position in the case.
    pub fn add_forces(
        &self,
        stage: &Stage,
        factor: f64,
        internal: &mut [f64],
        external: &mut [f64],
    ) -> Result<()> {
        let rows = external.len();
        for (body, [position, rotation]) in self.own() {
            let (force, torque) = body.loads(stage.trial.time)?;
            let [first, about] = [position, rotation].map(|node| node as usize * D);
            debug_assert!(first + D <= rows && about + D <= rows);
            let orientation = body.orientation_of(stage, rotation);
            let moment = body.rigid.components(&body.seen_from_body(&orientation, &torque).into());
            for i in 0..D {
                external[first + i] += factor * force[i];
                external[about + i] += factor * moment[i];
            }
            if let Some(mass) = massive(body).filter(|_| stage.inertia) {
                let rate = Vector::from_column_slice(&stage.trial.v.local()[about..][..D]);
                let (gyroscopic, _) = body.rigid.gyroscopic(&mass, &rate);
                (0..D).for_each(|i| internal[about + i] += gyroscopic[i]);
            }
        }
        Ok(())
    }

    /// Adds the derivatives of [`add_forces`](Self::add_forces) to the blocks of the rotations,
    /// which only bodies in space have.
    ///
    /// # Errors
    /// A torque is not finite, at its position in the case.
    pub fn add_stiffness(
        &self,
        stage: &Stage,
        terms: Terms,
        factor: f64,
        pattern: &BlockPattern,
        values: &mut BlockValues,
    ) -> Result<()> {
        if D == 2 {
            return Ok(());
        }
        for (body, [_, rotation]) in self.own() {
            let Some(slot) = pattern.slot(rotation as usize, body.globals[1]) else { continue };
            let about = rotation as usize * D;
            let mut block = Tensor::<D>::zeros();
            if let Some(mass) = massive(body).filter(|_| stage.inertia && terms.contains(Terms::MASS)) {
                let rate = Vector::from_column_slice(&stage.trial.v.local()[about..][..D]);
                block += body.rigid.gyroscopic(&mass, &rate).1 * stage.shifts.velocity;
            }
            if terms.contains(Terms::FOLLOWING_LOAD) {
                let (_, torque) = body.loads(stage.trial.time)?;
                let seen = body.seen_from_body(&body.orientation_of(stage, rotation), &torque);
                let change = body.change_of(stage, rotation);
                for (j, turn) in body.rigid.variations(&change).turns.iter().enumerate() {
                    let turned = turn * Vector::<D>::from_fn(|i, _| seen[i]);
                    let moment = std::array::from_fn(|i| turned.iter().nth(i).copied().unwrap_or(0.0));
                    let column = body.rigid.components(&moment) * factor;
                    (0..D).for_each(|i| block[(i, j)] += column[i]);
                }
            }
            for i in 0..D {
                for j in 0..D {
                    if body.is_held(1, i) || body.is_held(1, j) {
                        block[(i, j)] = 0.0;
                    }
                }
            }
            values.add(slot, block.transpose().as_slice());
        }
        Ok(())
    }

    /// Turns the stored rotations by the rotation of this step. Collective.
    pub fn turn(&mut self, session: &Session, stage: &Stage, turn: TurnDirection) {
        if self.is_empty() {
            return;
        }
        let sign = if turn == TurnDirection::Forwards { 1.0 } else { -1.0 };
        let fields = self.fields(session, stage);
        for (body, fields) in self.bodies.iter_mut().zip(&fields) {
            body.orientation = body.rigid.turned(&body.orientation, &(fields.change() * sign));
        }
    }

    /// Rotations at the start of the step as quaternions `i, j, k, w`.
    pub fn orientations(&self) -> Vec<[f64; 4]> {
        self.bodies.iter().map(|body| body.orientation.coords.into()).collect()
    }

    /// Restores the rotations at the start of the step.
    pub fn set_orientations(&mut self, stored: &[[f64; 4]]) {
        for (body, stored) in self.bodies.iter_mut().zip(stored) {
            let [i, j, k, w] = *stored;
            body.orientation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
        }
    }

    /// Number of unknowns that only contact resists, and the words for messages, of each body.
    pub fn free_directions(&self) -> Vec<(usize, String)> {
        let words = |body: &FreeBody<D>| {
            let moves = (0..D).filter(|&i| body.is_loose(0, i)).map(|i| ["x", "y", "z"][i].to_owned());
            let turns = (0..D).filter(|&i| body.is_loose(1, i));
            let turns = turns.map(|i| format!("r{}", ["x", "y", "z"][FreeRigid::<D>::axis(i)]));
            let all: Vec<String> = moves.chain(turns).collect();
            (all.len(), format!("'{}' along {}", body.name, all.join(", ")))
        };
        self.bodies.iter().map(words).collect()
    }

    /// The free motions of all bodies, with groups that begin at `group`. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn motions(&self, pattern: &PetscVector, group: usize) -> Result<Vec<RigidMotion>> {
        let mut motions = Vec::new();
        for (number, body) in self.bodies.iter().enumerate() {
            for k in 0..2 {
                for i in (0..D).filter(|&i| body.is_loose(k, i)) {
                    let mut field = pattern.like()?;
                    field.set(0.0);
                    if let Some(nodes) = body.nodes {
                        field.owned_mut()[nodes[k] as usize * D + i] = 1.0;
                    }
                    let mut shift = [0.0; 3];
                    let mut spin = [0.0; 3];
                    match k {
                        0 => shift[i] = 1.0,
                        _ => {
                            let unit = Vector::from_fn(|j, _| f64::from(u8::from(i == j)));
                            spin = body.rigid.step_vector(&unit);
                        }
                    }
                    let name = format!("'{}'", body.name);
                    let spread = body.rigid.lengths[i].powi(2);
                    let part = MovingPart { name, nodes: 1.0, spread, shift, spin };
                    motions.push(RigidMotion { group: group + number, field, parts: vec![part] });
                }
            }
        }
        Ok(motions)
    }

    /// Corrections of the sums of the nodal momenta on this rank: the rotation nodes have no linear
    /// momentum, and their angular momentum is that of the spin. Calls `receive(node, angular)` for
    /// each rotation node, with its angular momentum in space [N m s], for the nodal momenta
    /// `momenta` of a state at the end of this stage.
    pub fn spins(&self, stage: &Stage, momenta: &[f64], mut receive: impl FnMut(usize, [f64; 3])) {
        for (body, [_, rotation]) in self.own() {
            let node = rotation as usize;
            let Some(mass) = massive(body).filter(|mass| mass.mass > 0.0) else { continue };
            let rate = Vector::from_column_slice(&momenta[node * D..][..D]) / mass.mass;
            // With the products of inertia about axes that are fixed.
            let seen = mass.inertia * Vector3::from(body.rigid.angular_velocity(&rate));
            let angular = match D {
                2 => seen,
                _ => body.orientation_of(stage, rotation) * seen,
            };
            receive(node, angular.into());
        }
    }
}

impl<const D: usize> FreeBody<D> {
    /// Change of the rotation unknown over the step, on the rank that owns the node.
    fn change_of(&self, stage: &Stage, rotation: u32) -> Vector<D> {
        let about = rotation as usize * D;
        let (end, start) = (stage.trial.u.local(), stage.start.u.local());
        Vector::from_fn(|i, _| end[about + i] - start[about + i])
    }

    /// Orientation at the trial state, on the rank that owns the node.
    fn orientation_of(&self, stage: &Stage, rotation: u32) -> UnitQuaternion<f64> {
        self.rigid.turned(&self.orientation, &self.change_of(stage, rotation))
    }
}

/// The nodes of a free target, if this contact has one.
pub(super) fn pose_of<const D: usize>(
    target: &ContactTarget<D>,
    bodies: &FreeBodies<D>,
) -> Option<([i32; 2], Vector<D>)> {
    let body = bodies.all().get(target.free_body()?)?;
    Some((body.globals, body.rigid.centre))
}
