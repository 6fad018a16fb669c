//! The equations of motion of one rank's share, as solvers and integrators see them.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::build::{FreeBody, contacts, extent, free_bodies, loads, physics, supports, unit};
use super::contact::{Contact, Pair};
use super::external::{External, Moment};
use super::forces::{Solid, solids};
use super::interface::Interface;
use super::mass::{Mass, Supported};
use super::meeting::Meeting;
use super::pattern::pattern_of_elements;
use super::scatter::LiftTarget;
use super::stages::{self, Target, hold};
use super::start::{Overclosure, overclosure_of_points, resolve_overclosure};
use super::supports::{Supports, in_space};
use crate::contact::evaluation::{AreaKind, ContactFields, ContactRequest};
use crate::contact::point::{ContactLaw, Selection};
use crate::contact::state::{Branches, Changes, Hold};
use crate::dynamics::{ContactCounts, Dynamics, ForceChange, Freeze, FrictionMode, Lift, Residual, Stage};
use crate::element::Inverted;
use crate::error::{Error, Result, agree};
use crate::model::Model;
use crate::partition::LocalMesh;
use crate::petsc::{BlockPattern, Event, Format, Matrix, Session, Symmetry, Vector};
use crate::space::Fields;
use crate::terms::Terms;

/// What the system is built for.
#[derive(Debug, Clone, Copy)]
pub struct SystemOptions {
    /// Inertia takes part.
    pub inertia: bool,
    /// Storage of the matrix.
    pub format: Format,
}

/// Forces on the owned unknowns by origin [N].
#[derive(Default)]
pub(super) struct Parts {
    pub internal: Vec<f64>,
    pub contact: Vec<f64>,
    pub external: Vec<f64>,
}

/// Phases whose time is recorded.
pub(super) struct Phases {
    contact: Event,
    forces: Event,
    tangent: Event,
    pub search: Event,
    pub exchange: Event,
}

/// The discretised bodies with their contacts, supports and loads: `M`, `Q(q)`, `F_ext`, `F_n`, `F_T`.
pub struct ContactSystem<const D: usize> {
    pub(super) session: Rc<Session>,
    pub(super) local: LocalMesh<D>,
    pub(super) solids: Vec<Solid<D>>,
    pub(super) contacts: Vec<Contact<D>>,
    pub(super) supports: Supports<D>,
    pub(super) external: External<D>,
    pub(super) mass: Option<Mass>,
    pub(super) parts: Parts,
    /// `Q - F_ext - F_n - F_T` at the last trial state [N].
    pub(super) forces: Vector,
    /// `M a` at the last trial state [N].
    pub(super) inertia: Vector,
    overclosures: Vec<Overclosure<D>>,
    /// Couplings by elements alone.
    pub(super) elements: Rc<BlockPattern>,
    /// What deformable contacts share.
    pub(super) interface: Option<Interface<D>>,
    /// A contact met a facet that the pattern does not know.
    missed: bool,
    /// The matrix knows the rigid-body modes.
    pub(super) has_modes: bool,
    pub(super) matrix: Matrix,
    work: Vector,
    fault: Option<Inverted>,
    /// A prescribed value that is no number; told with the next residual, where all ranks listen.
    trouble: Option<Error>,
    changes: Changes,
    extent: f64,
    free_bodies: Vec<FreeBody>,
    /// Stiffness of the unit rows of prescribed unknowns [N/m].
    unit: f64,
    pub(super) phases: Phases,
}

