//! A contact with a deformable target by mortar segments on this rank: what is near, and which nodes each vertex couples.

use mpi::traits::CommunicatorCollectives;

use super::interface::{Couples, Opening, PairLift, PairStiffness, RemoteForce, SegmentForces, add_forces};
use super::meeting::Outlook;
use super::targets::{Evaluated, Reach, Surfaces, TargetGather};
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::mortar::candidates::CandidateRange;
use crate::contact::mortar::contact::SegmentContact;
use crate::contact::state::ContactState;
use crate::contact::surface::ContactSurface;
use crate::contact::target::{TargetFacets, TargetSurface};
use crate::error::Result;
use crate::mesh::Facet;
use crate::partition::{IndexMap, LocalMesh};
use crate::tensor::Vector as Point;

/// Lengths by which a contact by segments looks around.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchRadii {
    /// Largest extent of a facet of either side \[m\].
    pub facet: f64,
    /// Half the thickness of the thinner body: what is deeper than this comes from its other side \[m\].
    pub depth: f64,
}

impl SearchRadii {
    /// Relative motion of the surfaces, over the size of a facet, before candidates are sought anew. Half of it seeks twice as often;
    /// twice as much couples a quarter more nodes.
    const SLACK: f64 = 0.3;
    /// Distance, over the size of a facet, at which surfaces have a gap at all: where the weights of segments have faded.
    const OPEN: f64 = 0.5;
    /// Motion along a tilted axis is this much larger than along those in which it is measured, at most.
    const TILT: f64 = 1.5;

    fn reach(&self, below: f64) -> Reach {
        Reach { radius: self.range(below, Outlook::Ahead).across, slack: Self::SLACK * self.facet }
    }

    fn range(&self, below: f64, outlook: Outlook) -> CandidateRange {
        let motion = match outlook {
            Outlook::Now => Self::TILT * Self::SLACK * self.facet,
            Outlook::Ahead => 2.0 * Self::TILT * Self::SLACK * self.facet,
        };
        CandidateRange { across: Self::OPEN * self.facet + below + motion, along: motion }
    }
}

/// The two sides of a contact by segments, and what is near.
pub struct SegmentMeeting<const D: usize> {
    /// Laws, vertices, and the target as far as this rank knows it.
    pub contact: SegmentContact<D>,
    /// The facets of the contactor that this rank reports.
    pub outline: ContactSurface<D>,
    /// Nodes that each vertex couples, with the places of their blocks: the couples of vertex `p` are `(p, 0)`.
    pub cliques: Couples,
    /// Every vertex is counted.
    pub counted: Vec<bool>,
    couples: Vec<(u32, u32)>,
    radii: SearchRadii,
    /// Depth of the deepest vertex when the target was gathered \[m\].
    below: f64,
    contactor: Vec<Facet>,
    target: Vec<Facet>,
    gather: Option<TargetGather<D>>,
}

impl<const D: usize> SegmentMeeting<D> {
    /// A contact with the local facets `target` that knows nothing of its target yet.
    pub fn new(
        contact: SegmentContact<D>,
        outline: ContactSurface<D>,
        target: &[Facet],
        radii: SearchRadii,
    ) -> Self {
        let contactor = contact.surface.facets().iter().map(|facet| facet.facet).collect();
        let counted = vec![true; contact.surface.vertices().len()];
        Self {
            contact,
            outline,
            cliques: Couples::default(),
            counted,
            couples: Vec::new(),
            radii,
            below: 0.0,
            contactor,
            target: target.to_vec(),
            gather: None,
        }
    }

    /// Motion by which no vertex can pass through the target \[m\]: half a facet, and half the depth at which points count as its own.
    pub fn stride(&self) -> f64 {
        0.5 * self.radii.facet.min(self.radii.depth)
    }

    /// Largest extent of a facet of either side \[m\].
    pub fn facet(&self) -> f64 {
        self.radii.facet
    }

    /// Facets of the target in this rank's share of the mesh.
    pub fn target_facets(&self) -> &[Facet] {
        &self.target
    }

    /// Distance at which surfaces have a gap \[m\].
    pub fn reach(&self) -> f64 {
        SearchRadii::OPEN * self.radii.facet
    }

