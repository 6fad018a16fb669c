//! A contact on this rank: nearby facets, and the nodes that each vertex couples.

use std::collections::HashSet;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::free_bodies::{FreeBodies, pose_of};
use super::interface::{
    Couplings, Numbering, Opening, PairLift, RemoteForce, VertexForces, VertexStiffness, add_forces,
};
use super::targets::{Reach, Surfaces, TargetGather};
use crate::collective::Collective;
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::mortar::candidates::{CandidateRange, Candidates};
use crate::contact::mortar::contact::{OPEN, VertexContact};
use crate::contact::mortar::facing::ALIKE;
use crate::contact::mortar::resultant::ContactResultant;
use crate::contact::state::ContactState;
use crate::contact::surface::ContactSurface;
use crate::contact::target::{ContactTarget, TargetFacets, TargetSurface};
use crate::dynamics::{OverStep, Sides};
use crate::error::Result;
use crate::mesh::{Facet, Mesh};
use crate::partition::{IndexMap, LocalMesh};
use crate::tensor::Vector as Point;

/// How far ahead couplings must be known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CandidateHorizon {
    /// Until the surfaces have moved so far that the target is gathered again.
    Now,
    /// Twice as far, as in the pattern of the matrix. Facets that turn have no such margin: then
    /// the pattern is made again.
    Ahead,
}

/// Search lengths of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchRadii {
    /// Largest extent of a facet of either side \[m\].
    pub facet: f64,
    /// Half the thickness of the thinner body \[m\]. Penetrations deeper than this belong to its
    /// other side. Unlimited for an obstacle.
    pub depth: f64,
}

impl SearchRadii {
    /// Relative motion of the surfaces, relative to the facet size, after which candidates are
    /// searched again. Half of the value searches twice as often; twice the value couples a quarter
    /// more nodes.
    const SLACK: f64 = 0.3;
    /// Largest ratio of a motion along a tilted axis to its largest component: the square root of
    /// the dimension.
    const TILT: f64 = 1.7321;

    /// Computes the reach from the depth `below` of the deepest vertex and the relative motion
    /// `swing` of the surfaces over the step \[m\].
    fn reach(&self, below: f64, swing: f64) -> Reach {
        Reach {
            radius: self.range(below, swing, CandidateHorizon::Ahead, false).across,
            slack: Self::SLACK * self.facet,
        }
    }

    fn range(&self, below: f64, swing: f64, outlook: CandidateHorizon, facing: bool) -> CandidateRange {
        let motion = match outlook {
            CandidateHorizon::Now => Self::TILT * Self::SLACK * self.facet,
            CandidateHorizon::Ahead => 2.0 * Self::TILT * Self::SLACK * self.facet,
        };
        CandidateRange {
            across: OPEN * self.facet + below + motion + swing,
            along: motion + swing,
            alike: facing.then_some(ALIKE),
        }
    }
}

/// Motion of the surfaces between the ends of a step and its midpoint, if forces act over the step.
/// Segments at the ends are then also needed.
#[derive(Debug, Clone, Copy)]
struct Swing<const D: usize> {
    /// Mean motion of both surfaces \[m\].
    mean: Point<D>,
    /// Largest motion of a node relative to the mean \[m\].
    most: f64,
}

impl<const D: usize> Swing<D> {
    /// Largest relative motion of the two surfaces \[m\].
    fn relative(&self) -> f64 {
        2.0 * self.most
    }

    fn beside(&self, nodes: &[u32], step: impl Fn(u32) -> Point<D>) -> f64 {
        nodes.iter().map(|&node| (step(node) - self.mean).norm()).fold(0.0, f64::max)
    }

    /// Evaluates the nodes of all ranks. Collective.
    fn of(world: &impl CommunicatorCollectives, nodes: &[u32], step: impl Fn(u32) -> Point<D>) -> Self {
        let mut own = [0.0; 4];
        own[3] = nodes.len() as f64;
        for &node in nodes {
            let step = step(node);
            (0..D).for_each(|i| own[i] += step[i]);
        }
        let mut all = [0.0_f64; 4];
        world.reduce_all(&own[..], &mut all[..], SystemOperation::sum());
        let mean = Point::from_fn(|i, _| all[i] / all[3].max(1.0));
        let swing = Self { mean, most: 0.0 };
        let mut most = 0.0;
        world.reduce_all(&swing.beside(nodes, step), &mut most, SystemOperation::max());
        Self { mean, most }
    }
}

