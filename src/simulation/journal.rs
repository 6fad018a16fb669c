//! Output of a run: rank 0 writes tables, record and console; every rank writes its piece of the
//! fields.

use std::path::PathBuf;
use std::rc::Rc;
use std::time::{Instant, SystemTime};

use super::current_solve::CurrentSolve;
use super::derived::{StepRows, derived_cells};
use super::earlier_run::EarlierRun;
use super::field_output::FieldOutput;
use super::place::{RunRequest, prepare, shared_folder, versions};
use super::remarks::{
    RESTARTS_TO_ROUNDING, SpringEnergies, contact_starts, is_chosen, notes, remarks, untouched, unused,
    warning,
};
use super::tables::Tables;
use super::unit_note::unit_note;
use crate::advice::precision::Precision;
use crate::advice::{locking, magnitudes, precision};
use crate::assembly::ContactSystem;
use crate::case::{Case, Derived, FieldFormat};
use crate::contact::obstacle::Obstacle;
use crate::dynamics::Stage;
use crate::error::{Cause, Result, agree};
use crate::model::Model;
use crate::observe::bodies::body_reports;
use crate::observe::contact::{self, ContactColumn};
use crate::observe::energy::{Energies, EnergyLedger};
use crate::observe::fields::surface_cells;
use crate::observe::lines::{self, WatchedPoint};
use crate::observe::loads::load_reports;
use crate::observe::probes::{self, Watched};
use crate::observe::reactions::reactions;
use crate::observe::rigid;
use crate::observe::rigid_surfaces::{RigidShape, RigidSurfaces};
use crate::output::accuracy::AccuracyRecord;
use crate::output::console::{Console, StepLine};
use crate::output::folder::RECORD;
use crate::output::record::{InputRecord, RankBalance, Record, Totals, Verdict};
use crate::output::summary::StartUp;
use crate::output::table::Marks;
use crate::partition::Report;
use crate::petsc::{Event, Session, blas_threads};
use crate::reader::at::At;
use crate::solvers::{SolveReport, Strategy};
use crate::time::StepControl;

/// The journal of a run.
pub struct Journal<const D: usize> {
    pub(super) session: Rc<Session>,
    pub(super) console: Console,
    pub(super) folder: PathBuf,
    /// The folder by the path under which all ranks find it, whatever their working directory.
    pub(super) shared_folder: PathBuf,
    pub(super) tables: Option<Tables<D>>,
    pub(super) fields: Option<FieldOutput<D>>,
    /// Fields are written every `every` steps and at the end of time \[s\]; 0 writes no fields.
    every: u64,
    /// Whether the fields include derived and nodal stresses.
    pub(super) stresses: bool,
    /// The obstacles and rigid bodies.
    pub(super) rigid_shapes: Vec<RigidShape<D>>,
    /// Their surfaces, if fields are written.
    pub(super) rigid_surfaces: RigidSurfaces<D>,
    /// Format of the fields.
    pub(super) format: FieldFormat,
    /// Whether the case requests the table of the bodies.
    bodies: bool,
    /// Whether the case requests the table of the loads.
    loads: bool,
    /// The quantities that the case derives.
    derived: Vec<Derived>,
    pub(super) end: f64,
    model: Model<D>,
    /// A sentence on the units if they are not SI.
    units: Option<String>,
    /// Remarks on the choices of the case. They are held until the start-up report prints them.
    remarks: Vec<String>,
    watched: Vec<Watched<D>>,
    /// Points of the segments.
    line_points: Vec<WatchedPoint>,
    /// Worst precision of coordinates and displacements.
    precision: Option<Precision>,
    /// Warnings that would be printed if the run ended now.
    last_words: Vec<String>,
    /// Largest energies since the start or restart.
    springs: SpringEnergies,
    pub(super) record: Record,
    /// What was computed before this process, and the instant \[s\] at which this process began.
    past: Option<(EarlierRun, f64)>,
    began: Instant,
    pub(super) step: u64,
    /// Totals before the present step.
    pub(super) before_step: Option<Totals>,
    pub(super) now: CurrentSolve,
    output: Event,
}