impl<const D: usize> ContactSystem<D> {
    /// Builds everything that the model names on the rank's share of the mesh. Collective.
    ///
    /// # Errors
    /// When the model does not fit the mesh, the same on all ranks.
    pub fn new(
        session: &Rc<Session>,
        mut local: LocalMesh<D>,
        model: &Model<D>,
        options: SystemOptions,
    ) -> Result<Self> {
        let world = session.world();
        let extent = extent(world, &local);
        let mut overclosures = Vec::with_capacity(model.contacts.len());
        for contact in &model.contacts {
            if let Some(obstacle) = contact.target.obstacle() {
                overclosures.push(resolve_overclosure(world, &mut local, contact, obstacle, extent)?);
            }
        }
        let supports = agree(world, supports(&local, model))?;
        let pattern = Rc::new(pattern_of_elements(&local.mesh, local.assembled, &local.index));
        let constrained = &supports.dofs.constrained;
        let solids = agree(world, solids(&local, &physics(model), &pattern, constrained))?;
        let contacts = contacts(world, &local, model, &pattern, constrained)?;
        let external = agree(world, loads(&local, model, &pattern, constrained))?;
        let mass = if options.inertia {
            let supported = Supported { constrained, index: &local.index };
            Some(Mass::new(session, &pattern, &solids, &supported)?)
        } else {
            None
        };
        let forces = Vector::ghosted(session, local.index.owned, D, &local.index.ghosts)?;
        let rows = local.index.owned * D;
        let parts = Parts { internal: vec![0.0; rows], contact: vec![0.0; rows], external: vec![0.0; rows] };
        let phases = Phases {
            contact: Event::register(session, "Contact")?,
            forces: Event::register(session, "ElementForces")?,
            tangent: Event::register(session, "Tangent")?,
            search: Event::register(session, "ContactSearch")?,
            exchange: Event::register(session, "ContactExchange")?,
        };
        let mut system = Self {
            session: session.clone(),
            elements: pattern.clone(),
            interface: None,
            missed: false,
            has_modes: false,
            matrix: Matrix::new(session, &pattern, options.format)?,
            inertia: forces.like()?,
            work: forces.like()?,
            forces,
            extent,
            free_bodies: free_bodies(world, &local, model, &supports),
            unit: unit(model, extent, &local),
            local,
            solids,
            contacts,
            supports,
            external,
            mass,
            parts,
            overclosures,
            fault: None,
            trouble: None,
            changes: Changes::default(),
            phases,
        };
        if system.contacts.iter().any(|contact| contact.meeting().is_some()) {
            system.meet_undeformed(model)?;
        }
        Ok(system)
    }

    /// Finds the targets of deformable contacts and the gaps at the start. Collective.
    fn meet_undeformed(&mut self, model: &Model<D>) -> Result<()> {
        let zero = vec![0.0; self.local.mesh.points.len() * D];
        self.renew(&ContactFields { u: &zero, v: &zero, u_start: &zero })?;
        let session = self.session.clone();
        let request = ContactRequest { hold: Hold::Frictionless, ..ContactRequest::default() };
        let mut force = vec![0.0; self.local.index.owned * D];
        if let Some(interface) = &mut self.interface {
            meet(interface, &mut self.contacts, (session.world(), &self.phases), &request, &mut force);
        }
        for (at, (contact, given)) in self.contacts.iter().zip(&model.contacts).enumerate() {
            if contact.meeting().is_some() {
                let points = (contact.surface(), &contact.state);
                self.overclosures
                    .insert(at, overclosure_of_points(session.world(), given, points, self.extent)?);
            }
        }
        Ok(())
    }

    /// A zero vector of the system's layout: what states are made of.
    pub fn pattern_vector(&self) -> &Vector {
        &self.forces
    }

    /// The rank's share of the mesh.
    pub fn local(&self) -> &LocalMesh<D> {
        &self.local
    }

    /// Gaps and overclosures of the undeformed state.
    pub fn overclosures(&self) -> &[Overclosure<D>] {
        &self.overclosures
    }

    /// Laws of the contacts, derived ones resolved, in the order of the model.
    pub fn contact_laws(&self) -> impl Iterator<Item = &ContactLaw> {
        self.contacts.iter().map(Contact::law)
    }

    /// Number of prescribed unknowns over all ranks. Collective.
    pub fn prescribed(&self) -> usize {
        let rows = self.local.index.owned * D;
        let own = self.supports.dofs.constrained[..rows].iter().filter(|held| **held).count() as u64;
        let mut total = 0;
        self.session.world().all_reduce_into(&own, &mut total, SystemOperation::sum());
        total as usize
    }

    /// Number of unknowns over all ranks, prescribed ones included.
    pub fn unknowns(&self) -> usize {
        self.local.index.total as usize * D
    }

    /// Whether a load follows the surface, which makes the matrix non-symmetric.
    pub fn has_following_loads(&self) -> bool {
        self.external.follows()
    }

    /// Whether the system was built with inertia.
    pub fn is_dynamic(&self) -> bool {
        self.mass.is_some()
    }

    /// Whether supports hold every body in every direction.
    pub fn is_held(&self) -> bool {
        self.free_bodies.is_empty()
    }

    /// Bodies that no support holds in some direction, as `body (along x, y)`.
    pub fn free_bodies(&self) -> Vec<String> {
        self.free_bodies.iter().map(|free| free.words.clone()).collect()
    }

