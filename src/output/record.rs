//! `run.json`: the input of a run, its environment and its outcome. It is rewritten as a whole and
//! says `running` until the end.

use std::io::Read as _;
use std::path::Path;
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use crate::case::Units;
use crate::error::{Cause, Error, Result};
use crate::files;

use super::accuracy::AccuracyRecord;
use super::folder::{PROGRAM, RECORD, write_whole};
use super::io_error::trouble;
use super::process;
use super::table::{Marks, hex};
use super::timestamp::timestamp;

/// State of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Has not reached its end. A killed run also leaves this verdict.
    Running,
    /// The end time was reached.
    Completed,
    /// It stopped on request, with a checkpoint.
    Stopped {
        /// The reason, as printed for the user.
        reason: String,
    },
    /// Ended early because of an error.
    Failed {
        /// The error, as printed for the user.
        reason: String,
        /// Exit code of the process.
        code: i32,
    },
}

impl Verdict {
    /// The verdict that corresponds to an error.
    pub fn of(error: &Error) -> Self {
        if error.cause == Cause::Stopped {
            return Self::Stopped { reason: error.message.clone() };
        }
        Self::Failed { reason: error.message.clone(), code: error.exit_code() }
    }
}

/// Wall time and number of calls of one phase.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PhaseTime {
    /// Wall time, the largest over ranks \[s\].
    pub seconds: f64,
    /// Number of calls.
    pub count: u64,
}

/// Largest penetration and force of a contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PenetrationRecord {
    /// Name in the case.
    pub contact: String,
    /// Largest penetration of any point in any step \[m\]. It is 0 if multipliers enforce contact
    /// exactly.
    pub deepest: f64,
    /// Largest depth of the target between the contactor points in any step \[m\], and the same in
    /// facets of the contactor; 0 if it is not known.
    pub between: [f64; 2],
    /// Largest normal force in any step \[N\]; 0 if the contact never closed.
    pub force: f64,
    /// The penetration tolerance \[m\], if the user requested one.
    pub asked: Option<f64>,
}

impl PenetrationRecord {
    /// Whether the surfaces were in contact in any step.
    pub fn has_closed(&self) -> bool {
        self.deepest > 0.0 || self.force > 0.0
    }
}

/// Bodies that supports alone do not hold, and how they were held in the static equilibrium of the
/// start or in steps of statics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HoldingRecord {
    /// The first step in which they were held; 0 is the start.
    pub step: u64,
    /// The bodies, with the motions that supports leave free.
    pub free: Vec<String>,
    /// Number of motions that were held. Contact resists the other motions.
    pub motions: u32,
    /// Largest force along a held motion in any step, relative to the largest force.
    pub force: f64,
    /// The resultant that held them, which friction has to carry from then on. It is `None` if no
    /// force was needed.
    pub by: Option<Resultant>,
    /// The same information as a sentence for the console.
    pub note: String,
}

/// The resultant of a force on a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Resultant {
    /// The motion that the force resists: body and direction.
    pub against: String,
    /// Its magnitude.
    pub size: f64,
    /// N or N m.
    pub unit: String,
}

/// A file that the run read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InputRecord {
    /// Its path as the user gave it.
    pub path: String,
    /// Its SHA-256 in hexadecimal.
    pub sha256: String,
}

impl InputRecord {
    /// Reads and hashes a file.
    ///
    /// # Errors
    /// It can not be read.
    pub fn of(path: &Path) -> Result<Self> {
        let mut file = files::open(path).map_err(|e| trouble(path, "read", &e))?;
        let mut hash = Sha256::new();
        let mut piece = vec![0; 1 << 16];
        loop {
            match file.read(&mut piece).map_err(|e| trouble(path, "read", &e))? {
                0 => return Ok(Self { path: path.display().to_string(), sha256: hex(hash) }),
                count => hash.update(&piece[..count]),
            }
        }
    }

    /// The record of an input that was already read, such as the case. The file may have been a
    /// pipe, or may have changed since.
    pub fn of_text(path: &Path, text: &str) -> Self {
        Self { path: path.display().to_string(), sha256: hex(Sha256::new().chain_update(text)) }
    }
}

