//! The discretised bodies of one rank: contents, construction, and the end of a step.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::bodies::{NamedBody, named_bodies};
use super::build::{contacts, extent, farthest, free_bodies, loads, middle_of, physics, supports, unit};
use super::contact::LocalContact;
use super::contact_forces::add_contact_forces;
use super::external::{External, Moment};
use super::holding::Holding;
use super::interface::Interface;
use super::mass::{MassMatrix, Supported};
use super::pattern::pattern_of_elements;
use super::phases::Phases;
use super::pieces::Pieces;
use super::redistribution::Redistribution;
use super::rigid::RigidBodies;
use super::solid::{SolidElements, solids};
use super::start::{Overclosure, known_length, resolve_overclosure, resolve_overclosure_of_points};
use super::supports::Supports;
use crate::case::Units;
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::point::ContactLaw;
use crate::contact::state::{Changes, Hold};
use crate::dynamics::{Continuation, MatrixSource, OverStep, SearchSource, Split, Stage};
use crate::element::Inverted;
use crate::error::{Error, Result, agree};
use crate::model::{Model, RigidModel};
use crate::partition::LocalMesh;
use crate::petsc::{BlockPattern, Format, Matrix, Session, Vector};

/// Options for the construction of a system.
#[derive(Debug, Clone, Copy)]
pub struct SystemOptions {
    /// Whether to include inertia.
    pub inertia: bool,
    /// Format of the matrix.
    pub format: Format,
}

/// Forces on the owned unknowns, by origin \[N\].
#[derive(Default)]
pub(super) struct ForceParts {
    pub internal: Vec<f64>,
    pub contact: Vec<f64>,
    pub external: Vec<f64>,
}

/// The discretised bodies with their contacts, supports and loads: `M`, `Q(q)`, `F_ext`, `F_n`,
/// `F_T`.
pub struct ContactSystem<const D: usize> {
    /// Units of all numbers, for messages.
    pub(super) units: Units,
    pub(super) session: Rc<Session>,
    pub(super) local: LocalMesh<D>,
    pub(super) solids: Vec<SolidElements<D>>,
    pub(super) contacts: Vec<LocalContact<D>>,
    pub(super) supports: Supports<D>,
    pub(super) external: External<D>,
    pub(super) mass: Option<MassMatrix>,
    pub(super) redistribution: Option<Redistribution>,
    pub(super) parts: ForceParts,
    /// `Q - F_ext - F_n - F_T` at the last trial state \[N\].
    pub(super) forces: Vector,
    /// `M a` at the last trial state \[N\].
    pub(super) inertia: Vector,
    overclosures: Vec<Overclosure<D>>,
    /// Couplings by elements only.
    pub(super) elements: Rc<BlockPattern>,
    /// Data that deformable contacts share.
    pub(super) interface: Option<Interface<D>>,
    /// Whether the matrix has the rigid-body modes.
    pub(super) has_modes: bool,
    pub(super) matrix: Matrix,
    /// Source of the matrix; `None` before the first assembly.
    pub(super) matrix_source: Option<Rc<MatrixSource>>,
    /// Source of the last search of the contacts.
    pub(super) search: Option<Rc<SearchSource>>,
    /// Source of the search from which the pattern of the matrix was built.
    pub(super) pattern_search: Option<Rc<SearchSource>>,
    pub(super) work: Vector,
    /// How the equations differ from those of the scene at present.
    pub(super) continuation: Continuation,
    /// Which quantities a staggered solve currently holds fixed.
    pub(super) split: Split,
    pub(super) fault: Option<Inverted>,
    /// A prescribed value that is not finite. It is reported with the next residual, which is
    /// collective.
    pub(super) trouble: Option<Error>,
    pub(super) changes: Changes,
    /// Extent of all bodies \[m\].
    pub(super) size: f64,
    /// Largest magnitude of coordinates: the extent, or the distance from the origin \[m\].
    pub(super) extent: f64,
    /// Whether the matrix of forces that conserve over a step is symmetric: everything is linear,
    /// and targets are flat.
    pub(super) symmetric_steps: bool,
    holding: Holding,
    /// Rigid bodies that move.
    pub(super) tools: Vec<RigidModel<D>>,
    /// Load factor of the last evaluated state.
    pub(super) factor: f64,
    pub(super) bodies: Vec<NamedBody>,
    pub(super) pieces: Pieces<D>,
    /// Stiffness in the unit rows of prescribed unknowns \[N/m\].
    pub(super) unit: f64,
    pub(super) phases: Phases,
}

