//! What a run writes down: rank 0 keeps tables, record and console, every rank its piece of the fields.

use std::path::PathBuf;
use std::rc::Rc;
use std::time::{Instant, SystemTime};

use super::place::{Place, prepare, versions};
use super::remarks::{contact_starts, remarks, untouched, warning};
use super::restart::Saved;
use super::resume::Past;
use super::tables::Tables;
use crate::assembly::{ContactSystem, Energies, EnergyLedger, SurfaceCells, Watched};
use crate::case::Case;
use crate::dynamics::Stage;
use crate::error::{Result, agree};
use crate::model::Model;
use crate::output::accuracy::AccuracyRecord;
use crate::output::console::{Attempt, Console, StepLine};
use crate::output::fields::{Cells, FieldWriter, Ranks, SurfaceFields, VolumeFields};
use crate::output::iterations::IterationRow;
use crate::output::record::{Balance, Record, Totals, Verdict};
use crate::output::summary::StartUp;
use crate::partition::Report;
use crate::petsc::{Event, Session};
use crate::solvers::{Fallback, IterationReport, SolveReport, Strategy};
use crate::time::StepControl;

/// The journal of a run.
pub struct Journal<const D: usize> {
    pub(super) session: Rc<Session>,
    pub(super) console: Console,
    folder: PathBuf,
    pub(super) tables: Option<Tables<D>>,
    fields: Option<FieldWriter<D>>,
    /// Fields, unless this is zero, are written every so many steps, and at the end of time \[s\].
    every: u64,
    pub(super) end: f64,
    model: Model<D>,
    /// Of the case's choices, until the start-up report tells them.
    remarks: Vec<String>,
    watched: Vec<Watched<D>>,
    pub(super) record: Record,
    /// What was done before this process, with the instant [s] at which it began.
    past: Option<(Past, f64)>,
    began: Instant,
    pub(super) step: u64,
    now: At,
    output: Event,
}

/// Which solve the iterations belong to.
#[derive(Debug, Clone, Copy, Default)]
struct At {
    time: f64,
    dt: f64,
    attempt: u64,
    stage: &'static str,
}

impl<const D: usize> Journal<D> {
    /// Makes the results folder, or goes on in it. Collective.
    ///
    /// # Errors
    /// When it can not be made, or holds what another program wrote.
    pub fn open(
        session: &Rc<Session>,
        (case, model): (&Case, &Model<D>),
        place: &Place,
        saved: Option<&Saved>,
    ) -> Result<Self> {
        let rank = session.rank() as usize;
        let past = saved.map(|saved| (saved.state.past.clone(), saved.state.time));
        let lengths = past.as_ref().map(|(past, _)| &past.lengths);
        let own = if rank == 0 { prepare::<D>(case, place, lengths) } else { Ok((None, Vec::new())) };
        let (tables, inputs) = agree(session.world(), own)?;
        let mut record = Record {
            case: case.to_json()?,
            digest: case.digest()?,
            inputs,
            versions: versions(),
            petsc_options: session.options_at_the_start(),
            ranks: session.size() as usize,
            unknowns: 0,
            start: SystemTime::now(),
            totals: Totals::default(),
            simulated_time: 0.0,
            wall_seconds: 0.0,
            phases: Vec::new(),
            peak_memory: Vec::new(),
            balance: Balance::default(),
            penetrations: model.contacts.iter().map(untouched).collect(),
            accuracy: None,
            warnings: Vec::new(),
            verdict: Verdict::Running,
        };
        past.iter().for_each(|(past, _)| past.recall(&mut record));
        Ok(Self {
            session: session.clone(),
            console: Console::new(rank, place.verbosity),
            folder: place.folder.clone(),
            tables,
            fields: None,
            every: u64::from(case.output.fields.every.value),
            end: case.time.end.si,
            model: model.clone(),
            remarks: super::options::remarks(case),
            watched: Vec::new(),
            record,
            past,
            began: Instant::now(),
            step: 0,
            now: At::default(),
            output: Event::register(session, "Output")?,
        })
    }

