//! Contact over a moving rigid body: evaluated in the body frame, where the body is at rest, and
//! brought to space.
//!
//! A free body also receives its force and moment, and the matrix has the rows and columns of its
//! unknowns (theory, section 1.13).

use std::collections::HashMap;

use super::candidates::Candidates;
use super::contact::{ContactSink, VertexContact};
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::nodal::at;
use crate::contact::point::TermSelection;
use crate::contact::rigid::{BodyFrame, PoseVariations, SeenNode, TargetLoad};
use crate::contact::state::ContactState;
use crate::tensor::{Tensor, Vector};
use crate::terms::Terms;

impl<const D: usize> VertexContact<D> {
    /// Evaluates all vertices in the frame of the target, and sums up the load on the target.
    pub(super) fn evaluate_moving(
        &self,
        frame: &BodyFrame<D>,
        candidates: &Candidates<D>,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        sink: &mut impl ContactSink,
    ) {
        let springs = request.stiffness.as_ref().is_some_and(|selection| selection.joint.is_some());
        let mut seen = state.seen_from(frame);
        let pose = self.target.pose_nodes().zip(frame.variations());
        let guesses = !springs && request.stiffness.is_some() && frame.ahead(&Vector::zeros()).is_some();
        let needs_nodes = request.stiffness.is_none() || pose.is_some() || guesses;
        let nodes = if needs_nodes { self.seen_nodes(frame, fields) } else { HashMap::new() };
        let free = pose.map(|(nodes, variations)| FreePose {
            nodes,
            variations,
            force: Vector::zeros(),
            moment: Vector::zeros(),
        });
        let derivatives = match (&request.stiffness, &free) {
            (Some(selection), Some(_)) if !springs => {
                self.derivatives(candidates, fields, request, selection, &seen)
            }
            _ => PoseDerivatives::default(),
        };
        let mut turned = FrameSink {
            sink,
            frame,
            nodes,
            // Springs for multigrid stay symmetric.
            forces: if springs { *frame.at_end() } else { frame.forces() },
            positions: frame.at_end().transpose(),
            load: TargetLoad::default(),
            free,
            guesses,
            derivatives,
            scratch: Vec::new(),
            members: Vec::new(),
            placed: Vec::new(),
            blocks: Vec::new(),
        };
        self.evaluate_at_rest(candidates, fields, request, &mut seen, &mut turned);
        turned.add_pose_force();
        let FrameSink { load, .. } = turned;
        state.adopt(frame, seen);
        if request.stiffness.is_none() {
            state.load = load;
        }
    }

    /// The nodes of the contactor as seen from the target.
    fn seen_nodes(&self, frame: &BodyFrame<D>, fields: &ContactFields<'_>) -> HashMap<u32, SeenNode<D>> {
        let facets = self.surface.facets().iter();
        let nodes = facets.flat_map(|facet| {
            self.surface.facet_nodes(facet).iter().zip(self.surface.reference_points(facet))
        });
        let see = |(&node, reference): (&u32, &Vector<D>)| {
            let [u_start, u, v] = [fields.u_start, fields.u, fields.v].map(|field| at(field, node));
            (node, frame.see(reference, &u_start, &u, &v))
        };
        nodes.map(see).collect()
    }

    /// What the columns of a free body need besides the stiffness: the forces of the nodes, and the
    /// stiffness without the part through velocities.
    fn derivatives(
        &self,
        candidates: &Candidates<D>,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        selection: &TermSelection,
        seen: &ContactState<D>,
    ) -> PoseDerivatives<D> {
        let mut derivatives =
            PoseDerivatives { shift: selection.velocity_shift, ..PoseDerivatives::default() };
        if selection.terms.intersects(Terms::NORMAL_GEOMETRY | Terms::FRICTION_GEOMETRY) {
            let forces = ContactRequest { stiffness: None, ..*request };
            let mut sink = NodalForces::<D>::default();
            self.evaluate_at_rest(candidates, fields, &forces, &mut seen.clone(), &mut sink);
            derivatives.forces = sink.forces;
        }
        let by_velocity = self.law.friction.is_some() || !self.law.damping.is_none();
        if by_velocity && selection.velocity_shift != 0.0 {
            let still = TermSelection { velocity_shift: 0.0, ..*selection };
            let request = ContactRequest { stiffness: Some(still), ..*request };
            let mut sink = RecordedStiffness::default();
            self.evaluate_at_rest(candidates, fields, &request, &mut seen.clone(), &mut sink);
            derivatives.still = sink.values;
        }
        derivatives
    }
}

/// Sums of the forces of the nodes.
#[derive(Default)]
struct NodalForces<const D: usize> {
    forces: HashMap<u32, Vector<D>>,
}