impl<const D: usize> ContactSystem<D> {
    /// Builds all parts of the model on the rank's part of the mesh. Collective.
    ///
    /// # Errors
    /// If the model does not fit the mesh, the same on all ranks.
    pub fn new(
        session: &Rc<Session>,
        mut local: LocalMesh<D>,
        model: &Model<D>,
        options: SystemOptions,
    ) -> Result<Self> {
        let world = session.world();
        let extent = extent(world, &local);
        let span = extent.max(farthest(world, &local));
        let known = known_length(extent, span);
        let mut overclosures = Vec::with_capacity(model.contacts.len());
        let middle = middle_of(world, &local);
        let anchored: Vec<_> = model.contacts.iter().map(|contact| contact.anchored(&middle)).collect();
        for contact in &anchored {
            if let Some(obstacle) = contact.target.obstacle() {
                overclosures.push(resolve_overclosure(
                    world,
                    &mut local,
                    contact,
                    model.units,
                    obstacle,
                    known,
                )?);
            }
        }
        let supports = agree(world, supports(&local, model))?;
        let pattern = Rc::new(pattern_of_elements(&local));
        let constrained = &supports.dofs.constrained;
        let solids = agree(world, solids(&local, &physics(model), &pattern, constrained))?;
        let mut contacts = contacts(world, &local, &anchored)?;
        contacts.iter_mut().for_each(|contact| contact.state.round_gaps(known));
        let external = agree(world, loads(&local, model, &pattern, constrained))?;
        let redistribution = match options.inertia {
            true => Redistribution::new(session, &local, model, &solids)?,
            false => None,
        };
        let mass = if options.inertia {
            let supported = Supported { constrained, index: &local.index };
            Some(MassMatrix::new(session, &pattern, &solids, &supported, redistribution.as_ref())?)
        } else {
            None
        };
        let forces = Vector::ghosted(session, local.index.owned, D, &local.index.ghosts)?;
        let rows = local.index.owned * D;
        let parts =
            ForceParts { internal: vec![0.0; rows], contact: vec![0.0; rows], external: vec![0.0; rows] };
        let phases = Phases::register(session)?;
        let pieces = Pieces::new(world, &local, model);
        let bodies = named_bodies(model);
        let rigid = RigidBodies {
            session,
            local: &local,
            bodies: &bodies,
            pieces: &pieces,
            held: &supports.dofs.constrained,
            size: extent,
        };
        let holding = Holding::new(free_bodies(world, &local, &pieces, &supports), &pieces, &rigid.allowed());
        let mut system = Self {
            session: session.clone(),
            elements: pattern.clone(),
            interface: None,
            has_modes: false,
            matrix: Matrix::new(session, &pattern, options.format)?,
            matrix_source: None,
            search: None,
            pattern_search: None,
            inertia: forces.like_if(options.inertia)?,
            work: forces.like()?,
            forces,
            size: extent,
            extent: span,
            units: model.units,
            symmetric_steps: model.has_symmetric_steps(),
            holding,
            tools: model.rigid.clone(),
            factor: 0.0,
            bodies,
            pieces,
            unit: unit(model, extent, &local),
            local,
            solids,
            contacts,
            supports,
            external,
            mass,
            redistribution,
            parts,
            overclosures,
            continuation: Continuation { start_factor: 0.0, ..Continuation::default() },
            split: Split::Monolithic,
            fault: None,
            trouble: None,
            changes: Changes::default(),
            phases,
        };
        if !system.contacts.is_empty() {
            system.meet_undeformed(model)?;
        }
        Ok(system)
    }

