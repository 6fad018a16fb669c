//! The discretised bodies without their contacts: mesh, elements, mass and supports.

use std::collections::BTreeSet;
use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::build::{extent, farthest, free_bodies, physics, supports};
use super::contact::LocalContact;
use super::damping::DampingMatrix;
use super::elastic::ElasticSupports;
use super::free_bodies::{FreeBodies, TurnDirection};
use super::holding::Holding;
use super::mass::{MassMatrix, Masses, Supported};
use super::patches::{SolidPatches, patches, pressures};
use super::pattern::pattern_of_elements;
use super::pieces::Pieces;
use super::redistribution::{NodeCounts, Redistribution};
use super::solid::{SolidElements, solids};
use super::supports::Supports;
use super::ties::Ties;
use crate::case::Units;
use crate::collective::Collective;
use crate::dynamics::Stage;
use crate::element::{ElementStress, Inverted, Kinematics, ViscousEnergies, ViscousHistory};
use crate::error::{Error, Result, agree};
use crate::material::{Overstress, PronySeries};
use crate::mesh::spelled;
use crate::model::regions::ElementMaterials;
use crate::model::{Body, Model};
use crate::partition::LocalMesh;
use crate::petsc::{BlockPattern, Session, Vector};
use crate::space::{Held, Prescribed};

/// Name and kinematics of a body.
pub(super) struct NamedBody {
    name: String,
    /// Strain measure of the body.
    pub kinematics: Kinematics,
}

impl NamedBody {
    /// Name in the case file.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// A material of a body with viscous branches.
pub(super) struct ViscousBody {
    /// Number among the viscous bodies.
    pub number: usize,
    /// Index of the body.
    pub body: usize,
    /// Index of the material among those of the body.
    pub material: usize,
    /// Its Prony series.
    pub series: Rc<PronySeries>,
    name: String,
}

impl ViscousBody {
    /// Name of its table in a checkpoint.
    pub fn table(&self) -> String {
        format!("branches of {}", self.name)
    }
}

/// The viscous materials of all bodies of the model.
fn viscous_bodies<const D: usize>(model: &Model<D>) -> Vec<ViscousBody> {
    let mut found: Vec<ViscousBody> = Vec::new();
    for (body, of) in model.bodies.iter().enumerate() {
        for (material, its) in of.materials.iter().enumerate() {
            let Some(series) = its.series.clone() else { continue };
            let name = of.material_name(its).to_owned();
            found.push(ViscousBody { number: found.len(), body, material, series, name });
        }
    }
    found
}

/// Names and kinematics of the bodies of the model.
fn named_bodies<const D: usize>(model: &Model<D>) -> Vec<NamedBody> {
    let named = |body: &Body| NamedBody { name: body.name.clone(), kinematics: body.kinematics() };
    model.bodies.iter().map(named).collect()
}

/// Relative accuracy of coordinates. Surfaces that overlap by less than this part of the extent of
/// all bodies touch exactly.
const ROUNDING: f64 = 1e-12;
/// Accuracy far from the origin, in units of the rounding of the largest coordinate.
const ROUNDINGS: f64 = 8.0;

/// Size and position of all bodies together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// Longest side of the box around all bodies \[m\].
    pub size: f64,
    /// Largest magnitude of coordinates: the size, or the distance from the origin \[m\].
    pub farthest: f64,
}

impl Extent {
    /// Of all bodies on all ranks. Collective.
    pub fn of<const D: usize>(world: &impl CommunicatorCollectives, local: &LocalMesh<D>) -> Self {
        let size = extent(world, local);
        Self { size, farthest: size.max(farthest(world, local)) }
    }

    /// Accuracy to which positions are known \[m\].
    pub fn known_length(&self) -> f64 {
        (ROUNDING * self.size).max(ROUNDINGS * f64::EPSILON * self.farthest)
    }
}