impl<const D: usize> Journal<D> {
    /// Creates the results folder, or opens it to resume a run. Collective.
    ///
    /// # Errors
    /// The folder can not be created, or it holds files of another program.
    pub fn open(
        session: &Rc<Session>,
        case: &Case,
        model: &Model<D>,
        place: &RunRequest,
        past: Option<(EarlierRun, f64)>,
    ) -> Result<Self> {
        let rank = session.rank() as usize;
        let marks = past.as_ref().and_then(|(past, _)| past.tables());
        let own = if rank == 0 { prepare::<D>(case, place, marks) } else { Ok((None, Vec::new())) };
        let (tables, inputs) = agree(session.world(), own)?;
        let every = u64::from(case.output.fields.every.value);
        let token = tables.as_ref().map_or("", Tables::token);
        let shared_folder = shared_folder(session, &place.folder, token, every > 0)?;
        let mut record = record(session, case, inputs)?;
        record.penetrations = model.contacts.iter().map(untouched).collect();
        past.iter().for_each(|(past, _)| past.copy_to(&mut record));
        Ok(Self {
            session: session.clone(),
            console: Console::new(rank, place.verbosity, case.units),
            folder: place.folder.clone(),
            shared_folder,
            tables,
            fields: None,
            every,
            rigid_shapes: rigid_shapes(case),
            rigid_surfaces: RigidSurfaces::default(),
            stresses: case.output.fields.stresses,
            format: case.output.fields.format.value,
            bodies: case.output.bodies,
            loads: case.output.loads,
            derived: case.output.derived.values().map(|derived| derived.value.clone()).collect(),
            end: case.time.end.value,
            model: model.clone(),
            remarks: super::options::remarks(case),
            units: unit_note(case),
            watched: Vec::new(),
            line_points: Vec::new(),
            precision: None,
            last_words: Vec::new(),
            springs: SpringEnergies::default(),
            record,
            past,
            began: Instant::now(),
            step: 0,
            before_step: None,
            now: CurrentSolve::default(),
            output: Event::register(session, "Output")?,
        })
    }

    /// Adds remarks that are printed before the start-up report.
    pub fn remark(&mut self, remarks: Vec<String>) {
        self.remarks.extend(remarks);
    }

    /// Prints the start-up report and records the mesh data that the results need. Collective.
    ///
    /// # Errors
    /// A probe finds no node, or a file can not be created.
    pub fn start_up(
        &mut self,
        system: &ContactSystem<D>,
        partition: &Report,
        strategy: &dyn Strategy,
    ) -> Result<()> {
        self.watched = probes::watch(system, &self.model.probes)?;
        self.line_points = lines::locate_lines(system, &self.model.lines)?;
        self.record.unknowns = system.bodies().unknowns() as u64;
        self.record.balance.elements = partition.elements.clone();
        self.record.balance.nodes = partition.owned.clone();
        let facets = surface_cells(system).vtk_types.len();
        self.record.balance.contact_facets = super::measure::of_each_rank(&self.session, facets as u64);
        let marks = self.past.as_ref().and_then(|(past, _)| past.tables());
        let watch = |tables: &mut Tables<D>| tables.watch(&self.folder, &self.watched, marks);
        agree(self.session.world(), self.tables.as_mut().map_or(Ok(()), watch))?;
        if self.every > 0 {
            self.rigid_surfaces = RigidSurfaces::new(system, &self.rigid_shapes);
            let mut fields = agree(self.session.world(), self.field_writer(system))?;
            let mut lost = 0;
            if let Some((past, time)) = &self.past {
                fields.resume(self.session.world(), past.totals.steps, *time)?;
                let own = if self.session.rank() == 0 { fields.drop_lost() } else { Ok(0) };
                lost = agree(self.session.world(), own)?;
                if self.session.rank() == 0 {
                    lost = lost.max(past.field_steps().saturating_sub(fields.steps()));
                }
            }
            let file = fields.file();
            self.fields = Some(fields);
            if lost > 0 {
                self.warn(&lost_fields(lost, file));
            }
        }
        let mut warnings = remarks(system, &self.watched);
        warnings.extend(magnitudes::remarks(system, &self.model));
        warnings.extend(locking::remarks(system, &self.model));
        let precision = Precision::of(system);
        warnings.extend(precision::remark(&precision));
        self.precision = Some(precision);
        warnings.append(&mut self.remarks);
        let keeps = !self.record.case["output"]["checkpoint"].is_null();
        let rounded = (keeps && strategy.factorises_together()).then(|| RESTARTS_TO_ROUNDING.to_owned());
        let report = StartUp {
            title: self.record.case["title"].as_str().unwrap_or("untitled").to_owned(),
            folder: self.folder.display().to_string(),
            elements: partition.elements.iter().sum(),
            nodes: partition.owned.iter().sum::<u64>() - system.bodies().rigid_nodes(),
            unknowns: self.record.unknowns,
            ranks: self.record.ranks,
            imbalance: partition.element_imbalance(),
            edge_cut: partition.edge_cut.unsigned_abs(),
            meeting: (partition.pairs > 0)
                .then(|| (partition.contact_imbalance(), partition.pairs, partition.pairs_cut)),
            solver: strategy.describe(),
            contacts: contact_starts(system),
            remarks: notes(system)
                .into_iter()
                .chain(self.units.take())
                .chain(rounded)
                .chain(warnings.iter().cloned())
                .collect(),
        };
        self.console.start_up(&report, &warnings);
        warnings.into_iter().for_each(|text| self.record.warn(text));
        Ok(())
    }