    /// Finds the targets of deformable contacts and the initial gaps. Collective.
    fn meet_undeformed(&mut self, model: &Model<D>) -> Result<()> {
        let zero = vec![0.0; self.local.mesh.points.len() * D];
        self.renew(&ContactFields { u: &zero, v: &zero, u_start: &zero }, OverStep::No)?;
        self.note_undeformed();
        let session = self.session.clone();
        let request = ContactRequest { hold: Hold::Frictionless, ..ContactRequest::default() };
        let mut force = vec![0.0; self.local.index.owned * D];
        if let Some(interface) = &mut self.interface {
            let world = session.world();
            let phases = &self.phases;
            add_contact_forces(interface, &mut self.contacts, world, phases, &request, &mut force, || ());
        }
        let known = known_length(self.size, self.extent);
        for (at, (contact, given)) in self.contacts.iter_mut().zip(&model.contacts).enumerate() {
            if contact.is_deformable() {
                self.overclosures.insert(
                    at,
                    resolve_overclosure_of_points(session.world(), given, self.units, contact, known)?,
                );
            }
        }
        Ok(())
    }

    /// The session, shared by all ranks.
    pub fn session(&self) -> &Rc<Session> {
        &self.session
    }

    /// A zero vector with the layout of the system, used to create states.
    pub fn pattern_vector(&self) -> &Vector {
        &self.forces
    }

    /// The rank's part of the mesh.
    pub fn local(&self) -> &LocalMesh<D> {
        &self.local
    }

    /// The elements of this rank, by body and kind.
    pub fn solids(&self) -> &[SolidElements<D>] {
        &self.solids
    }

    /// The prescribed displacements.
    pub fn supports(&self) -> &Supports<D> {
        &self.supports
    }

    /// Adds the loads on the undeformed bodies at `time` to the owned rows of `force` \[N\].
    pub fn add_undeformed_loads(&mut self, time: f64, force: &mut [f64]) {
        let zero = vec![0.0; self.local.mesh.points.len() * D];
        self.external.add_force(&Moment { time, u: &zero, factor: 1.0 }, &self.solids, force);
    }

    /// Mass of each body \[kg\]. Collective.
    pub fn body_masses(&self) -> Vec<f64> {
        let mut own = vec![0.0; self.bodies.len()];
        for solid in &self.solids {
            solid.group.mass(|index, mass| {
                if self.local.mine[solid.group.elements()[index] as usize] {
                    own[solid.body] += mass.iter().sum::<f64>();
                }
            });
        }
        let mut masses = vec![0.0; own.len()];
        self.session.world().all_reduce_into(&own[..], &mut masses[..], SystemOperation::sum());
        masses
    }

    /// Gaps and overclosures of the undeformed state.
    pub fn overclosures(&self) -> &[Overclosure<D>] {
        &self.overclosures
    }

    /// Laws of the contacts in the order of the model, with derived laws resolved.
    pub fn contact_laws(&self) -> impl Iterator<Item = &ContactLaw> {
        self.contacts.iter().map(LocalContact::law)
    }

    /// Number of prescribed unknowns on all ranks. Collective.
    pub fn prescribed(&self) -> usize {
        let rows = self.local.index.owned * D;
        let own = self.supports.dofs.constrained[..rows].iter().filter(|held| **held).count() as u64;
        let mut total = 0u64;
        self.session.world().all_reduce_into(&own, &mut total, SystemOperation::sum());
        total as usize
    }

    /// Number of unknowns on all ranks, including prescribed ones.
    pub fn unknowns(&self) -> usize {
        self.local.index.total as usize * D
    }

