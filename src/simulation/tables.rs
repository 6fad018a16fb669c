//! The tables of a run, on rank 0: converts reports of the system to rows.

use std::path::Path;

use crate::case::Units;
use crate::error::{Error, Result};
use crate::observe::bodies::{BODY_COLUMNS, BODY_FILE, BodyReport};
use crate::observe::contact::{CONTACT_FILE, ContactColumn, ContactReport};
use crate::observe::energy::{
    ENERGY_COLUMNS, ENERGY_FILE, Energies, MOMENTUM_COLUMNS, MOMENTUM_FILE, Momentum,
};
use crate::observe::lines::{LINE_COLUMNS, LINE_FILE, LinePoint};
use crate::observe::loads::{LOAD_COLUMNS, LOAD_FILE};
use crate::observe::probes::{PROBE_FILE, Watched};
use crate::observe::quantity::{Cell, Column, DERIVED_FILE, TableFile, headings};
use crate::observe::reactions::{REACTION_COLUMNS, REACTION_FILE, Reaction};
use crate::observe::rigid::{RIGID_COLUMNS, RIGID_FILE, RigidReport};
use crate::output::anchor::Anchor;
use crate::output::iterations::{IterationRow, IterationTable};
use crate::output::lock::Lock;
use crate::output::table::{Mark, Marks, Table};

/// Tables that only some cases have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OptionalTables {
    /// That of the rigid bodies, if there are any.
    pub rigid: bool,
    /// That of the deformable bodies, if the case requests it.
    pub bodies: bool,
    /// That of the loads, if the case requests it.
    pub loads: bool,
    /// That of segments.
    pub lines: bool,
    /// Names of the derived quantities; without any there is no table of them.
    pub derived: Vec<String>,
}

/// The open tables.
pub struct Tables<const D: usize> {
    probes: Option<Table>,
    contact: Table,
    reactions: Table,
    /// The table of the rigid bodies, if there are any.
    rigid: Option<Table>,
    /// The table of the deformable bodies, if the case requests it.
    bodies: Option<Table>,
    /// The table of the loads, if the case requests it.
    loads: Option<Table>,
    /// The table of segments; `None` without segments.
    lines: Option<Table>,
    /// The table of the derived quantities, if there are any.
    derived: Option<Table>,
    energy: Table,
    momentum: Table,
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
    /// Creates the tables that do not depend on probes, with headings in `units`, and those of
    /// `optional`. With marks of a checkpoint it opens the tables and continues from these marks.
    ///
    /// # Errors
    /// A file can not be created, or it is not the file that was written before.
    pub fn open(
        folder: &Path,
        units: Units,
        lock: Lock,
        optional: OptionalTables,
        past: Option<&Marks>,
    ) -> Result<Self> {
        let open = |file: &TableFile, columns: Vec<String>| {
            Table::open(&folder.join(file.name), units.headings(file.headings(columns)), past)
        };
        let contact = headings::<D>(ContactColumn::<D>::TABLE.iter().map(|column| &column.quantity));
        Ok(Self {
            place: Anchor::of(folder)?,
            lock,
            probes: None,
            contact: open(&CONTACT_FILE, contact)?,
            reactions: open(&REACTION_FILE, columns::<D, _>(REACTION_COLUMNS))?,
            rigid: optional.rigid.then(|| open(&RIGID_FILE, columns::<D, _>(RIGID_COLUMNS))).transpose()?,
            bodies: optional.bodies.then(|| open(&BODY_FILE, columns::<D, _>(BODY_COLUMNS))).transpose()?,
            loads: optional.loads.then(|| open(&LOAD_FILE, columns::<D, _>(LOAD_COLUMNS))).transpose()?,
            lines: optional.lines.then(|| open(&LINE_FILE, columns::<D, _>(LINE_COLUMNS))).transpose()?,
            derived: (!optional.derived.is_empty())
                .then(|| open(&DERIVED_FILE, optional.derived))
                .transpose()?,
            energy: open(&ENERGY_FILE, columns::<D, _>(ENERGY_COLUMNS))?,
            momentum: open(&MOMENTUM_FILE, columns::<D, _>(MOMENTUM_COLUMNS))?,
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
        let columns = PROBE_FILE.headings(watched.iter().flat_map(Watched::headings));
        let path = folder.join(PROBE_FILE.name);
        self.probes = Some(Table::open(&path, self.units.headings(columns), past)?);
        Ok(())
    }

    fn all(&self) -> impl Iterator<Item = &Table> {
        let others = [&self.contact, &self.reactions, &self.energy, &self.momentum];
        self.probes
            .iter()
            .chain(&self.rigid)
            .chain(&self.bodies)
            .chain(&self.loads)
            .chain(&self.lines)
            .chain(&self.derived)
            .chain(others)
            .chain([self.iterations.table()])
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

    /// Writes one row for all probes, whose cells are those of [`crate::observe::probes::report`].
    ///
    /// # Errors
    /// The file can not be written.
    pub fn probes(&mut self, points: &[Vec<Cell>]) -> Result<()> {
        let head = [Cell::Count(self.step), Cell::Number(self.time), Cell::Number(self.dt)];
        let cells: Vec<Cell> = head.into_iter().chain(points.iter().flatten().copied()).collect();
        self.probes.as_mut().map_or(Ok(()), |table| table.row(&cells))
    }

    /// Writes one row for each contact.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn contacts(&mut self, reports: &[ContactReport]) -> Result<()> {
        let head = [Cell::Count(self.step), Cell::Number(self.time)].into_iter();
        reports.iter().try_for_each(|report| {
            let cells = head.clone().chain([Cell::Text(&report.name)]).chain(report.cells::<D>());
            self.contact.row(&cells.collect::<Vec<_>>())
        })
    }

    /// Writes one row for each support.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn reactions(&mut self, reactions: &[Reaction]) -> Result<()> {
        let head = [Cell::Count(self.step), Cell::Number(self.time)].into_iter();
        reactions.iter().try_for_each(|reaction| {
            let own = REACTION_COLUMNS.iter().flat_map(|column| column.cells::<D>(reaction));
            self.reactions
                .row(&head.clone().chain([Cell::Text(&reaction.name)]).chain(own).collect::<Vec<_>>())
        })
    }

    /// Writes one row for each boundary with loads, if the case requests them.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn loads(&mut self, loads: &[Reaction]) -> Result<()> {
        let Some(table) = &mut self.loads else { return Ok(()) };
        let head = [Cell::Count(self.step), Cell::Number(self.time)].into_iter();
        loads.iter().try_for_each(|load| {
            let own = LOAD_COLUMNS.iter().flat_map(|column| column.cells::<D>(load));
            table.row(&head.clone().chain([Cell::Text(&load.name)]).chain(own).collect::<Vec<_>>())
        })
    }