    /// Those of them that no contact can hold either.
    pub fn lost_bodies(&self, model: &Model<D>) -> Vec<String> {
        let touches = |body: usize| model.contacts.iter().any(|contact| contact.body == body);
        let lost = self.free_bodies.iter().filter(|free| !touches(free.body));
        lost.map(|free| free.words.clone()).collect()
    }

    /// Sets the start velocity of the bodies; prescribed components follow their supports.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn set_velocity(&mut self, stage: &mut Stage, model: &Model<D>) -> Result<()> {
        let mesh = &self.local.mesh;
        {
            let mut v = stage.start.v.local_mut();
            v.fill(0.0);
            for element in 0..mesh.element_count() {
                let functions = &model.bodies[usize::from(mesh.body[element])].initial_velocity;
                for &node in mesh.element_nodes(element) {
                    for (i, function) in functions.iter().enumerate().take(D) {
                        let point = in_space(&mesh.points[node as usize]);
                        v[node as usize * D + i] = function.value(point, 0.0);
                    }
                }
            }
        }
        stage.start.a.set(0.0);
        stage.start.v.update_ghosts()
    }

    /// Takes contact tractions and forces of the trial state as those at the start of the motion.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn remember_start(&mut self, stage: &mut Stage) -> Result<()> {
        for contact in &mut self.contacts {
            let state = &mut contact.state;
            for (history, point) in state.history.iter_mut().zip(&state.current) {
                *history = crate::contact::history::History::start(point);
            }
            state.begin();
        }
        stage.start_forces.copy_from(&self.forces)
    }

    /// Whether friction takes part anywhere.
    pub fn has_friction(&self) -> bool {
        self.contacts.iter().any(|contact| contact.law().friction.is_some())
    }

    /// Whether there is contact at all.
    pub fn has_contact(&self) -> bool {
        !self.contacts.is_empty()
    }

    /// Gives the matrix the rigid-body modes of its nodes, for multigrid. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn set_rigid_body_modes(&mut self) -> Result<()> {
        self.has_modes = true;
        let mut coordinates = Vector::new(&self.session, self.local.index.owned, D)?;
        for (entry, value) in coordinates.owned_mut().iter_mut().zip(self.local.mesh.points.iter().flatten())
        {
            *entry = *value;
        }
        self.matrix.set_near_null_space(&coordinates)
    }

    fn moment<'a>(stage: &Stage, u: &'a [f64]) -> Moment<'a> {
        Moment { time: stage.trial.time, u, factor: stage.load_factor }
    }

    /// Fills the three parts of the forces at the trial state; remembers an inverted element.
    fn sweep(&mut self, stage: &Stage, branches: Branches) {
        let (u, v, u_start) = (stage.trial.u.local(), stage.trial.v.local(), stage.start.u.local());
        let Parts { internal, contact, external } = &mut self.parts;
        // Predicted branches change the contact alone, and come after the residual of the same state.
        if branches == Branches::Actual {
            let _running = self.phases.forces.begin();
            self.fault = None;
            internal.fill(0.0);
            for solid in &self.solids {
                if let Err(inverted) = solid.add_force(&u, internal) {
                    self.fault.get_or_insert(inverted);
                }
            }
            external.fill(0.0);
            self.external.add_force(&Self::moment(stage, &u), &self.solids, external);
        }
        contact.fill(0.0);
        let fields = ContactFields { u: &u, v: &v, u_start: &u_start };
        let request = ContactRequest { stiffness: None, hold: hold(stage), branches };
        self.phases.contact.time(|| {
            self.contacts.iter_mut().for_each(|pair| pair.add_force(&fields, &request, contact));
        });
        if let Some(interface) = &mut self.interface {
            interface.bring(self.session.world(), &fields);
            self.missed =
                meet(interface, &mut self.contacts, (self.session.world(), &self.phases), &request, contact);
        }
    }

    /// `M (w_0 a_start + w_1 a_end)` into `work`, and nothing where there is no inertia.
    fn weigh_inertia(&mut self, stage: &Stage) -> Result<()> {
        let Some(mass) = self.mass.as_ref().filter(|_| stage.inertia) else {
            self.work.set(0.0);
            return Ok(());
        };
        let [at_start, at_end] = stage.balance.mass;
        self.inertia.copy_from(&stage.trial.a)?;
        self.inertia.axpby(at_start, at_end, &stage.start.a)?;
        // The scheme's own accelerations lag, so that their mean lies where the mean of the forces does. Prescribed
        // accelerations do not lag: they take the weights of the forces, or the scheme falls to first order.
        {
            let mut mean = self.inertia.owned_mut();
            let (start, end) = (stage.start.a.owned(), stage.trial.a.owned());
            let held = self.supports.dofs.constrained[..mean.len()].iter().enumerate();
            for (dof, _) in held.filter(|(_, held)| **held) {
                mean[dof] = stage.balance.start_force * start[dof] + end[dof];
            }
        }
        mass.multiply(&self.inertia, &mut self.work)
    }

    /// Residual on the free unknowns with the branches of the friction law as given.
    fn balance(&mut self, stage: &Stage, branches: Branches, out: &mut Vector) -> Result<Residual> {
        let (residual, stale) = self.weigh(stage, branches, out)?;
        if !stale {
            return Ok(residual);
        }
        {
            let (u, v, u_start) = (stage.trial.u.local(), stage.trial.v.local(), stage.start.u.local());
            self.renew(&ContactFields { u: &u, v: &v, u_start: &u_start })?;
        }
        self.weigh(stage, branches, out).map(|(residual, _)| residual)
    }

    /// The residual, and whether contacts have to look around anew.
    fn weigh(&mut self, stage: &Stage, branches: Branches, out: &mut Vector) -> Result<(Residual, bool)> {
        self.sweep(stage, branches);
        self.weigh_inertia(stage)?;
        let mut sums = [0.0; 7];
        {
            let (mut forces, mut out) = (self.forces.owned_mut(), out.owned_mut());
            let (inertia, start) = (self.work.owned(), stage.start_forces.owned());
            let Parts { internal, contact, external } = &self.parts;
            let constrained = &self.supports.dofs.constrained;
            for i in 0..out.len() {
                forces[i] = internal[i] - external[i] - contact[i];
                let total = inertia[i] + stage.balance.start_force * start[i] + forces[i];
                out[i] = if constrained[i] { 0.0 } else { total };
                let terms = [out[i], internal[i], contact[i], external[i], inertia[i]];
                sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term * term);
            }
        }
        if self.fault.is_some() {
            sums[0] = f64::NAN;
        }
        sums[5] = f64::from(u8::from(self.trouble.is_some()));
        sums[6] = f64::from(u8::from(self.missed || self.is_stale(&stage.trial.u.local())));
        let mut total = [0.0; 7];
        self.session.world().all_reduce_into(&sums[..], &mut total[..], SystemOperation::sum());
        if total[5] > 0.0 {
            agree(self.session.world(), self.trouble.take().map_or(Ok(()), Err))?;
        }
        let scale = total[1..5].iter().copied().fold(0.0, f64::max).sqrt();
        let residual = Residual { norm: total[0].sqrt(), scale };
        Ok((residual, total[6] > 0.0 && residual.norm.is_finite()))
    }

    /// `M a + Q - F_ext - F_n - F_T` of the trial state: zero on free unknowns, reactions on prescribed ones [N].
    ///
    /// To be called after [`Dynamics::residual`] at the same state. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn imbalance(&mut self, stage: &Stage, out: &mut Vector) -> Result<()> {
        match self.mass.as_ref().filter(|_| stage.inertia) {
            Some(mass) => mass.multiply(&stage.trial.a, out)?,
            None => out.set(0.0),
        }
        out.axpy(1.0, &self.forces)
    }

    /// The inverted element in words: number, place, determinant.
    fn describe(&self, inverted: &Inverted) -> Error {
        let mesh = &self.local.mesh;
        let centre = mesh.element_centre(inverted.element as usize);
        let number = self.local.input_element[inverted.element as usize];
        Error::guard(format!(
            "element {number} at {centre:?} is turned inside out (det F = {:.3e})",
            inverted.det
        ))
    }

    /// Ends the step: contact points remember their tractions, the forces become those at the start of the next
    /// step, the trial state becomes its start.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn accept(&mut self, stage: &mut Stage) -> Result<()> {
        let dt = stage.dt;
        for contact in &mut self.contacts {
            contact.state.accept(dt);
            contact.begin_step();
        }
        stage.start_forces.copy_from(&self.forces)?;
        stage.accept();
        Ok(())
    }

    /// Assembles the derivative of the residual, restricted to `terms`.
    fn assemble(&mut self, stage: &Stage, terms: Terms, target: Target, lift: Option<Lift>) -> Result<()> {
        let (u, v, u_start) = (stage.trial.u.local(), stage.trial.v.local(), stage.start.u.local());
        let inertia = stage.inertia && terms.contains(Terms::MASS);
        let mass = self.mass.as_ref().filter(|_| inertia);
        let (change, mut rhs) = match lift {
            Some(Lift { change, rhs }) => (Some(change.local()), Some(rhs.owned_mut())),
            None => (None, None),
        };
        let mut lifted = change.as_ref().zip(rhs.as_mut()).map(|(change, rhs)| LiftTarget { change, rhs });
        let constrained = &self.supports.dofs.constrained;
        let (solids, contacts, external) = (&self.solids, &mut self.contacts, &self.external);
        let (shifts, weight, unit) = (stage.shifts, stage.balance.mass[1], self.unit);
        let (rows, holding) = (self.local.index.owned * D, stage.holding);
        let (phases, interface, world) = (&self.phases, self.interface.as_mut(), self.session.world());
        let symmetric = symmetric(contacts, external, stage, terms);
        let matrix = match target {
            Target::Own => &mut self.matrix,
            Target::Other(matrix) => matrix,
        };
        let inverted = matrix.fill(|values| {
            let tangent = phases.tangent.begin();
            match mass {
                Some(mass) => mass.write_to(weight * shifts.acceleration, values),
                None => values.zero(),
            }
            for (dof, held) in constrained[..rows].iter().enumerate() {
                if *held || holding > 0.0 {
                    values.add_diagonal(dof, if *held { unit } else { holding * unit });
                }
            }
            let mut inverted = Ok(());
            for solid in solids {
                let lift = lifted.as_mut().map(LiftTarget::reborrow);
                inverted = inverted.and(solid.add_stiffness(&u, terms, constrained, values, lift));
            }
            let lift = lifted.as_mut().map(LiftTarget::reborrow);
            if terms.contains(Terms::FOLLOWING_LOAD) {
                external.add_stiffness(&Self::moment(stage, &u), constrained, values, lift);
            }
            drop(tangent);
            let fields = ContactFields { u: &u, v: &v, u_start: &u_start };
            let selection = Selection { terms, velocity_shift: shifts.velocity };
            let request = ContactRequest {
                stiffness: Some(selection),
                hold: hold(stage),
                branches: Branches::Predicted,
            };
            phases.contact.time(|| {
                for pair in contacts.iter_mut() {
                    let lift = lifted.as_mut().map(LiftTarget::reborrow);
                    pair.add_stiffness(&fields, &request, constrained, values, lift);
                }
            });
            if let Some(interface) = interface {
                interface.bring(world, &fields);
                let lift = lifted.as_mut().map(|lift| (lift.change, &mut *lift.rhs));
                interface.add_stiffness(world, values, lift, |fields, opening| {
                    let _running = phases.contact.begin();
                    for contact in contacts.iter_mut() {
                        if let Pair::Deformable(meeting) = &contact.pair {
                            meeting.add_stiffness(fields, &request, &mut contact.state, opening);
                        }
                    }
                });
            }
            inverted
        })?;
        self.fault = inverted.err();
        matrix.set_symmetry(if symmetric { Symmetry::Symmetric } else { Symmetry::None })?;
        Ok(())
    }
}