/// Totals of the run so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Totals {
    /// Accepted steps.
    pub steps: u64,
    /// Cuts of a step: attempts that were rolled back, and steps that were halved before they were
    /// tried because surfaces with friction would move too far in them.
    pub cut_steps: u64,
    /// Newton iterations, including those of failed attempts.
    pub newton_iterations: u64,
    /// Krylov iterations, including those of failed attempts.
    pub krylov_iterations: u64,
    /// Krylov iterations within preconditioners, including those of failed attempts.
    pub inner_krylov_iterations: u64,
    /// Linear solvers that failed and were replaced by a stronger one.
    pub linear_fallbacks: u64,
    /// Number of restarts from a checkpoint.
    pub restarts: u64,
}

/// Size and work of each rank, one entry per rank.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RankBalance {
    /// Elements that belong to it.
    pub elements: Vec<u64>,
    /// Nodes that it owns.
    pub nodes: Vec<u64>,
    /// Contactor facets of its elements.
    pub contact_facets: Vec<u64>,
    /// Processor time in user mode, including time waiting in MPI \[s\].
    pub cpu_seconds: Vec<f64>,
    /// Wall time in search, contact, element forces and tangents, in which ranks do not wait for
    /// each other \[s\].
    pub work_seconds: Vec<f64>,
}

/// The run record. Rank 0 writes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The units of its numbers, and of the tables in the same folder.
    pub units: Units,
    /// The case, completed with its defaults.
    pub case: Value,
    /// SHA-256 of the completed case.
    pub digest: String,
    /// The case file and the mesh files.
    pub inputs: Vec<InputRecord>,
    /// Name and version of the program and of each library.
    pub versions: Vec<(String, String)>,
    /// PETSc's options of the command line, with their values.
    pub petsc_options: String,
    /// MPI ranks.
    pub ranks: usize,
    /// Threads of the BLAS in each rank, if the BLAS reports them.
    pub blas_threads: Option<u32>,
    /// Degrees of freedom.
    pub unknowns: u64,
    /// When the run began.
    pub start: SystemTime,
    /// Totals so far.
    pub totals: Totals,
    /// Simulated time reached \[s\].
    pub simulated_time: f64,
    /// Wall time so far \[s\].
    pub wall_seconds: f64,
    /// Time and calls of each phase, in display order: search, element kernels, insertion, solver
    /// set-up, solve, output.
    pub phases: Vec<(String, PhaseTime)>,
    /// The part of the phases that the start took, with static equilibrium and initial
    /// acceleration. The rest belongs to the steps.
    pub start_phases: Vec<(String, PhaseTime)>,
    /// Largest resident memory of each rank \[bytes\].
    pub peak_memory: Vec<u64>,
    /// Size and work of each rank.
    pub balance: RankBalance,
    /// Largest penetrations and forces of the contacts so far.
    pub penetrations: Vec<PenetrationRecord>,
    /// How bodies were held that supports do not hold.
    pub held: Option<HoldingRecord>,
    /// Requested and achieved accuracy, if the case requests an accuracy.
    pub accuracy: Option<AccuracyRecord>,
    /// Warnings and remarks printed for the user, one sentence each.
    pub warnings: Vec<String>,
    /// Marks of the tables at the end, with which a reader checks that they are complete. They are
    /// empty before the end.
    pub tables: Marks,
    /// State of the run.
    pub verdict: Verdict,
}

/// Maximum number of warnings that are kept. A run with a million cut steps does not need a million
/// sentences.
const MOST_WARNINGS: usize = 100;

impl Record {
    /// Stores a warning in the record as one line. The console's label is removed, and the hint is
    /// appended.
    pub fn warn(&mut self, text: String) {
        match self.warnings.len() {
            count if count < MOST_WARNINGS => {
                self.warnings.push(text.trim_start_matches("warning: ").replace("\nhint: ", "; "));
            }
            MOST_WARNINGS => self.warnings.push("further warnings are omitted".into()),
            _ => {}
        }
    }

