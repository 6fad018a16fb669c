//! A contact with a deformable target on this rank: who is near, who is paired with whom.

use mpi::traits::CommunicatorCollectives;

use super::interface::{Couples, Opening, PairForces, PairStiffness, RemoteForce};
use super::targets::{Reach, Surfaces, TargetGather};
use crate::contact::deformable::{DeformableContact, PairContribution, PairSink};
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::pairing::Pairing;
use crate::contact::search::{Search, SearchLimits};
use crate::contact::state::ContactState;
use crate::contact::target::{TargetFacets, TargetSurface};
use crate::error::Result;
use crate::mesh::Facet;
use crate::partition::{IndexMap, LocalMesh};
use crate::tensor::Vector as Point;

/// Lengths by which a contact looks around.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Largest extent of a facet of either side \[m\].
    pub facet: f64,
    /// Half the thickness of the thinner body: points deeper than this come from its other side \[m\].
    pub depth: f64,
}

impl Sight {
    /// Motion towards each other before the target facets are gathered anew.
    const SLACK: f64 = 0.5;
    /// Distance at which a point has a gap at all.
    const REACH: f64 = 1.0;
    /// Distance between facets whose couple the pattern must hold now, and for some time to come.
    const NEEDED: f64 = 1.0;
    const AHEAD: f64 = 2.5;

    /// With `below` the depth of the deepest point, which must not lose its facet.
    fn reach(&self, below: f64) -> Reach {
        let (slack, beyond) = (Self::SLACK * self.facet, (1.0 + Self::REACH).max(Self::AHEAD));
        // The neighbours of every facet that may be reached have to be known, too.
        Reach { radius: beyond * self.facet + below, slack }
    }

    fn limits(&self, below: f64) -> SearchLimits {
        let ahead = (Self::REACH + Self::SLACK) * self.facet;
        SearchLimits { reach: ahead + below, ahead, depth: self.depth }
    }
}

/// How far ahead couples are to be known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outlook {
    /// Until the target facets are gathered anew.
    Now,
    /// For some time after: what a new pattern is made for.
    Ahead,
}

/// The two sides of a contact, what is near, and the facet of each point.
pub struct Meeting<const D: usize> {
    /// Laws, contactor, and the target as far as this rank knows it.
    pub contact: DeformableContact<D>,
    /// The facet of each point.
    pub pairing: Pairing,
    /// Facets that may meet, with the places of their blocks.
    pub couples: Couples,
    sight: Sight,
    /// Depth of the deepest point when the target was gathered \[m\].
    below: f64,
    surfaces: [Vec<Facet>; 2],
    gather: Option<TargetGather<D>>,
    search: Option<Search<D>>,
    /// Facets by name that the points had at the last accepted state.
    accepted: Vec<u64>,
    /// Facets by name that the points shall have on the target gathered next.
    recalled: Option<Vec<u64>>,
}

impl<const D: usize> Meeting<D> {
    /// A contact of `surfaces` (contactor, target) that knows nothing of its target yet.
    pub fn new(contact: DeformableContact<D>, surfaces: [Vec<Facet>; 2], sight: Sight) -> Self {
        let pairing = Pairing::new(contact.surface.point_count());
        let (couples, below) = (Couples::default(), sight.depth);
        let (gather, search, accepted, recalled) = (None, None, Vec::new(), None);
        Self { contact, pairing, couples, sight, below, surfaces, gather, search, accepted, recalled }
    }

    /// Motion that no point can pass through the target by: half a facet, and half of the depth at which points count
    /// as its own \[m\].
    pub fn stride(&self) -> f64 {
        0.5 * self.sight.facet.min(self.sight.depth)
    }

    /// Largest extent of a facet of either side \[m\].
    pub fn facet(&self) -> f64 {
        self.sight.facet
    }

    /// Local facets of contactor and target.
    pub fn surfaces(&self) -> &[Vec<Facet>; 2] {
        &self.surfaces
    }

