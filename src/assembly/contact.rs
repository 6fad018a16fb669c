//! The contacts of a rank, evaluated into the system.

use mpi::traits::CommunicatorCollectives;

use super::interface::{Opening, RemoteForce};
use super::pair::{ContactPair, SearchRadii};
use crate::contact::evaluation::{AreaKind, ContactFields, ContactRequest};
use crate::contact::mortar::contact::VertexContact;
use crate::contact::mortar::obstacle::is_lumped;
use crate::contact::mortar::surface::VertexSurface;
use crate::contact::normal::PressedSide;
use crate::contact::obstacle::Shape;
use crate::contact::point::{ContactLaw, PointState};
use crate::contact::state::{Changes, ContactState, ForceChange};
use crate::contact::surface::{ContactSurface, Ownership};
use crate::contact::target::{ContactTarget, TargetFacets, TargetSurface};
use crate::contact::totals::ContactEnergy;
use crate::contact::zone::ZoneSummary;
use crate::dynamics::FrictionMode;
use crate::error::{Error, Result};
use crate::mesh::Facet;
use crate::model::{self, Target};
use crate::partition::LocalMesh;
use crate::tensor::Vector;

/// One contact of the case on this rank.
pub struct LocalContact<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Both sides and the laws. A vertex is evaluated on the rank that owns its node.
    pub pair: ContactPair<D>,
    /// What its points remember.
    pub state: ContactState<D>,
    /// Indices of the bodies that take part, each once.
    pub bodies: Vec<usize>,
    /// Mean size of the contactor's facets \[m\].
    pub facet_size: f64,
    /// Stiffness of an element of the softer side under the mean facet, `E / h` \[Pa/m\].
    pub beneath: f64,
    /// Penetration that is asked for \[m\]; none where any will do.
    pub tolerance: Option<f64>,
    /// How much stiffer than its law says the contact is, to keep that penetration.
    pub stiffening: f64,
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
    /// How far the contact looks around.
    pub radii: SearchRadii,
}