/// The discretised bodies of one rank.
pub struct Bodies<const D: usize> {
    pub(super) session: Rc<Session>,
    /// Units of all numbers, for messages.
    pub(super) units: Units,
    pub(super) local: LocalMesh<D>,
    pub(super) extent: Extent,
    pub(super) solids: Vec<SolidElements<D>>,
    /// Patches of elements with a common pressure.
    pub(super) patches: Vec<SolidPatches<D>>,
    pub(super) supports: Supports<D>,
    /// Foundations, springs and dashpots.
    pub(super) elastic: ElasticSupports<D>,
    /// Ties of surfaces.
    pub(super) ties: Ties<D>,
    pub(super) mass: Option<MassMatrix>,
    /// Damping matrix; `None` without inertia or without damping.
    pub(super) damping: Option<DampingMatrix>,
    /// Damping matrix of joined bodies; `None` if it is `damping`.
    pub(super) joined_damping: Option<DampingMatrix>,
    /// Whether joined bodies have a damping matrix of their own: a damped body is nearly incompressible.
    softens_damping: bool,
    pub(super) redistribution: Option<Redistribution>,
    pub(super) inertia: bool,
    damped: bool,
    materials: ElementMaterials,
    linearises_pressure: bool,
    /// The free rigid bodies.
    pub(super) free: FreeBodies<D>,
    /// The viscous bodies.
    pub(super) viscous: Vec<ViscousBody>,
    /// Whether the branches of viscous bodies follow the motion, because it has started.
    relaxes: bool,
    /// Couplings by elements.
    pub(super) pattern: Rc<BlockPattern>,
    pub(super) names: Vec<NamedBody>,
    pub(super) pieces: Pieces<D>,
    holding: Holding,
}

impl<const D: usize> Bodies<D> {
    /// Discretises the bodies of the model on the rank's part of the mesh. Collective.
    ///
    /// # Errors
    /// If the model does not fit the mesh, the same on all ranks.
    pub(super) fn new(
        session: &Rc<Session>,
        local: LocalMesh<D>,
        model: &Model<D>,
        extent: Extent,
        inertia: bool,
    ) -> Result<Self> {
        let world = session.world();
        let mut supports = supports(world, &local, model)?;
        let free_rigid = FreeBodies::new(session, &local, model, extent.size);
        free_rigid.mark_held(supports.dofs.held.axes_mut());
        let pattern = Rc::new(pattern_of_elements(&local));
        let held = &supports.dofs.held;
        let materials = ElementMaterials::new(&model.bodies, &local.mesh);
        let physics = physics(model);
        let softens_damping = physics.iter().flatten().any(|material| {
            let is_damped = material.damping.is_some_and(|rayleigh| rayleigh.stiffness > 0.0);
            is_damped && material.formulation.is_softened(material.relaxed())
        });
        let solids = agree(world, solids(&local, &physics, materials.indices(), &pattern, held))?;
        let patches = agree(world, patches(&local, &physics, &pattern, held))?;
        let elastic = ElasticSupports::new(
            &model.elastic_supports,
            &free_rigid.nodes(),
            &free_rigid.rotations(),
            &local,
            &pattern,
            held,
            inertia,
        );
        let elastic = agree(world, elastic)?;
        let ties = Ties::new(&local, &model.ties, &pattern, held);
        let redistribution =
            if inertia { Redistribution::new(session, &local, model, &solids)? } else { None };
        let pieces = Pieces::new(world, &local, model);
        let free = free_bodies(world, &local, &pieces, &supports, &elastic);
        let mut bodies = Self {
            session: session.clone(),
            units: model.units,
            local,
            extent,
            solids,
            patches,
            supports,
            elastic,
            ties,
            mass: None,
            damping: None,
            joined_damping: None,
            softens_damping,
            free: free_rigid,
            redistribution,
            inertia,
            viscous: viscous_bodies(model),
            relaxes: false,
            linearises_pressure: physics.iter().flatten().any(|of| of.formulation.linearises_pressure()),
            materials,
            damped: inertia && model.bodies.iter().any(Body::is_damped),
            pattern: pattern.clone(),
            names: named_bodies(model),
            pieces,
            holding: Holding::default(),
        };
        bodies.set_pattern(&pattern)?;
        bodies.holding = Holding::new(free, &bodies.pieces, &bodies.allowed_motions());
        for (body, (motions, words)) in bodies.free.all().iter().zip(bodies.free.free_directions()) {
            let touched = model.contacts.iter().any(|contact| contact.target_name == body.name);
            bodies.holding.add_rigid(&body.name, motions, touched, words);
        }
        Ok(bodies)
    }

    /// Whether Newton's method linearises the pressure of a body, on any rank.
    pub(super) fn linearises_pressure(&self) -> bool {
        self.linearises_pressure
    }

    /// Assembles the matrices of mass and damping with this pattern, to which the solids have been
    /// relocated. Collective.
    pub(super) fn set_pattern(&mut self, pattern: &Rc<BlockPattern>) -> Result<()> {
        let supported = Supported { held: &self.supports.dofs.held, index: &self.local.index };
        let redistribution = self.redistribution.as_ref();
        let masses = Masses { solids: &self.solids, nodes: &self.free.masses() };
        if self.inertia {
            self.mass = Some(MassMatrix::new(&self.session, pattern, &masses, &supported, redistribution)?);
        }
        if self.damped {
            let matrix = |softened| {
                DampingMatrix::new(
                    &self.session,
                    pattern,
                    &self.solids,
                    &self.patches,
                    &supported,
                    redistribution,
                    softened,
                )
            };
            let joined = if self.softens_damping { Some(matrix(true)?) } else { None };
            self.damping = Some(matrix(false)?);
            self.joined_damping = joined;
        }
        Ok(())
    }