    /// Writes one row for each rigid body.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn rigid(&mut self, reports: &[RigidReport]) -> Result<()> {
        let Some(table) = &mut self.rigid else { return Ok(()) };
        let head = [Cell::Count(self.step), Cell::Number(self.time)].into_iter();
        reports.iter().try_for_each(|report| {
            let own = RIGID_COLUMNS.iter().flat_map(|column| column.cells::<D>(report));
            table.row(&head.clone().chain([Cell::Text(&report.state.name)]).chain(own).collect::<Vec<_>>())
        })
    }

    /// Writes one row for each deformable body.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn bodies(&mut self, reports: &[BodyReport]) -> Result<()> {
        let Some(table) = &mut self.bodies else { return Ok(()) };
        let head = [Cell::Count(self.step), Cell::Number(self.time)].into_iter();
        reports.iter().try_for_each(|report| {
            let own = BODY_COLUMNS.iter().flat_map(|column| column.cells::<D>(report));
            table.row(&head.clone().chain([Cell::Text(&report.name)]).chain(own).collect::<Vec<_>>())
        })
    }

    /// Writes one row for each point of a segment.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn lines(&mut self, points: &[LinePoint]) -> Result<()> {
        let Some(table) = &mut self.lines else { return Ok(()) };
        let head = [Cell::Count(self.step), Cell::Number(self.time)].into_iter();
        points.iter().try_for_each(|point| {
            let own = LINE_COLUMNS.iter().flat_map(|column| column.cells::<D>(point));
            let names = [Cell::Text(&point.name), Cell::Count(point.number)];
            table.row(&head.clone().chain(names).chain(own).collect::<Vec<_>>())
        })
    }

    /// Writes one row of the derived quantities.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn derived(&mut self, values: &[Cell]) -> Result<()> {
        let Some(table) = &mut self.derived else { return Ok(()) };
        let head = [Cell::Count(self.step), Cell::Number(self.time)];
        table.row(&head.into_iter().chain(values.iter().copied()).collect::<Vec<_>>())
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
        let head = [Cell::Count(self.step), Cell::Number(self.time)].into_iter();
        let own = ENERGY_COLUMNS.iter().flat_map(|column| column.cells::<D>(energies));
        self.energy.row(&head.chain(own).collect::<Vec<_>>())
    }

    /// Writes one row of momentum.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn momentum(&mut self, momentum: &Momentum) -> Result<()> {
        let head = [Cell::Count(self.step), Cell::Number(self.time)].into_iter();
        let own = MOMENTUM_COLUMNS.iter().flat_map(|column| column.cells::<D>(momentum));
        self.momentum.row(&head.chain(own).collect::<Vec<_>>())
    }

    /// Writes one row for an iteration.
    pub fn iteration(&mut self, row: &IterationRow) {
        if let Err(error) = self.iterations.row(row) {
            self.trouble.get_or_insert(error);
        }
    }
}

/// Headings of the columns of a table.
fn columns<const D: usize, S: 'static>(table: &[Column<S>]) -> Vec<String> {
    headings::<D>(table.iter().map(|column| &column.quantity))
}