/// Pairs the points of deformable contacts and adds their forces; whether a pair is missing in the couples. Collective.
fn meet<const D: usize>(
    interface: &mut Interface<D>,
    contacts: &mut [Contact<D>],
    (world, phases): (&impl CommunicatorCollectives, &Phases),
    request: &ContactRequest,
    force: &mut [f64],
) -> bool {
    let u = interface.fields().u;
    phases
        .search
        .time(|| contacts.iter_mut().filter_map(Contact::meeting_mut).for_each(|meeting| meeting.pair(u)));
    let missed = interface.add_forces(world, force, |fields, own, mut remote| {
        let _running = phases.contact.begin();
        let mut missed = false;
        for contact in contacts {
            let Pair::Deformable(meeting) = &contact.pair else { continue };
            missed |= meeting.add_force(fields, request, &mut contact.state, own, remote.reborrow());
        }
        missed
    });
    missed.unwrap_or(false)
}

impl<const D: usize> Dynamics for ContactSystem<D> {
    fn prescribe(&mut self, stage: &mut Stage) -> Result<()> {
        let (time, factor) = (stage.trial.time, stage.load_factor);
        let filled = {
            let (mut u, mut v, mut a) =
                (stage.trial.u.local_mut(), stage.trial.v.local_mut(), stage.trial.a.local_mut());
            let fields = Fields { u: &mut u, v: &mut v, a: &mut a };
            self.supports.fill(&self.local.mesh.points, time, factor, fields)
        };
        self.trouble = filled.err();
        stage.trial.u.update_ghosts()?;
        stage.trial.v.update_ghosts()
    }