    /// The units of all numbers.
    pub fn units(&self) -> Units {
        self.units
    }

    /// The rank's part of the mesh.
    pub fn local(&self) -> &LocalMesh<D> {
        &self.local
    }

    /// The elements of this rank, by body, material and kind.
    pub fn solids(&self) -> &[SolidElements<D>] {
        &self.solids
    }

    /// The prescribed displacements.
    pub fn supports(&self) -> &Supports<D> {
        &self.supports
    }

    /// The displacement boundaries with their unknowns on this rank.
    pub fn boundaries(&self) -> &[Prescribed] {
        &self.supports.dofs.boundaries
    }

    /// The foundations, springs and dashpots.
    pub fn elastic_supports(&self) -> &ElasticSupports<D> {
        &self.elastic
    }

    /// Whether surfaces are tied, on any rank.
    pub fn has_ties(&self) -> bool {
        self.ties.has_pairs()
    }

    /// The ties of surfaces.
    pub fn ties(&self) -> &Ties<D> {
        &self.ties
    }

    /// The held directions of each local node.
    pub fn held(&self) -> &Held<D> {
        &self.supports.dofs.held
    }

    /// How supports hold the bodies.
    pub fn holding(&self) -> &Holding {
        &self.holding
    }

    /// Number of prescribed unknowns on all ranks. Collective.
    pub fn prescribed(&self) -> usize {
        let own = self.held().count(self.local.index.owned) as u64;
        let mut total = 0u64;
        self.session.world().reduce_all(&own, &mut total, SystemOperation::sum());
        total as usize
    }

    /// Number of unknowns on all ranks, including prescribed ones.
    pub fn unknowns(&self) -> usize {
        self.local.index.total as usize * D
    }

    /// Longest side of the box around all bodies \[m\].
    pub fn size(&self) -> f64 {
        self.extent.size
    }

    /// Accuracy to which positions are known \[m\].
    pub fn known_length(&self) -> f64 {
        self.extent.known_length()
    }

    /// Whether the bodies have inertia.
    pub fn is_dynamic(&self) -> bool {
        self.inertia
    }

    /// The materials of the elements of this rank.
    pub fn materials(&self) -> &ElementMaterials {
        &self.materials
    }

    /// Whether a body is damped.
    pub fn is_damped(&self) -> bool {
        self.damped
    }

    /// Mass of each body \[kg\]. Collective.
    pub fn masses(&self) -> Vec<f64> {
        let mut own = vec![0.0; self.names.len()];
        for solid in &self.solids {
            solid.group.mass(|index, mass| {
                if self.local.mine[solid.group.elements()[index] as usize] {
                    own[solid.body] += mass.iter().sum::<f64>();
                }
            });
        }
        let mut masses = vec![0.0; own.len()];
        self.session.world().reduce_all(&own[..], &mut masses[..], SystemOperation::sum());
        masses
    }

