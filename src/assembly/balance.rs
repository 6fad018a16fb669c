//! The residual (3.9): forces of elements, contacts and loads, and the inertia.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact_forces::add_contact_forces;
use super::external::Moment;
use super::forces::At;
use super::stages::hold;
use super::system::{ContactSystem, ForceParts};
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::state::Branches;
use crate::dynamics::{Equations, OverStep, Residual, Stage};
use crate::error::{Result, agree};
use crate::petsc::Vector;

impl<const D: usize> ContactSystem<D> {
    pub(super) fn moment<'a>(stage: &Stage, factor: f64, u: &'a [f64]) -> Moment<'a> {
        Moment { time: stage.trial.time, u, factor }
    }

    /// Computes the three parts of the forces at the trial state. Records an inverted element.
    pub(super) fn sweep(&mut self, stage: &Stage, branches: Branches) {
        self.place_targets(stage);
        let (u, v, u_start) = (stage.trial.u.local(), stage.trial.v.local(), stage.start.u.local());
        let ForceParts { internal, contact, external } = &mut self.parts;
        contact.fill(0.0);
        let fields = ContactFields { u: &u, v: &v, u_start: &u_start };
        let over_step = stage.over_step == OverStep::Middle;
        let hold = hold(self.continuation.friction, self.split);
        let factor = self.continuation.load_factor;
        let request = ContactRequest { stiffness: None, hold, branches, over_step };
        let solids = &self.solids;
        let loads = &mut self.external;
        let phases = &self.phases;
        let fault = &mut self.fault;
        let mut bodies = || {
            // Predicted branches change only the contact forces, and follow a residual at the same
            // state.
            if branches == Branches::Predicted {
                return;
            }
            let _running = phases.forces.begin();
            *fault = None;
            internal.fill(0.0);
            for solid in solids {
                if let Err(inverted) = solid.add_force(&At::of(stage, &u, &u_start), internal) {
                    fault.get_or_insert(inverted);
                }
            }
            external.fill(0.0);
            loads.add_force(&Self::moment(stage, factor, &u), solids, external);
        };
        let Some(interface) = &mut self.interface else { return bodies() };
        let world = self.session.world();
        if branches == Branches::Actual {
            interface.bring(world, &fields);
        }
        // Contact comes first, so that its forces have arrived when the elements are finished.
        add_contact_forces(interface, &mut self.contacts, world, phases, &request, contact, bodies);
    }

    /// Computes `M (w_0 a_start + w_1 a_end)` into `work`. Does nothing without inertia.
    pub(super) fn weigh_inertia(&mut self, stage: &Stage) -> Result<()> {
        let Some(mass) = self.mass.as_ref().filter(|_| stage.inertia) else {
            self.work.set(0.0);
            return Ok(());
        };
        let [at_start, at_end] = stage.balance.mass;
        self.inertia.copy_from(&stage.trial.a)?;
        self.inertia.axpby(at_start, at_end, &stage.start.a)?;
        // The scheme's own accelerations lag, so that their mean is at the time of the mean force.
        // Prescribed accelerations do not lag. They take the weights of the forces; otherwise the
        // scheme falls to first order.
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

    /// Residual on the free unknowns for the given branches of the friction law.
    pub(super) fn balance(
        &mut self,
        stage: &Stage,
        branches: Branches,
        out: &mut Vector,
    ) -> Result<Residual> {
        let (residual, stale) = self.weigh(stage, branches, out)?;
        if !stale {
            return Ok(residual);
        }
        {
            let (u, v, u_start) = (stage.trial.u.local(), stage.trial.v.local(), stage.start.u.local());
            self.renew(&ContactFields { u: &u, v: &v, u_start: &u_start }, stage.over_step)?;
        }
        self.weigh(stage, branches, out).map(|(residual, _)| residual)
    }

    /// Computes the residual, and whether contacts have to search again.
    pub(super) fn weigh(
        &mut self,
        stage: &Stage,
        branches: Branches,
        out: &mut Vector,
    ) -> Result<(Residual, bool)> {
        self.sweep(stage, branches);
        self.trouble = self.trouble.take().or_else(|| self.external.take_trouble());
        self.weigh_inertia(stage)?;
        let mut sums = [0.0; 7];
        {
            let (mut forces, mut out) = (self.forces.owned_mut(), out.owned_mut());
            let (inertia, start) = (self.work.owned(), stage.start_forces.owned());
            let ForceParts { internal, contact, external } = &self.parts;
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
        sums[6] = f64::from(u8::from(self.is_stale(stage)));
        let mut total = [0.0; 7];
        self.session.world().all_reduce_into(&sums[..], &mut total[..], SystemOperation::sum());
        if total[5] > 0.0 {
            agree(self.session.world(), self.trouble.take().map_or(Ok(()), Err))?;
        }
        let scale = total[1..5].iter().copied().fold(0.0, f64::max).sqrt();
        // This also applies if only prescribed unknowns are affected: no residual is small compared
        // with NaN.
        let sound = total[1..5].iter().all(|sum| sum.is_finite());
        let residual = Residual { norm: if sound { total[0].sqrt() } else { f64::NAN }, scale };
        Ok((residual, total[6] > 0.0 && residual.norm.is_finite()))
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
            let dofs = mass.massless().iter().flat_map(|&node| node as usize * D..node as usize * D + D);
            for dof in dofs.filter(|&dof| !self.supports.dofs.constrained[dof]) {
                v[dof] = (end[dof] - start[dof]) / stage.dt;
                a[dof] = 0.0;
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

    /// Sets the prescribed unknowns at the end of a step over which forces conserve. Accelerations
    /// stay those of its midpoint, to which the reactions belong. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn settle_end(&mut self, stage: &mut Stage) -> Result<()> {
        self.work.copy_from(&stage.trial.a)?;
        self.prescribe(stage)?;
        stage.trial.a.copy_from(&self.work)
    }

    /// Computes `M a + Q - F_ext - F_n - F_T` of the trial state: zero on free unknowns, reactions
    /// on prescribed ones \[N\].
    ///
    /// Call it after [`Equations::residual`] at the same state. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn imbalance(&mut self, stage: &Stage, out: &mut Vector) -> Result<()> {
        match self.mass.as_ref().filter(|_| stage.inertia) {
            Some(mass) => mass.multiply(&stage.trial.a, out)?,
            None => out.set(0.0),
        }
        out.axpy(1.0, &self.forces)
    }
}