    fn residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual> {
        self.balance(stage, Branches::Actual, out)
    }

    fn predicts(&self) -> bool {
        self.changes.flipped > 0
    }

    fn predicted_residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual> {
        self.balance(stage, Branches::Predicted, out)
    }

    fn jacobian(&mut self, stage: &Stage, terms: Terms, lift: Option<Lift>) -> Result<()> {
        self.assemble(stage, terms, Target::Own, lift)
    }

    fn jacobian_into(&mut self, stage: &Stage, terms: Terms, matrix: &mut Matrix) -> Result<()> {
        self.assemble(stage, terms, Target::Other(matrix), None)
    }

    fn matrix(&self) -> &Matrix {
        &self.matrix
    }

    fn is_symmetric(&self, stage: &Stage, terms: Terms) -> bool {
        symmetric(&self.contacts, &self.external, stage, terms)
    }

    fn observe(&mut self) -> Result<ContactCounts> {
        let mut own = Changes::default();
        let (mut stick, mut slip) = (0, 0);
        for contact in &mut self.contacts {
            own += contact.iterate();
            let summary = contact.surface().summary(&contact.state);
            stick += summary.stick;
            slip += summary.slip;
        }
        let counts = [own.closed, own.changed, own.alternating, own.flipped, stick, slip].map(|n| n as u64);
        let mut total = [0u64; 6];
        self.session.world().all_reduce_into(&counts[..], &mut total[..], SystemOperation::sum());
        let [closed, changed, alternating, flipped, stick, slip] = total;
        let usize_of = |n: u64| n as usize;
        self.changes = Changes {
            closed: usize_of(closed),
            changed: usize_of(changed),
            alternating: usize_of(alternating),
            flipped: usize_of(flipped),
        };
        Ok(ContactCounts { closed, stick, slip, changed, flipped })
    }