    /// The model of the run.
    pub fn model(&self) -> &Model<D> {
        &self.model
    }

    /// Prints a warning now and stores it for `run.json`.
    pub fn warn(&mut self, text: &str) {
        self.console.warn(text);
        self.record.warn(text.to_owned());
    }

    /// Records the present precision of displacements.
    pub fn known(&mut self, precision: Precision) {
        if self.precision.as_ref().is_none_or(|before| precision.spacing > before.spacing) {
            self.precision = Some(precision);
        }
    }

    /// Sets the warnings that are printed if the run ends with the present step.
    pub fn at_the_end(&mut self, words: Vec<String>) {
        self.last_words = words;
    }

    /// Records the accuracy achieved so far.
    pub fn accuracy(&mut self, accuracy: AccuracyRecord) {
        self.record.accuracy = Some(accuracy);
    }

    /// Writes the rows of the start. Collective.
    ///
    /// # Errors
    /// A file can not be written; the error is the same on all ranks.
    pub fn begin(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        ledger: &EnergyLedger,
        control: &StepControl,
    ) -> Result<()> {
        self.now = CurrentSolve::default();
        self.console.begin(control.time(), control.end());
        self.rows(system, stage, ledger, ledger.now(), 0.0)?;
        self.write_fields(system, stage, ledger)?;
        self.measure();
        self.record.start_phases.clone_from(&self.record.phases);
        self.write_record(stage.trial.time)
    }

    /// Writes the rows of a finished step, before the step is accepted. Collective.
    ///
    /// # Errors
    /// A file can not be written; the error is the same on all ranks.
    pub fn record(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        ledger: &EnergyLedger,
        energies: &Energies,
        report: &SolveReport,
    ) -> Result<()> {
        let output = self.output.clone();
        let _running = output.begin();
        self.step += 1;
        self.count(report);
        self.stepped(report, || system.bodies().holding().free_bodies());
        self.record.totals.steps = self.step;
        self.rows(system, stage, ledger, energies, stage.dt)?;
        let last = stage.trial.time >= self.end * (1.0 - 1e-12);
        if last || self.step.is_multiple_of(self.every) {
            self.write_fields(system, stage, ledger)?;
            self.write_record(stage.trial.time)?;
        }
        self.record.simulated_time = stage.trial.time;
        self.console.step(&StepLine {
            step: self.step,
            time: stage.trial.time,
            dt: stage.dt,
            iterations: u64::from(report.newton),
            krylov_iterations: u64::from(report.krylov),
            stick: report.contact.stick,
            slip: report.contact.slip,
        });
        self.now = CurrentSolve::default();
        Ok(())
    }

