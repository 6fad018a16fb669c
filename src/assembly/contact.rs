//! The contacts of a rank and their contributions to the system.

use mpi::traits::CommunicatorCollectives;

use super::interface::{Opening, RemoteForce};
use super::pair::{ContactPair, SearchRadii};
use crate::contact::evaluation::{AreaKind, ContactFields, ContactRequest};
use crate::contact::mortar::contact::{CLOSABLE, VertexContact};
use crate::contact::mortar::integrals::NormalOf;
use crate::contact::mortar::surface::VertexSurface;
use crate::contact::normal::PressedSide;
use crate::contact::point::{ContactLaw, Status};
use crate::contact::rigid::{BodyFrame, MotionStep};
use crate::contact::state::{Changes, ContactState, SquaredForceChange};
use crate::contact::surface::{ContactSurface, Ownership};
use crate::contact::target::ContactTarget;
use crate::contact::totals::ContactEnergy;
use crate::dynamics::{OverStep, Sides};
use crate::error::{Error, Result};
use crate::mesh::{Facet, PlaneState};
use crate::model::{self, InitialOverclosure};
use crate::partition::LocalMesh;
use crate::tensor::Vector;

/// A contact of the case on this rank.
pub struct LocalContact<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Both sides and the laws. A vertex is evaluated on the rank that owns its node.
    pub pair: ContactPair<D>,
    /// State and history of its points.
    pub state: ContactState<D>,
    /// Name of the target in the case file.
    pub target_name: String,
    /// Indices of the bodies in this contact, each once.
    pub bodies: Vec<usize>,
    /// Mean size of the contactor's facets \[m\].
    pub facet_size: f64,
    /// Smallest Young's modulus of the elements beneath the facets of both sides \[Pa\], the reference for
    /// penalties.
    pub softer: f64,
    /// Stiffness of an element of the softer side under the mean facet, `E / h` \[Pa/m\]: the largest one of
    /// the springs that represent the contact in the matrix of joined bodies.
    pub beneath: f64,
    /// Requested penetration tolerance \[m\]; `None` if there is no limit.
    pub tolerance: Option<f64>,
    /// Factor by which the contact is stiffer than its law, to meet that tolerance.
    pub stiffening: f64,
}

/// Returns the facets of a named set.
///
/// # Errors
/// If there is no such set. The error lists the existing sets.
pub fn facets_of<'a, const D: usize>(local: &'a LocalMesh<D>, set: &str) -> Result<&'a [Facet]> {
    local.mesh.facet_sets.get(set).map(Vec::as_slice).ok_or_else(|| {
        let known: Vec<&str> = local.mesh.facet_sets.keys().map(String::as_str).collect();
        Error::case(format!("there is no surface '{set}'")).hint(&format!("known: {}", known.join(", ")))
    })
}

/// Properties of a contact that depend on all ranks.
#[derive(Debug, Clone, Copy)]
pub struct Measures {
    /// Mean size of the contactor's facets \[m\].
    pub facet_size: f64,
    /// Smallest Young's modulus of the elements beneath the facets of both sides \[Pa\].
    pub softer: f64,
    /// Lengths of the contact search.
    pub radii: SearchRadii,
}

impl<const D: usize> LocalContact<D> {
    /// Creates the contact of the model on this rank.
    ///
    /// # Errors
    /// If the set or a derived law is invalid.
    pub fn new(contact: &model::ContactModel<D>, measures: &Measures, local: &LocalMesh<D>) -> Result<Self> {
        let ownership = Ownership {
            owned_nodes: local.index.owned,
            mine: &local.mine,
            global_element: &local.input_element,
        };
        let facets = facets_of(local, &contact.contactor)?;
        let law = ContactLaw {
            normal: contact
                .normal
                .completed(&PressedSide { young_modulus: measures.softer, facet_size: measures.facet_size }),
            friction: contact.friction,
            damping: contact.damping,
        };
        let target = contact.target.before_gathering();
        let opposite = contact.target.set().map_or(Ok(&[][..]), |set| facets_of(local, set))?;
        let vertices = VertexContact {
            surface: VertexSurface::new(&local.mesh, facets, &ownership, &target),
            law,
            area: if contact.current_area { AreaKind::Current } else { AreaKind::Reference },
            depth: measures.radii.depth,
            share: if contact.is_with_itself() { 0.5 } else { 1.0 },
            closed: match contact.conserves && contact.initial_overclosure != InitialOverclosure::Conform {
                true => 0.0,
                false => CLOSABLE,
            },
            edge_normal: if contact.keeps_momentum { NormalOf::Contactor } else { NormalOf::Target },
            target,
        };
        let outline = ContactSurface::new(&local.mesh, facets, &ownership);
        Ok(Self {
            name: contact.name.clone(),
            state: ContactState::new(vertices.surface.vertices().len()),
            pair: ContactPair::new(vertices, outline, &local.mesh, opposite, measures.radii),
            target_name: contact.target_name.clone(),
            bodies: contact.all_bodies(),
            facet_size: measures.facet_size,
            softer: measures.softer,
            beneath: measures.softer / measures.facet_size,
            tolerance: None,
            stiffening: 1.0,
        })
    }

