//! When a run writes a checkpoint, what goes into it, and when it is asked to stop.

use std::cell::Cell;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Instant;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::journal::Journal;
use super::place::RunRequest;
use super::restart::CheckpointHeader;
use super::signals::Signals;
use super::{RunMonitors, SOLVER_PREFIXES, options};
use crate::assembly::ContactSystem;
use crate::case::{Case, Units};
use crate::checkpoint::{self, Store};
use crate::dynamics::Stage;
use crate::error::{Cause, Error, Result, agree};
use crate::petsc::{Event, Session};
use crate::solvers::Strategy;

/// Code of the wall-time limit among the numbers of signals, none of which it is.
const WALL_TIME: i32 = 1000;

/// How a run that was out of time tells so.
pub const WALL_TIME_IS_OVER: &str = "the wall time is over";

/// The run at the end of a step that was accepted.
pub struct RunView<'a, const D: usize> {
    /// The bodies.
    pub system: &'a mut ContactSystem<D>,
    /// At the start of the next step.
    pub stage: &'a mut Stage,
    /// What solved the step.
    pub strategy: &'a mut Box<dyn Strategy>,
    /// Where in time the run is, the energies, and what watches them.
    pub watch: &'a mut RunMonitors,
    /// The results.
    pub journal: &'a mut Journal<D>,
}

/// Watches the steps of a run.
pub struct CheckpointPolicy {
    session: Rc<Session>,
    output: Event,
    signals: Signals,
    store: Store,
    /// How a user goes on.
    command: String,
    every: Option<u64>,
    keep: usize,
    limit: Option<f64>,
    began: Instant,
    /// End of the last step; what comes before the first one is done once only.
    last: Option<Instant>,
    /// Longest step so far \[s\].
    longest_step: f64,
    /// Longest checkpoint so far \[s\].
    longest_write: f64,
    /// The same for who asks within a step; there is no wall time within the first step of a process, so that each one
    /// comes further than the last.
    reserve: Rc<Cell<Option<f64>>>,
}

impl CheckpointPolicy {
    /// A keeper for the case; listens to signals from now on.
    ///
    /// # Errors
    /// The system refuses.
    pub fn new(session: &Rc<Session>, case: &Case, place: &RunRequest) -> Result<Self> {
        let wanted = case.output.checkpoint.as_ref();
        let limit = wanted.and_then(|checkpoint| checkpoint.wall_time).map(|limit| limit.value);
        let (every, keep) = wanted.map_or((None, 2), |c| (Some(u64::from(c.every.value)), c.keep.value));
        let limit = place.wall_time.map(|limit| limit.as_secs_f64()).or(limit);
        let signals = Signals::listen()?;
        let began = Instant::now();
        let reserve = Rc::<Cell<_>>::default();
        let (heard, kept): (Signals, Rc<Cell<Option<f64>>>) = (signals.clone(), Rc::clone(&reserve));
        session.listen(move || {
            let over = |reserve, limit| began.elapsed().as_secs_f64() + reserve >= limit;
            heard.last() != 0 || kept.get().zip(limit).is_some_and(|(reserve, limit)| over(reserve, limit))
        });
        Ok(Self {
            session: session.clone(),
            output: Event::register(session, "Output")?,
            signals,
            store: Store::of(&place.folder),
            command: place.command(session.size() as usize),
            every,
            keep: keep as usize,
            limit,
            began,
            last: None,
            longest_step: 0.0,
            longest_write: 0.0,
            reserve,
        })
    }

    /// Writes a checkpoint where one is due, or where the run is asked to stop. The run goes on from it as a restarted one
    /// would: contacts and solvers begin anew, so that both compute the same. Collective.
    ///
    /// # Errors
    /// The same on all ranks: the checkpoint can not be written, or [`Cause::Stopped`].
    pub fn step_done<const D: usize>(&mut self, run: RunView<'_, D>, case: &Case) -> Result<()> {
        let finished = run.watch.control.finished();
        let asked = if finished { 0 } else { self.asked() };
        let due = self.every.is_some_and(|every| finished || run.journal.step().is_multiple_of(every));
        if !due && asked == 0 {
            return Ok(());
        }
        let RunView { system, stage, strategy, watch, journal } = run;
        let path = self.write(case, system, stage, watch, journal)?;
        if asked != 0 {
            return Err(self.stopped(asked, stage.start.time, case.units, &path));
        }
        if !finished {
            system.forget(stage)?;
            watch.ledger.forget();
            watch.pace.forget(system);
            *strategy = options::strategy(case, system, SOLVER_PREFIXES[0])?;
        }
        self.last = Some(Instant::now());
        Ok(())
    }