    /// The start-up report, and everything that the results need to know of the mesh. Collective.
    ///
    /// # Errors
    /// When a probe finds no node or a file can not be made.
    pub fn start_up(
        &mut self,
        system: &ContactSystem<D>,
        partition: &Report,
        strategy: &dyn Strategy,
    ) -> Result<()> {
        self.watched = system.watch(&self.model.probes)?;
        self.record.unknowns = system.unknowns() as u64;
        self.record.balance.elements = partition.elements.clone();
        self.record.balance.nodes = partition.owned.clone();
        let facets = system.surface_cells().mine.iter().filter(|&&mine| mine).count();
        self.record.balance.contact_facets = super::measure::of_each_rank(&self.session, facets as u64);
        let lengths = self.past.as_ref().map(|(past, _)| &past.lengths);
        let watch = |tables: &mut Tables<D>| tables.watch(&self.folder, &self.watched, lengths);
        agree(self.session.world(), self.tables.as_mut().map_or(Ok(()), watch))?;
        if self.every > 0 {
            let mut fields = self.field_writer(system);
            let resumed = match (&self.past, self.session.rank()) {
                (Some((past, time)), 0) => fields.resume(past.totals.steps, *time),
                _ => Ok(()),
            };
            agree(self.session.world(), resumed)?;
            self.fields = Some(fields);
        }
        let report = StartUp {
            title: self.record.case["title"].as_str().unwrap_or("untitled").to_owned(),
            folder: self.folder.display().to_string(),
            elements: partition.elements.iter().sum(),
            nodes: partition.owned.iter().sum(),
            unknowns: self.record.unknowns,
            ranks: self.record.ranks,
            imbalance: partition.imbalance(),
            edge_cut: partition.edge_cut.unsigned_abs(),
            meeting: (partition.pairs > 0)
                .then(|| (partition.contact_imbalance(), partition.pairs, partition.pairs_cut)),
            solver: strategy.describe(),
            contacts: contact_starts(system),
            remarks: remarks(system, &self.watched).into_iter().chain(self.remarks.drain(..)).collect(),
        };
        self.record.warnings.clone_from(&report.remarks);
        self.console.start_up(&report);
        Ok(())
    }

    fn field_writer(&self, system: &ContactSystem<D>) -> FieldWriter<D> {
        let local = system.local();
        let types: Vec<u8> = local.mesh.kinds.iter().map(|kind| kind.vtk_type()).collect();
        let volume = Cells {
            points: &local.mesh.points,
            node_number: &local.input_node,
            offsets: &local.mesh.offsets,
            nodes: &local.mesh.nodes,
            vtk_types: &types,
            mine: &local.mine,
            group: &local.mesh.body,
        };
        let SurfaceCells { offsets, nodes, vtk_types, mine, contact } = system.surface_cells();
        let surface = Cells {
            points: &local.mesh.points,
            node_number: &local.input_node,
            offsets: &offsets,
            nodes: &nodes,
            vtk_types: &vtk_types,
            mine: &mine,
            group: &contact,
        };
        let ranks = Ranks { rank: self.session.rank() as usize, size: self.session.size() as usize };
        FieldWriter::new(&self.folder, ranks, volume, system.has_contact().then_some(surface))
    }

    /// A load level of the static start begins.
    pub fn start_attempt(&mut self, factor: f64) {
        self.header(At { time: 0.0, dt: 0.0, attempt: 1, stage: "start" });
        if factor == 1.0 {
            self.console.note("static start at full load");
        }
    }

    /// A load level of the static start was reached.
    pub fn pressed(&mut self, report: &SolveReport) {
        self.count(report);
    }

    /// The next step is tried; until it has ended its iterations are none of what a run goes on from.
    pub fn try_step(&mut self) {
        if let Some(tables) = &mut self.tables {
            tables.begin_attempt();
        }
    }

