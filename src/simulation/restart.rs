//! Restarts a run from a checkpoint: selects it, checks it against the case, and restores the run.

use std::path::PathBuf;
use std::rc::Rc;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::begin::Begin;
use super::earlier_run::EarlierRun;
use super::input::shared_text;
use super::journal::Journal;
use super::place::{RunRequest, inputs, quoted};
use super::run_state::{RunState, StoredSnapshot, solver_settings};
use super::{agree, options, start};
use crate::accuracy::{self, StepPacing};
use crate::advice::precision::{MotionPrecision, Precision};
use crate::assembly::{ContactSystem, StoredState};
use crate::case::{Case, Units};
use crate::checkpoint::{self, FileSection, Store};
use crate::dynamics::{Split, Stage, Staging};
use crate::error::{Error, Result};
use crate::guard::RunGuard;
use crate::model::Model;
use crate::observe::energy::EnergyLedger;
use crate::output::folder::{ResultsFolder, record};
use crate::output::process::{self, claim};
use crate::output::record::InputRecord;
use crate::petsc::Session;
use crate::solvers::Strategy;

/// Description of the run in the header of a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckpointHeader {
    /// Version of the program.
    version: String,
    /// 2 or 3.
    dimension: usize,
    /// Instant \[s\].
    pub time: f64,
    /// End of the case \[s\], which may change at a restart.
    end: f64,
    /// The case without the entries that may change at a restart.
    case: Value,
    /// Hashes of the mesh files.
    meshes: Vec<String>,
    /// The state of the run, except for its fields.
    run: StoredSnapshot,
    /// What was computed up to the checkpoint.
    pub past: EarlierRun,
}

impl CheckpointHeader {
    /// The header for a run at the instant `time` \[s\].
    ///
    /// # Errors
    /// An internal error of the program.
    pub fn new<const D: usize>(
        case: &Case,
        inputs: &[InputRecord],
        time: f64,
        run: StoredSnapshot,
        past: EarlierRun,
    ) -> Result<Self> {
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            dimension: D,
            time,
            end: case.time.end.value,
            case: fixed(case)?,
            meshes: meshes(inputs),
            run,
            past,
        })
    }

    /// The header as JSON.
    ///
    /// # Errors
    /// An internal error of the program.
    pub fn to_json(&self) -> Result<Value> {
        serde_json::to_value(self).map_err(|error| Error::internal(format!("checkpoint: {error}")))
    }

    /// Checks whether the case can be resumed from this checkpoint.
    fn check<const D: usize>(&self, case: &Case, inputs: &[InputRecord]) -> Result<()> {
        let cure = "restore the case of that run, or start again without --restart; only title, end, \
                    solver, PETSc options and output except probes, bodies, derived \
                    quantities and the fields of the format vtkhdf may change";
        let units = Units::of_record(&self.case);
        if units != case.units {
            let message =
                format!("the checkpoint is in {}, but the case is in {}", units.bases(), case.units.bases());
            return Err(Error::case(message).hint(cure));
        }
        if let Some(what) = difference(&self.case, &fixed(case)?, "") {
            return Err(
                Error::case(format!("the case differs from that of the checkpoint: {what}")).hint(cure)
            );
        }
        if self.meshes != meshes(inputs) {
            return Err(Error::case(
                "a mesh or surface differs from that of the checkpoint: its file has changed",
            )
            .hint(cure));
        }
        if self.dimension != D {
            return Err(Error::internal("checkpoint: wrong dimension"));
        }
        if case.time.end.value < self.time {
            let end = case.time.end.value;
            let time = self.time;
            let s = case.units.of("s");
            return Err(Error::case(format!(
                "the case ends at {end:.6e} {s}, but the checkpoint is at {time:.6e} {s}"
            ))
            .hint("set a later end, or resume from an older checkpoint with --restart=FILE"));
        }
        Ok(())
    }
}

/// The checkpoint from which a run resumes.
pub struct Saved {
    path: PathBuf,
    /// Its header.
    pub state: CheckpointHeader,
    sections: Vec<FileSection>,
    tables: Option<StoredState>,
}

