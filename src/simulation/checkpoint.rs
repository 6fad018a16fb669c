//! Decides when a run writes a checkpoint, what the checkpoint contains, and when the run stops on
//! request.

use std::cell::Cell;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Instant;

use mpi::collective::SystemOperation;

use super::journal::Journal;
use super::place::RunRequest;
use super::restart::CheckpointHeader;
use super::run_state::{RunState, Snapshot};
use super::signals::Signals;
use crate::case::{Case, Units};
use crate::checkpoint::{self, Store};
use crate::collective::Collective;
use crate::error::{Cause, Error, Result, agree};
use crate::petsc::{Event, Session};

/// Code of the wall-time limit. It differs from every signal number.
const WALL_TIME: i32 = 1000;

/// Message of a run that reached its wall-time limit.
pub const WALL_TIME_IS_OVER: &str = "the wall time limit is reached";

/// Decides at every step whether a checkpoint is written and whether the run stops.
pub struct CheckpointPolicy {
    session: Rc<Session>,
    output: Event,
    signals: Signals,
    store: Store,
    /// Command with which a user resumes the run.
    command: String,
    every: Option<u64>,
    keep: usize,
    limit: Option<f64>,
    began: Instant,
    /// End of the last step. It is `None` before the first step, so that one-time set-up is not
    /// counted as a step.
    last: Option<Instant>,
    /// Longest step so far \[s\].
    longest_step: f64,
    /// Longest checkpoint so far \[s\].
    longest_write: f64,
    /// Longest checkpoint so far \[s\], for the test within a step. It is `None` within the first
    /// step of a process, which disables the wall-time limit there, so that each process advances
    /// by at least one step.
    reserve: Rc<Cell<Option<f64>>>,
    /// The state at the end of the last accepted step.
    last_state: Option<Snapshot>,
}

impl CheckpointPolicy {
    /// The policy for the case. It listens to signals from this call on.
    ///
    /// # Errors
    /// The operating system refuses the signal handlers.
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
            last_state: None,
        })
    }

    /// Notes the state before the first step of this process.
    ///
    /// # Errors
    /// An internal error of the program.
    pub fn begin<const D: usize>(&mut self, run: &RunState<D>) -> Result<()> {
        self.last_state = Some(run.snapshot()?);
        Ok(())
    }

    /// Notes the state at the end of a step, and writes a checkpoint when one is due or when the run
    /// is requested to stop. The run does not change by it. Collective.
    ///
    /// # Errors
    /// The checkpoint can not be written, or the run stops ([`Cause::Stopped`]). The error is the
    /// same on all ranks.
    pub fn step_done<const D: usize>(
        &mut self,
        run: &RunState<D>,
        journal: &mut Journal<D>,
        case: &Case,
    ) -> Result<()> {
        self.last_state = Some(run.snapshot()?);
        let finished = run.control.finished();
        let asked = if finished { 0 } else { self.asked() };
        let due = self.every.is_some_and(|every| finished || journal.step().is_multiple_of(every));
        if !due && asked == 0 {
            return Ok(());
        }
        let path = self.write(run, journal, case)?;
        if asked != 0 {
            return Err(self.stopped(asked, run.stage.start.time, case.units, &path));
        }
        self.last = Some(Instant::now());
        Ok(())
    }

    /// Writes a checkpoint of the last accepted step, because a rank was requested to stop within
    /// the next step. Returns the error that ends the run. Collective.
    ///
    /// # Errors
    /// The checkpoint can not be written; the error is the same on all ranks.
    pub fn within_a_step<const D: usize>(
        &mut self,
        run: &RunState<D>,
        journal: &mut Journal<D>,
        case: &Case,
    ) -> Result<Error> {
        let asked = self.asked();
        let path = self.write(run, journal, case)?;
        Ok(self.stopped(asked, run.stage.start.time, case.units, &path))
    }

    /// Completes the error that ended the start. If a rank was requested to stop, the message says
    /// that there is no checkpoint yet. Collective in that case.
    pub fn within_the_start(&mut self, error: Error) -> Error {
        if error.cause != Cause::Stopped {
            return error;
        }
        let why = Self::reason(self.asked());
        Error::stopped(format!(
            "{why} during the static start; no step was completed, and no checkpoint was written"
        ))
        .hint("start again")
    }

    /// Why any rank was requested to stop; 0 if no rank was. Collective.
    fn asked(&mut self) -> i32 {
        let seconds = self.last.map_or(0.0, |last| last.elapsed().as_secs_f64());
        self.last = Some(Instant::now());
        self.longest_step = self.longest_step.max(seconds);
        let ahead = self.began.elapsed().as_secs_f64() + self.longest_step + self.longest_write;
        self.reserve.set(Some(self.longest_write));
        let over = self.limit.is_some_and(|limit| ahead >= limit);
        let own = self.signals.last().max(if over { WALL_TIME } else { 0 });
        let mut any = 0;
        self.session.world().reduce_all(&own, &mut any, SystemOperation::max());
        any
    }

    /// Writes the state of the last accepted step. Older checkpoints are deleted once it is on the
    /// disk. Collective.
    fn write<const D: usize>(
        &mut self,
        run: &RunState<D>,
        journal: &mut Journal<D>,
        case: &Case,
    ) -> Result<PathBuf> {
        let began = Instant::now();
        let output = self.output.clone();
        let world = self.session.world();
        let past = journal.past()?;
        let _running = output.begin();
        let path = self.store.path(journal.step());
        let snapshot =
            self.last_state.as_ref().ok_or_else(|| Error::internal("a checkpoint without a state"))?;
        let stored = run.stored(snapshot);
        let tables = run.tables(snapshot);
        let state = stored.and_then(|stored| {
            CheckpointHeader::new::<D>(case, journal.inputs(), snapshot.time, stored, past)
        });
        let state = agree(world, state.and_then(|state| state.to_json()))?;
        checkpoint::write(world, &path, state, &tables).map_err(|error| self.with_older(error))?;
        if self.session.rank() == 0 {
            self.store.prune(journal.step(), self.keep);
        }
        self.longest_write = self.longest_write.max(began.elapsed().as_secs_f64());
        Ok(path)
    }

    /// Adds a hint to the error on how the user can continue.
    fn with_older(&self, error: Error) -> Error {
        match self.store.list().first() {
            Some((step, _)) => error.hint(&format!(
                "free some disk space; the checkpoint of step {step} is intact: resume from it with\n  {} \
                 --restart",
                self.command
            )),
            None => error.hint(
                "check that the folder exists and that the disk has free space, and start again; there is \
                 no older checkpoint",
            ),
        }
    }

    /// Completes the error of a run that ends early. If a file could not be written and there is a
    /// checkpoint, the hint names that checkpoint.
    pub fn offered(&self, error: Error) -> Error {
        let known = error.cause != Cause::File || error.message.contains("--restart");
        match self.store.list().first().filter(|_| !known) {
            Some((step, _)) => {
                let on = &self.command;
                error.hint(&format!(
                    "the checkpoint of step {step} is intact: resume from it with\n  {on} --restart"
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
        Error::stopped(format!("{why} at t = {time:.6e} {s}; the state was saved in {}", path.display()))
            .hint(&format!("resume with\n  {} --restart", self.command))
    }
}