    /// Points deeper than this are not below the target, but come from its other side \[m\].
    pub fn depth(&self) -> f64 {
        self.sight.depth
    }

    /// Distance at which targets are looked for \[m\].
    pub fn reach(&self) -> f64 {
        self.sight.limits(0.0).reach
    }

    /// Gathers the target facets near by, at the current positions of the local nodes \[m\]. The first time it looks as
    /// deep as a point may lie, later a little deeper than the deepest point of `state`. Collective.
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
        if self.gather.is_some() {
            self.below = state.depth();
        }
        let [contactor, target] = &self.surfaces;
        let surfaces = Surfaces { local, contactor, target };
        let gather = TargetGather::new(world, &surfaces, positions, self.sight.reach(self.below))?;
        self.gather = Some(gather);
        Ok(())
    }

    /// Takes the gathered facets as the target; `points` are the reference points of all nodes of `foreign` and before.
    pub fn adopt(&mut self, index: &IndexMap, foreign: &[i32], points: &[[f64; D]]) {
        let Some(gather) = &self.gather else { return };
        let numbers = &gather.foreign.numbers;
        let number = |&node: &u32| match (node as usize).checked_sub(index.local_count()) {
            None => node,
            Some(beyond) => {
                let place = foreign.partition_point(|&other| other < numbers[beyond]);
                (index.local_count() + place) as u32
            }
        };
        let nodes = gather.facets.nodes.iter().map(number).collect();
        let facets = TargetFacets { nodes, ..gather.facets.clone() };
        let target = TargetSurface::new(facets, points);
        self.pairing = match self.recalled.take() {
            Some(identities) => Pairing::from_identities(&identities, &target),
            None => self.pairing.renumbered(&self.contact.target, &target),
        };
        self.contact.target = target;
        self.search = None;
    }

    /// Foreign nodes of the gathered facets with their reference points.
    pub fn foreign(&self) -> impl Iterator<Item = (i32, [f64; D])> + '_ {
        let nodes = self.gather.iter().map(|gather| &gather.foreign);
        nodes.flat_map(|nodes| nodes.numbers.iter().copied().zip(nodes.points.iter().copied()))
    }

    /// The name of the facet of each point, which a checkpoint keeps.
    pub fn identities(&self) -> Vec<u64> {
        self.pairing.identities(&self.contact.target)
    }

    /// Remembers the facets of the points: the state is accepted.
    pub fn keep_pairs(&mut self) {
        self.accepted = self.identities();
    }

    /// Gives the points the facets of the last accepted state again, after an attempt that led nowhere: where two facets are
    /// as near, the one that a point had counts, and the iterates of such an attempt may be rounding.
    pub fn take_back(&mut self) {
        self.pairing.take_back(&self.accepted, &self.contact.target);
    }

    /// Gives the points the facets of these names as soon as the target is gathered anew, and forgets all else of them.
    pub fn recall(&mut self, identities: Vec<u64>) {
        self.accepted.clone_from(&identities);
        self.recalled = Some(identities);
    }

    /// Whether names were given since the target was gathered last.
    pub fn recalls(&self) -> bool {
        self.recalled.is_some()
    }

    /// Whether this rank's facets moved so far since the gathering that others may have come near: if no rank says so,
    /// the gathered facets are all that matter.
    pub fn is_stale(&self, position: impl Fn(u32) -> [f64; D]) -> bool {
        let Some(gather) = &self.gather else { return true };
        let [contactor, target] = gather.motion(position);
        !gather.holds([2.0 * contactor.max(target), 0.0])
    }

    /// Couples of facets that may meet, at the displacements of all nodes, those that are paired included.
    pub fn find_couples(&mut self, u: &[f64], outlook: Outlook) {
        let factor = match outlook {
            Outlook::Now => Sight::NEEDED,
            Outlook::Ahead => Sight::AHEAD,
        };
        self.pair(u);
        let radius = 0.5 * factor * self.sight.facet;
        let sides = self.contact.sides();
        let Some(search) = &mut self.search else { return };
        let mut couples = search.candidates(sides, u, radius);
        for (index, facet) in self.contact.surface.facets().iter().enumerate() {
            let paired = facet.points.clone().filter_map(|point| self.pairing.facet(point));
            couples.extend(paired.map(|target| (index as u32, target)));
        }
        let facets = self.contact.surface.facets();
        self.couples = Couples::new(facets.len(), &couples, |contactor, target, nodes| {
            nodes.extend_from_slice(self.contact.surface.facet_nodes(&facets[contactor as usize]));
            nodes.extend_from_slice(self.contact.target.nodes(target));
        });
    }

    /// Looks no deeper from now on than the points of the accepted `state` lie: the first look is as deep as they may,
    /// and dear where most of the points are open.
    pub fn settle(&mut self, state: &ContactState<D>) {
        self.below = self.below.min(state.depth());
        let reach = self.sight.limits(self.below).reach;
        self.search.iter_mut().for_each(|search| search.shorten(reach));
    }

    /// Finds the facet of each point at the displacements of all nodes.
    pub fn pair(&mut self, u: &[f64]) {
        let limits = self.sight.limits(self.below);
        let search = self.search.get_or_insert_with(|| self.contact.search(limits, u));
        self.contact.pair(search, u, &mut self.pairing);
    }

    /// Evaluates the forces; whether a closed pair is not among the couples.
    pub fn add_force(
        &self,
        fields: &ContactFields,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        own: &mut [f64],
        remote: RemoteForce,
    ) -> bool {
        let mut sink = PairForces::<D> { couples: &self.couples, own, remote, missed: false };
        self.contact.evaluate(fields, request, &self.pairing, state, &mut sink);
        sink.missed
    }

    /// Adds the normals of the closed points, by area, to the nodes of both facets.
    pub fn add_normals(&self, state: &ContactState<D>, own: &mut [f64], remote: RemoteForce) {
        let normal = |point: usize| state.current[point].normal * self.contact.surface.reference_area(point);
        self.add_closed(state, normal, own, remote);
    }

    /// Adds one to all entries of the nodes of both facets of each closed point.
    pub fn add_marks(&self, state: &ContactState<D>, own: &mut [f64], remote: RemoteForce) {
        self.add_closed(state, |_| Point::repeat(1.0), own, remote);
    }

    /// Adds a value of each closed point to the nodes of both facets.
    fn add_closed(
        &self,
        state: &ContactState<D>,
        value: impl Fn(usize) -> Point<D>,
        own: &mut [f64],
        remote: RemoteForce,
    ) {
        let mut sink = PairForces::<D> { couples: &self.couples, own, remote, missed: false };
        let surface = &self.contact.surface;
        for (contactor_facet, facet) in surface.facets().iter().enumerate() {
            for point in facet.points.clone().filter(|&point| state.current[point].is_closed()) {
                let Some(target_facet) = self.pairing.facet(point) else { continue };
                let mut nodes = surface.facet_nodes(facet).to_vec();
                nodes.extend_from_slice(self.contact.target.nodes(target_facet));
                let force = value(point).as_slice().repeat(nodes.len());
                let (nodes, force) = (&nodes[..], &force[..]);
                sink.pair(&PairContribution {
                    point,
                    contactor_facet,
                    target_facet,
                    nodes,
                    force,
                    stiffness: None,
                });
            }
        }
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
            couples: &self.couples,
            constrained: opening.constrained,
            values: &mut *opening.values,
            remote: &mut *opening.remote,
            lift: opening.lift.as_mut().map(super::interface::PairLift::reborrow),
            symmetry: opening.symmetry,
        };
        self.contact.evaluate(fields, request, &self.pairing, state, &mut sink);
    }
}