    /// Computes the momenta of the nodes, `out = M v` \[N s\]. Returns `false` if the bodies have no
    /// inertia. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn momenta(&self, v: &Vector, out: &mut Vector) -> Result<bool> {
        let Some(mass) = &self.mass else { return Ok(false) };
        mass.multiply(v, out)?;
        Ok(true)
    }

    /// Strain energy of this rank's elements at the local displacements `u` \[J\].
    pub fn strain_energy(&self, u: &[f64]) -> f64 {
        let of_solids: f64 = self.solids.iter().map(|solid| self.strain_energy_of(solid, u)).sum();
        of_solids + self.patches.iter().map(|patches| patches.energy(u)).sum::<f64>()
    }

    /// Strain energy of this rank's elements of a group at the local displacements `u` \[J\], without that of
    /// patches.
    pub(super) fn strain_energy_of(&self, solid: &SolidElements<D>, u: &[f64]) -> f64 {
        let mine = &self.local.mine;
        let base = solid.viscous.as_ref().map_or(0.0, |viscous| viscous.series().base());
        let relaxed = if base == 0.0 { 0.0 } else { base * solid.group.isochoric_energy(u, mine) };
        solid.group.strain_energy(u, mine) + relaxed
    }

    /// Energies of the viscous branches of this rank's elements in the step of `stage`.
    pub fn viscous_energies(&self, stage: &Stage) -> ViscousEnergies {
        let mut out = ViscousEnergies::default();
        for solid in &self.solids {
            let Some(viscous) = &solid.viscous else { continue };
            let (start, end) = (stage.start.u.local(), stage.trial.u.local());
            let found = viscous.energies(&solid.group, stage.elapsed(), [&start, &end], &self.local.mine);
            out.work += found.work;
            out.stored += found.stored;
        }
        out
    }

    /// Passes the stress of each local element at the trial state of `stage` to
    /// `receive(element, stress)`.
    pub fn element_stress(&self, stage: &Stage, mut receive: impl FnMut(usize, &ElementStress)) {
        let u = stage.trial.u.local();
        let pressures = pressures(&self.patches, self.local.mesh.element_count(), &u);
        for solid in &self.solids {
            let elements = solid.group.elements();
            let viscous = solid.viscous.as_ref().and_then(|viscous| viscous.at(stage.elapsed()));
            solid.group.full_stress(&u, viscous.as_deref(), &pressures, |index, stress| {
                receive(elements[index] as usize, stress);
            });
        }
    }

    /// Whether a body has viscous branches.
    pub fn is_viscous(&self) -> bool {
        !self.viscous.is_empty()
    }

    /// The groups of elements with viscous branches, each with its body.
    pub(super) fn viscous_groups(&self) -> impl Iterator<Item = (&SolidElements<D>, &ViscousBody)> {
        let body = |solid: &SolidElements<D>| {
            self.viscous.iter().find(|body| (body.body, body.material) == (solid.body, solid.material))
        };
        self.solids.iter().filter_map(move |solid| Some((solid, body(solid)?)))
    }

    /// Stress of the viscous groups at the last evaluation; `None` without viscous bodies and before the
    /// motion starts.
    pub(super) fn viscous_sources(&self) -> Option<Vec<Rc<Overstress>>> {
        let all = || self.solids.iter().filter_map(|solid| solid.viscous.as_ref()?.source()).collect();
        (self.relaxes && self.is_viscous()).then(all)
    }

    /// Evaluates the bodies with the stress of these viscous groups, until
    /// [`resume_viscous`](Self::resume_viscous).
    pub(super) fn use_viscous(&mut self, sources: Option<&[Rc<Overstress>]>) {
        let groups = self.solids.iter_mut().filter_map(|solid| solid.viscous.as_mut());
        for (number, viscous) in groups.enumerate() {
            viscous.use_source(sources.and_then(|sources| sources.get(number)).cloned());
        }
    }

    /// Restores the histories of the viscous groups.
    pub(super) fn resume_viscous(&mut self, histories: Vec<ViscousHistory>) {
        let groups = self.solids.iter_mut().filter_map(|solid| solid.viscous.as_mut());
        groups.zip(histories).for_each(|(viscous, history)| viscous.resume(history));
        self.relaxes = true;
    }

    /// Memory for the viscous branches of this rank \[bytes\].
    pub(super) fn viscous_bytes(&self) -> usize {
        let bytes = |solid: &SolidElements<D>| Some(solid.viscous.as_ref()?.bytes(&solid.group));
        self.solids.iter().filter_map(bytes).sum()
    }

    /// Prepares the stress of the viscous branches at the trial state of `stage`.
    pub(super) fn prepare_viscous(&mut self, stage: &Stage) {
        for viscous in self.solids.iter_mut().filter_map(|solid| solid.viscous.as_mut()) {
            viscous.prepare(stage.elapsed());
        }
    }

    /// Takes the trial state of `stage` as relaxed, and lets the branches follow the motion from there.
    pub(super) fn begin_viscous(&mut self, stage: &Stage) {
        for solid in &mut self.solids {
            let Some(viscous) = &mut solid.viscous else { continue };
            viscous.begin(&solid.group.isochoric_stress(&stage.trial.u.local()), D);
        }
        self.relaxes = true;
    }

    /// Advances the branches to the trial state of `stage`, which is accepted.
    pub(super) fn advance_viscous(&mut self, stage: &Stage) {
        for solid in &mut self.solids {
            let Some(viscous) = &mut solid.viscous else { continue };
            viscous.advance(&solid.group, stage.elapsed(), &stage.trial.u.local());
        }
    }

    /// Square of a nodal field, weighted by the mass. Without inertia all nodes have equal weight.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn weighted_square(&self, field: &Vector) -> Result<f64> {
        let Some(mass) = &self.mass else { return field.dot(field) };
        let mut weighted = field.like()?;
        mass.multiply(field, &mut weighted)?;
        field.dot(&weighted)
    }

    /// Whether a side of the contact has nodes without mass.
    pub fn is_calm(&self, contact: &LocalContact<D>) -> bool {
        self.redistribution.as_ref().is_some_and(|mass| contact.bodies.iter().any(|&body| mass.has(body)))
    }

    /// Names of the bodies whose mass is redistributed, and of those whose mass cannot be
    /// redistributed as required.
    pub fn redistributed(&self) -> [Vec<String>; 2] {
        let names = |bodies: &BTreeSet<usize>| {
            bodies.iter().map(|&body| self.names[body].name().to_owned()).collect()
        };
        self.redistribution.as_ref().map_or_else(Default::default, |mass| mass.bodies().each_ref().map(names))
    }

    /// The bodies most of whose nodes have no mass, with the numbers of their nodes.
    pub fn mostly_massless(&self) -> Vec<(&str, NodeCounts)> {
        let counts = self.redistribution.iter().flat_map(Redistribution::counts);
        let most = counts.filter(|(_, counts)| counts.are_mostly_massless());
        most.map(|(&body, &counts)| (self.names[body].name(), counts)).collect()
    }

    /// Gives the nodes without mass the mean velocity of the step and zero acceleration.
    /// Collective.
    ///
    /// Without inertia, rates that a scheme derives for them would oscillate from step to step.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn calm_massless(&self, stage: &mut Stage) -> Result<()> {
        let Some(mass) = self.mass.as_ref().filter(|mass| stage.inertia && mass.is_partial()) else {
            return Ok(());
        };
        {
            let (start, end) = (stage.start.u.owned(), stage.trial.u.owned());
            let (mut v, mut a) = (stage.trial.v.owned_mut(), stage.trial.a.owned_mut());
            for &node in mass.massless() {
                let node = node as usize;
                let first = node * D;
                let mean = std::array::from_fn(|i| (end[first + i] - start[first + i]) / stage.dt);
                self.held().replace_free(node, &mut v[first..first + D], &mean);
                self.held().replace_free(node, &mut a[first..first + D], &[0.0; D]);
            }
        }
        stage.trial.v.update_ghosts()?;
        stage.trial.a.update_ghosts()
    }

    /// Sets the nodes without mass to zero. They have no acceleration of their own, and their
    /// forces balance at every instant, independent of earlier ones.
    pub fn rest_massless(&self, rhs: &mut Vector) {
        let Some(mass) = &self.mass else { return };
        let mut rhs = rhs.owned_mut();
        for &node in mass.massless() {
            rhs[node as usize * D..][..D].fill(0.0);
        }
    }

    /// Stores the rotations of free rigid bodies at the end of an accepted step. Collective.
    pub(super) fn accept_rigid(&mut self, stage: &Stage) {
        let session = Rc::clone(&self.session);
        self.free.turn(&session, stage, TurnDirection::Forwards);
    }

    /// Whether the scheme `conserving` accepts all bodies: none is viscoelastic, a free rigid body or a body
    /// of revolution.
    pub fn may_conserve(&self) -> bool {
        self.free.is_empty() && self.viscous.is_empty() && !self.local.mesh.plane.is_revolved()
    }

    /// Masses of the free rigid bodies \[kg\], in the order of their indices; 0 if it is completely
    /// prescribed or has no mass.
    pub fn rigid_masses(&self) -> Vec<f64> {
        self.free.mass_of_each()
    }

    /// Rotation nodes of the free rigid bodies on this rank.
    pub fn rotation_nodes(&self) -> impl Iterator<Item = usize> + '_ {
        self.free.rotation_nodes()
    }

    /// Number of nodes of free rigid bodies, which are not nodes of the mesh.
    pub fn rigid_nodes(&self) -> u64 {
        2 * self.free.all().len() as u64
    }

    /// Calls `receive(node, angular)` for each rotation node of a free rigid body on this rank, whose
    /// nodal momentum in `momenta` is not linear. `angular` is the angular momentum of its rotation
    /// [N m s].
    pub fn spins(&self, stage: &Stage, momenta: &[f64], receive: impl FnMut(usize, [f64; 3])) {
        self.free.spins(stage, momenta, receive);
    }

    /// Describes the inverted or overstretched element: number, position, determinant.
    pub(super) fn describe(&self, inverted: &Inverted) -> Error {
        let centre = self.local.mesh.element_centre(inverted.element as usize);
        let number = self.local.input_element[inverted.element as usize];
        let fault = if inverted.det > 0.0 {
            "is stretched beyond the limit of its material".to_owned()
        } else {
            format!("is inverted (det F = {:.3e})", inverted.det)
        };
        Error::guard(format!("element {number} at {} {} {fault}", spelled(&centre), self.units.of("m")))
    }
}