    fn rows(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        ledger: &EnergyLedger,
        energies: &Energies,
        dt: f64,
    ) -> Result<()> {
        if self.step > 0 {
            self.springs.record(energies);
        }
        let points = probes::report(system, &self.watched, stage)?;
        let along = lines::report(system, &self.line_points, stage)?;
        let resultants = contact::resultants(system, stage);
        let contacts = contact::reports(system, stage, ledger.contacts(), &resultants);
        for (penetration, report) in self.record.penetrations.iter_mut().zip(&contacts) {
            let number = |column: ContactColumn<D>| report.number(&column);
            penetration.deepest = penetration.deepest.max(number(ContactColumn::MAX_PENETRATION));
            let depth = number(ContactColumn::DEPTH_BETWEEN);
            for (most, now) in penetration.between.iter_mut().zip([depth, depth / report.facet]) {
                *most = most.max(now);
            }
            penetration.force = penetration.force.max(number(ContactColumn::FORCE_N));
        }
        let reactions = reactions(system, &stage.trial.u, ledger.reactions());
        let rigid = rigid::reports(system, ledger, &resultants);
        let bodies = if self.bodies { body_reports(system, stage) } else { Vec::new() };
        let loads = if self.loads { load_reports(system, stage) } else { Vec::new() };
        let own = self.tables.as_mut().map_or(Ok(()), |tables| {
            tables.check()?;
            tables.begin_row(self.step, stage.trial.time, dt);
            tables.probes(&points)?;
            tables.contacts(&contacts)?;
            tables.reactions(&reactions)?;
            tables.rigid(&rigid)?;
            tables.bodies(&bodies)?;
            tables.loads(&loads)?;
            tables.lines(&along)?;
            tables.energies(energies)?;
            tables.momentum(ledger.momentum())?;
            let rows = StepRows {
                time: stage.trial.time,
                probes: (&self.watched, &points),
                contacts: &contacts,
                reactions: &reactions,
                rigid: &rigid,
                bodies: &bodies,
                loads: &loads,
                energies,
                momentum: ledger.momentum(),
            };
            tables.derived(&derived_cells(&self.derived, &rows))
        });
        agree(self.session.world(), own)
    }

    /// Updates `run.json`. Collective.
    pub(super) fn write_record(&mut self, time: f64) -> Result<()> {
        self.record.simulated_time = time;
        self.measure();
        let own = self.tables.as_ref().map_or(Ok(()), |tables| {
            tables.check()?;
            tables.explain(self.record.write(&self.folder))
        });
        agree(self.session.world(), own)
    }

    /// Collects times and memory of all ranks. Collective.
    pub(super) fn measure(&mut self) {
        self.record.wall_seconds = self.began.elapsed().as_secs_f64();
        self.record.phases = super::measure::phases(&self.session);
        self.record.peak_memory = super::measure::peak_memory(&self.session);
        if let Some((past, _)) = &self.past {
            past.add_to(&mut self.record.wall_seconds, &mut self.record.phases);
        }
        let [cpu, work] = super::measure::seconds(&self.session);
        (self.record.balance.cpu_seconds, self.record.balance.work_seconds) = (cpu, work);
    }

    /// Closes the journal with the outcome of the run. Collective.
    ///
    /// # Errors
    /// The record can not be written.
    pub fn close(&mut self, outcome: &Result<()>) -> Result<()> {
        self.measure();
        self.record.verdict = outcome.as_ref().map_or_else(Verdict::of, |()| Verdict::Completed);
        let missed = self.record.accuracy.as_ref().and_then(|accuracy| accuracy.warning(self.record.units));
        // If a run failed before its first row, it is unknown which contacts closed.
        let known = outcome.is_ok() || self.record.totals.steps > 0;
        let contacts = self.record.penetrations.iter().filter(|_| known);
        let is_general = |name: &str| self.record.case["contact"][name]["target"] == crate::case::ALL;
        let contacts =
            contacts.filter_map(|contact| warning(contact, is_general(&contact.contact), self.record.units));
        let precision = self.precision.iter();
        let blurred = precision.flat_map(|known| precision::blurred(&self.record.penetrations, known));
        let last_words = std::mem::take(&mut self.last_words);
        let all = &self.model.contacts;
        let chosen = all.iter().filter(|_| all.iter().all(is_chosen));
        let chosen: Vec<&str> = chosen.map(|contact| &*contact.name).collect();
        let soft = self.springs.warning(&chosen, self.record.units);
        let contacts = contacts
            .chain(missed)
            .chain(blurred)
            .chain(last_words.iter().cloned())
            .chain(soft)
            .collect::<Vec<_>>();
        let options = if is_solved(outcome) { unused(&self.session) } else { Vec::new() };
        contacts.iter().chain(&options).for_each(|text| self.record.warn(text.clone()));
        let written = self.write_end();
        if outcome.is_ok() {
            self.console.finish(&self.record);
            contacts.iter().for_each(|text| self.console.warn(text));
        } else if is_lost(outcome) {
            last_words.iter().for_each(|text| self.console.warn(text));
        }
        options.iter().for_each(|text| self.console.warn(text));
        outcome.as_ref().map_or(Ok(()), |()| agree(self.session.world(), written))
    }