    fn reverses(&self) -> bool {
        let own = u8::from(self.contacts.iter().any(|contact| contact.state.reverses()));
        let mut any = 0;
        self.session.world().all_reduce_into(&own, &mut any, SystemOperation::max());
        any > 0
    }

    fn freeze(&mut self, what: Freeze) {
        stages::freeze(&mut self.contacts, what);
    }

    fn force_change(&self) -> ForceChange {
        stages::force_change(self.session.world(), &self.contacts)
    }

    fn contact_normals(&mut self, out: &mut Vector) -> Result<()> {
        let (world, nodes) = (self.session.world(), self.local.mesh.points.len());
        stages::contact_normals(world, &self.contacts, self.interface.as_mut(), nodes, out);
        Ok(())
    }

    fn is_cycling(&self) -> bool {
        self.changes.is_two_cycle()
    }

    fn stride(&self) -> f64 {
        let strides = self.contacts.iter().filter_map(|contact| contact.meeting().map(Meeting::stride));
        strides.fold(f64::INFINITY, f64::min)
    }

    fn rewind(&mut self) {
        self.contacts.iter_mut().for_each(Contact::begin_step);
    }

    fn fault(&mut self) -> Option<Error> {
        let own = self.fault.map(|inverted| self.describe(&inverted));
        agree(self.session.world(), own.map_or(Ok(()), Err)).err()
    }

    fn restless_points(&mut self) -> String {
        match self.changes.changed {
            0 => String::new(),
            1 => "1 contact point still changes its status".to_owned(),
            n => format!("{n} contact points still change their status"),
        }
    }

    fn extent(&self) -> f64 {
        self.extent
    }
}

/// Friction, a changing area or a following load make the matrix non-symmetric.
fn symmetric<const D: usize>(
    contacts: &[Contact<D>],
    external: &External<D>,
    stage: &Stage,
    terms: Terms,
) -> bool {
    let friction = stage.friction == FrictionMode::AsGiven;
    let coupled = Terms::FRICTION_NORMAL_COUPLING | Terms::FRICTION_GEOMETRY;
    let contact = |contact: &Contact<D>| {
        let area = contact.area() == AreaKind::Current;
        (friction && contact.law().friction.is_some() && terms.intersects(coupled))
            || (area && terms.contains(Terms::ZONE_CHANGE))
    };
    let follows = external.follows() && terms.contains(Terms::FOLLOWING_LOAD);
    !follows && !contacts.iter().any(contact)
}
