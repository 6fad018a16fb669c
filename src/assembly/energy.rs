//! The energy ledger: where energy is, where it went, and what the integration leaves over; and the momentum.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::system::ContactSystem;
use crate::dynamics::{OverStep, Stage};
use crate::error::Result;
use crate::petsc::Vector;
use serde::{Deserialize, Serialize};

/// Energies of one instant and sums since the start [J, per metre of depth in 2D].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// `v . M v / 2`.
    pub kinetic: f64,
    /// Stored in the solids.
    pub strain: f64,
    /// Stored by the contact laws.
    pub contact: f64,
    /// Turned into heat by friction since the start.
    pub friction_dissipated: f64,
    /// Work of loads and supports since the start.
    pub external_work: f64,
    /// What was lost without a cause since the start: work done less energy gained less heat.
    pub numerical: f64,
}

impl Energies {
    /// Whether all are numbers.
    pub fn is_finite(&self) -> bool {
        let Self { kinetic, strain, contact, friction_dissipated, external_work, numerical } = self;
        [kinetic, strain, contact, friction_dissipated, external_work, numerical]
            .iter()
            .all(|e| e.is_finite())
    }

    /// Kinetic, strain and contact energy.
    pub fn total(&self) -> f64 {
        self.kinetic + self.strain + self.contact
    }
}

/// Momentum of all bodies together at one instant, per metre of depth in 2D.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Momentum {
    /// `int rho v dV`, the components that the space has \[N s\].
    pub linear: [f64; 3],
    /// `int rho x x v dV` about the origin at the current places; in the plane the last component alone [N m s].
    pub angular: [f64; 3],
}

/// Sums up work and heat from step to step.
pub struct EnergyLedger {
    /// Loads and reactions at the start of the step \[N\].
    drive: Vec<f64>,
    at_start: f64,
    now: Energies,
    momentum: Momentum,
    reactions: Vector,
}

/// A ledger before a step.
pub struct SavedLedger {
    drive: Vec<f64>,
    now: Energies,
    momentum: Momentum,
}

/// What a ledger remembers from step to step, beside the [`EnergyLedger::drive`] of each rank.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Balances {
    /// Energy at the start \[J\].
    pub at_start: f64,
    /// The energies of the last step.
    pub now: Energies,
}

impl EnergyLedger {
    /// A ledger that goes on from what another one remembered, with its `drive` \[N\]; `reactions` is where the next ones go.
    pub fn resume(balances: Balances, drive: Vec<f64>, reactions: Vector) -> Self {
        let Balances { at_start, now } = balances;
        Self { drive, at_start, now, momentum: Momentum::default(), reactions }
    }

    /// What to go on from.
    pub fn balances(&self) -> Balances {
        Balances { at_start: self.at_start, now: self.now }
    }

    /// Loads and reactions at the end of the last step, owned unknowns \[N\].
    pub fn drive(&self) -> &[f64] {
        &self.drive
    }