    /// The step has ended, well or not.
    pub fn tried(&mut self) {
        self.tables.iter_mut().for_each(Tables::end_attempt);
    }

    /// A solve of the next step begins.
    pub fn attempt(&mut self, stage: &Stage) {
        let attempt = self.now.attempt + 1;
        self.header(At { time: stage.trial.time, dt: stage.dt, attempt, stage: "step" });
    }

    fn header(&mut self, at: At) {
        self.now = at;
        let step = if at.stage == "start" { 0 } else { self.step + 1 };
        let At { time, dt, attempt, stage } = at;
        self.console.newton_header(&Attempt { step, time, dt, attempt, stage });
    }

    /// One Newton iteration. Rank 0 writes; an unwritable table is found at the end of the step.
    pub fn iteration(&mut self, report: &IterationReport) {
        let finite = |value: f64| value.is_finite().then_some(value);
        let row = IterationRow {
            step: if self.now.stage == "start" { 0 } else { self.step + 1 },
            time: self.now.time,
            dt: self.now.dt,
            attempt: self.now.attempt,
            stage: if self.now.stage == "start" { "start" } else { report.phase.name() },
            iteration: u64::from(report.iteration),
            residual: finite(report.residual),
            increment: finite(report.increment),
            krylov_iterations: u64::from(report.krylov),
            points: report.contact.closed,
            changed: report.contact.changed,
            line_search: finite(report.line_search),
            contraction: report.contraction.and_then(finite),
        };
        self.console.newton_row(&row);
        if let Some(tables) = &mut self.tables {
            tables.iteration(&row);
        }
    }

    /// The model of the run.
    pub fn model(&self) -> &Model<D> {
        &self.model
    }

    /// What a user should know now, and finds in `run.json` later.
    pub fn warn(&mut self, text: &str) {
        self.console.note(text);
        self.record.warn(text.trim_start_matches("warning: ").to_owned());
    }

    /// An attempt failed.
    pub fn failed(&mut self, report: &SolveReport, reason: &str, control: &StepControl) {
        self.count(report);
        self.record.totals.cut_steps += 1;
        let note = format!("step {} of {:.3e} s failed: {reason}", self.step + 1, control.dt());
        self.console.note(&note);
        self.record.warn(note);
    }

    /// A step was solved and is repeated, since its errors are too large.
    pub fn repeated(&mut self, report: &SolveReport, control: &StepControl) {
        self.count(report);
        self.console.note(&format!("step {} is repeated with {:.3e} s", self.step + 1, control.dt()));
    }

    /// What accuracy was achieved so far.
    pub fn accuracy(&mut self, accuracy: AccuracyRecord) {
        self.record.accuracy = Some(accuracy);
    }

    /// Linear solvers failed in the last solve, and stronger ones took over.
    pub fn fallbacks(&mut self, fallbacks: &[Fallback]) {
        self.record.totals.linear_fallbacks += fallbacks.len() as u64;
        for Fallback { from, to, why } in fallbacks {
            let note = format!("linear solver {from} failed ({why}); {to} took over");
            self.console.note(&note);
            self.record.warn(note);
        }
    }

    fn count(&mut self, report: &SolveReport) {
        self.record.totals.newton_iterations += u64::from(report.newton);
        self.record.totals.krylov_iterations += u64::from(report.krylov);
        self.record.totals.inner_krylov_iterations += u64::from(report.inner);
    }

    /// The rows of the start. Collective.
    ///
    /// # Errors
    /// When a file can not be written, the same on all ranks.
    pub fn begin(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        ledger: &EnergyLedger,
        control: &StepControl,
    ) -> Result<()> {
        self.now = At::default();
        self.console.begin(control.time(), control.end());
        self.rows(system, stage, (ledger, ledger.now()), 0.0)?;
        self.write_fields(system, stage)?;
        self.write_record(stage.trial.time)
    }