/// The two sides of a contact, and the nearby target facets.
pub struct ContactPair<const D: usize> {
    /// Laws, vertices, and the part of the target that this rank knows.
    pub contact: VertexContact<D>,
    /// The facets of the contactor that this rank reports.
    pub outline: ContactSurface<D>,
    /// Nodes that each vertex couples, with the positions of their blocks.
    pub couplings: Couplings,
    candidates: Candidates<D>,
    radii: SearchRadii,
    /// Depth of the deepest vertex when the target was gathered \[m\].
    below: f64,
    /// Motion over the step for which the target was gathered.
    swing: Swing<D>,
    /// Whether pairs of facets with similar normals are left out. They are not if facets turn far within
    /// the step.
    facing: bool,
    contactor: Vec<Facet>,
    target: Vec<Facet>,
    /// Those of them at an edge of the target.
    target_edges: HashSet<Facet>,
    /// Local nodes of both surfaces.
    nodes: Vec<u32>,
    gather: Option<TargetGather<D>>,
    /// Global numbers of the nodes of a free rigid target, with their reference point \[m\].
    pose: Option<([i32; 2], Point<D>)>,
}

impl<const D: usize> ContactPair<D> {
    /// Creates a contact with the local facets `target`. The target is not gathered yet.
    pub fn new(
        contact: VertexContact<D>,
        outline: ContactSurface<D>,
        mesh: &Mesh<D>,
        target: &[Facet],
        radii: SearchRadii,
    ) -> Self {
        let contactor: Vec<Facet> = contact.surface.facets().iter().map(|facet| facet.facet).collect();
        let mut nodes = Vec::new();
        let mut of_facet = Vec::new();
        for &facet in contactor.iter().chain(target) {
            mesh.facet_nodes(facet, &mut of_facet);
            nodes.extend_from_slice(&of_facet);
        }
        nodes.sort_unstable();
        nodes.dedup();
        Self {
            contact,
            outline,
            couplings: Couplings::default(),
            candidates: Candidates::default(),
            radii,
            below: 0.0,
            swing: Swing { mean: Point::zeros(), most: 0.0 },
            facing: false,
            contactor,
            target: target.to_vec(),
            target_edges: HashSet::new(),
            nodes,
            gather: None,
            pose: None,
        }
    }

    /// Marks the facets of both sides with a corner at an edge of their surface, given by its local nodes.
    /// Call it before the target is gathered.
    pub fn mark_edges(
        &mut self,
        mesh: &Mesh<D>,
        contactor: impl Fn(u32) -> bool,
        target: impl Fn(u32) -> bool,
    ) {
        self.contact.surface.mark_edges(contactor);
        let mut nodes = Vec::new();
        let mut is_at_edge = |facet: &&Facet| {
            mesh.facet_nodes(**facet, &mut nodes);
            nodes[..mesh.facet_kind(**facet).corners()].iter().any(|&node| target(node))
        };
        self.target_edges = self.target.iter().filter(|facet| is_at_edge(facet)).copied().collect();
    }

    /// Finds the nodes of the target if it is a free rigid body.
    pub(super) fn find_pose(&mut self, bodies: &FreeBodies<D>) {
        self.pose = pose_of(&self.contact.target, bodies);
    }

    /// Motion by which no vertex can pass through the target \[m\]: half a facet, and at most half
    /// the depth limit. Unlimited for a plane, which has no other side.
    pub fn stride(&self) -> f64 {
        if self.contact.target.is_plane() {
            return f64::INFINITY;
        }
        0.5 * self.radii.facet.min(self.radii.depth)
    }

    /// The nodes that vertices couple in addition to the couplings of elements, if there are any.
    pub fn wider_couplings(&self) -> Option<&Couplings> {
        (!self.contact.acts_on_own_node()).then_some(&self.couplings)
    }