impl Saved {
    /// The checkpoint that `place` requests, checked against the case; `None` if it requests no
    /// checkpoint. Collective.
    ///
    /// # Errors
    /// There is no checkpoint, it is damaged, or it belongs to another case. The error is the same
    /// on all ranks.
    pub fn find<const D: usize>(
        session: &Rc<Session>,
        case: &Case,
        place: &RunRequest,
    ) -> Result<Option<Self>> {
        if place.begin == Begin::Fresh {
            let rank = session.rank();
            let own =
                if rank == 0 { keep_interrupted_run(case, place, session.size() as usize) } else { Ok(()) };
            agree(session.world(), own)?;
        }
        if matches!(place.begin, Begin::Anew | Begin::Fresh) {
            return Ok(None);
        }
        let own = if session.rank() == 0 {
            find_checkpoint::<D>(case, place, session.size() as usize)
        } else {
            Ok(String::new())
        };
        let text = shared_text(session, own)?;
        let (path, state, sections) =
            serde_json::from_str(&text).map_err(|error| Error::internal(format!("checkpoint: {error}")))?;
        Ok(Some(Self { path, state, sections, tables: None }))
    }

    /// Reads this rank's part of the file before the results folder is changed. Collective.
    ///
    /// # Errors
    /// The file does not fit the mesh or this version of the program. The error is the same on all
    /// ranks.
    pub fn read<const D: usize>(&mut self, system: &ContactSystem<D>) -> Result<()> {
        let sections =
            self.sections.iter().map(|section| (section.name.as_str(), section.columns.as_slice()));
        let mut wanted = StoredState::wanted(system, sections)
            .map_err(|error| error.within(&self.path.display().to_string()))?;
        checkpoint::read(system.session().world(), &self.path, wanted.tables_mut())?;
        self.tables = Some(wanted);
        Ok(())
    }

    /// Restores the run from what [`read`](Self::read) has read. Collective.
    ///
    /// # Errors
    /// PETSc reports an error, or the record can not be written.
    pub fn resume<const D: usize>(
        &self,
        mut system: ContactSystem<D>,
        mut stage: Stage,
        strategy: Box<dyn Strategy>,
        case: &Case,
        model: &Model<D>,
        journal: &mut Journal<D>,
    ) -> Result<RunState<D>> {
        let scheme = options::scheme(&case.time);
        stage.inertia = scheme.has_inertia();
        let time = self.state.time;
        let end = case.time.end.value;
        let control = accuracy::control(case, model, if end > time { time } else { 0.0 });
        let pace = StepPacing::new(&mut system, &stage, case, model)?;
        let ledger = EnergyLedger::empty(system.pattern_vector().like()?)?;
        let guard = RunGuard::new(case, model, scheme, ledger.now());
        let precision = MotionPrecision::new(Precision::of(&system));
        let settings = solver_settings(case, &*strategy, system.session())?;
        let mut run = RunState { system, stage, strategy, control, ledger, guard, pace, precision, settings };
        let tables = self.tables.as_ref().ok_or_else(|| Error::internal("a checkpoint that was not read"))?;
        let ends_elsewhere = end != self.state.end && end > time;
        run.restore(&self.state.run, tables, ends_elsewhere)
            .map_err(|error| error.within(&self.path.display().to_string()))?;
        run.system.set_continuation(start::of_steps(&run.system, case));
        run.system.set_split(Split::Monolithic);
        journal.resume(&run.control, &format!("resumed from {}", self.path.display()))?;
        Ok(run)
    }
}

const NO_RUN_TO_RESUME: &str = "there is no run to resume: start without --restart, name the folder of \
                                     the run with --output, or branch into a new folder with \
                                     --restart=CHECKPOINT --output NEW";

/// Protects an interrupted run of the same case from being overwritten when `--restart` was
/// forgotten. Rank 0 only.
///
/// # Errors
/// The results folder holds a run of the same case that stopped before its end and left
/// checkpoints.
fn keep_interrupted_run(case: &Case, place: &RunRequest, ranks: usize) -> Result<()> {
    claim(&place.folder)?;
    let record = record(&place.folder);
    let ended = ["completed", "failed"].contains(&process::verdict(&record));
    let same = case.digest()? == record["case_sha256"].as_str().unwrap_or_default();
    let Some((step, _)) = Store::of(&place.folder).list().into_iter().next().filter(|_| same && !ended)
    else {
        return Ok(());
    };
    let folder = place.folder.display();
    let text = format!(
        "{folder}: an interrupted run of this case can be resumed from step {step}; nothing was changed"
    );
    let on = place.command(ranks);
    let cure =
        format!("resume with {on} --restart, or use --anew instead to start again and replace the results");
    Err(Error::file(text).hint(&cure))
}