    /// The rows of a step that is done, before it is accepted. Collective.
    ///
    /// # Errors
    /// When a file can not be written, the same on all ranks.
    pub fn record(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        energy: (&EnergyLedger, &Energies),
        report: &SolveReport,
    ) -> Result<()> {
        let output = self.output.clone();
        let _running = output.begin();
        self.step += 1;
        self.count(report);
        self.record.totals.steps = self.step;
        self.rows(system, stage, energy, stage.dt)?;
        let last = stage.trial.time >= self.end * (1.0 - 1e-12);
        if last || self.step.is_multiple_of(self.every) {
            self.write_fields(system, stage)?;
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
        self.now = At::default();
        Ok(())
    }

    fn rows(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        (ledger, energies): (&EnergyLedger, &Energies),
        dt: f64,
    ) -> Result<()> {
        let points = system.points(&self.watched, &stage.trial.u, &stage.trial.v)?;
        let zones = system.contact_summaries();
        for (penetration, summary) in self.record.penetrations.iter_mut().zip(&zones) {
            penetration.deepest = penetration.deepest.max(summary.zone.max_penetration);
        }
        let reactions = system.reactions(ledger.reactions());
        let own = self.tables.as_mut().map_or(Ok(()), |tables| {
            tables.begin_row(self.step, stage.trial.time, dt);
            tables.probes(&points)?;
            tables.contacts(&zones)?;
            tables.reactions(&reactions)?;
            tables.energies(energies)?;
            tables.momentum(ledger.momentum())
        });
        agree(self.session.world(), own)
    }

    fn write_fields(&mut self, system: &ContactSystem<D>, stage: &Stage) -> Result<()> {
        let Some(writer) = &mut self.fields else { return Ok(()) };
        let stress = system.stress_fields(&stage.trial.u);
        let contact = system.contact_fields()?;
        let (u, v) = (stage.trial.u.local(), stage.trial.v.local());
        let volume = VolumeFields {
            displacement: &u,
            velocity: system.is_dynamic().then_some(&v[..]),
            cauchy_stress: &stress.cauchy_stress,
            det_f: &stress.det_f,
        };
        let surface = SurfaceFields {
            displacement: &u,
            contact_pressure: &contact.contact_pressure,
            traction_t: &contact.traction_t,
            gap: &contact.gap,
            slip: &contact.slip,
            slip_velocity: &contact.slip_velocity,
            status: &contact.status,
            friction_work: &contact.friction_work,
        };
        let written = writer.write(self.step, &volume, system.has_contact().then_some(&surface));
        agree(self.session.world(), written)?;
        let published = match self.session.rank() {
            0 => writer.publish(self.step, stage.trial.time),
            _ => Ok(()),
        };
        agree(self.session.world(), published)
    }

    /// Brings `run.json` up to date. Collective.
    pub(super) fn write_record(&mut self, time: f64) -> Result<()> {
        self.record.simulated_time = time;
        self.measure();
        let own = if self.session.rank() == 0 { self.record.write(&self.folder) } else { Ok(()) };
        agree(self.session.world(), own)
    }

    /// Times and memory of all ranks. Collective.
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

    /// Ends the journal with the verdict. Collective.
    ///
    /// # Errors
    /// When the record can not be written.
    pub fn close(&mut self, outcome: &Result<()>) -> Result<()> {
        self.measure();
        self.record.verdict = outcome.as_ref().map_or_else(Verdict::of, |()| Verdict::Completed);
        let missed = self.record.accuracy.and_then(|accuracy| accuracy.warning());
        let warnings: Vec<String> =
            self.record.penetrations.iter().filter_map(warning).chain(missed).collect();
        let plain = |text: &String| text.trim_start_matches("warning: ").to_owned();
        self.record.warnings.extend(warnings.iter().map(plain));
        let written = if self.session.rank() == 0 { self.record.write(&self.folder) } else { Ok(()) };
        if outcome.is_ok() {
            self.console.finish(&self.record);
            warnings.iter().for_each(|text| self.console.note(text));
            return agree(self.session.world(), written);
        }
        Ok(())
    }
}
