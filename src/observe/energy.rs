//! Energy ledger (4.12): stored energies, work, heat and the numerical loss of the integration.
//! Also the momentum. One entry of [`ENERGY_COLUMNS`] is one column of `energy.csv`, one of
//! [`MOMENTUM_COLUMNS`] a vector in `momentum.csv`.

use super::quantity::{Column, ReportedQuantity, STEP, TIME, TableFile, Value};
use crate::assembly::{ContactSystem, ToolState};
use crate::contact::totals::ContactEnergy;
use crate::dynamics::{OverStep, Stage};
use crate::error::Result;
use crate::petsc::{Vector, sum_over_ranks};
use serde::{Deserialize, Serialize};

/// Energies at one instant and sums since the start [J, per metre of depth in 2D].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Kinetic energy, `v . M v / 2`.
    pub kinetic: f64,
    /// Strain energy of the solids.
    pub strain: f64,
    /// Energy of the springs of viscous branches.
    pub viscous_stored: f64,
    /// Energy stored by the contact laws.
    pub contact: f64,
    /// Energy stored by foundations, springs and ties.
    #[serde(default)]
    pub springs: f64,
    /// Heat from friction since the start.
    pub friction_dissipated: f64,
    /// Heat from damping of bodies and contacts and from dashpots since the start.
    pub damping_dissipated: f64,
    /// Heat from viscous branches since the start.
    pub viscous_dissipated: f64,
    /// Work of loads, supports and rigid bodies since the start.
    pub external_work: f64,
    /// Numerical loss since the start: work done, minus gain of energy, minus heat.
    pub numerical: f64,
}

impl Energies {
    /// Whether all energies are finite.
    pub fn is_finite(&self) -> bool {
        ENERGY_COLUMNS.iter().all(|column| match column.value {
            Value::Number(energy) => energy(self).is_finite(),
            _ => true,
        })
    }

    /// Sum of kinetic and stored energies.
    pub fn total(&self) -> f64 {
        self.kinetic + self.strain + self.viscous_stored + self.contact + self.springs
    }
}

/// The table of the energies.
pub const ENERGY_FILE: TableFile =
    TableFile { name: "energy.csv", rows: "one per step", keys: &[STEP, TIME] };

/// The table of the momentum.
pub const MOMENTUM_FILE: TableFile =
    TableFile { name: "momentum.csv", rows: "one per step", keys: &[STEP, TIME] };

/// The columns of `energy.csv` after step and time.
pub const ENERGY_COLUMNS: &[Column<Energies>] = &[
    energy("kinetic", "kinetic energy", |energies| energies.kinetic),
    energy("strain", "strain energy of the bodies", |energies| energies.strain),
    energy("viscous_stored", "energy of the springs of viscous branches", |energies| energies.viscous_stored),
    energy("contact", "energy stored by the contact laws", |energies| energies.contact),
    energy("springs", "energy stored by foundations, springs and ties", |energies| energies.springs),
    energy("friction_dissipated", "heat from friction since the start", |energies| {
        energies.friction_dissipated
    }),
    energy(
        "damping_dissipated",
        "heat from damping of bodies and contacts and from dashpots since the start",
        |energies| energies.damping_dissipated,
    ),
    energy("viscous_dissipated", "heat from viscous branches since the start", |energies| {
        energies.viscous_dissipated
    }),
    energy("external_work", "work of loads, supports and moving rigid bodies since the start", |energies| {
        energies.external_work
    }),
    energy("numerical", "energy that the balance leaves over", |energies| energies.numerical),
    energy(
        "total",
        "sum of kinetic, strain, viscous and contact energy and that of springs",
        Energies::total,
    ),
];

const fn energy(name: &'static str, about: &'static str, value: fn(&Energies) -> f64) -> Column<Energies> {
    Column { quantity: ReportedQuantity::number(name, "J", about), value: Value::Number(value) }
}

/// The columns of `momentum.csv` after step and time.
pub const MOMENTUM_COLUMNS: &[Column<Momentum>] = &[
    Column {
        quantity: ReportedQuantity::vector("linear", "N s", "linear momentum of all bodies"),
        value: Value::Vector(|momentum| momentum.linear),
    },
    Column {
        quantity: ReportedQuantity::rotation(
            "angular",
            "N m s",
            "angular momentum of all bodies about the origin, at the current positions",
        ),
        value: Value::Vector(|momentum| momentum.angular),
    },
];