    /// State across the plane, in two dimensions.
    pub fn plane(&self) -> PlaneState {
        self.pair.contact.surface.plane()
    }

    /// The facets of the contactor that this rank reports.
    pub fn surface(&self) -> &ContactSurface<D> {
        &self.pair.outline
    }

    /// Local nodes of the vertices, which are the contact points. Each belongs to exactly one rank.
    pub fn vertices(&self) -> &[u32] {
        self.pair.contact.surface.vertices()
    }

    /// For each vertex its number among those of its node, the same on every rank.
    pub fn parts(&self) -> &[u32] {
        self.pair.contact.surface.parts()
    }

    /// Whether the node of a vertex has several vertices, because it is on a sharp edge.
    pub fn is_on_edge(&self, vertex: usize) -> bool {
        let nodes = self.vertices();
        let same = |other: Option<usize>| other.and_then(|other| nodes.get(other)) == Some(&nodes[vertex]);
        same(vertex.checked_sub(1)) || same(Some(vertex + 1))
    }

    /// Whether both sides carry tractions as contactors, so that the forces of a pair enter twice.
    pub fn is_two_sided(&self) -> bool {
        self.pair.contact.share != 1.0
    }

    /// Factor from the area of each point to its area at the local displacements `u` \[m\]. It is 1 if
    /// the tractions act on the current area.
    pub fn area_factors(&self, u: &[f64]) -> Vec<f64> {
        match self.pair.contact.area {
            AreaKind::Current => vec![1.0; self.vertices().len()],
            AreaKind::Reference => self.pair.contact.surface.stretches(u),
        }
    }

    /// The target, with the motion of the step.
    pub fn target(&self) -> &ContactTarget<D> {
        &self.pair.contact.target
    }

    /// Sets the pose of a moving rigid target for a step. `free` are the frames of the free rigid
    /// bodies.
    ///
    /// # Errors
    /// A value of its motion is not finite, at its position in the case.
    pub fn place(&mut self, step: &MotionStep, free: &[BodyFrame<D>]) -> Result<()> {
        self.pair.contact.target.place(step, free)
    }

    /// Largest extent of a facet of either side \[m\]. Over a target without facets, the mean size of the
    /// contactor's facets.
    pub fn largest_facet(&self) -> f64 {
        if self.target().has_facets() { self.pair.facet() } else { self.facet_size }
    }

    /// Normal stiffness at a high pressure (a tenth of the softer modulus), relative to that of the
    /// elements beneath the surface.
    pub fn relative_stiffness(&self) -> f64 {
        let law = self.law().normal;
        let modulus = self.beneath * self.facet_size;
        -law.evaluate(-law.penetration(0.1 * modulus)).derivative / self.beneath
    }

    /// Undeformed position of a point \[m\].
    pub fn reference_point(&self, vertex: usize) -> Vector<D> {
        self.pair.contact.surface.reference_point(vertex)
    }

    /// Number of points of a status on this rank.
    pub fn count(&self, status: Status) -> usize {
        self.state.current.iter().filter(|point| point.status == status).count()
    }

    /// Energies on this rank. Call it before the step of length `dt` \[s\] is accepted.
    pub fn energy(&self, dt: f64) -> ContactEnergy {
        let mut energy = ContactEnergy::default();
        for (point, history) in self.state.current.iter().zip(&self.state.history) {
            energy.stored += point.area * (point.potential + point.recoverable);
            energy.heat_of_step += point.area * history.work_of_step(point, dt);
            energy.damping_of_step += point.area * point.damping_work;
        }
        energy
    }

