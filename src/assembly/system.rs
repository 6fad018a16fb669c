//! The discretised bodies of one rank: contents, construction, and the end of a step.

use std::rc::Rc;

use super::bodies::{Bodies, Extent};
use super::build::{contacts, loads, middle_of, unit};
use super::contact::LocalContact;
use super::contact_forces::add_contact_forces;
use super::external::{External, Moment};
use super::interface::Interface;
use super::phases::Phases;
use super::slip_limit::SlipLimit;
use super::start::{Overclosure, resolve_overclosure, resolve_overclosure_of_points};
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::state::{Changes, Hold};
use crate::dynamics::{Continuation, MatrixSource, OverStep, SearchSource, Split, Stage};
use crate::element::Inverted;
use crate::error::{Error, Result};
use crate::model::{Model, RigidModel};
use crate::partition::LocalMesh;
use crate::petsc::{Format, Matrix, Session, Vector};

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
    /// Forces of foundations and springs.
    pub springs: Vec<f64>,
}

/// The discretised bodies with their contacts, supports and loads: `M`, `Q(q)`, `F_ext`, `F_n`,
/// `F_T`.
pub struct ContactSystem<const D: usize> {
    pub(super) bodies: Bodies<D>,
    pub(super) contacts: Vec<LocalContact<D>>,
    /// Data that deformable contacts share.
    pub(super) interface: Option<Interface<D>>,
    pub(super) external: External<D>,
    overclosures: Vec<Overclosure<D>>,
    pub(super) parts: ForceParts,
    /// `Q + K_s u + C v - F_ext - F_n - F_T` at the last trial state \[N\].
    pub(super) forces: Vector,
    /// `M a` at the last trial state \[N\].
    pub(super) inertia: Vector,
    /// `C v` of bodies and dashpots at the last trial state \[N\]; without entries if nothing is damped.
    pub(super) damping: Vector,
    pub(super) work: Vector,
    pub(super) matrix: Matrix,
    /// Whether the matrix has the rigid-body modes.
    pub(super) has_modes: bool,
    /// Source of the matrix; `None` before the first assembly.
    pub(super) matrix_source: Option<Rc<MatrixSource>>,
    /// Source of the last search of the contacts.
    pub(super) search: Option<Rc<SearchSource>>,
    /// Source of the search from which the pattern of the matrix was built.
    pub(super) pattern_search: Option<Rc<SearchSource>>,
    /// How the equations differ from those of the scene at present.
    pub(super) continuation: Continuation,
    /// Which quantities a staggered solve currently holds fixed.
    pub(super) split: Split,
    /// Displacements of the local nodes at which the pressure of nearly incompressible bodies is linearised
    /// \[m\]; `None` if it is not.
    pub(super) linearised_at: Option<Vec<f64>>,
    pub(super) fault: Option<Inverted>,
    /// A prescribed value that is not finite. It is reported with the next residual, which is
    /// collective.
    pub(super) trouble: Option<Error>,
    pub(super) changes: Changes,
    /// Whether the matrix of forces that conserve over a step is symmetric: everything is linear,
    /// and targets are flat.
    pub(super) symmetric_steps: bool,
    /// Requested limit of the elastic slip, in statics.
    pub(super) slip_limit: Option<SlipLimit>,
    /// Rigid bodies that move.
    pub(super) tools: Vec<RigidModel<D>>,
    /// Load factor of the last evaluated state.
    pub(super) factor: f64,
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
        let extent = Extent::of(world, &local);
        let known = extent.known_length();
        let mut of_nodes = Vec::with_capacity(model.contacts.len());
        let middle = middle_of(world, &local);
        let anchored: Vec<_> = model.contacts.iter().map(|contact| contact.anchored(&middle)).collect();
        for contact in &anchored {
            of_nodes.push(resolve_overclosure(world, &mut local, contact, model.units, known)?);
        }
        let bodies = Bodies::new(session, local, model, extent, options.inertia)?;
        let mut contacts = contacts(world, &bodies.local, &model.bodies, &anchored)?;
        contacts.iter_mut().for_each(|contact| contact.state.round_gaps(known));
        contacts.iter_mut().for_each(|contact| contact.pair.find_pose(&bodies.free));
        let external = loads(world, &bodies.local, model, &bodies.pattern, bodies.held())?;
        let index = &bodies.local.index;
        let forces = Vector::ghosted(session, index.owned, D, &index.ghosts)?;
        let rows = index.owned * D;
        let mut system = Self {
            interface: None,
            slip_limit: None,
            has_modes: false,
            matrix: Matrix::new(session, &bodies.pattern, options.format)?,
            matrix_source: None,
            search: None,
            pattern_search: None,
            inertia: forces.like_if(options.inertia)?,
            damping: forces.like_if(bodies.damping.is_some() || bodies.elastic.is_damped())?,
            work: forces.like()?,
            forces,
            symmetric_steps: model.has_symmetric_steps(),
            unit: unit(model, extent.size, &bodies.local),
            tools: model.rigid.clone(),
            factor: 0.0,
            bodies,
            contacts,
            external,
            parts: ForceParts {
                internal: vec![0.0; rows],
                contact: vec![0.0; rows],
                external: vec![0.0; rows],
                springs: vec![0.0; rows],
            },
            overclosures: Vec::new(),
            continuation: Continuation { start_factor: 0.0, ..Continuation::default() },
            split: Split::Monolithic,
            linearised_at: None,
            fault: None,
            trouble: None,
            changes: Changes::default(),
            phases: Phases::register(session)?,
        };
        if !system.contacts.is_empty() {
            system.meet_undeformed(model, of_nodes)?;
        }
        Ok(system)
    }

    /// Gathers the facets of targets and finds the initial gaps. Contacts with an obstacle already have an
    /// overclosure, that of their nodes. Collective.
    fn meet_undeformed(&mut self, model: &Model<D>, of_nodes: Vec<Option<Overclosure<D>>>) -> Result<()> {
        let zero = vec![0.0; self.bodies.local.mesh.points.len() * D];
        self.renew(&ContactFields { u: &zero, v: &zero, u_start: &zero }, OverStep::No)?;
        self.note_undeformed();
        let session = self.bodies.session.clone();
        let request = ContactRequest { hold: Hold::Frictionless, ..ContactRequest::default() };
        let mut force = vec![0.0; self.bodies.local.index.owned * D];
        if let Some(interface) = &mut self.interface {
            let world = session.world();
            let phases = &self.phases;
            add_contact_forces(interface, &mut self.contacts, world, phases, &request, &mut force, || ());
        }
        let known = self.bodies.extent.known_length();
        let units = self.bodies.units;
        for ((contact, given), of_nodes) in self.contacts.iter_mut().zip(&model.contacts).zip(of_nodes) {
            let overclosure = match of_nodes {
                // The nodes decide what is an error.
                Some(of_nodes) if !given.initial_overclosure.is_removed() => of_nodes,
                of_nodes => {
                    let of_points =
                        resolve_overclosure_of_points(session.world(), given, units, contact, known)?;
                    of_nodes.unwrap_or(of_points)
                }
            };
            self.overclosures.push(overclosure);
        }
        Ok(())
    }

    /// The bodies without their contacts.
    pub fn bodies(&self) -> &Bodies<D> {
        &self.bodies
    }

    /// The session, shared by all ranks.
    pub fn session(&self) -> &Rc<Session> {
        &self.bodies.session
    }

    /// A zero vector with the layout of the system, used to create states.
    pub fn pattern_vector(&self) -> &Vector {
        &self.forces
    }

    /// Adds the loads on the undeformed bodies at `time` to the owned rows of `force` \[N\].
    pub fn add_undeformed_loads(&mut self, time: f64, force: &mut [f64]) {
        let zero = vec![0.0; self.bodies.local.mesh.points.len() * D];
        self.external.add_force(&Moment { time, u: &zero, factor: 1.0 }, &self.bodies.solids, force);
    }

    /// Gaps and overclosures of the undeformed state.
    pub fn overclosures(&self) -> &[Overclosure<D>] {
        &self.overclosures
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

    /// Takes the gaps of the trial state as those at the start of the motion, and returns whether any
    /// contact is damped. Its forces then have to be evaluated again: a dashpot acts only at points that
    /// are known to be in contact.
    pub fn know_gaps(&mut self) -> bool {
        let damped = self.contacts.iter_mut().filter(|contact| !contact.law().damping.is_none());
        damped
            .map(|contact| {
                let state = &mut contact.state;
                for (history, point) in state.history.iter_mut().zip(&state.current) {
                    history.gap = point.gap;
                }
            })
            .count()
            > 0
    }

    /// Discards what the contacts know of the iterates of another attempt.
    pub fn begin_attempt(&mut self) {
        self.contacts.iter_mut().for_each(|contact| contact.state.begin_attempt());
    }

    /// Takes contact tractions and forces of the trial state as those at the start of the motion. In statics
    /// bodies may overlap there, with pressures far above those of the first step, so no point counts as
    /// closed.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn remember_start(&mut self, stage: &mut Stage) -> Result<()> {
        let is_dynamic = self.bodies.is_dynamic();
        for contact in &mut self.contacts {
            let state = &mut contact.state;
            for (history, point) in state.history.iter_mut().zip(&state.current) {
                *history = crate::contact::history::History::start(point);
                if !is_dynamic {
                    history.normal.fill(0.0);
                }
            }
            state.begin_attempt();
            contact.remember_multipliers();
        }
        self.continuation.start_factor = self.factor;
        self.bodies.begin_viscous(stage);
        stage.start_forces.copy_from(&self.forces)?;
        self.bodies.rest_massless(&mut stage.start_forces);
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

    /// Whether any contact has friction.
    pub fn has_friction(&self) -> bool {
        self.contacts.iter().any(|contact| contact.law().friction.is_some())
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
        let mut coordinates = Vector::new(&self.bodies.session, self.bodies.local.index.owned, D)?;
        for (entry, value) in
            coordinates.owned_mut().iter_mut().zip(self.bodies.local.mesh.points.iter().flatten())
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
            contact.state.begin_attempt();
        }
        self.continuation.start_factor = self.factor;
        self.bodies.advance_viscous(stage);
        stage.start_forces.copy_from(&self.forces)?;
        self.bodies.rest_massless(&mut stage.start_forces);
        self.bodies.calm_massless(stage)?;
        self.bodies.accept_rigid(stage);
        stage.accept();
        Ok(())
    }
}