    /// Gathers the target facets near by, at the current positions of the local nodes \[m\]. Collective.
    ///
    /// # Errors
    /// The same on all ranks.
    pub fn gather(
        &mut self,
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        positions: &[f64],
        state: &ContactState<D>,
    ) -> Result<()> {
        self.below = match self.gather {
            Some(_) => state.depth().min(self.radii.depth),
            None => self.radii.depth.min(self.radii.facet),
        };
        let surfaces =
            Surfaces { local, contactor: &self.contactor, evaluated: Evaluated::All, target: &self.target };
        self.gather = Some(TargetGather::new(world, &surfaces, positions, self.radii.reach(self.below))?);
        Ok(())
    }

    /// Takes the gathered facets as the target; `points` are the reference points of all nodes of `foreign` and before.
    pub fn adopt(&mut self, index: &IndexMap, foreign: &[i32], points: &[[f64; D]]) {
        let Some(gather) = &self.gather else { return };
        let nodes = gather.placed(index, foreign);
        self.contact.target = TargetSurface::new(TargetFacets { nodes, ..gather.facets.clone() }, points);
    }

    /// Foreign nodes of the gathered facets with their reference points.
    pub fn foreign(&self) -> impl Iterator<Item = (i32, [f64; D])> + '_ {
        self.gather.iter().flat_map(TargetGather::foreign_nodes)
    }

    /// Whether this rank's facets moved so far since the gathering that others may have come near.
    pub fn is_stale(&self, position: impl Fn(u32) -> [f64; D]) -> bool {
        let Some(gather) = &self.gather else { return true };
        let [contactor, target] = gather.motion(position);
        !gather.holds([2.0 * contactor.max(target), 0.0])
    }

    /// Facets that may meet at the displacements of all nodes, and the nodes that vertices couple by them.
    pub fn find_couples(&mut self, u: &[f64], outlook: Outlook) {
        self.couples = self.contact.candidates(u, &self.radii.range(self.below, outlook));
        let surface = &self.contact.surface;
        let vertices = surface.vertices().len();
        let couples: Vec<(u32, u32)> = (0..vertices as u32).map(|vertex| (vertex, 0)).collect();
        self.cliques = Couples::new(vertices, &couples, |vertex, _, nodes| {
            let first = nodes.len();
            for &facet in surface.around(vertex as usize) {
                let opposite = self.couples.partition_point(|couple| couple.0 < facet);
                let opposite = self.couples[opposite..].iter().take_while(|couple| couple.0 == facet);
                let mut alone = true;
                for (_, target) in opposite {
                    alone = false;
                    nodes.extend_from_slice(self.contact.target.nodes(*target));
                }
                if !alone {
                    nodes.extend_from_slice(surface.facet_nodes(&surface.facets()[facet as usize]));
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

    /// Evaluates the forces.
    pub fn add_force(
        &self,
        fields: &ContactFields,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        own: &mut [f64],
        remote: RemoteForce,
    ) {
        let mut sink = SegmentForces::<D> { own, remote };
        self.contact.evaluate(&self.couples, fields, request, state, &mut sink);
    }

    /// Evaluates the stiffness.
    pub fn add_stiffness(
        &self,
        fields: &ContactFields,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        opening: &mut Opening,
    ) {
        let mut sink = PairStiffness::<D> {
            couples: &self.cliques,
            constrained: opening.constrained,
            values: &mut *opening.values,
            remote: &mut *opening.remote,
            lift: opening.lift.as_mut().map(PairLift::reborrow),
            symmetry: opening.symmetry,
        };
        self.contact.evaluate(&self.couples, fields, request, state, &mut sink);
    }

    /// Adds the normals of the closed vertices, by area, to all nodes that they couple.
    pub fn add_normals(&self, state: &ContactState<D>, own: &mut [f64], remote: RemoteForce) {
        self.add_closed(
            state,
            |vertex| state.current[vertex].normal * state.current[vertex].area,
            own,
            remote,
        );
    }

    /// Adds one to all entries of the nodes that closed vertices couple.
    pub fn add_marks(&self, state: &ContactState<D>, own: &mut [f64], remote: RemoteForce) {
        self.add_closed(state, |_| Point::repeat(1.0), own, remote);
    }

    fn add_closed(
        &self,
        state: &ContactState<D>,
        value: impl Fn(usize) -> Point<D>,
        own: &mut [f64],
        mut remote: RemoteForce,
    ) {
        for (vertex, _) in state.current.iter().enumerate().filter(|(_, point)| point.is_closed()) {
            let Some(clique) = self.cliques.find(vertex, 0) else { continue };
            let nodes = self.cliques.nodes_of(clique);
            let values = value(vertex).as_slice().repeat(nodes.len());
            add_forces::<D>(nodes, &values, own, &mut remote);
        }
    }
}
