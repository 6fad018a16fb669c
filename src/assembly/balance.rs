//! The residual (3.9): forces of elements, contacts, springs and loads, and the inertia.

use mpi::traits::CommunicatorCollectives;

use super::contact_forces::add_contact_forces;
use super::external::Moment;
use super::forces::SolidFields;
use super::patches::solid_terms;
use super::stages::{active_damping, hold};
use super::system::{ContactSystem, ForceParts};
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::state::Branches;
use crate::dynamics::{Equations, OverStep, Residual, Stage};
use crate::error::{Result, agree};
use crate::petsc::{Vector, sum_over_ranks};

/// Sums of squares of the residual and its parts [N^2], and numbers of ranks.
#[derive(Debug, Clone, Copy, Default)]
struct ResidualSums {
    residual: f64,
    internal: f64,
    contact: f64,
    external: f64,
    springs: f64,
    inertia: f64,
    /// Ranks with an error.
    trouble: f64,
    /// Ranks with a contact that has to search again.
    stale: f64,
}

impl ResidualSums {
    fn add_all_ranks(&mut self, world: &impl CommunicatorCollectives) {
        let Self { residual, internal, contact, external, springs, inertia, trouble, stale } = self;
        sum_over_ranks(world, [residual, internal, contact, external, springs, inertia, trouble, stale]);
    }

    /// Norm of the residual, and the largest norm of its parts.
    ///
    /// If a part is not finite, the norm is NaN, also if only prescribed unknowns are affected: no
    /// residual is small compared with NaN.
    fn residual(&self) -> Residual {
        let parts = [self.internal, self.contact, self.external, self.springs, self.inertia];
        let scale = parts.into_iter().fold(0.0, f64::max).sqrt();
        let sound = parts.into_iter().all(f64::is_finite);
        Residual { norm: if sound { self.residual.sqrt() } else { f64::NAN }, scale }
    }
}

