//! Contact over a moving rigid body: evaluated in the body frame, where the body is at rest, and
//! brought to space.

use std::collections::HashMap;

use super::candidates::Candidates;
use super::contact::{ContactSink, VertexContact};
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::nodal::at;
use crate::contact::rigid::{BodyFrame, TargetLoad};
use crate::contact::state::ContactState;
use crate::tensor::{Tensor, Vector};

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
        let mut turned = FrameSink {
            sink,
            arms: if request.stiffness.is_none() { self.arms(frame, fields) } else { HashMap::new() },
            // Springs for multigrid stay symmetric.
            forces: if springs { *frame.at_end() } else { frame.forces() },
            positions: frame.at_end().transpose(),
            load: TargetLoad::default(),
            scratch: Vec::new(),
        };
        self.evaluate_at_rest(candidates, fields, request, &mut seen, &mut turned);
        let FrameSink { load, .. } = turned;
        state.adopt(frame, seen);
        if request.stiffness.is_none() {
            state.load = load;
        }
    }

    /// Vectors from the reference point of the target to the nodes of the contactor \[m\].
    fn arms(&self, frame: &BodyFrame<D>, fields: &ContactFields<'_>) -> HashMap<u32, Vector<D>> {
        let facets = self.surface.facets().iter();
        let nodes = facets.flat_map(|facet| {
            self.surface.facet_nodes(facet).iter().zip(self.surface.reference_points(facet))
        });
        let arm = |(&node, reference): (&u32, &Vector<D>)| {
            let [u_start, u, v] = [fields.u_start, fields.u, fields.v].map(|field| at(field, node));
            (node, frame.arm(&frame.see(reference, &u_start, &u, &v).iterate))
        };
        nodes.map(arm).collect()
    }
}

/// Brings contributions from the frame of a moving target to space.
struct FrameSink<'a, S, const D: usize> {
    sink: &'a mut S,
    /// Vectors from the reference point to the nodes \[m\].
    arms: HashMap<u32, Vector<D>>,
    /// Takes forces to space.
    forces: Tensor<D>,
    /// Derivative of positions in the frame by those in space.
    positions: Tensor<D>,
    load: TargetLoad<D>,
    scratch: Vec<f64>,
}

impl<S: ContactSink, const D: usize> ContactSink for FrameSink<'_, S, D> {
    fn force(&mut self, nodes: &[u32], force: &[f64]) {
        self.scratch.clear();
        for (node, force) in nodes.iter().zip(force.chunks_exact(D)) {
            let force = self.forces * Vector::<D>::from_column_slice(force);
            self.scratch.extend_from_slice(force.as_slice());
            if let Some(arm) = self.arms.get(node) {
                self.load.react(arm, &force);
            }
        }
        self.sink.force(nodes, &self.scratch);
    }

    fn stiffness(&mut self, vertex: usize, nodes: &[u32], stiffness: &[f64]) {
        self.scratch.clear();
        for block in stiffness.chunks_exact(D * D) {
            let block = self.forces * Tensor::<D>::from_row_slice(block) * self.positions;
            self.scratch.extend_from_slice(block.transpose().as_slice());
        }
        self.sink.stiffness(vertex, nodes, &self.scratch);
    }
}