    /// Calls `add(vertex, node, share)` for the share of the area of each vertex that belongs to a
    /// local node.
    ///
    /// The sum of a value of the vertices times these shares, divided by the sum of the shares, is
    /// the nodal value once all ranks have added theirs. It is the mean, weighted by the node's own
    /// shape function, of the value that is linear between vertices. Values at single vertices
    /// would alternate at the edge of a contact. A node between corners gets the mean of its
    /// neighbours.
    pub fn nodal_shares(&self, mut add: impl FnMut(usize, u32, f64)) {
        let surface = &self.pair.contact.surface;
        for facet in surface.facets() {
            let own = facet.vertices.iter().zip(&facet.shares);
            for (vertex, shares) in own.filter_map(|(vertex, shares)| vertex.map(|vertex| (vertex, shares))) {
                let parents = facet.kind.parents();
                for (&node, parents) in surface.facet_nodes(facet).iter().zip(parents) {
                    let share = parents.iter().map(|&corner| shares[usize::from(corner)]).sum::<f64>()
                        / parents.len() as f64;
                    add(vertex as usize, node, share);
                }
            }
        }
    }

    /// Undeformed positions of all points with their gaps \[m\].
    pub fn gaps(&self) -> Vec<(f64, [f64; D])> {
        let surface = &self.pair.contact.surface;
        let points = self.state.current.iter().enumerate();
        points.map(|(vertex, point)| (point.gap, surface.reference_point(vertex).into())).collect()
    }

    /// Laws of the contact.
    pub fn law(&self) -> &ContactLaw {
        &self.pair.contact.law
    }

    /// Laws of the contact, which may be changed between steps.
    pub fn law_mut(&mut self) -> &mut ContactLaw {
        &mut self.pair.contact.law
    }

    /// Gathers the nearby facets of a deformable target at the current positions of the local nodes
    /// \[m\]. Collective.
    ///
    /// `step` is the motion of the nodes as for `ContactPair::is_stale`. The deepest vertex is
    /// `below` the target \[m\].
    ///
    /// # Errors
    /// All ranks return the same error.
    pub fn gather(
        &mut self,
        world: &impl CommunicatorCollectives,
        local: &LocalMesh<D>,
        positions: &[f64],
        step: (OverStep, impl Fn(u32) -> Vector<D>),
        below: f64,
    ) -> Result<()> {
        self.pair.gather(world, local, positions, step, below)
    }

    /// Adds the contact forces.
    pub fn add_force(
        &mut self,
        fields: &ContactFields,
        request: &ContactRequest,
        own: &mut [f64],
        remote: RemoteForce,
    ) {
        self.pair.add_force(fields, request, &mut self.state, own, remote);
    }

    /// Adds the requested terms of the matrix.
    pub fn add_stiffness(
        &mut self,
        fields: &ContactFields,
        request: &ContactRequest,
        opening: &mut Opening<D>,
    ) {
        self.pair.add_stiffness(fields, request, &mut self.state, opening);
    }

    /// Adds the area-weighted normals of the closed points to the nodes that they couple.
    pub fn add_normals(&self, own: &mut [f64], remote: RemoteForce) {
        self.pair.add_normals(&self.state, own, remote);
    }

    /// Adds one to all entries of the nodes that closed points couple.
    pub fn add_marks(&self, sides: Sides, own: &mut [f64], remote: RemoteForce) {
        self.pair.add_marks(&self.state, sides, own, remote);
    }

    /// Whether tangents of frictionless contact on a fixed area are symmetric.
    ///
    /// They are symmetric over a plane, except for facets at more than 60 degrees to it. Over other
    /// obstacles, the weight of points decreases with their gap. Between bodies, pressures act
    /// along the normals of the contactor, while gaps also change with the slope of the target.
    pub fn is_symmetric(&self) -> bool {
        self.target().free_body().is_none()
            && self.pair.contact.area == AreaKind::Reference
            && self.target().is_plane()
    }

    /// Compares the forces of the points with the frozen ones.
    pub fn force_change(&self) -> SquaredForceChange {
        self.state.force_change()
    }

    /// Records the current points as the new iterate, and counts the changes.
    pub fn iterate(&mut self) -> Changes {
        self.state.iterate()
    }

    /// Discards the iterates of a solve.
    pub fn begin_solve(&mut self) {
        self.state.begin();
    }
}