    /// Writes `run.json` into the results folder and replaces the previous one atomically.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let mut text = serde_json::to_string_pretty(&self.to_json())
            .map_err(|e| Error::new(Cause::Internal, format!("{RECORD}: {e}")))?;
        text.push('\n');
        write_whole(&folder.join(RECORD), text.as_bytes())
    }

    fn to_json(&self) -> Value {
        let (verdict, reason, code) = match &self.verdict {
            Verdict::Running => ("running", None, None),
            Verdict::Completed => ("completed", None, Some(0)),
            Verdict::Stopped { reason } => ("stopped", Some(reason), Some(Cause::Stopped as i32)),
            Verdict::Failed { reason, code } => ("failed", Some(reason), Some(*code)),
        };
        let versions: Map<String, Value> =
            self.versions.iter().map(|(name, version)| (name.clone(), json!(version))).collect();
        let named = |phases: &[(String, PhaseTime)]| -> Map<String, Value> {
            phases.iter().map(|(name, phase)| (name.clone(), json!(phase))).collect()
        };
        let mut record = json!({
            "program": PROGRAM,
            "units": self.units,
            "verdict": verdict,
            "reason": reason,
            "exit_code": code,
            "process": process::own(),
            "start": timestamp(self.start),
            "wall_seconds": self.wall_seconds,
            "simulated_time": self.simulated_time,
            "ranks": self.ranks,
            "blas_threads": self.blas_threads,
            "unknowns": self.unknowns,
            "steps": self.totals.steps,
            "cut_steps": self.totals.cut_steps,
            "newton_iterations": self.totals.newton_iterations,
            "krylov_iterations": self.totals.krylov_iterations,
            "inner_krylov_iterations": self.totals.inner_krylov_iterations,
            "linear_fallbacks": self.totals.linear_fallbacks,
            "restarts": self.totals.restarts,
            "phases": named(&self.phases),
            "start_phases": named(&self.start_phases),
            "peak_memory_bytes": self.peak_memory,
            "balance": self.balance,
            "penetration": self.penetrations,
            "warnings": self.warnings,
            "versions": versions,
            "inputs": self.inputs,
            "petsc_options": self.petsc_options,
            "case_sha256": self.digest,
            "case": self.case,
        });
        let entries = record.as_object_mut().into_iter();
        entries.for_each(|entries| {
            let tables = (!self.tables.0.is_empty()).then(|| json!(self.tables));
            let optional = [
                tables.map(|tables| ("tables", tables)),
                self.held.as_ref().map(|held| ("held", json!(held))),
                self.accuracy.as_ref().map(|accuracy| ("accuracy", with_units(json!(accuracy), self.units))),
            ];
            entries.extend(optional.into_iter().flatten().map(|(name, value)| (name.to_owned(), value)));
        });
        record
    }
}

/// Checks that the tables of a run that has ended are unchanged.
///
/// # Errors
/// A table is missing, truncated or changed, or the record of a completed run has no marks of the
/// tables.
pub fn check_tables(record: &Value, folder: &Path) -> Result<()> {
    let place = folder.join(RECORD);
    match &record["tables"] {
        Value::Null if record["verdict"] == "completed" => {
            Err(Error::file(format!("{}: has no checksums of the tables", place.display())))
        }
        Value::Null => Ok(()),
        marks => {
            let marks: Marks = serde_json::from_value(marks.clone())
                .map_err(|error| Error::file(format!("{}: damaged: {error}", place.display())))?;
            marks.check(folder)
        }
    }
}

