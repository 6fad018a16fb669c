//! The discretised bodies of one rank: contents, construction, and the end of a step.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::bodies::{NamedBody, named_bodies};
use super::build::{
    FreeBody, contacts, extent, farthest, free_bodies, loads, middle_of, physics, supports, unit,
};
use super::contact::LocalContact;
use super::contact_forces::add_contact_forces;
use super::external::External;
use super::interface::Interface;
use super::mass::{MassMatrix, Supported};
use super::pattern::pattern_of_elements;
use super::phases::Phases;
use super::pieces::Pieces;
use super::redistribution::Redistribution;
use super::solid::{SolidElements, solids};
use super::start::{Overclosure, known, resolve_overclosure, resolve_overclosure_of_points};
use super::supports::{Supports, in_space};
use crate::case::Units;
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::point::ContactLaw;
use crate::contact::state::{Changes, Hold};
use crate::dynamics::{MatrixSource, OverStep, SearchSource, Stage};
use crate::element::Inverted;
use crate::error::{Error, Result, agree};
use crate::model::Model;
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
    pub(super) free_bodies: Vec<FreeBody>,
    pub(super) bodies: Vec<NamedBody>,
    pub(super) pieces: Pieces<D>,
    /// For each group of pieces, the number of strain-free motions that supports allow, including
    /// rotations only.
    leeway: Vec<usize>,
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
        let known = known(extent, span);
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
            free_bodies: free_bodies(world, &local, &pieces, &supports),
            bodies: named_bodies(model),
            pieces,
            leeway: Vec::new(),
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
            fault: None,
            trouble: None,
            changes: Changes::default(),
            phases,
        };
        system.leeway = system.leeway();
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
        let known = known(self.size, self.extent);
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

    /// Whether supports hold every body against every rigid motion.
    pub fn is_held(&self) -> bool {
        self.leeway.iter().all(|motions| *motions == 0)
    }

    /// Bodies that no support holds in some direction, as `body (along x, y)`.
    pub fn free_bodies(&self) -> Vec<String> {
        self.free_bodies.iter().map(|free| free.words.clone()).collect()
    }

    /// Bodies that neither a support nor a contact can hold.
    pub fn lost_bodies(&self) -> Vec<String> {
        let lost = self.free_bodies.iter().filter(|free| !self.pieces.touched[free.group]);
        lost.map(|free| free.words.clone()).collect()
    }

    /// Bodies, or pieces of them, that are supported along all axes and touched by no contact, but
    /// can still move, for example about a single held point. Returns the number of such motions
    /// for each.
    pub fn hinged_bodies(&self) -> Vec<(String, usize)> {
        let loose = |group: &usize| {
            let free = self.free_bodies.iter().any(|free| free.group == *group);
            self.leeway[*group] > 0 && !free && !self.pieces.touched[*group]
        };
        let groups = (0..self.leeway.len()).filter(loose);
        groups.map(|group| (self.pieces.group_name(group), self.leeway[group])).collect()
    }

    /// Sets the initial velocity of the bodies. Prescribed components follow their supports.
    /// Collective.
    ///
    /// # Errors
    /// If a velocity is not finite (the same on all ranks), or a PETSc call fails.
    pub fn set_velocity(&mut self, stage: &mut Stage, model: &Model<D>) -> Result<()> {
        let own = self.fill_velocity(&mut stage.start.v.local_mut(), model);
        agree(self.session.world(), own)?;
        stage.start.a.set(0.0);
        stage.start.v.update_ghosts()
    }

    fn fill_velocity(&self, v: &mut [f64], model: &Model<D>) -> Result<()> {
        let mesh = &self.local.mesh;
        v.fill(0.0);
        for element in 0..mesh.element_count() {
            let functions = &model.bodies[usize::from(mesh.body[element])].initial_velocity;
            for &node in mesh.element_nodes(element) {
                let point = &mesh.points[node as usize];
                for (i, function) in functions.iter().enumerate().take(D) {
                    let motion = function.motion(in_space(point), 0.0);
                    function.require_sound(&motion, point, 0.0)?;
                    v[node as usize * D + i] = motion.value;
                }
            }
        }
        Ok(())
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
        stage.start_forces.copy_from(&self.forces)?;
        self.rest_massless(&mut stage.start_forces);
        Ok(())
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
        stage.start_forces.copy_from(&self.forces)?;
        self.rest_massless(&mut stage.start_forces);
        self.calm_massless(stage)?;
        stage.accept();
        Ok(())
    }
}
