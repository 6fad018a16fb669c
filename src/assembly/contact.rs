//! Contacts of a rank: surfaces with the places of their entries, evaluated into the system.

use mpi::traits::CommunicatorCollectives;

use super::interface::{Couples, Opening, RemoteForce};
use super::scatter::{ForceSink, LiftTarget, MatrixSink, ScatterMap};
use super::segments::{Outlook, SearchRadii, SegmentMeeting};
use crate::contact::evaluation::{AreaKind, ContactFields, ContactRequest};
use crate::contact::mortar::contact::SegmentContact;
use crate::contact::mortar::surface::VertexSurface;
use crate::contact::obstacle::Obstacle;
use crate::contact::point::{ContactLaw, PointState};
use crate::contact::rigid::{ContactSink, RigidContact};
use crate::contact::state::{Changes, ContactState, ForceChange};
use crate::contact::surface::{ContactSurface, Ownership, Quadrature};
use crate::contact::target::{TargetFacets, TargetSurface};
use crate::contact::totals::ContactEnergy;
use crate::contact::zone::ZoneSummary;
use crate::dynamics::FrictionMode;
use crate::element::ElementSink;
use crate::error::{Error, Result};
use crate::mesh::Facet;
use crate::model::{self, Target};
use crate::partition::{IndexMap, LocalMesh};
use crate::petsc::{BlockPattern, BlockValues};
use crate::tensor::Vector;

/// One contact of the case on this rank.
pub struct Contact<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Surface, target, laws.
    pub pair: Pair<D>,
    /// What its points remember.
    pub state: ContactState<D>,
    /// Bodies of contactor and target; twice the same where an obstacle is the target.
    pub bodies: [usize; 2],
    /// Mean size of the contactor's facets \[m\].
    pub facet_size: f64,
    /// Stiffness of an element of the softer side under the mean facet, `E / h` \[Pa/m\].
    pub beneath: f64,
    /// Penetration that is asked for \[m\]; none where any will do.
    pub tolerance: Option<f64>,
    /// How much stiffer than its law says the contact is, to keep that penetration.
    pub stiffening: f64,
}

/// A contactor with its target.
pub enum Pair<const D: usize> {
    /// An obstacle: every rank evaluates the facets that touch its nodes.
    Rigid {
        /// Surface, obstacle, laws.
        contact: Box<RigidContact<D>>,
        /// Where the entries of the facets go.
        maps: FacetMaps,
    },
    /// Another body, by mortar segments: a vertex is evaluated on the rank that owns its node.
    Segments(Box<SegmentMeeting<D>>),
}

/// Facets may differ in kind: one map for each number of nodes.
pub struct FacetMaps {
    maps: Vec<ScatterMap>,
    /// Map and piece of each facet.
    places: Vec<(usize, usize)>,
}

/// Where contacts are resolved.
pub struct Place<'a, const D: usize> {
    /// The rank's mesh.
    pub local: &'a LocalMesh<D>,
    /// Pattern of the matrix.
    pub pattern: &'a BlockPattern,
    /// Prescribed unknowns.
    pub constrained: &'a [bool],
}

fn flat<const D: usize>(contact: &model::Contact<D>) -> bool {
    matches!(contact.target, Target::Obstacle(Obstacle::Plane(_)))
}

/// Facets of a named set.
///
/// # Errors
/// When there is no such set, with the names of those there are.
pub fn facets_of<'a, const D: usize>(local: &'a LocalMesh<D>, set: &str) -> Result<&'a [Facet]> {
    local.mesh.facet_sets.get(set).map(Vec::as_slice).ok_or_else(|| {
        let known: Vec<&str> = local.mesh.facet_sets.keys().map(String::as_str).collect();
        Error::case(format!("there is no surface '{set}'")).hint(&format!("known: {}", known.join(", ")))
    })
}

/// What a contact needs to know of all ranks.
#[derive(Debug, Clone, Copy)]
pub struct Measures {
    /// Mean size of the contactor's facets \[m\].
    pub facet_size: f64,
    /// Every facet of the contactor has a rule of points at its nodes.
    pub nodal: bool,
    /// How far the contact looks around.
    pub radii: SearchRadii,
}