/// The value with the headings of `units` in place of its keys that name an SI unit.
fn with_units(value: Value, units: Units) -> Value {
    match value {
        Value::Object(entries) => {
            entries.into_iter().map(|(key, value)| (units.heading(&key), with_units(value, units))).collect()
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::super::folder::ResultsFolder;
    use super::super::folder::tests::Scratch;
    use super::super::table::{Cell, Table};
    use super::*;

    fn sample(verdict: Verdict) -> Record {
        Record {
            units: Units::SI,
            case: json!({"title": "Rubber block", "dimension": 2}),
            digest: String::new(),
            inputs: vec![],
            versions: vec![("petsc".into(), "3.18.5".into())],
            petsc_options: String::new(),
            ranks: 2,
            blas_threads: Some(1),
            unknowns: 4998,
            start: UNIX_EPOCH + Duration::from_secs(951_827_696),
            totals: Totals {
                steps: 140,
                cut_steps: 1,
                newton_iterations: 454,
                krylov_iterations: 3000,
                inner_krylov_iterations: 0,
                linear_fallbacks: 2,
                restarts: 1,
            },
            simulated_time: 0.07,
            wall_seconds: 9.5,
            phases: vec![
                ("search".into(), PhaseTime { seconds: 0.5, count: 454 }),
                ("solve".into(), PhaseTime::default()),
            ],
            start_phases: vec![("search".into(), PhaseTime { seconds: 0.1, count: 4 })],
            peak_memory: vec![1 << 27, 1 << 26],
            balance: RankBalance::default(),
            penetrations: vec![],
            held: None,
            accuracy: None,
            warnings: vec!["watch it".into()],
            tables: Marks::default(),
            verdict,
        }
    }

    /// The record says `running` until the end, then the outcome with the exit code. A folder with
    /// it belongs to this program.
    #[test]
    fn tells_how_the_run_stands() {
        let scratch = Scratch::new("record");
        let read = |verdict| -> Value {
            sample(verdict).write(&scratch.0).unwrap();
            serde_json::from_str(&std::fs::read_to_string(scratch.0.join("run.json")).unwrap()).unwrap()
        };
        let running = read(Verdict::Running);
        assert_eq!((&running["verdict"], &running["exit_code"]), (&json!("running"), &Value::Null));
        let failed = read(Verdict::of(&Error::guard("element 3 is inverted")));
        assert_eq!((&failed["verdict"], &failed["exit_code"]), (&json!("failed"), &json!(6)));
        assert_eq!(failed["reason"], "element 3 is inverted");
        let stopped = read(Verdict::of(&Error::stopped("SIGTERM")));
        assert_eq!((&stopped["verdict"], &stopped["exit_code"]), (&json!("stopped"), &json!(7)));
        let completed = read(Verdict::Completed);
        assert_eq!((&completed["verdict"], &completed["exit_code"]), (&json!("completed"), &json!(0)));
        assert_eq!(completed["phases"]["search"], json!({"seconds": 0.5, "count": 454}));
        assert_eq!(completed["start_phases"]["search"], json!({"seconds": 0.1, "count": 4}));
        assert_eq!(completed["case"]["title"], "Rubber block");
        assert_eq!(completed["peak_memory_bytes"][0], 1 << 27);
        assert_eq!(completed["warnings"][0], "watch it");
        assert_eq!(std::fs::read_dir(&scratch.0).unwrap().count(), 1);
        assert!(ResultsFolder::open(&scratch.0).is_ok());
    }

    /// A warning is stored as one line, whatever its form on the console, and their number is
    /// limited.
    #[test]
    fn warnings_are_single_lines() {
        let mut record = sample(Verdict::Running);
        record.warn("warning: 1 mm deep\nhint: ask for less".into());
        assert_eq!(record.warnings[1], "1 mm deep; ask for less");
        (0..200).for_each(|_| record.warn("again".into()));
        assert_eq!(record.warnings.len(), MOST_WARNINGS + 1);
    }

    /// A record verifies its tables: a truncated, damaged or missing table is named, and so is a
    /// record without marks.
    #[test]
    fn the_record_proves_its_tables() {
        let scratch = Scratch::new("proof");
        let path = scratch.0.join("a.csv");
        let mut table = Table::create(&path, vec!["step".into(), "a".into()]).unwrap();
        (0..9).for_each(|step| table.row(&[Cell::Count(step), Cell::Number(0.5)]).unwrap());
        let mut record = sample(Verdict::Completed);
        record.tables.add(&table).unwrap();
        record.write(&scratch.0).unwrap();
        let text = std::fs::read_to_string(scratch.0.join(RECORD)).unwrap();
        let mut told: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(told["tables"]["a.csv"]["rows"], 9);
        let check = |told: &Value| check_tables(told, &scratch.0);
        check(&told).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let other = String::from_utf8(whole.clone()).unwrap().replace("7,0.5", "7,0.4");
        for (content, words) in [
            (&whole[..20], "rows are missing"),
            (other.as_bytes(), "SHA-256"),
            (b"", "rows are missing"),
            (&[&whole[..], b"9"].concat(), "instead of"),
        ] {
            std::fs::write(&path, content).unwrap();
            let error = check(&told).unwrap_err();
            assert!(error.message.contains("a.csv: ") && error.message.contains(words), "{words}: {error}");
        }
        std::fs::remove_file(&path).unwrap();
        assert!(check(&told).is_err());
        told["tables"] = json!({ "a.csv": 7 });
        assert!(check(&told).unwrap_err().message.contains("run.json: damaged"));
        told["tables"] = Value::Null;
        assert!(check(&told).unwrap_err().message.contains("no checksums"));
        told["verdict"] = json!("failed");
        check(&told).unwrap();
    }

    /// The hash is SHA-256: the standard's value for "abc".
    #[test]
    fn hashes_inputs() {
        let scratch = Scratch::new("hash");
        let path = scratch.0.join("abc");
        std::fs::write(&path, "abc").unwrap();
        let hash = InputRecord::of(&path).unwrap().sha256;
        assert_eq!(hash, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_eq!(InputRecord::of_text(&path, "abc"), InputRecord::of(&path).unwrap());
        assert_eq!(InputRecord::of(&scratch.0.join("absent")).unwrap_err().cause, Cause::File);
    }
}