impl<const D: usize> LocalContact<D> {
    /// The contact of the model on this rank.
    ///
    /// # Errors
    /// When the set or a derived law is no good.
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
                .completed(&PressedSide { young_modulus: contact.softer, facet_size: measures.facet_size }),
            friction: contact.friction,
        };
        let (target, opposite) = match &contact.target {
            Target::Obstacle(shape) => (ContactTarget::Obstacle(shape.clone()), &[][..]),
            Target::Surface { set, .. } => {
                let unknown = TargetSurface::new(TargetFacets::default(), &[]);
                (ContactTarget::Body(unknown), facets_of(local, set)?)
            }
        };
        let lumped = |kind| target.obstacle().is_some_and(|obstacle| is_lumped(obstacle, kind));
        let vertices = VertexContact {
            surface: VertexSurface::new(&local.mesh, facets, &ownership, lumped),
            target,
            law,
            area: if contact.current_area { AreaKind::Current } else { AreaKind::Reference },
            depth: measures.radii.depth,
            share: if contact.is_with_itself() { 0.5 } else { 1.0 },
        };
        let outline = ContactSurface::new(&local.mesh, facets, &ownership);
        Ok(Self {
            name: contact.name.clone(),
            state: ContactState::new(vertices.surface.vertices().len()),
            pair: ContactPair::new(vertices, outline, &local.mesh, opposite, measures.radii),
            bodies: contact.all_bodies(),
            facet_size: measures.facet_size,
            beneath: contact.softer / measures.facet_size,
            tolerance: None,
            stiffening: 1.0,
        })
    }

    /// The facets of the contactor that this rank reports.
    pub fn surface(&self) -> &ContactSurface<D> {
        &self.pair.outline
    }

    /// Local nodes of the vertices, which are the contact points. Each is one rank's.
    pub fn vertices(&self) -> &[u32] {
        self.pair.contact.surface.vertices()
    }

    /// The obstacle, if it is the target.
    pub fn obstacle(&self) -> Option<&dyn Shape<D>> {
        self.pair.contact.target.obstacle()
    }

    /// Largest extent of a facet of either side \[m\]; on an obstacle the mean size of those of the contactor.
    pub fn largest_facet(&self) -> f64 {
        if self.is_deformable() { self.pair.facet() } else { self.facet_size }
    }

    /// Whether the target is deformable.
    pub fn is_deformable(&self) -> bool {
        self.obstacle().is_none()
    }

    /// What this rank reports of the zone; merge it over ranks.
    pub fn summary(&self) -> ZoneSummary<D> {
        let mut summary = ZoneSummary::default();
        for point in &self.state.current {
            summary.add_forces(point);
            summary.count(point);
        }
        summary
    }

    /// Energies on this rank; call it before the step of length `dt` \[s\] is accepted.
    pub fn energy(&self, dt: f64) -> ContactEnergy {
        let mut energy = ContactEnergy::default();
        for (point, history) in self.state.current.iter().zip(&self.state.history) {
            energy.stored += point.area * (point.potential + point.recoverable);
            energy.heat_of_step += point.area * history.work_of_step(point, dt);
        }
        energy
    }

    /// Adds to each local node the area-weighted sum of a value of its vertices, `sum[node * K + k]`, and the weights, `weight[node]`; their
    /// quotient is the nodal value once all ranks have added theirs. What a node gets is the mean, weighted by its own shape function, of
    /// the value that is linear between vertices: values at vertices alone alternate where a contact ends. A node between corners has the
    /// mean of those beside it.
    pub fn gather_nodal<const K: usize>(
        &self,
        value: impl Fn(usize, &PointState<D>) -> [f64; K],
        sum: &mut [f64],
        weight: &mut [f64],
    ) {
        let surface = &self.pair.contact.surface;
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
        let surface = &self.pair.contact.surface;
        let points = self.state.current.iter().enumerate();
        points.map(|(vertex, point)| (point.gap, surface.reference_point(vertex).into())).collect()
    }

    /// Its laws.
    pub fn law(&self) -> &ContactLaw {
        &self.pair.contact.law
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
        &mut self.pair.contact.law
    }

    /// Gathers the facets of a deformable target near by, at the current positions of the local nodes \[m\], with their `step` as for
    /// [`ContactPair::is_stale`]. Collective.
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
        self.pair.gather(world, local, positions, step, &self.state)
    }

    /// Adds the forces.
    pub fn add_force(
        &mut self,
        fields: &ContactFields,
        request: &ContactRequest,
        own: &mut [f64],
        remote: RemoteForce,
    ) {
        self.pair.add_force(fields, request, &mut self.state, own, remote);
    }

    /// Adds the wanted terms of the matrix.
    pub fn add_stiffness(&mut self, fields: &ContactFields, request: &ContactRequest, opening: &mut Opening) {
        self.pair.add_stiffness(fields, request, &mut self.state, opening);
    }

    /// Adds the normals of the closed points, by area, to the nodes that they couple.
    pub fn add_normals(&self, own: &mut [f64], remote: RemoteForce) {
        self.pair.add_normals(&self.state, own, remote);
    }

    /// Adds one to all entries of the nodes that closed points couple.
    pub fn add_marks(&self, own: &mut [f64], remote: RemoteForce) {
        self.pair.add_marks(&self.state, own, remote);
    }

    /// Whether tangents of frictionless contact on a fixed area are symmetric: over a plane, but for facets that stand at more than 60 degrees
    /// to it. Over other obstacles points fade with their gap. Between bodies pressures act along the normals of the contactor, while gaps
    /// change with the slope of the target as well.
    pub fn is_symmetric(&self) -> bool {
        self.pair.contact.area == AreaKind::Reference && self.obstacle().is_some_and(Shape::is_plane)
    }

    /// How the forces of the points differ from the frozen ones.
    pub fn force_change(&self) -> ForceChange {
        self.state.force_change()
    }

    /// Takes the current points as the new iterate.
    pub fn iterate(&mut self) -> Changes {
        self.state.iterate()
    }

    /// Forgets the iterates of a step.
    pub fn begin_step(&mut self) {
        self.state.begin();
    }
}