/// Path and header of the checkpoint, as text. Rank 0 only.
fn find_checkpoint<const D: usize>(case: &Case, place: &RunRequest, ranks: usize) -> Result<String> {
    let branches = matches!(place.begin, Begin::From(_)) && ResultsFolder::is_free(&place.folder);
    if !branches {
        ResultsFolder::find(&place.folder).map_err(|error| error.hint(NO_RUN_TO_RESUME))?;
        claim(&place.folder)?;
    }
    let asked = match &place.begin {
        Begin::From(path) => Some(path.as_path()),
        Begin::Anew | Begin::Fresh | Begin::Newest => None,
    };
    let again = |path: &std::path::Path| format!("{} --restart={}", place.command(ranks), quoted(path));
    let found = Store::of(&place.folder).find(asked, again)?;
    let name = found.path.display().to_string();
    let mut state: CheckpointHeader = serde_json::from_value(found.header.state).map_err(|error| {
        Error::file(format!("{name}: written by another version of this program ({error})"))
            .hint("resume with that version, or start again without --restart")
    })?;
    state
        .check::<D>(case, &inputs(case, place).collect::<Result<Vec<_>>>()?)
        .and_then(|()| state.run.check())
        .map_err(|error| error.within(&name))?;
    match branches {
        true => state.past.branch(),
        false => state.past.tables().map_or(Ok(()), |tables| tables.check_starts(&place.folder))?,
    }
    serde_json::to_string(&(found.path, state, found.header.sections))
        .map_err(|error| Error::internal(format!("checkpoint: {error}")))
}

/// The case without the entries that may change: title, end of time, solver, partition, PETSc's
/// options, and output except probes, bodies and derived quantities.
fn fixed(case: &Case) -> Result<Value> {
    let mut json = case.to_json()?;
    if let Some(case) = json.as_object_mut() {
        ["title", "solver", "partition", "petsc"].iter().for_each(|key| drop(case.remove(*key)));
        if let Some(time) = case.get_mut("time").and_then(Value::as_object_mut) {
            time.remove("end");
        }
        if let Some(output) = case.get_mut("output").and_then(Value::as_object_mut) {
            // A file for all steps has the same fields in all of them.
            let fields = output.get_mut("fields").and_then(Value::as_object_mut);
            let is_one_file = fields.is_some_and(|fields| {
                fields.remove("every");
                fields.contains_key("format")
            });
            output.retain(|key, _| {
                ["probes", "bodies", "derived"].contains(&key.as_str()) || (is_one_file && key == "fields")
            });
        }
    }
    Ok(json)
}

fn meshes(inputs: &[InputRecord]) -> Vec<String> {
    inputs.iter().skip(1).map(|input| input.sha256.clone()).collect()
}

/// Describes the first entry at which two values differ.
fn difference(was: &Value, is: &Value, path: &str) -> Option<String> {
    let inner = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match (was, is) {
        (Value::Object(was), Value::Object(is)) => {
            let keys = was.keys().chain(is.keys().filter(|key| !was.contains_key(*key)));
            let of = |map: &serde_json::Map<String, Value>, key: &str| {
                map.get(key).cloned().unwrap_or(Value::Null)
            };
            keys.map(|key| difference(&of(was, key), &of(is, key), &inner(key))).find_map(|found| found)
        }
        _ => (was != is).then(|| format!("{path} was {was} and is {is}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The first difference is named with both values, also in nested entries and for keys that
    /// were added or removed.
    #[test]
    fn differences_are_named() {
        let was = json!({"a": {"b": 1, "c": [1, 2]}, "d": 2});
        assert_eq!(difference(&was, &was, ""), None);
        let is = json!({"a": {"b": 1, "c": [1, 3]}, "d": 2});
        assert_eq!(difference(&was, &is, "").unwrap(), "a.c was [1,2] and is [1,3]");
        assert_eq!(difference(&was, &json!({"a": was["a"].clone()}), "").unwrap(), "d was 2 and is null");
        let more = json!({"a": was["a"].clone(), "d": 2, "e": 0});
        assert_eq!(difference(&was, &more, "").unwrap(), "e was null and is 0");
    }
}