impl<const D: usize> ContactSink for NodalForces<D> {
    fn force(&mut self, nodes: &[u32], force: &[f64]) {
        for (&node, force) in nodes.iter().zip(force.chunks_exact(D)) {
            *self.forces.entry(node).or_insert_with(Vector::zeros) += Vector::<D>::from_column_slice(force);
        }
    }

    fn stiffness(&mut self, _: usize, _: &[u32], _: &[f64]) {}
}

/// The blocks of an evaluation, one after the other.
#[derive(Default)]
struct RecordedStiffness {
    values: Vec<f64>,
}

impl ContactSink for RecordedStiffness {
    fn force(&mut self, _: &[u32], _: &[f64]) {}

    fn stiffness(&mut self, _: usize, _: &[u32], stiffness: &[f64]) {
        self.values.extend_from_slice(stiffness);
    }
}

/// What the columns of a free body need besides the stiffness of the nodes.
#[derive(Default)]
struct PoseDerivatives<const D: usize> {
    /// Forces of the nodes in the frame \[N\]. The entry of a node is removed when its part of the
    /// matrix has been added.
    forces: HashMap<u32, Vector<D>>,
    /// Blocks without the part through velocities, in the order of the evaluation; empty if no force
    /// depends on velocities.
    still: Vec<f64>,
    /// Number of values of `still` that have been used.
    used: usize,
    /// Derivative of velocities by displacements [1/s].
    shift: f64,
}

/// The unknowns of a free target, with the sums of its contact forces.
struct FreePose<'a, const D: usize> {
    /// Displacement and rotation, as indices into the field arrays.
    nodes: [u32; 2],
    variations: &'a PoseVariations<D>,
    /// Force in space \[N\].
    force: Vector<D>,
    /// Moment along the rotation unknowns \[N\].
    moment: Vector<D>,
}

/// Brings contributions from the frame of a moving target to space.
struct FrameSink<'a, S, const D: usize> {
    sink: &'a mut S,
    frame: &'a BodyFrame<D>,
    /// Nodes of the contactor as seen from the target.
    nodes: HashMap<u32, SeenNode<D>>,
    /// Takes forces to space.
    forces: Tensor<D>,
    /// Derivative of positions in the frame by those in space.
    positions: Tensor<D>,
    load: TargetLoad<D>,
    free: Option<FreePose<'a, D>>,
    /// Whether the motion of the body to the end of the step enters a first guess.
    guesses: bool,
    derivatives: PoseDerivatives<D>,
    scratch: Vec<f64>,
    members: Vec<u32>,
    /// Arm and velocity of each node of a block in the frame, see
    /// [`stiffness_with_pose`](Self::stiffness_with_pose).
    placed: Vec<[Vector<D>; 2]>,
    blocks: Vec<Tensor<D>>,
}

impl<S: ContactSink, const D: usize> ContactSink for FrameSink<'_, S, D> {
    fn force(&mut self, nodes: &[u32], force: &[f64]) {
        self.scratch.clear();
        for (node, force) in nodes.iter().zip(force.chunks_exact(D)) {
            let in_frame = Vector::<D>::from_column_slice(force);
            let force = self.forces * in_frame;
            self.scratch.extend_from_slice(force.as_slice());
            let Some(seen) = self.nodes.get(node) else { continue };
            self.load.react(&self.frame.arm(&seen.iterate), &force);
            if let Some(free) = &mut self.free {
                let arm = self.frame.arm_in_frame(seen);
                free.force -= force;
                for (moment, axis) in free.moment.iter_mut().zip(&free.variations.axes) {
                    *moment -= (axis * arm).dot(&in_frame);
                }
            }
        }
        self.sink.force(nodes, &self.scratch);
    }

    fn stiffness(&mut self, vertex: usize, nodes: &[u32], stiffness: &[f64]) {
        if self.free.is_some() {
            return self.stiffness_with_pose(vertex, nodes, stiffness);
        }
        self.scratch.clear();
        for block in stiffness.chunks_exact(D * D) {
            let block = self.forces * Tensor::<D>::from_row_slice(block) * self.positions;
            self.scratch.extend_from_slice(block.transpose().as_slice());
        }
        self.sink.stiffness(vertex, nodes, &self.scratch);
        if self.guesses {
            self.move_ahead(nodes, stiffness);
        }
    }
}

