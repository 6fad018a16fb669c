//! The tables of a run, on rank 0: what the system reports, put into rows.

use std::path::Path;

use crate::assembly::{ContactSummary, Energies, Momentum, NodalContact, PointReport, Watched};
use crate::case::Units;
use crate::contact::point::Status as PointStatus;
use crate::error::{Error, Result};
use crate::output::Status;
use crate::output::anchor::Anchor;
use crate::output::contact::{ContactRow, ContactTable};
use crate::output::energy::{EnergyRow, EnergyTable};
use crate::output::iterations::{IterationRow, IterationTable};
use crate::output::lock::Lock;
use crate::output::momentum::{MomentumRow, MomentumTable};
use crate::output::probes::{ProbeColumns, ProbeContact, ProbeRow, ProbeTable};
use crate::output::reactions::{ReactionRow, ReactionTable};
use crate::output::table::{Mark, Marks, Table};

/// The open tables.
pub struct Tables<const D: usize> {
    probes: Option<ProbeTable<D>>,
    contact: ContactTable<D>,
    reactions: ReactionTable<D>,
    energy: EnergyTable,
    momentum: MomentumTable<D>,
    iterations: IterationTable,
    units: Units,
    /// An iteration that could not be written; told at the end of the step, where all ranks listen.
    trouble: Option<Error>,
    /// The table of iterations before the step under way.
    before: Option<Mark>,
    /// The results folder.
    place: Anchor,
    /// It is this run's alone.
    lock: Lock,
    step: u64,
    time: f64,
    dt: f64,
}

impl<const D: usize> Tables<D> {
    /// Creates the tables that need no probe, with headings in `units`, or goes on from the marks that they had at a checkpoint.
    ///
    /// # Errors
    /// When a file can not be made, or is not the one that it was.
    pub fn open(folder: &Path, units: Units, lock: Lock, past: Option<&Marks>) -> Result<Self> {
        Ok(Self {
            place: Anchor::of(folder)?,
            lock,
            probes: None,
            contact: ContactTable::open(folder, units, past)?,
            reactions: ReactionTable::open(folder, units, past)?,
            energy: EnergyTable::open(folder, units, past)?,
            momentum: MomentumTable::open(folder, units, past)?,
            iterations: IterationTable::open(folder, units, past)?,
            units,
            trouble: None,
            before: None,
            step: 0,
            time: 0.0,
            dt: 0.0,
        })
    }