    /// Whether a node is on one of the two surfaces, in this rank's part of the mesh.
    pub fn has_node(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    /// Largest extent of a facet of either side \[m\].
    pub fn facet(&self) -> f64 {
        self.radii.facet
    }

    /// Penetration below the target beyond which a point belongs to the other side \[m\].
    pub fn depth(&self) -> f64 {
        self.radii.depth
    }

    /// Both sides: facets around the vertices of this rank, and the target facets in its part of
    /// the mesh.
    pub fn surfaces<'a>(&'a self, local: &'a LocalMesh<D>) -> Surfaces<'a, D> {
        let Self { contactor, target, target_edges, .. } = self;
        Surfaces { local, contactor, target, target_edges }
    }

    /// Facets of the target in this rank's part of the mesh.
    pub fn target_facets(&self) -> &[Facet] {
        &self.target
    }

    /// Distance up to which gaps are known \[m\].
    pub fn reach(&self) -> f64 {
        self.contact.known_gap(self.radii.facet)
    }

    /// Depth of the deepest vertex \[m\], as far as it is known and limited.
    pub fn depth_of(&self, state: &ContactState<D>) -> f64 {
        match self.gather {
            Some(_) => state.depth().min(self.radii.depth),
            None => self.radii.depth,
        }
    }

    /// Gathers the nearby target facets at the current positions of the local nodes \[m\], when the
    /// deepest vertex is `below` the target \[m\]. `step` is the motion of the nodes as for
    /// [`is_stale`](Self::is_stale). Collective.
    ///
    /// # Errors
    /// All ranks return the same error.
    pub fn gather(
        &mut self,
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        positions: &[f64],
        (over_step, step): (OverStep, impl Fn(u32) -> Point<D>),
        below: f64,
    ) -> Result<()> {
        if !self.contact.target.has_facets() {
            return Ok(());
        }
        self.below = below;
        self.swing = Swing::of(world, &self.nodes, &step);
        let reach = self.radii.reach(self.below, self.swing.relative());
        let gather = TargetGather::new(world, &self.surfaces(local), positions, reach)?;
        let position = |node| std::array::from_fn(|i| positions[node as usize * D + i]);
        let turned = has_turned(&gather, position, (over_step, step));
        let mut any = 0u8;
        world.reduce_all(&u8::from(turned), &mut any, SystemOperation::max());
        self.facing = any == 0;
        self.gather = Some(gather);
        Ok(())
    }

    /// Takes the gathered facets as the target. `points` are the reference points of all nodes: the
    /// local ones, then those of `foreign`.
    pub fn adopt(&mut self, index: &IndexMap, foreign: &[i32], points: &[[f64; D]]) {
        if let Some((globals, _)) = self.pose {
            let numbering = Numbering { index, foreign };
            self.contact.target.set_pose_nodes(globals.map(|global| numbering.node(global)));
        }
        let Some(gather) = &self.gather else { return };
        let nodes = gather.placed(index, foreign);
        let facets = TargetFacets { nodes, ..gather.facets.clone() };
        self.contact.target = ContactTarget::Body(TargetSurface::new(facets, points));
    }

    /// Nodes of the target beyond those of `index`, with their reference points.
    pub fn foreign<'a>(&'a self, index: &'a IndexMap) -> impl Iterator<Item = (i32, [f64; D])> + 'a {
        let pose = self.pose.iter().flat_map(|(globals, at)| globals.map(|global| (global, (*at).into())));
        let pose = pose.filter(|(global, _)| index.local(*global).is_none());
        self.gather.iter().flat_map(TargetGather::foreign_nodes).chain(pose)
    }

    /// Whether this rank's facets have moved so far since the gathering that other facets may have
    /// come near.
    ///
    /// `position` is the position of a local node \[m\]. `step` is its motion from the start of the
    /// step to its midpoint \[m\], or zero unless forces act over the step.
    pub fn is_stale(
        &self,
        position: impl Fn(u32) -> [f64; D],
        (over_step, step): (OverStep, impl Fn(u32) -> Point<D>),
    ) -> bool {
        let Some(gather) = &self.gather else { return self.contact.target.has_facets() };
        if self.facing && has_turned(gather, &position, (over_step, &step)) {
            return true;
        }
        let [contactor, target] = gather.motion(position);
        let beyond = (2.0 * self.swing.beside(&self.nodes, step) - self.swing.relative()).max(0.0);
        !gather.holds([2.0 * contactor.max(target), beyond])
    }

    /// Finds facets that may touch at the displacements of all nodes, and the nodes that vertices
    /// couple through them.
    pub fn find_couplings(&mut self, u: &[f64], outlook: CandidateHorizon) {
        let range = self.radii.range(self.below, self.swing.relative(), outlook, self.facing);
        self.candidates = self.contact.candidates(u, &range);
        let surface = &self.contact.surface;
        let vertices = surface.vertices().len();
        let near = self.candidates.couples();
        self.couplings = Couplings::new(vertices, |vertex, nodes| {
            let first = nodes.len();
            for &facet in surface.around(vertex) {
                let opposite = near.partition_point(|couple| couple.0 < facet);
                let opposite = near[opposite..].iter().take_while(|couple| couple.0 == facet);
                let mut alone = true;
                for (_, target) in opposite {
                    alone = false;
                    nodes.extend_from_slice(self.contact.target.nodes(*target));
                }
                if !alone {
                    nodes.extend_from_slice(surface.facet_nodes(&surface.facets()[facet as usize]));
                    nodes.extend(self.contact.target.pose_nodes().iter().flatten());
                }
            }
            nodes[first..].sort_unstable();
            let mut kept = first;
            for k in first..nodes.len() {
                if k == first || nodes[k] != nodes[kept - 1] {
                    nodes[kept] = nodes[k];
                    kept += 1;
                }
            }
            nodes.truncate(kept);
        });
    }

    /// Evaluates the contact forces.
    pub fn add_force(
        &self,
        fields: &ContactFields,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        own: &mut [f64],
        remote: RemoteForce,
    ) {
        let mut sink = VertexForces::<D> { own, remote };
        self.contact.evaluate(&self.candidates, fields, request, state, &mut sink);
    }

    /// The resultant of the forces on the contactor, on this rank.
    pub fn resultant(
        &self,
        fields: &ContactFields,
        request: &ContactRequest,
        state: &ContactState<D>,
    ) -> ContactResultant<D> {
        self.contact.resultant(&self.candidates, fields, request, state)
    }

    /// Evaluates the contact stiffness.
    pub fn add_stiffness(
        &self,
        fields: &ContactFields,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        opening: &mut Opening<D>,
    ) {
        let mut sink = VertexStiffness::<D> {
            couplings: &self.couplings,
            held: opening.held,
            values: &mut *opening.values,
            remote: &mut *opening.remote,
            lift: opening.lift.as_mut().map(PairLift::reborrow),
            symmetry: opening.symmetry,
        };
        self.contact.evaluate(&self.candidates, fields, request, state, &mut sink);
    }

    /// Adds the area-weighted normals of the closed vertices to all nodes that they couple.
    pub fn add_normals(&self, state: &ContactState<D>, own: &mut [f64], remote: RemoteForce) {
        let normal = |vertex: usize| state.current[vertex].normal * state.current[vertex].area;
        self.add_closed(state, Sides::Both, normal, own, remote);
    }

    /// Adds one to all entries of the nodes of these sides that closed vertices couple.
    pub fn add_marks(&self, state: &ContactState<D>, sides: Sides, own: &mut [f64], remote: RemoteForce) {
        self.add_closed(state, sides, |_| Point::repeat(1.0), own, remote);
    }

    fn add_closed(
        &self,
        state: &ContactState<D>,
        sides: Sides,
        value: impl Fn(usize) -> Point<D>,
        own: &mut [f64],
        mut remote: RemoteForce,
    ) {
        let surface = &self.contact.surface;
        let own_node = self.contact.acts_on_own_node();
        let pose = self.contact.target.pose_nodes();
        let mut nodes = Vec::new();
        for (vertex, _) in state.current.iter().enumerate().filter(|(_, point)| point.is_closed()) {
            nodes.clear();
            match sides {
                _ if own_node => nodes.push(surface.vertices()[vertex]),
                Sides::Both => nodes.extend_from_slice(self.couplings.nodes_of(vertex)),
                Sides::Contactor => nodes.extend(surface.nodes_around(vertex)),
            }
            let values = value(vertex);
            // The nodes of a free rigid target are not on a surface.
            for node in nodes.iter().filter(|node| pose.is_none_or(|pose| !pose.contains(node))) {
                add_forces::<D>(&[*node], values.as_slice(), own, &mut remote);
            }
        }
    }
}

/// Whether a facet of this rank has turned far since the facets were gathered, at these positions of the
/// local nodes \[m\] or, if forces act over the step, at one of its ends.
fn has_turned<const D: usize>(
    gather: &TargetGather<D>,
    position: impl Fn(u32) -> [f64; D],
    (over_step, step): (OverStep, impl Fn(u32) -> Point<D>),
) -> bool {
    let places: &[f64] = if over_step == OverStep::Middle { &[-1.0, 0.0, 1.0] } else { &[0.0] };
    places
        .iter()
        .any(|place| gather.has_turned(|node| (Point::from(position(node)) + step(node) * *place).into()))
}