impl<S: ContactSink, const D: usize> FrameSink<'_, S, D> {
    /// Passes on the change of the forces when a first guess moves the body to the end of the step
    /// and the nodes stay.
    fn move_ahead(&mut self, nodes: &[u32], stiffness: &[f64]) {
        let count = nodes.len();
        self.scratch.clear();
        self.scratch.resize(count * D, 0.0);
        for (b, node) in nodes.iter().enumerate() {
            let arm = self.nodes.get(node).map(|seen| self.frame.arm_in_frame(seen));
            let Some(moved) = arm.and_then(|arm| self.frame.ahead(&arm)) else { return };
            for a in 0..count {
                let first = (a * count + b) * D * D;
                let block = Tensor::<D>::from_row_slice(&stiffness[first..first + D * D]);
                let change = self.forces * (block * moved);
                (0..D).for_each(|i| self.scratch[a * D + i] -= change[i]);
            }
        }
        self.sink.lift(nodes, &self.scratch);
    }

    /// Passes on the force on a free target.
    fn add_pose_force(&mut self) {
        let Some(free) = &self.free else { return };
        self.scratch.clear();
        self.scratch.extend_from_slice(free.force.as_slice());
        self.scratch.extend_from_slice(free.moment.as_slice());
        self.sink.force(&free.nodes, &self.scratch);
    }

    /// Passes on the stiffness of nodes together with the rows and columns of the target.
    ///
    /// In the frame, a node moves by `y = R^T (dx - dc) - T r`, where `T` is the variation `R^T dR` and `r`
    /// the arm. Its relative velocity changes by what the frame accounts for, plus `-T q - c (A -
    /// T) r` with the velocity `q = v' + W r`, the derivative `c` of velocities by displacements, and `A`
    /// the change of the rotation vector.
    fn stiffness_with_pose(&mut self, vertex: usize, nodes: &[u32], stiffness: &[f64]) {
        let Some(free) = &self.free else { return };
        let count = nodes.len();
        let width = count + 2;
        let (moving, turning) = (count, count + 1);
        self.members.clear();
        self.members.extend_from_slice(nodes);
        self.members.extend_from_slice(&free.nodes);
        let used = self.derivatives.used;
        let still = self.derivatives.still.get(used..used + stiffness.len());
        self.derivatives.used += stiffness.len();
        let shift = self.derivatives.shift;
        let blocks = &mut self.blocks;
        blocks.clear();
        blocks.resize(width * width, Tensor::zeros());
        let spin = self.frame.velocity_by_position().unwrap_or_else(Tensor::zeros);
        self.placed.clear();
        for node in nodes {
            let Some(seen) = self.nodes.get(node) else { return };
            let arm = self.frame.arm_in_frame(seen);
            self.placed.push([arm, seen.velocity - spin * arm]);
        }
        for a in 0..count {
            let arm = self.placed[a][0];
            let levers: [Vector<D>; D] = free.variations.axes.map(|axis| axis * arm);
            for b in 0..count {
                let [arm, velocity] = self.placed[b];
                let first = (a * count + b) * D * D;
                let block = Tensor::<D>::from_row_slice(&stiffness[first..first + D * D]);
                let by_velocity = still
                    .filter(|_| shift != 0.0)
                    .map(|still| (block - Tensor::<D>::from_row_slice(&still[first..first + D * D])) / shift);
                let by_position = block * self.positions;
                blocks[a * width + b] += self.forces * by_position;
                blocks[a * width + moving] -= self.forces * by_position;
                let mut by_turn = Tensor::<D>::zeros();
                for (j, (turn, axis)) in free.variations.turns.iter().zip(&free.variations.axes).enumerate() {
                    let mut change = -(block * (turn * arm));
                    if let Some(by_velocity) = &by_velocity {
                        change -= by_velocity * (turn * velocity + (axis - turn) * arm * shift);
                    }
                    by_turn.set_column(j, &change);
                }
                blocks[a * width + turning] += self.forces * by_turn;
                for (i, lever) in levers.iter().enumerate() {
                    let along = lever.transpose() * by_position;
                    let about = lever.transpose() * by_turn;
                    for j in 0..D {
                        blocks[turning * width + b][(i, j)] -= along[j];
                        blocks[turning * width + moving][(i, j)] += along[j];
                        blocks[turning * width + turning][(i, j)] -= about[j];
                    }
                }
            }
            let Some(force) = self.derivatives.forces.remove(&nodes[a]) else { continue };
            for (j, turn) in free.variations.turns.iter().enumerate() {
                let carried = self.forces * (turn * force);
                for i in 0..D {
                    blocks[a * width + turning][(i, j)] -= carried[i];
                }
            }
            for (i, axis) in free.variations.axes.iter().enumerate() {
                let by_arm = axis.transpose() * force;
                let by_position = by_arm.transpose() * self.positions;
                for j in 0..D {
                    blocks[turning * width + a][(i, j)] += by_position[j];
                    blocks[turning * width + moving][(i, j)] -= by_position[j];
                    blocks[turning * width + turning][(i, j)] -=
                        by_arm.dot(&(free.variations.turns[j] * arm));
                }
            }
        }
        for column in 0..width {
            let total: Tensor<D> = (0..count).map(|a| blocks[a * width + column]).sum();
            blocks[moving * width + column] = -total;
        }
        self.scratch.clear();
        for block in blocks.iter() {
            self.scratch.extend_from_slice(block.transpose().as_slice());
        }
        self.sink.stiffness(vertex, &self.members, &self.scratch);
    }
}