    /// Creates the table of the probes, or goes on with it.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn watch(&mut self, folder: &Path, watched: &[Watched<D>], past: Option<&Marks>) -> Result<()> {
        let probe = |point: &Watched<D>| ProbeColumns {
            name: point.name.clone(),
            on_contact: point.contact.is_some(),
        };
        let probes = watched.iter().map(probe).collect();
        self.probes = Some(ProbeTable::open(folder, self.units, probes, past)?);
        Ok(())
    }

    fn all(&self) -> impl Iterator<Item = &Table> {
        let others =
            [self.contact.table(), self.reactions.table(), self.energy.table(), self.momentum.table()];
        self.probes.iter().map(ProbeTable::table).chain(others).chain([self.iterations.table()])
    }

    /// Makes sure that the folder and its tables are where they were, as they were written, and this run's alone.
    ///
    /// # Errors
    /// One of them was moved, deleted or changed; another run has taken the folder.
    pub fn check(&self) -> Result<()> {
        self.check_place()?;
        self.all().try_for_each(Table::check)
    }

    /// Makes sure that the folder is where it was, and this run's alone.
    ///
    /// # Errors
    /// It was moved or deleted, or another run has taken it.
    pub fn check_place(&self) -> Result<()> {
        self.lock.check()?;
        self.place.check()
    }

    /// The outcome of writing into the folder, see [`Anchor::explain`].
    ///
    /// # Errors
    /// Writing failed.
    pub fn explain<T>(&self, written: Result<T>) -> Result<T> {
        self.place.explain(written)
    }

    /// By which other ranks know the folder.
    pub fn token(&self) -> &str {
        self.lock.token()
    }

    /// What the tables hold; they are on the disk when this returns.
    ///
    /// # Errors
    /// When the disk refuses, or as [`check`](Self::check).
    pub fn marks(&self) -> Result<Marks> {
        self.check()?;
        let mut marks = Marks::default();
        self.all().try_for_each(|table| marks.add(table))?;
        Ok(marks)
    }

    /// What they held before the step under way; they are on the disk when this returns.
    ///
    /// # Errors
    /// As [`marks`](Self::marks).
    pub fn marks_of_steps(&self) -> Result<Marks> {
        let mut marks = self.marks()?;
        self.before.iter().for_each(|before| marks.cut(self.iterations.table(), before));
        Ok(marks)
    }

    /// Iterations that follow count only when their step has ended, in [`marks_of_steps`](Self::marks_of_steps).
    pub fn begin_attempt(&mut self) {
        self.before = Some(self.iterations.table().mark());
    }

    /// The iterations written so far count.
    pub fn end_attempt(&mut self) {
        self.before = None;
    }

    /// The rows that follow belong to this step.
    pub fn begin_row(&mut self, step: u64, time: f64, dt: f64) {
        (self.step, self.time, self.dt) = (step, time, dt);
    }

    /// One row for all probes.
    ///
    /// # Errors
    /// When the file can not be written.
    pub fn probes(&mut self, points: &[PointReport<D>]) -> Result<()> {
        let row = |point: &PointReport<D>| ProbeRow {
            u: point.u,
            v: point.v,
            contact: point.contact.map(probe_contact),
        };
        let rows: Vec<ProbeRow<D>> = points.iter().map(row).collect();
        let (step, time, dt) = (self.step, self.time, self.dt);
        self.probes.as_mut().map_or(Ok(()), |table| table.row(step, time, dt, &rows))
    }

    /// One row for each contact.
    ///
    /// # Errors
    /// When the file can not be written.
    pub fn contacts(&mut self, summaries: &[ContactSummary<D>]) -> Result<()> {
        for ContactSummary { name, zone, .. } in summaries {
            let row = ContactRow {
                force_n: zone.normal_force,
                force: zone.force.into(),
                force_t: if D == 2 { zone.tangential_force } else { zone.friction_force.norm() },
                area: zone.area,
                points: zone.points as u64,
                stick: zone.stick as u64,
                slip: zone.slip as u64,
                max_penetration: zone.max_penetration,
                max_pressure: zone.max_pressure,
                friction_power: zone.friction_power,
            };
            self.contact.row(self.step, self.time, name, &row)?;
        }
        Ok(())
    }

    /// One row for each support.
    ///
    /// # Errors
    /// When the file can not be written.
    pub fn reactions(&mut self, reactions: &[(String, [f64; D])]) -> Result<()> {
        for (name, force) in reactions {
            self.reactions.row(self.step, self.time, name, &ReactionRow { force: *force })?;
        }
        Ok(())
    }

    /// One row of energies; also tells of an iteration that could not be written.
    ///
    /// # Errors
    /// When a file can not be written.
    pub fn energies(&mut self, energies: &Energies) -> Result<()> {
        if let Some(trouble) = self.trouble.take() {
            return Err(trouble);
        }
        let row = EnergyRow {
            kinetic: energies.kinetic,
            strain: energies.strain,
            contact: energies.contact,
            friction_dissipated: energies.friction_dissipated,
            damping_dissipated: 0.0,
            external_work: energies.external_work,
            numerical: energies.numerical,
            total: energies.total(),
        };
        self.energy.row(self.step, self.time, &row)
    }

    /// One row of the momentum.
    ///
    /// # Errors
    /// When the file can not be written.
    pub fn momentum(&mut self, momentum: &Momentum) -> Result<()> {
        let Momentum { linear, angular } = *momentum;
        self.momentum.row(self.step, self.time, &MomentumRow { linear, angular })
    }

    /// One row of an iteration.
    pub fn iteration(&mut self, row: &IterationRow) {
        if let Err(error) = self.iterations.row(row) {
            self.trouble.get_or_insert(error);
        }
    }
}

fn probe_contact(contact: NodalContact) -> ProbeContact {
    ProbeContact {
        contact_pressure: contact.normal_traction,
        traction_t: contact.friction_traction,
        gap: Some(contact.gap),
        slip_velocity: contact.slip_velocity,
        status: match contact.status {
            PointStatus::Open => Status::Open,
            PointStatus::Stick => Status::Stick,
            PointStatus::Slip => Status::Slip,
        },
    }
}
