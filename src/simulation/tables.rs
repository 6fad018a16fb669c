//! The tables of a run, on rank 0: converts reports of the system to rows.

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
    /// Error of an iteration row that could not be written. It is returned at the end of the step,
    /// when the ranks compare their errors.
    trouble: Option<Error>,
    /// Mark of the table of iterations before the current step.
    before: Option<Mark>,
    /// The results folder.
    place: Anchor,
    /// Lock of the folder for this run.
    lock: Lock,
    step: u64,
    time: f64,
    dt: f64,
}

impl<const D: usize> Tables<D> {
    /// Creates the tables that do not depend on probes, with headings in `units`. With marks of a
    /// checkpoint it opens the tables and continues from these marks.
    ///
    /// # Errors
    /// A file can not be created, or it is not the file that was written before.
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

    /// Creates the table of the probes, or opens it to continue.
    ///
    /// # Errors
    /// See [`open`](Self::open).
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

    /// Checks that the folder and its tables are in place, unchanged, and locked by this run.
    ///
    /// # Errors
    /// One of them was moved, deleted or changed, or another run has taken the folder.
    pub fn check(&self) -> Result<()> {
        self.check_place()?;
        self.all().try_for_each(Table::check)
    }

    /// Checks that the folder is in place and locked by this run.
    ///
    /// # Errors
    /// It was moved or deleted, or another run has taken it.
    pub fn check_place(&self) -> Result<()> {
        self.lock.check()?;
        self.place.check()
    }

    /// Adds the state of the folder to an error of writing, see [`Anchor::explain`].
    ///
    /// # Errors
    /// Writing failed.
    pub fn explain<T>(&self, written: Result<T>) -> Result<T> {
        self.place.explain(written)
    }

    /// Token by which other ranks identify the folder.
    pub fn token(&self) -> &str {
        self.lock.token()
    }

    /// Marks of the tables. Their contents are on the disk when this returns.
    ///
    /// # Errors
    /// The disk can not be written, or [`check`](Self::check) fails.
    pub fn marks(&self) -> Result<Marks> {
        self.check()?;
        let mut marks = Marks::default();
        self.all().try_for_each(|table| marks.add(table))?;
        Ok(marks)
    }

    /// Marks of the tables before the current step. Their contents are on the disk when this
    /// returns.
    ///
    /// # Errors
    /// See [`marks`](Self::marks).
    pub fn marks_of_steps(&self) -> Result<Marks> {
        let mut marks = self.marks()?;
        self.before.iter().for_each(|before| marks.cut(self.iterations.table(), before));
        Ok(marks)
    }

    /// Begins a step. The iterations that follow are included in
    /// [`marks_of_steps`](Self::marks_of_steps) only after the step has ended.
    pub fn begin_step(&mut self) {
        self.before = Some(self.iterations.table().mark());
    }

    /// Ends a step. The iterations written so far are included in the marks.
    pub fn end_step(&mut self) {
        self.before = None;
    }

    /// Starts the rows of a step.
    pub fn begin_row(&mut self, step: u64, time: f64, dt: f64) {
        (self.step, self.time, self.dt) = (step, time, dt);
    }

    /// Writes one row for all probes.
    ///
    /// # Errors
    /// The file can not be written.
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

    /// Writes one row for each contact.
    ///
    /// # Errors
    /// The file can not be written.
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

    /// Writes one row for each support.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn reactions(&mut self, reactions: &[(String, [f64; D])]) -> Result<()> {
        for (name, force) in reactions {
            self.reactions.row(self.step, self.time, name, &ReactionRow { force: *force })?;
        }
        Ok(())
    }

    /// Writes one row of energies. Also returns the error of an iteration that could not be
    /// written.
    ///
    /// # Errors
    /// A file can not be written.
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

    /// Writes one row of momentum.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn momentum(&mut self, momentum: &Momentum) -> Result<()> {
        let Momentum { linear, angular } = *momentum;
        self.momentum.row(self.step, self.time, &MomentumRow { linear, angular })
    }

    /// Writes one row for an iteration.
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