impl<const D: usize> ContactSystem<D> {
    pub(super) fn moment<'a>(stage: &Stage, factor: f64, u: &'a [f64]) -> Moment<'a> {
        Moment { time: stage.trial.time, u, factor }
    }

    /// Computes the parts of the forces at the trial state. Records an inverted element.
    pub(super) fn sweep(&mut self, stage: &Stage, branches: Branches) {
        self.place_targets(stage);
        self.bodies.prepare_viscous(stage);
        let (u, v, u_start) = (stage.trial.u.local(), stage.trial.v.local(), stage.start.u.local());
        let ForceParts { internal, contact, external, springs } = &mut self.parts;
        contact.fill(0.0);
        let fields = ContactFields { u: &u, v: &v, u_start: &u_start };
        let over_step = stage.over_step == OverStep::Middle;
        // Over a step the prescribed jump of ties is the mean of those at its ends.
        let times =
            if over_step { [stage.start.time, stage.start.time + stage.dt] } else { [stage.trial.time; 2] };
        let hold = hold(self.continuation.friction, self.split);
        let factor = self.continuation.load_factor;
        let request = ContactRequest {
            stiffness: None,
            hold,
            branches,
            over_step,
            step: stage.dt,
            damping: active_damping(self.continuation.damped),
        };
        let solids = &self.bodies.solids;
        let patches = &self.bodies.patches;
        let elastic = &mut self.bodies.elastic;
        let ties = &mut self.bodies.ties;
        let damped = self.continuation.damped;
        let loads = &mut self.external;
        let phases = &self.phases;
        let fault = &mut self.fault;
        let free = &self.bodies.free;
        let trouble = &mut self.trouble;
        let mut bodies = || {
            // Predicted branches change only the contact forces, and follow a residual at the same
            // state.
            if branches != Branches::Actual {
                return;
            }
            let _running = phases.forces.begin();
            *fault = None;
            internal.fill(0.0);
            for terms in solid_terms(solids, patches) {
                if let Err(inverted) = terms.add_force(&SolidFields::of(stage, &u, &u_start), internal) {
                    fault.get_or_insert(inverted);
                }
            }
            elastic.evaluate(&u, damped.then_some(&v[..]));
            if let Err(error) = ties.evaluate(&u, times) {
                trouble.get_or_insert(error);
            }
            springs.fill(0.0);
            elastic.add_springs(springs);
            ties.add_forces(springs);
            external.fill(0.0);
            loads.add_force(&Self::moment(stage, factor, &u), solids, external);
            if let Err(error) = free.add_forces(stage, factor, internal, external) {
                trouble.get_or_insert(error);
            }
        };
        let Some(interface) = &mut self.interface else { return bodies() };
        let world = self.bodies.session.world();
        if branches == Branches::Actual {
            interface.bring(world, &fields);
        }
        // Contact comes first, so that its forces have arrived when the elements are finished.
        add_contact_forces(interface, &mut self.contacts, world, phases, &request, contact, bodies);
    }

    /// Computes `M (w_0 a_start + w_1 a_end)` into `work`. Does nothing without inertia.
    pub(super) fn weigh_inertia(&mut self, stage: &Stage) -> Result<()> {
        let Some(mass) = self.bodies.mass.as_ref().filter(|_| stage.inertia) else {
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
            let target = |dof: usize, _| stage.balance.start_force * start[dof] + end[dof];
            self.bodies.held().replace_held(&mut mean, target);
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
        match &self.bodies.damping {
            Some(damping) if self.continuation.damped => {
                damping.multiply(&stage.trial.v, &mut self.damping)?;
            }
            _ => self.damping.set(0.0),
        }
        if self.bodies.elastic.is_damped() {
            self.bodies.elastic.add_dashpots(&mut self.damping.owned_mut());
        }
        let mut sums = ResidualSums::default();
        {
            let (mut forces, mut out) = (self.forces.owned_mut(), out.owned_mut());
            let (inertia, start) = (self.work.owned(), stage.start_forces.owned());
            let ForceParts { internal, contact, external, springs } = &self.parts;
            let damping = self.damping.owned();
            for i in 0..out.len() {
                let body = internal[i] + damping.get(i).copied().unwrap_or(0.0);
                forces[i] = body + springs[i] - external[i] - contact[i];
                out[i] = inertia[i] + stage.balance.start_force * start[i] + forces[i];
                sums.internal += body * body;
                sums.contact += contact[i] * contact[i];
                sums.external += external[i] * external[i];
                sums.springs += springs[i] * springs[i];
                sums.inertia += inertia[i] * inertia[i];
            }
            self.bodies.held().clear(&mut out);
            sums.residual = out.iter().map(|residual| residual * residual).sum();
        }
        if self.fault.is_some() {
            sums.residual = f64::NAN;
        }
        sums.trouble = f64::from(u8::from(self.trouble.is_some()));
        sums.stale = f64::from(u8::from(self.is_stale(stage)));
        let world = self.bodies.session.world();
        sums.add_all_ranks(world);
        if sums.trouble > 0.0 {
            agree(world, self.trouble.take().map_or(Ok(()), Err))?;
        }
        let residual = sums.residual();
        Ok((residual, sums.stale > 0.0 && residual.norm.is_finite()))
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

    /// Computes `M a + C v + Q + K_s u - F_ext - F_n - F_T` of the trial state: zero on free unknowns, reactions
    /// on prescribed ones \[N\].
    ///
    /// Call it after [`Equations::residual`] at the same state. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn imbalance(&mut self, stage: &Stage, out: &mut Vector) -> Result<()> {
        match self.bodies.mass.as_ref().filter(|_| stage.inertia) {
            Some(mass) => mass.multiply(&stage.trial.a, out)?,
            None => out.set(0.0),
        }
        out.axpy(1.0, &self.forces)
    }
}