    /// A ledger that begins at the start of `stage`, where `reactions` act on the supports. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn begin<const D: usize>(
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
        reactions: Vector,
    ) -> Result<Self> {
        let drive = vec![0.0; reactions.owned_len()];
        let mut ledger =
            Self { drive, at_start: 0.0, now: Energies::default(), momentum: Momentum::default(), reactions };
        let [kinetic, strain, contact, ..] = ledger.step(system, stage, 0.0)?;
        ledger.now = Energies { kinetic, strain, contact, ..Energies::default() };
        ledger.at_start = ledger.now.total();
        Ok(ledger)
    }

    /// Energies at the end of the step in `stage`; to be called before it is accepted. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn advance<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
    ) -> Result<Energies> {
        let dt = stage.dt;
        let [kinetic, strain, contact, heat, work] = self.step(system, stage, dt)?;
        let friction_dissipated = self.now.friction_dissipated + heat;
        let external_work = self.now.external_work + work;
        let gained = kinetic + strain + contact - self.at_start;
        let numerical = external_work - gained - friction_dissipated;
        self.now = Energies { kinetic, strain, contact, friction_dissipated, external_work, numerical };
        Ok(self.now)
    }

    /// What [`restore`](Self::restore) takes back to: the ledger before a step that may be repeated.
    pub fn save(&self) -> SavedLedger {
        SavedLedger { drive: self.drive.clone(), now: self.now, momentum: self.momentum }
    }

    /// The step since then is repeated.
    pub fn restore(&mut self, saved: SavedLedger) {
        (self.drive, self.now, self.momentum) = (saved.drive, saved.now, saved.momentum);
    }

    /// The energies of the last step.
    pub fn now(&self) -> &Energies {
        &self.now
    }

    /// The momentum at the end of the last step.
    pub fn momentum(&self) -> &Momentum {
        &self.momentum
    }

    /// Reactions of the supports at the end of the last step, owned unknowns \[N\].
    pub fn reactions(&self) -> &Vector {
        &self.reactions
    }

    /// Kinetic, strain, contact energy; heat and work of the step.
    fn step<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
        dt: f64,
    ) -> Result<[f64; 5]> {
        system.imbalance(stage, &mut self.reactions)?;
        let (kinetic, momentum) = system.motion(stage)?;
        let mut own = [0.0; 11];
        own[0] = kinetic;
        own[5..8].copy_from_slice(&momentum.linear);
        own[8..11].copy_from_slice(&momentum.angular);
        let u = stage.trial.u.local();
        own[1] = system.solids.iter().map(|solid| solid.group.strain_energy(&u, &system.local.mine)).sum();
        for contact in &system.contacts {
            let energy = contact.energy(dt);
            own[2] += energy.stored;
            own[3] += energy.heat_of_step;
        }
        let (reactions, before) = (self.reactions.owned(), stage.start.u.owned());
        let constrained = &system.supports.dofs.constrained;
        for (i, drive) in self.drive.iter_mut().enumerate() {
            let reaction = if constrained[i] { reactions[i] } else { 0.0 };
            let now = system.parts.external[i] + reaction;
            // Over a step that conserves, the forces now are those that acted all the while.
            let mean = if stage.over_step == OverStep::End { now } else { 0.5 * (*drive + now) };
            own[4] += mean * (u[i] - before[i]);
            *drive = now;
        }
        let mut total = [0.0; 11];
        system.session.world().all_reduce_into(&own[..], &mut total[..], SystemOperation::sum());
        let three = |k: usize| [total[k], total[k + 1], total[k + 2]];
        self.momentum = Momentum { linear: three(5), angular: three(8) };
        Ok([total[0], total[1], total[2], total[3], total[4]])
    }
}

impl<const D: usize> ContactSystem<D> {
    /// This rank's shares of `v . M v / 2` \[J\] and of the momentum at the trial state. Collective.
    fn motion(&mut self, stage: &Stage) -> Result<(f64, Momentum)> {
        let Some(mass) = &self.mass else { return Ok((0.0, Momentum::default())) };
        mass.multiply(&stage.trial.v, &mut self.inertia)?;
        let (u, v, p) = (stage.trial.u.owned(), stage.trial.v.owned(), self.inertia.owned());
        let kinetic = 0.5 * v.iter().zip(p.iter()).map(|(v, p)| v * p).sum::<f64>();
        let mut momentum = Momentum::default();
        for ((place, u), p) in self.local.mesh.points.iter().zip(u.chunks_exact(D)).zip(p.chunks_exact(D)) {
            let at = |i: usize| if i < D { place[i] + u[i] } else { 0.0 };
            let p = |i: usize| if i < D { p[i] } else { 0.0 };
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                momentum.linear[i] += p(i);
                momentum.angular[i] += at(j) * p(k) - at(k) * p(j);
            }
        }
        Ok((kinetic, momentum))
    }
}