impl<const D: usize> Contact<D> {
    /// The contact of the model on this rank.
    ///
    /// # Errors
    /// When the set, the quadrature or a derived law is no good.
    pub fn new(contact: &model::Contact<D>, measures: &Measures, place: &Place<D>) -> Result<Self> {
        let local = place.local;
        let ownership = Ownership {
            owned_nodes: local.index.owned,
            mine: &local.mine,
            global_element: &local.input_element,
        };
        let quadrature = match contact.quadrature {
            model::Quadrature::Nodal => Quadrature::Nodal,
            model::Quadrature::Auto if flat(contact) && measures.nodal => Quadrature::Nodal,
            model::Quadrature::Gauss | model::Quadrature::Auto => Quadrature::Gauss,
        };
        let facets = facets_of(local, &contact.contactor)?;
        let law = ContactLaw {
            normal: contact.normal.law(contact.softer, measures.facet_size)?,
            friction: contact.friction,
        };
        let area = if contact.current_area { AreaKind::Current } else { AreaKind::Reference };
        let pair = match &contact.target {
            Target::Obstacle(obstacle) => {
                let surface = ContactSurface::new(&local.mesh, facets, &ownership, quadrature)?;
                let maps = FacetMaps::new(&surface, place);
                Pair::Rigid {
                    contact: Box::new(RigidContact { surface, obstacle: *obstacle, law, area }),
                    maps,
                }
            }
            Target::Surface { set, .. } => {
                let outline = ContactSurface::of_mine(&local.mesh, facets, &ownership)?;
                let contact = SegmentContact {
                    surface: VertexSurface::new(&local.mesh, facets, &ownership),
                    target: TargetSurface::new(TargetFacets::default(), &[]),
                    law,
                    area,
                    depth: measures.radii.depth,
                    share: if contact.is_with_itself() { 0.5 } else { 1.0 },
                };
                let target = facets_of(local, set)?;
                Pair::Segments(Box::new(SegmentMeeting::new(
                    contact,
                    outline,
                    &local.mesh,
                    target,
                    measures.radii,
                )))
            }
        };
        let mut contact = Self {
            name: contact.name.clone(),
            pair,
            state: ContactState::new(0),
            bodies: match &contact.target {
                Target::Obstacle(_) => [contact.body; 2],
                Target::Surface { body, .. } => [contact.body, *body],
            },
            facet_size: measures.facet_size,
            beneath: contact.softer / measures.facet_size,
            tolerance: None,
            stiffening: 1.0,
        };
        contact.state = ContactState::new(contact.point_count());
        Ok(contact)
    }

    /// The contactor: its facets on this rank. Contact points are theirs, except when they are vertices of segments.
    pub fn surface(&self) -> &ContactSurface<D> {
        match &self.pair {
            Pair::Rigid { contact, .. } => &contact.surface,
            Pair::Segments(meeting) => &meeting.outline,
        }
    }

    /// Local nodes of the vertices, when the points of this contact are vertices of segments.
    pub fn vertices(&self) -> Option<&[u32]> {
        match &self.pair {
            Pair::Segments(meeting) => Some(meeting.contact.surface.vertices()),
            _ => None,
        }
    }

    /// Number of contact points on this rank.
    pub fn point_count(&self) -> usize {
        match &self.pair {
            Pair::Segments(meeting) => meeting.contact.surface.vertices().len(),
            _ => self.surface().point_count(),
        }
    }