    /// Writes a checkpoint of the last step that was accepted, since a rank was asked to stop within the next one; the
    /// error that ends the run. Collective.
    ///
    /// # Errors
    /// The same on all ranks: the checkpoint can not be written.
    pub fn within_a_step<const D: usize>(&mut self, run: RunView<'_, D>, case: &Case) -> Result<Error> {
        let asked = self.asked();
        let RunView { system, stage, watch, journal, .. } = run;
        let path = self.write(case, system, stage, watch, journal)?;
        Ok(self.stopped(asked, stage.start.time, case.units, &path))
    }

    /// What ended the start: where a rank was asked to stop there is nothing yet to go on from. Collective in that case.
    pub fn within_the_start(&mut self, error: Error) -> Error {
        if error.cause != Cause::Stopped {
            return error;
        }
        let why = Self::reason(self.asked());
        Error::stopped(format!("{why} in the static start; no step is done, and no checkpoint is written"))
            .hint("start anew")
    }

    /// Why any rank was asked to stop; 0 where none was. Collective.
    fn asked(&mut self) -> i32 {
        let seconds = self.last.map_or(0.0, |last| last.elapsed().as_secs_f64());
        self.last = Some(Instant::now());
        self.longest_step = self.longest_step.max(seconds);
        let ahead = self.began.elapsed().as_secs_f64() + self.longest_step + self.longest_write;
        self.reserve.set(Some(self.longest_write));
        let over = self.limit.is_some_and(|limit| ahead >= limit);
        let own = self.signals.last().max(if over { WALL_TIME } else { 0 });
        let mut any = 0;
        self.session.world().all_reduce_into(&own, &mut any, SystemOperation::max());
        any
    }

    /// Writes the state; the older files go once it is on the disk. Collective.
    fn write<const D: usize>(
        &mut self,
        case: &Case,
        system: &ContactSystem<D>,
        stage: &Stage,
        watch: &RunMonitors,
        journal: &mut Journal<D>,
    ) -> Result<PathBuf> {
        let began = Instant::now();
        let output = self.output.clone();
        let world = self.session.world();
        let past = journal.past()?;
        let _running = output.begin();
        let path = self.store.path(journal.step());
        let tables = system.memory(stage, watch.ledger.drive());
        let state = CheckpointHeader::new::<D>(case, journal.inputs(), stage.start.time, watch, past);
        let state = agree(world, state.and_then(|state| state.to_json()))?;
        checkpoint::write(world, &path, state, &tables).map_err(|error| self.with_older(error))?;
        if self.session.rank() == 0 {
            self.store.prune(journal.step(), self.keep);
        }
        self.longest_write = self.longest_write.max(began.elapsed().as_secs_f64());
        Ok(path)
    }

    /// The error with what the user can still do.
    fn with_older(&self, error: Error) -> Error {
        match self.store.list().first() {
            Some((step, _)) => error.hint(&format!(
                "make room; the checkpoint of step {step} is whole: go on from it with\n  {} --restart",
                self.command
            )),
            None => error.hint("see that there is room and that the folder is there, and start anew; there is no older checkpoint"),
        }
    }

    /// The error of a run that ends early; where a file could not be written, with the checkpoint to go on from, if there is one.
    pub fn offered(&self, error: Error) -> Error {
        let known = error.cause != Cause::File || error.message.contains("--restart");
        match self.store.list().first().filter(|_| !known) {
            Some((step, _)) => {
                let on = &self.command;
                error.hint(&format!(
                    "the checkpoint of step {step} is whole: go on from it with\n  {on} --restart"
                ))
            }
            None => error,
        }
    }

    fn reason(asked: i32) -> &'static str {
        if asked == WALL_TIME { WALL_TIME_IS_OVER } else { Signals::name(asked) }
    }

    fn stopped(&self, asked: i32, time: f64, units: Units, path: &std::path::Path) -> Error {
        let s = units.of("s");
        let why = Self::reason(asked);
        Error::stopped(format!("{why} at t = {time:.6e} {s}; the state is in {}", path.display()))
            .hint(&format!("go on with\n  {} --restart", self.command))
    }
}