/// Total momentum of all bodies at one instant, per metre of depth in 2D.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Momentum {
    /// `int rho v dV`, as many components as dimensions \[N s\].
    pub linear: [f64; 3],
    /// `int rho x x v dV` about the origin at the current positions. In 2D only the last component
    /// is used [N m s].
    pub angular: [f64; 3],
}

/// Energies of one contact [J, per metre of depth in 2D].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactEnergies {
    /// Energy stored by the laws of the contact at the end of the last step.
    pub stored: f64,
    /// Energy stored by the laws of the contact at the start.
    pub stored_at_start: f64,
    /// Heat from friction since the start.
    pub friction_work: f64,
    /// Heat from damping of the contact since the start.
    pub damping_work: f64,
}

impl ContactEnergies {
    /// Work of its forces on both sides since the start: what they neither store nor turn into heat. The
    /// error of the time integration is not in it.
    pub fn work(&self) -> f64 {
        self.stored_at_start - self.stored - self.friction_work - self.damping_work
    }
}

/// Accumulates work and heat over the steps.
pub struct EnergyLedger {
    /// Loads and reactions at the start of the step \[N\].
    drive: Vec<f64>,
    /// Whether there is damping.
    damped: bool,
    /// Damping forces at the start of the step \[N\]; empty without damping.
    damping: Vec<f64>,
    /// Forces of the rigid bodies at the start of the step, and their work.
    rigid: Vec<RigidWork>,
    /// Rigid bodies at the end of the last step.
    tools: Vec<ToolState>,
    /// Energies of each contact.
    contacts: Vec<ContactEnergies>,
    at_start: f64,
    now: Energies,
    momentum: Momentum,
    reactions: Vector,
    /// Momenta of the nodes \[N s\].
    momenta: Vector,
    /// The previous load step, in statics.
    last: Option<LoadStep>,
    /// Bound on the error of the work \[J\].
    work_error: f64,
}

/// State of a ledger before a step.
pub struct SavedLedger {
    drive: Vec<f64>,
    damping: Vec<f64>,
    rigid: Vec<RigidWork>,
    tools: Vec<ToolState>,
    contacts: Vec<ContactEnergies>,
    now: Energies,
    momentum: Momentum,
    last: Option<LoadStep>,
    work_error: f64,
}

/// Force that a rigid body exerts, and its work since the start.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct RigidWork {
    /// Force \[N\], then torque about the reference point \[N m\], on the deformable bodies.
    exerted: [f64; 6],
    /// Work \[J\].
    work: f64,
}

/// Energies at the end of a step, and heat and work of the step \[J\].
#[derive(Debug, Clone, Copy, Default)]
struct StepEnergies {
    kinetic: f64,
    strain: f64,
    contact: f64,
    springs: f64,
    heat: f64,
    damping: f64,
    viscous_stored: f64,
    /// Work against the stress of viscous branches.
    viscous: f64,
    work: f64,
}

/// Changes in a load step, on owned unknowns.
#[derive(Debug, Clone)]
struct LoadStep {
    /// Change of loads and reactions \[N\].
    drive: Vec<f64>,
    /// Change of the displacement \[m\].
    motion: Vec<f64>,
    /// Change of the force of each rigid body and of each pair of tied surfaces, and its motion, the
    /// same on all ranks.
    driven: Vec<[[f64; 6]; 2]>,
    /// Length of the step \[s\].
    dt: f64,
    /// `sum |dF_i du_i|` over all ranks \[J\].
    area: f64,
    /// Whether no previous step was known, so that the error of the work is counted by its bound.
    first: bool,
}

/// State of a ledger between steps, except for its [fields](EnergyLedger::fields).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Balances {
    /// Energy at the start \[J\].
    pub at_start: f64,
    /// The energies of the last step.
    pub now: Energies,
    /// Bound on the error of the work \[J\].
    pub work_error: f64,
    /// Whether there is damping.
    damped: bool,
    /// Forces and work of the rigid bodies.
    rigid: Vec<RigidWork>,
    /// Energies of each contact.
    #[serde(default)]
    contacts: Vec<ContactEnergies>,
    /// The previous load step. It is `None` in dynamics.
    last: Option<LastLoadStep>,
}