    /// The contact points that this rank reports, each of which is some rank's once.
    pub fn reported_points(&self) -> impl Iterator<Item = usize> + '_ {
        let vertices = match &self.pair {
            Pair::Segments(_) => 0..self.point_count(),
            _ => 0..0,
        };
        let facets = match &self.pair {
            Pair::Segments(_) => &[][..],
            _ => self.surface().facets(),
        };
        vertices.chain(facets.iter().filter(|facet| facet.mine).flat_map(|facet| facet.points.clone()))
    }

    /// Local nodes of the facet of a contact point, or the node of a vertex.
    pub fn nodes_of_point(&self, point: usize) -> &[u32] {
        if let Pair::Segments(meeting) = &self.pair {
            return &meeting.contact.surface.vertices()[point..point + 1];
        }
        let surface = self.surface();
        let after = surface.facets().partition_point(|facet| facet.points.end <= point);
        surface.facets().get(after).map_or(&[], |facet| surface.facet_nodes(facet))
    }

    /// Largest extent of a facet of either side \[m\]; on an obstacle the mean size of those of the contactor.
    pub fn largest_facet(&self) -> f64 {
        match &self.pair {
            Pair::Rigid { .. } => self.facet_size,
            Pair::Segments(meeting) => meeting.facet(),
        }
    }

    /// Facets of a deformable target in this rank's share of the mesh.
    pub fn target_facets(&self) -> &[Facet] {
        match &self.pair {
            Pair::Rigid { .. } => &[],
            Pair::Segments(meeting) => meeting.target_facets(),
        }
    }

    /// Whether the target is deformable.
    pub fn is_deformable(&self) -> bool {
        !matches!(self.pair, Pair::Rigid { .. })
    }

    /// What this rank reports of the zone; merge it over ranks.
    pub fn summary(&self) -> ZoneSummary<D> {
        let Pair::Segments(_) = &self.pair else { return self.surface().summary(&self.state) };
        let mut summary = ZoneSummary::default();
        for point in &self.state.current {
            summary.add_forces(point);
            summary.count(point);
        }
        summary
    }

    /// Energies on this rank; call it before the step of length `dt` \[s\] is accepted.
    pub fn energy(&self, dt: f64) -> ContactEnergy {
        let Pair::Segments(_) = &self.pair else { return self.surface().energy(&self.state, dt) };
        let mut energy = ContactEnergy::default();
        for (point, history) in self.state.current.iter().zip(&self.state.history) {
            energy.stored += point.area * (point.potential + point.recoverable);
            energy.heat_of_step += point.area * history.work_of_step(point, dt);
        }
        energy
    }

    /// Adds to each local node the area-weighted sum of a value of its points and the weights, see
    /// [`ContactSurface::gather_nodal`]. What a node gets from vertices is the mean, weighted by its own shape function, of the value
    /// that is linear between them: values at vertices alone alternate where a contact ends. A node between corners has the mean of those
    /// beside it.
    pub fn gather_nodal<const K: usize>(
        &self,
        value: impl Fn(usize, &PointState<D>) -> [f64; K],
        (sum, weight): (&mut [f64], &mut [f64]),
    ) {
        let Pair::Segments(meeting) = &self.pair else {
            return self.surface().gather_nodal(&self.state, value, (sum, weight));
        };
        let surface = &meeting.contact.surface;
        for facet in surface.facets() {
            let own = facet.vertices.iter().zip(&facet.shares);
            for (vertex, shares) in own.filter_map(|(vertex, shares)| vertex.map(|vertex| (vertex, shares))) {
                let values = value(vertex as usize, &self.state.current[vertex as usize]);
                let parents = facet.kind.parents();
                for (&node, parents) in surface.facet_nodes(facet).iter().zip(parents) {
                    let share = parents.iter().map(|&corner| shares[usize::from(corner)]).sum::<f64>()
                        / parents.len() as f64;
                    weight[node as usize] += share;
                    let sums = &mut sum[node as usize * K..][..K];
                    sums.iter_mut().zip(values).for_each(|(s, v)| *s += share * v);
                }
            }
        }
    }

    /// Undeformed places of all points with their gaps \[m\].
    pub fn gaps(&self) -> Vec<(f64, [f64; D])> {
        if let Pair::Segments(meeting) = &self.pair {
            let surface = &meeting.contact.surface;
            let gap = |(vertex, point): (usize, &PointState<D>)| {
                (point.gap, surface.reference_point(vertex).into())
            };
            return self.state.current.iter().enumerate().map(gap).collect();
        }
        let surface = self.surface();
        let gaps = surface.facets().iter().flat_map(|facet| {
            let nodes = surface.reference_points(facet);
            facet.points.clone().enumerate().map(move |(q, point)| {
                let place = surface.facet_point(facet, q).position(nodes);
                (self.state.current[point].gap, place.into())
            })
        });
        gaps.collect()
    }

    /// Its laws.
    pub fn law(&self) -> &ContactLaw {
        match &self.pair {
            Pair::Rigid { contact, .. } => &contact.law,
            Pair::Segments(meeting) => &meeting.contact.law,
        }
    }

    /// Stiffness of the springs that stand for it in the matrix of joined bodies, at most \[Pa/m\]. What slides freely has
    /// softer ones: multigrid that joins nodes across them ties sliding as well.
    pub fn joint(&self, friction: FrictionMode) -> f64 {
        const SLIDING: f64 = 0.2;
        let sticks = friction == FrictionMode::AsGiven && self.law().friction.is_some();
        if sticks { self.beneath } else { SLIDING * self.beneath }
    }

    /// Its laws, to be changed between steps.
    pub fn law_mut(&mut self) -> &mut ContactLaw {
        match &mut self.pair {
            Pair::Rigid { contact, .. } => &mut contact.law,
            Pair::Segments(meeting) => &mut meeting.contact.law,
        }
    }

    /// Area on which its tractions act.
    pub fn area(&self) -> AreaKind {
        match &self.pair {
            Pair::Rigid { contact, .. } => contact.area,
            Pair::Segments(meeting) => meeting.contact.area,
        }
    }

    /// Motion that no point can pass through the target by, or by a round obstacle \[m\]; a plane has no other side.
    pub fn stride(&self) -> f64 {
        match &self.pair {
            Pair::Segments(meeting) => meeting.stride(),
            Pair::Rigid { contact, .. } if matches!(contact.obstacle, Obstacle::Plane(_)) => f64::INFINITY,
            Pair::Rigid { .. } => 0.5 * self.facet_size,
        }
    }

    /// Distance up to which gaps are known \[m\].
    pub fn reach(&self) -> f64 {
        match &self.pair {
            Pair::Rigid { .. } => f64::MAX,
            Pair::Segments(meeting) => meeting.reach(),
        }
    }

    /// Gathers the facets of a deformable target near by, at the current positions of the local nodes \[m\], with their `step` as for
    /// [`is_stale`](Self::is_stale). Collective.
    ///
    /// # Errors
    /// The same on all ranks.
    pub fn gather(
        &mut self,
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        positions: &[f64],
        step: impl Fn(u32) -> Vector<D>,
    ) -> Result<()> {
        match &mut self.pair {
            Pair::Rigid { .. } => Ok(()),
            Pair::Segments(meeting) => meeting.gather(world, local, positions, step, &self.state),
        }
    }

    /// Nodes of the gathered facets that this rank does not hold, with their reference points.
    pub fn foreign(&self) -> Vec<(i32, [f64; D])> {
        match &self.pair {
            Pair::Rigid { .. } => Vec::new(),
            Pair::Segments(meeting) => meeting.foreign().collect(),
        }
    }

    /// Takes the gathered facets as the target; `points` are the reference points of all nodes of `foreign` and before.
    pub fn adopt(&mut self, index: &IndexMap, foreign: &[i32], points: &[[f64; D]]) {
        match &mut self.pair {
            Pair::Rigid { .. } => {}
            Pair::Segments(meeting) => meeting.adopt(index, foreign, points),
        }
    }

    /// Whether this rank's facets moved so far since the gathering that others may have come near.
    ///
    /// `position` and `step` of a local node: where it is \[m\], and how far it moves from the start of the step to its middle if forces
    /// act over the step, else zero \[m\].
    pub fn is_stale(&self, position: impl Fn(u32) -> [f64; D], step: impl Fn(u32) -> Vector<D>) -> bool {
        match &self.pair {
            Pair::Rigid { .. } => false,
            Pair::Segments(meeting) => meeting.is_stale(position, step),
        }
    }

    /// Finds the nodes that are coupled, at the displacements of all nodes.
    pub fn find_couples(&mut self, u: &[f64], outlook: Outlook) {
        match &mut self.pair {
            Pair::Rigid { .. } => {}
            Pair::Segments(meeting) => meeting.find_couples(u, outlook),
        }
    }

    /// Nodes that are coupled beyond the rank's own mesh.
    pub fn couples(&self) -> Option<&Couples> {
        match &self.pair {
            Pair::Rigid { .. } => None,
            Pair::Segments(meeting) => Some(&meeting.cliques),
        }
    }

    /// Mutable access to [`couples`](Self::couples).
    pub fn couples_mut(&mut self) -> Option<&mut Couples> {
        match &mut self.pair {
            Pair::Rigid { .. } => None,
            Pair::Segments(meeting) => Some(&mut meeting.cliques),
        }
    }

    /// Adds the forces of a contact with a deformable target.
    pub fn add_pair_force(
        &mut self,
        fields: &ContactFields,
        request: &ContactRequest,
        own: &mut [f64],
        remote: RemoteForce,
    ) {
        if let Pair::Segments(meeting) = &self.pair {
            meeting.add_force(fields, request, &mut self.state, own, remote);
        }
    }

    /// Adds the wanted terms of a contact with a deformable target.
    pub fn add_pair_stiffness(
        &mut self,
        fields: &ContactFields,
        request: &ContactRequest,
        opening: &mut Opening,
    ) {
        match &self.pair {
            Pair::Rigid { .. } => {}
            Pair::Segments(meeting) => meeting.add_stiffness(fields, request, &mut self.state, opening),
        }
    }

    /// Adds the normals of the closed points, by area, to the nodes on both sides of a contact with a deformable target.
    pub fn add_normals(&self, own: &mut [f64], remote: RemoteForce) {
        match &self.pair {
            Pair::Rigid { .. } => {}
            Pair::Segments(meeting) => meeting.add_normals(&self.state, own, remote),
        }
    }

    /// Adds one to all entries of the nodes on both sides of closed points of a contact with a deformable target.
    pub fn add_marks(&self, own: &mut [f64], remote: RemoteForce) {
        match &self.pair {
            Pair::Rigid { .. } => {}
            Pair::Segments(meeting) => meeting.add_marks(&self.state, own, remote),
        }
    }

    /// Whether tangents of frictionless contact on a fixed area are symmetric: not those of segments, whose pressures act along the
    /// normals of the contactor while gaps change with the target's slope as well.
    pub fn is_symmetric(&self) -> bool {
        !matches!(self.pair, Pair::Segments(_)) && self.area() == AreaKind::Reference
    }

    /// Adds the forces of a contact with an obstacle to the owned rows of `force` \[N\].
    pub fn add_force(&mut self, fields: &ContactFields, request: &ContactRequest, force: &mut [f64]) {
        if let Pair::Rigid { contact, maps } = &self.pair {
            contact.evaluate(fields, request, &mut self.state, &mut Forces::<D> { maps, force });
        }
    }

    /// Adds the wanted terms of a contact with an obstacle to the matrix.
    pub fn add_stiffness(
        &mut self,
        fields: &ContactFields,
        request: &ContactRequest,
        constrained: &[bool],
        values: &mut BlockValues,
        lift: Option<LiftTarget>,
    ) {
        if let Pair::Rigid { contact, maps } = &self.pair {
            let mut sink = Stiffness::<D> { maps, constrained, values, lift };
            contact.evaluate(fields, request, &mut self.state, &mut sink);
        }
    }

    /// Looks the places of all entries up in another pattern; those of couples are the interface's to find.
    pub fn relocate(&mut self, pattern: &BlockPattern, index: &IndexMap) {
        if let Pair::Rigid { maps, .. } = &mut self.pair {
            maps.maps.iter_mut().for_each(|map| map.relocate(pattern, index));
        }
    }

    /// How the forces of the facets that this rank reports differ from the frozen ones.
    pub fn force_change(&self) -> ForceChange {
        let mut sum = ForceChange::default();
        for point in self.reported_points() {
            sum += self.state.force_change(point..point + 1);
        }
        sum
    }

    /// Takes the current points as the new iterate.
    pub fn iterate(&mut self) -> Changes {
        match &self.pair {
            Pair::Rigid { contact, .. } => self.state.iterate(|p| contact.surface.representative()[p]),
            Pair::Segments(_) => self.state.iterate(|_| true),
        }
    }

    /// Forgets the iterates of a step.
    pub fn begin_step(&mut self) {
        self.state.begin();
    }
}