    /// Writes the final record, with length and hash of every table. On rank 0 only.
    ///
    /// If a table was damaged, the record names no tables. If a table or a series was damaged, a
    /// run that would have completed counts as failed. If the record itself was deleted, it is not
    /// created again.
    ///
    /// # Errors
    /// A table or a series was damaged, the folder belongs to another run, or the record can not be
    /// written.
    fn write_end(&mut self) -> Result<()> {
        let Some(tables) = &self.tables else { return Ok(()) };
        tables.check_place()?;
        let marks = tables.marks();
        let settled = marks.and_then(|marks| {
            self.record.tables = marks;
            self.fields.as_mut().map_or(Ok(0), FieldOutput::drop_lost)
        });
        match &settled {
            Ok(0) => {}
            Ok(lost) => {
                let file = self.fields.as_ref().map_or("", FieldOutput::file);
                self.warn(&lost_fields(*lost, file));
            }
            Err(error) if self.record.verdict == Verdict::Completed => {
                self.record.verdict = Verdict::of(error);
            }
            Err(_) => {}
        }
        // If a user deletes the folder, no new file must appear in it.
        if settled.is_err() && !self.folder.join(RECORD).exists() {
            return settled.map(|_| ());
        }
        let written = self.record.write(&self.folder);
        settled.and(written)
    }
}

/// The obstacles and rigid bodies of a case, in its order.
fn rigid_shapes<const D: usize>(case: &Case) -> Vec<RigidShape<D>> {
    let shape = |(name, obstacle): (&At<String>, &Obstacle)| RigidShape {
        name: name.value.clone(),
        shape: obstacle.shape(),
    };
    case.shapes().map(shape).collect()
}

/// Warning about field files that disappeared during a run or before it was resumed.
fn lost_fields(steps: u64, file: &str) -> String {
    format!("{steps} field steps that were written are missing; {file} lists the remaining ones")
}

/// The record of a run that has computed nothing yet.
///
/// # Errors
/// An internal error of the program.
pub(super) fn record(session: &Session, case: &Case, inputs: Vec<InputRecord>) -> Result<Record> {
    Ok(Record {
        units: case.units,
        case: case.to_json()?,
        digest: case.digest()?,
        inputs,
        versions: versions(),
        petsc_options: session.options_at_the_start(),
        ranks: session.size() as usize,
        blas_threads: blas_threads(),
        unknowns: 0,
        start: SystemTime::now(),
        totals: Totals::default(),
        simulated_time: 0.0,
        wall_seconds: 0.0,
        phases: Vec::new(),
        start_phases: Vec::new(),
        peak_memory: Vec::new(),
        balance: RankBalance::default(),
        penetrations: Vec::new(),
        held: None,
        accuracy: None,
        warnings: Vec::new(),
        tables: Marks::default(),
        verdict: Verdict::Running,
    })
}

/// Whether a run reached its solvers, so that options which the solvers did not read are known.
fn is_solved(outcome: &Result<()>) -> bool {
    let causes = [Cause::NotConverged, Cause::Guard, Cause::Stopped];
    outcome.as_ref().err().is_none_or(|error| causes.contains(&error.cause))
}

/// Whether the run ended without a solution of a step. Unexplained energy may then show the cause.
fn is_lost(outcome: &Result<()>) -> bool {
    outcome.as_ref().err().is_some_and(|error| matches!(error.cause, Cause::NotConverged | Cause::Guard))
}