    /// Extent of all bodies \[m\].
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Whether a load follows the surface, which makes the matrix non-symmetric.
    pub fn has_following_loads(&self) -> bool {
        self.external.follows()
    }

    /// Whether the matrix of forces that conserve over a step is symmetric, apart from the effects
    /// of loads and friction.
    pub fn has_symmetric_steps(&self) -> bool {
        self.symmetric_steps
    }

    /// Whether the system was built with inertia.
    pub fn is_dynamic(&self) -> bool {
        self.mass.is_some()
    }

    /// How supports hold the bodies.
    pub fn holding(&self) -> &Holding {
        &self.holding
    }

    /// The bodies, for their strain-free motions.
    pub(super) fn rigid_bodies(&self) -> RigidBodies<'_, D> {
        RigidBodies {
            session: &self.session,
            local: &self.local,
            bodies: &self.bodies,
            pieces: &self.pieces,
            held: &self.supports.dofs.constrained,
            size: self.size,
        }
    }

    /// Takes contact tractions and forces of the trial state as those at the start of the motion.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn remember_start(&mut self, stage: &mut Stage) -> Result<()> {
        for contact in &mut self.contacts {
            let state = &mut contact.state;
            for (history, point) in state.history.iter_mut().zip(&state.current) {
                *history = crate::contact::history::History::start(point);
            }
            state.begin();
            contact.remember_multipliers();
        }
        self.continuation.start_factor = self.factor;
        stage.start_forces.copy_from(&self.forces)?;
        self.rest_massless(&mut stage.start_forces);
        Ok(())
    }

    /// Sets how the equations differ from those of the scene. The factor of the accepted state at
    /// the start of the step stays.
    pub fn set_continuation(&mut self, continuation: Continuation) {
        let start_factor = self.continuation.start_factor;
        self.continuation = Continuation { start_factor, ..continuation };
    }

    /// Sets the load factor of the state at the start of the step.
    pub fn set_start_factor(&mut self, start_factor: f64) {
        self.continuation.start_factor = start_factor;
    }

    /// The units of all numbers.
    pub fn units(&self) -> Units {
        self.units
    }

    /// Whether any contact has friction.
    pub fn has_friction(&self) -> bool {
        self.contacts.iter().any(|contact| contact.law().friction.is_some())
    }

    /// Whether there is any contact.
    pub fn has_contact(&self) -> bool {
        !self.contacts.is_empty()
    }

    /// Provides the matrix with the rigid-body modes of its nodes, for multigrid. Collective.
    ///
    /// There is one basis for all bodies. Multigrid uses it aggregate by aggregate, and on nodes of
    /// one body the motions of the whole are exactly the motions of that body. Separate bases for
    /// the bodies would span nothing more there, and would multiply the number of unknowns on
    /// coarse levels. On an aggregate that joins two bodies, they would let the bodies separate.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn set_rigid_body_modes(&mut self) -> Result<()> {
        self.has_modes = true;
        let mut coordinates = Vector::new(&self.session, self.local.index.owned, D)?;
        for (entry, value) in coordinates.owned_mut().iter_mut().zip(self.local.mesh.points.iter().flatten())
        {
            *entry = *value;
        }
        self.matrix.set_near_null_space(&coordinates)
    }

    /// Ends the step. Contact points store their tractions, the forces become those at the start of
    /// the next step, and the trial state becomes its start.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn accept(&mut self, stage: &mut Stage) -> Result<()> {
        let dt = stage.dt;
        for contact in &mut self.contacts {
            contact.state.accept(dt);
            contact.remember_multipliers();
            contact.begin_step();
        }
        self.continuation.start_factor = self.factor;
        stage.start_forces.copy_from(&self.forces)?;
        self.rest_massless(&mut stage.start_forces);
        self.calm_massless(stage)?;
        stage.accept();
        Ok(())
    }
}