impl FacetMaps {
    fn new<const D: usize>(surface: &ContactSurface<D>, place: &Place<D>) -> Self {
        let width = |facet: &_| surface.facet_nodes(facet).len();
        let mut widths: Vec<usize> = surface.facets().iter().map(width).collect();
        widths.sort_unstable();
        widths.dedup();
        let mut pieces = vec![Vec::new(); widths.len()];
        let mut places = Vec::with_capacity(surface.facets().len());
        for facet in surface.facets() {
            let map = widths.iter().position(|&w| w == width(facet)).unwrap_or(0);
            places.push((map, pieces[map].len() / widths[map]));
            pieces[map].extend_from_slice(surface.facet_nodes(facet));
        }
        let map = |(&width, nodes)| {
            ScatterMap::new::<D>(width, nodes, place.pattern, &place.local.index, place.constrained)
        };
        Self { maps: widths.iter().zip(pieces).map(map).collect(), places }
    }

    fn get(&self, facet: usize) -> (&ScatterMap, usize) {
        let (map, piece) = self.places[facet];
        (&self.maps[map], piece)
    }
}

struct Forces<'a, const D: usize> {
    maps: &'a FacetMaps,
    force: &'a mut [f64],
}

impl<const D: usize> ContactSink for Forces<'_, D> {
    fn facet(&mut self, index: usize, _: &[u32], force: &[f64], _: Option<&[f64]>) {
        let (map, piece) = self.maps.get(index);
        ForceSink::<D> { map, force: &mut *self.force }.element(piece, force, None);
    }
}

struct Stiffness<'a, 'm, const D: usize> {
    maps: &'a FacetMaps,
    constrained: &'a [bool],
    values: &'a mut BlockValues<'m>,
    lift: Option<LiftTarget<'a>>,
}

impl<const D: usize> ContactSink for Stiffness<'_, '_, D> {
    fn facet(&mut self, index: usize, _: &[u32], force: &[f64], stiffness: Option<&[f64]>) {
        let (map, piece) = self.maps.get(index);
        let lift = self.lift.as_mut().map(LiftTarget::reborrow);
        let mut sink = MatrixSink::<D> {
            map,
            constrained: self.constrained,
            values: &mut *self.values,
            lift,
            scratch: Vec::new(),
        };
        sink.element(piece, force, stiffness);
    }
}