/// The previous load step, except for its fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LastLoadStep {
    /// Its length \[s\].
    dt: f64,
    /// The product of its changes \[J\].
    area: f64,
    /// Whether it was the first one.
    first: bool,
    /// Change of the force of each rigid body and of each pair of tied surfaces, and its motion.
    driven: Vec<[[f64; 6]; 2]>,
}

impl EnergyLedger {
    /// Creates a ledger without any energy. The reactions are written to `reactions`.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn empty(reactions: Vector) -> Result<Self> {
        Ok(Self {
            drive: vec![0.0; reactions.owned_len()],
            damped: false,
            damping: Vec::new(),
            rigid: Vec::new(),
            tools: Vec::new(),
            contacts: Vec::new(),
            at_start: 0.0,
            now: Energies::default(),
            momentum: Momentum::default(),
            momenta: reactions.like()?,
            reactions,
            last: None,
            work_error: 0.0,
        })
    }

    /// Returns the numbers that are needed to resume.
    pub fn balances(&self) -> Balances {
        let last = self.last.as_ref().map(|last| LastLoadStep {
            dt: last.dt,
            area: last.area,
            first: last.first,
            driven: last.driven.clone(),
        });
        let rigid = self.rigid.clone();
        Balances {
            at_start: self.at_start,
            now: self.now,
            work_error: self.work_error,
            damped: self.damped,
            rigid,
            contacts: self.contacts.clone(),
            last,
        }
    }

    /// Returns the fields that are needed to resume, on owned unknowns.
    pub fn fields(&self) -> Vec<(String, Vec<f64>)> {
        let drive = ("drive".to_owned(), self.drive.clone());
        let of_last = |last: &LoadStep| {
            [("last_drive".to_owned(), last.drive.clone()), ("last_motion".to_owned(), last.motion.clone())]
        };
        let damping = self.damped.then(|| ("damping".to_owned(), self.damping.clone()));
        std::iter::once(drive).chain(damping).chain(self.last.iter().flat_map(of_last)).collect()
    }

    /// Resumes from stored balances. `field` returns the stored field of this name.
    ///
    /// # Errors
    /// A field is missing.
    pub fn resume(&mut self, balances: Balances, field: impl Fn(&str) -> Result<Vec<f64>>) -> Result<()> {
        let Balances { at_start, now, work_error, damped, rigid, contacts, last } = balances;
        self.rigid = rigid;
        self.contacts = contacts;
        self.at_start = at_start;
        self.now = now;
        self.work_error = work_error;
        self.drive = field("drive")?;
        self.damped = damped;
        if damped {
            self.damping = field("damping")?;
        }
        self.last = match last {
            Some(LastLoadStep { dt, area, first, driven }) => {
                let (drive, motion) = (field("last_drive")?, field("last_motion")?);
                Some(LoadStep { drive, motion, driven, dt, area, first })
            }
            None => None,
        };
        Ok(())
    }

    /// Bound on the error of the work of loads and supports since the start \[J\]. A load step
    /// integrates the work by the trapezoidal rule. The bound is 0 in dynamics.
    pub fn work_error(&self) -> f64 {
        self.work_error
    }

    /// Loads and reactions at the end of the last step, owned unknowns \[N\].
    pub fn drive(&self) -> &[f64] {
        &self.drive
    }

    /// Creates a ledger at the start of `stage`, with the `reactions` that act on the supports.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn begin<const D: usize>(
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
        reactions: Vector,
    ) -> Result<Self> {
        let mut ledger = Self::empty(reactions)?;
        let StepEnergies { kinetic, strain, contact, springs, .. } = ledger.step(system, stage, 0.0)?;
        ledger.now = Energies { kinetic, strain, contact, springs, ..Energies::default() };
        ledger.at_start = ledger.now.total();
        ledger.contacts.iter_mut().for_each(|contact| contact.stored_at_start = contact.stored);
        Ok(ledger)
    }

    /// Computes the energies at the end of the step in `stage`. Call it before the step is
    /// accepted. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn advance<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
    ) -> Result<Energies> {
        let dt = stage.dt;
        let before = (!stage.inertia).then(|| (self.drive.clone(), self.rigid.clone()));
        let step = self.step(system, stage, dt)?;
        let StepEnergies { kinetic, strain, contact, springs, viscous_stored, .. } = step;
        before.map_or(Ok(()), |(drive, rigid)| self.add_work_error(system, stage, &drive, &rigid))?;
        let mut now = Energies {
            kinetic,
            strain,
            viscous_stored,
            contact,
            springs,
            friction_dissipated: self.now.friction_dissipated + step.heat,
            damping_dissipated: self.now.damping_dissipated + step.damping,
            // What the springs do not hold is heat.
            viscous_dissipated: self.now.viscous_dissipated + step.viscous
                - (viscous_stored - self.now.viscous_stored),
            external_work: self.now.external_work + step.work,
            numerical: 0.0,
        };
        let heat = now.friction_dissipated + now.damping_dissipated + now.viscous_dissipated;
        now.numerical = now.external_work - (now.total() - self.at_start) - heat;
        self.now = now;
        Ok(self.now)
    }

    /// Saves the ledger before a step that may be repeated, for [`restore`](Self::restore).
    pub fn save(&self) -> SavedLedger {
        SavedLedger {
            drive: self.drive.clone(),
            damping: self.damping.clone(),
            rigid: self.rigid.clone(),
            tools: self.tools.clone(),
            contacts: self.contacts.clone(),
            now: self.now,
            momentum: self.momentum,
            last: self.last.clone(),
            work_error: self.work_error,
        }
    }

    /// Restores the saved state, because the step since then is repeated.
    pub fn restore(&mut self, saved: SavedLedger) {
        let SavedLedger { drive, damping, rigid, tools, contacts, now, momentum, last, work_error } = saved;
        self.drive = drive;
        self.rigid = rigid;
        self.tools = tools;
        self.contacts = contacts;
        self.damping = damping;
        self.now = now;
        self.momentum = momentum;
        self.last = last;
        self.work_error = work_error;
    }

    /// Energies at the end of the last step.
    pub fn now(&self) -> &Energies {
        &self.now
    }

    /// Rigid bodies at the end of the last step, with their work since the start \[J\].
    pub fn rigid(&self) -> impl Iterator<Item = (&ToolState, f64)> + Clone {
        self.tools.iter().zip(self.rigid.iter().map(|rigid| rigid.work))
    }

    /// Energies of each contact at the end of the last step.
    pub fn contacts(&self) -> &[ContactEnergies] {
        &self.contacts
    }

    /// Momentum at the end of the last step.
    pub fn momentum(&self) -> &Momentum {
        &self.momentum
    }

    /// Reactions of the supports at the end of the last step, owned unknowns \[N\].
    pub fn reactions(&self) -> &Vector {
        &self.reactions
    }

    /// Estimates the error of the trapezoidal rule over the load step in `stage`, which began with
    /// the drive `before` and with the forces `rigid_before` of rigid bodies. Collective.
    ///
    /// The work of the step is the integral of `F . du` along the path of equilibria. A parabola
    /// through this step and the previous one, `r` times as long, gives
    ///
    /// `W = trapezoid + (dF_before . du - dF . du_before) / (6 r (r + 1))`.
    ///
    /// The last term estimates the error if the path is resolved. Otherwise each force may have
    /// acted with any value between its values at the ends, which gives the bound
    /// `sum |dF_i du_i| / 2`. This bound also applies to a first step, until the next one shows
    /// that it was resolved.
    fn add_work_error<const D: usize>(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        before: &[f64],
        rigid_before: &[RigidWork],
    ) -> Result<()> {
        let difference = |(now, before): (&f64, &f64)| now - before;
        let drive: Vec<f64> = self.drive.iter().zip(before).map(difference).collect();
        let (now, start) = (stage.trial.u.owned(), stage.start.u.owned());
        let motion: Vec<f64> = now.iter().zip(start.iter()).map(difference).collect();
        let last = self.last.take();
        let rigid = self.tools.iter().zip(rigid_before).map(|(tool, before)| {
            let exerted = tool.exerted();
            let moved = if tool.free { [0.0; 6] } else { tool.moved };
            [std::array::from_fn(|i| exerted[i] - before.exerted[i]), moved]
        });
        let mut driven: Vec<_> = rigid.collect();
        driven.extend(Self::changes_of_ties(system, stage)?);
        let mut step = LoadStep { drive, motion, driven, dt: stage.dt, area: 0.0, first: last.is_none() };
        let mut cross = last.as_ref().map_or(0.0, |last| last.cross(&step));
        step.area = step.own_area();
        sum_over_ranks(system.session().world(), [&mut step.area, &mut cross]);
        step.area += step.driven_area();
        cross += last.as_ref().map_or(0.0, |last| last.driven_cross(&step));
        self.work_error += match &last {
            None => 0.5 * step.area,
            Some(last) => {
                let known = last.error(cross, &step).filter(|_| last.first);
                known.map_or(0.0, |error| error - 0.5 * last.area)
                    + step.error(cross, last).unwrap_or(0.5 * step.area)
            }
        };
        self.last = Some(step);
        Ok(())
    }

    /// Change of the force of each pair of tied surfaces in a load step, and the increment of its
    /// prescribed jump. Collective.
    fn changes_of_ties<const D: usize>(
        system: &ContactSystem<D>,
        stage: &Stage,
    ) -> Result<Vec<[[f64; 6]; 2]>> {
        let (before, now) = (stage.start.u.local(), stage.trial.u.local());
        let mut changes =
            system.bodies().ties().changes(&before, stage.start.time, &now, stage.trial.time)?;
        sum_over_ranks(system.session().world(), changes.iter_mut().flat_map(|change| &mut change.force));
        let padded = |values: [f64; D]| std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0));
        Ok(changes.iter().map(|change| [padded(change.force), padded(change.jump)]).collect())
    }

    /// Computes the energies of the step on all ranks. Collective.
    fn step<const D: usize>(
        &mut self,
        system: &mut ContactSystem<D>,
        stage: &mut Stage,
        dt: f64,
    ) -> Result<StepEnergies> {
        let by_rigid = self.work_of_rigid(system, stage)?;
        system.imbalance(stage, &mut self.reactions)?;
        let u = stage.trial.u.local();
        let strain = system.bodies().strain_energy(&u);
        let ties = system.bodies().ties();
        let springs = system.bodies().elastic_supports().stored_energy(&u)
            + ties.stored_energy(&u, stage.trial.time)?;
        let mut own = StepEnergies { strain, springs, ..StepEnergies::default() };
        own.work += ties.work_of_jumps(&stage.start.u.local(), stage.start.time, &u, stage.trial.time)?;
        (own.kinetic, self.momentum) = self.motion(system, stage)?;
        let mut by_contact: Vec<ContactEnergy> = Vec::with_capacity(system.contacts().len());
        for contact in system.contacts() {
            let energy = contact.energy(dt);
            own.contact += energy.stored;
            own.heat += energy.heat_of_step;
            own.damping += energy.damping_of_step;
            by_contact.push(energy);
        }
        let branches = system.bodies().viscous_energies(stage);
        own.viscous_stored = branches.stored;
        own.viscous = branches.work;
        system.bodies().held().keep(&mut self.reactions.owned_mut());
        let (reactions, before) = (self.reactions.owned(), stage.start.u.owned());
        let external = system.external_forces();
        for (i, drive) in self.drive.iter_mut().enumerate() {
            let now = external[i] + reactions[i];
            // Over a step that conserves energy, the present forces acted during the whole step.
            let mean = if stage.over_step == OverStep::End { now } else { 0.5 * (*drive + now) };
            own.work += mean * (u[i] - before[i]);
            *drive = now;
        }
        let damping = system.damping_forces();
        self.damped = system.is_damped();
        self.damping.resize(damping.len(), 0.0);
        for (i, (force, &now)) in self.damping.iter_mut().zip(damping.iter()).enumerate() {
            let mean = if stage.over_step == OverStep::End { now } else { 0.5 * (*force + now) };
            own.damping += mean * (u[i] - before[i]);
            *force = now;
        }
        let StepEnergies { kinetic, strain, contact, springs, heat, damping, viscous_stored, viscous, work } =
            &mut own;
        let Momentum { linear, angular } = &mut self.momentum;
        let energies =
            [kinetic, strain, contact, springs, heat, damping, viscous_stored, viscous, work].into_iter();
        let of_contacts = by_contact
            .iter_mut()
            .flat_map(|energy| [&mut energy.stored, &mut energy.heat_of_step, &mut energy.damping_of_step]);
        sum_over_ranks(system.session().world(), energies.chain(linear).chain(angular).chain(of_contacts));
        self.contacts.resize(by_contact.len(), ContactEnergies::default());
        for (contact, step) in self.contacts.iter_mut().zip(&by_contact) {
            contact.stored = step.stored;
            contact.friction_work += step.heat_of_step;
            contact.damping_work += step.damping_of_step;
        }
        own.work += by_rigid;
        Ok(own)
    }

    /// Work of the moving rigid bodies in the step \[J\], the same on all ranks. Collective.
    fn work_of_rigid<const D: usize>(&mut self, system: &ContactSystem<D>, stage: &Stage) -> Result<f64> {
        self.tools = system.tools(stage)?;
        self.rigid.resize(self.tools.len(), RigidWork::default());
        let mut total = 0.0;
        for (rigid, tool) in self.rigid.iter_mut().zip(&self.tools) {
            let now = tool.exerted();
            let mean = |i: usize| match stage.over_step {
                OverStep::End => now[i],
                _ => 0.5 * (rigid.exerted[i] + now[i]),
            };
            let work: f64 = (0..6).map(|i| mean(i) * tool.moved[i]).sum();
            *rigid = RigidWork { exerted: now, work: rigid.work + work };
            // The energy that a free body gives is its own.
            if !tool.free {
                total += work;
            }
        }
        Ok(total)
    }

    /// This rank's parts of `v . M v / 2` \[J\] and of the momentum at the trial state. Collective.
    fn motion<const D: usize>(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
    ) -> Result<(f64, Momentum)> {
        if !system.bodies().momenta(&stage.trial.v, &mut self.momenta)? {
            return Ok((0.0, Momentum::default()));
        }
        let u = stage.trial.u.owned();
        let v = stage.trial.v.owned();
        let mut p = self.momenta.owned_mut();
        let kinetic = 0.5 * v.iter().zip(p.iter()).map(|(v, p)| v * p).sum::<f64>();
        let mut momentum = Momentum::default();
        let mut spins = Vec::new();
        system.bodies().spins(stage, &p, |node, angular| spins.push((node, angular)));
        for (node, angular) in spins {
            p[node * D..][..D].fill(0.0);
            momentum.angular.iter_mut().zip(angular).for_each(|(sum, part)| *sum += part);
        }
        let points = &system.bodies().local().mesh.points;
        for ((place, u), p) in points.iter().zip(u.chunks_exact(D)).zip(p.chunks_exact(D)) {
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

impl LoadStep {
    /// A path is resolved if the rule through three points changes the work of a step by less than
    /// this part of its area.
    ///
    /// `F ~ u^(3/2)`, for a round body that is pressed, has 0.04 in its second load step, and less
    /// in later ones. Contact that closes in the middle of a step has 0.08. With half of the value,
    /// the second step of such a body counts as not resolved. With twice the value, contact that
    /// closes counts as resolved, and its error is underestimated by a factor of three.
    const RESOLVED: f64 = 0.05;

    /// Smallest change of forces times displacements in a neighbouring step, relative to this step
    /// and to the square of the length ratio, at which the neighbour is used.
    ///
    /// A neighbour with far smaller changes gives no information on the path: after a load that
    /// acts suddenly, nothing changes in the following steps. From one step of a round body that is
    /// pressed to the next, this ratio is one half or more.
    const ALIKE: f64 = 0.1;

    /// `sum |dF_i du_i|` of this rank \[J\].
    fn own_area(&self) -> f64 {
        self.drive.iter().zip(&self.motion).map(|(drive, motion)| (drive * motion).abs()).sum()
    }

    /// `dF . du_next - dF_next . du` of this rank \[J\].
    fn cross(&self, next: &Self) -> f64 {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        dot(&self.drive, &next.motion) - dot(&next.drive, &self.motion)
    }

    /// `sum |dF_i du_i|` of the rigid bodies and ties \[J\].
    fn driven_area(&self) -> f64 {
        self.driven
            .iter()
            .map(|[drive, motion]| (0..6).map(|i| (drive[i] * motion[i]).abs()).sum::<f64>())
            .sum()
    }

    /// `dF . du_next - dF_next . du` of the rigid bodies and ties \[J\].
    fn driven_cross(&self, next: &Self) -> f64 {
        let dot = |a: &[f64; 6], b: &[f64; 6]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let pairs = self.driven.iter().zip(&next.driven);
        pairs
            .map(|([drive, motion], [next_drive, next_motion])| {
                dot(drive, next_motion) - dot(next_drive, motion)
            })
            .sum()
    }

    /// Estimates the error of the trapezoidal rule in this step by a parabola through it and a
    /// `neighbour` \[J\]. Returns `None` if one of them does not resolve the path.
    ///
    /// `cross` is the [`cross`](Self::cross) of the two \[J\].
    fn error(&self, cross: f64, neighbour: &Self) -> Option<f64> {
        let ratio = neighbour.dt / self.dt;
        let error = cross.abs() / (6.0 * ratio * (ratio + 1.0));
        let is_alike = neighbour.area >= Self::ALIKE * ratio.powi(2) * self.area;
        (is_alike && error <= Self::RESOLVED * self.area).then_some(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The headers of `energy.csv` and `momentum.csv`; components that do not exist in 2D are left
    /// out.
    #[test]
    fn headers_follow_the_contract() {
        use super::super::quantity::headings;
        let energies = headings::<2>(ENERGY_COLUMNS.iter().map(|column| &column.quantity)).join(",");
        assert_eq!(
            energies,
            "kinetic [J],strain [J],viscous_stored [J],contact [J],springs [J],friction_dissipated [J],\
             damping_dissipated [J],viscous_dissipated [J],external_work [J],numerical [J],total [J]"
        );
        let momentum = || MOMENTUM_COLUMNS.iter().map(|column| &column.quantity);
        let plane = headings::<2>(momentum()).join(",");
        assert_eq!(plane, "linear_x [N s],linear_y [N s],angular_z [N m s]");
        assert_eq!(headings::<3>(momentum()).len(), 6);
    }

    /// Each energy is under its name.
    #[test]
    fn energies_are_under_their_names() {
        let energies = Energies {
            kinetic: 1.0,
            strain: 2.0,
            viscous_stored: 3.0,
            contact: 4.0,
            springs: 5.0,
            friction_dissipated: 6.0,
            damping_dissipated: 7.0,
            viscous_dissipated: 8.0,
            external_work: 9.0,
            numerical: 10.0,
        };
        let cells: Vec<_> = ENERGY_COLUMNS.iter().flat_map(|column| column.cells::<2>(&energies)).collect();
        let expected = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 15.0]
            .map(super::super::quantity::Cell::Number);
        assert_eq!(cells, expected);
        assert!(energies.is_finite() && !Energies { numerical: f64::NAN, ..energies }.is_finite());
    }

    /// A step from `t` of a force `t^power` along a displacement `t`, and the error of the
    /// trapezoidal rule in it.
    fn step(power: f64, t: f64, dt: f64) -> (LoadStep, f64) {
        let end = t + dt;
        let (before, after) = (t.powf(power), end.powf(power));
        let exact = (end.powf(power + 1.0) - t.powf(power + 1.0)) / (power + 1.0);
        let change = after - before;
        let step = LoadStep {
            drive: vec![change],
            motion: vec![dt],
            driven: Vec::new(),
            dt,
            area: change * dt,
            first: true,
        };
        (step, 0.5 * (before + after) * dt - exact)
    }

    /// A load that acts suddenly is not resolved, even if little happens in the following steps.
    #[test]
    fn a_still_neighbour_says_nothing() {
        let (first, _) = step(1.5, 0.0, 1.0);
        let still =
            LoadStep { drive: vec![0.0], motion: vec![0.0], area: 0.0, first: false, ..first.clone() };
        assert!(first.error(first.cross(&still), &still).is_none());
    }

    /// The estimate is exact for a force that is a parabola, in two steps of any lengths. It is
    /// conservative for a round body that is pressed, whose first step is not resolved.
    #[test]
    fn the_error_of_the_work_is_known() {
        for (first, second) in [(0.5, 0.5), (0.4, 0.6), (0.7, 0.1)] {
            let (last, last_error) = step(2.0, 3.0, first);
            let (next, next_error) = step(2.0, 3.0 + first, second);
            let cross = last.cross(&next);
            for (estimate, error) in
                [(last.error(cross, &next), last_error), (next.error(cross, &last), next_error)]
            {
                let estimate = estimate.expect("a path that is resolved");
                assert!((estimate - error).abs() < 1e-12 * error.max(0.1), "{estimate} {error}");
            }
        }
        let (first, first_error) = step(1.5, 0.0, 1.0);
        let (second, second_error) = step(1.5, 1.0, 1.0);
        let cross = first.cross(&second);
        assert_eq!(first.error(cross, &second), None);
        assert!(first_error < 0.5 * first.area);
        let estimate = second.error(cross, &first).expect("a path that is resolved");
        assert!(second_error < estimate && estimate < 2.0 * second_error, "{estimate} {second_error}");
    }
}
