//! Runs a study: one member after the other on all ranks, each in a separate folder. An interrupted
//! study is resumed.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::{Communicator, Root};
use serde_json::Value;

use super::advice::{StudyFindings, percent, seconds};
use super::file::Study;
use super::folder::{self, Papers, StudyFolder};
use super::plan::{self, Member};
use super::row::{MemberState, References, StudyRow};
use crate::case::{Case, Units};
use crate::collective::Collective;
use crate::error::{Cause, Error, Result, agree};
use crate::output::console::{Verbosity, say};
use crate::output::folder::{RECORD, ResultsFolder, record};
use crate::output::record::{InputRecord, check_tables};
use crate::petsc::Session;
use crate::reader::document::Document;
use crate::reader::source::Source;
use crate::simulation::{Ready, RunRequest, Signals, WALL_TIME_IS_OVER, refuse, remove_options, set_options};

/// Options for running a study.
#[derive(Debug, Clone)]
pub struct StudyOptions {
    /// Folder of the study's results.
    pub folder: PathBuf,
    /// Whether members that failed before are run again.
    pub rerun_failed: bool,
    /// Verbosity of each member.
    pub members: Verbosity,
    /// Whether the study prints only errors.
    pub is_quiet: bool,
}

/// The study, read and planned; the same on all ranks.
pub struct Planned {
    /// The study file.
    pub study: Study,
    /// Its members.
    pub members: Vec<Member>,
}

impl Planned {
    /// Parses a study and all its cases from their texts.
    ///
    /// # Errors
    /// The study or the case of a member is invalid.
    pub fn read(
        study_text: &str,
        path: &Path,
        load_case: impl FnOnce(&Path) -> Result<String>,
    ) -> Result<Self> {
        let study = Study::parse(study_text, path)?;
        let case = study.source().directory.join(&study.case.value);
        let text = load_case(&case).map_err(|error| match error.cause {
            Cause::File => {
                study.error(study.case.place, error.message, "paths are relative to the study file")
            }
            _ => error,
        })?;
        let units = Document::read(&text, &case, Source::default())?.units();
        let study = if units.is_si() { study } else { Study::parse_in(study_text, path, units)? };
        let members = plan::members(&study, &text)?;
        Ok(Self { study, members })
    }

    /// The members that would be run, as text.
    pub fn listing(&self) -> String {
        let quantities: Vec<&str> = self.study.quantities.value.names().collect();
        let mut text = format!("{} members; quantities: {}", self.members.len(), quantities.join(", "));
        self.members.iter().for_each(|member| text.push_str(&format!("\n  {}", member.name)));
        text
    }
}

/// Causes of failure that concern a single member: its case, a file that the case names, or its
/// solution.
const OF_A_MEMBER: [Cause; 4] = [Cause::Case, Cause::File, Cause::NotConverged, Cause::Guard];

/// Runs all members that are not finished. Collective. Returns the conclusions of the study on rank
/// 0.
///
/// # Errors
/// A failure is not that of a single member, or no member completed. The error is the same on all
/// ranks.
pub fn run(session: &Rc<Session>, planned: &Planned, options: &StudyOptions) -> Result<Vec<String>> {
    let Planned { study, members } = planned;
    let signals = Signals::listen()?;
    let is_first = session.rank() == 0;
    let root = || -> Result<Option<Ledger>> {
        if !is_first {
            return Ok(None);
        }
        let place = folder::prepare(&options.folder)?;
        Ledger::open(study, members, options, session.options_at_the_start(), place).map(Some)
    };
    let mut ledger = agree(session.world(), root())?;
    if let Some(ledger) = &ledger {
        ledger.say(&format!("study of {}: {} members", study.case.value, members.len()));
    }
    for (index, member) in members.iter().enumerate() {
        let done = ledger.as_ref().map_or(Ok(false), |ledger| ledger.is_done(member));
        let mut is_done = agree(session.world(), done)?;
        session.world().process_at_rank(0).broadcast_into(&mut is_done);
        if !is_done {
            require_leave(session, &signals, member)?;
            match compute(session, planned, member, options) {
                // A signal is reported there with the command that resumes the study. A member that
                // reached its own wall-time limit is recorded as a row.
                Err(error) if error.cause == Cause::Stopped => require_leave(session, &signals, member)?,
                outcome => outcome.map_err(|error| error.within(&format!("member {}", member.name)))?,
            }
        }
        let told = ledger.as_mut().map_or(Ok(()), |ledger| ledger.enter(index, is_done));
        agree(session.world(), told)?;
    }
    let advice = ledger.as_mut().map_or(Ok(Vec::new()), Ledger::finish);
    agree(session.world(), advice)
}

/// Ends the study if a signal arrived between two members. While a member runs, it handles signals
/// itself. Collective.
fn require_leave(session: &Session, signals: &Signals, member: &Member) -> Result<()> {
    let mut any = 0;
    session.world().reduce_all(&signals.last(), &mut any, SystemOperation::max());
    if any == 0 {
        return Ok(());
    }
    let text = format!("{}: member {} is not finished", Signals::name(any), member.name);
    Err(Error::stopped(text).hint("resume with the same command"))
}

/// Runs a member, whose outcome is stored in its results. Collective.
///
/// # Errors
/// An error that ends the study, the same on all ranks.
fn compute(session: &Rc<Session>, planned: &Planned, member: &Member, options: &StudyOptions) -> Result<()> {
    let case = &member.case;
    let case_file = planned.study.source().directory.join(&planned.study.case.value);
    let place = RunRequest::anew(case_file, member_folder(&options.folder, member), options.members);
    session.measure_anew();
    let taken = set_options(session, case)?;
    let outcome = match case.dimension.value.coordinates() {
        2 => attempt::<2>(session, case, &place),
        _ => attempt::<3>(session, case, &place),
    };
    remove_options(session, &taken)?;
    outcome
}

fn attempt<const D: usize>(session: &Rc<Session>, case: &Case, place: &RunRequest) -> Result<()> {
    let outcome = match Ready::<D>::new(session, case, place) {
        Err(error) if OF_A_MEMBER.contains(&error.cause) => return refuse(session, case, place, &error),
        ready => ready?.run(session, case, place),
    };
    match outcome {
        // If a member can not write its files, the others can not either.
        Err(error) if error.cause != Cause::File && OF_A_MEMBER.contains(&error.cause) => Ok(()),
        outcome => outcome,
    }
}

fn member_folder(folder: &Path, member: &Member) -> PathBuf {
    folder.join("members").join(&member.name)
}

/// Whether a member failed for a reason that would recur. An input file that could not be read ends
/// a member before its unknowns are counted. An output file that could not be written ends it
/// later, and there may be space by now.
fn is_of_its_own(record: &Value) -> bool {
    let is = |cause: &Cause| record["exit_code"] == *cause as i32;
    let was_not_written = is(&Cause::File) && record["unknowns"] != 0;
    OF_A_MEMBER.iter().any(is) && !was_not_written
}

/// Whether a member was stopped by the wall-time limit of its own case, which would happen again.
fn ran_out_of_time(record: &Value) -> bool {
    record["reason"].as_str().is_some_and(|reason| reason.contains(WALL_TIME_IS_OVER))
}

/// Checks that a member that has ended has complete results.
///
/// # Errors
/// Results are missing or damaged.
fn check_results(member: &Member, record: &Value, folder: &Path) -> Result<()> {
    check_tables(record, folder)?;
    let end = member.case.time.end.value;
    let s = member.case.units.of("s");
    let reached = record["simulated_time"].as_f64().unwrap_or(0.0);
    if record["verdict"] == "completed" && reached < end * (1.0 - 1e-9) {
        let text = format!("{}: ends at {reached} {s}, but the case ends at {end} {s}", folder.display());
        return Err(Error::file(text));
    }
    Ok(())
}

/// Data of a study on rank 0.
struct Ledger<'a> {
    study: &'a Study,
    members: &'a [Member],
    options: &'a StudyOptions,
    references: References,
    axes: Vec<String>,
    quantities: Vec<String>,
    rows: Vec<StudyRow>,
    /// PETSc's options of the command line.
    petsc: String,
    /// The folder of the study, locked by this run.
    place: StudyFolder,
}

impl<'a> Ledger<'a> {
    fn open(
        study: &'a Study,
        members: &'a [Member],
        options: &'a StudyOptions,
        petsc: String,
        place: StudyFolder,
    ) -> Result<Self> {
        let quantities: Vec<String> = study.quantities.value.names().map(str::to_owned).collect();
        let rows = members.iter().map(|member| StudyRow::waiting(member, quantities.len())).collect();
        let references =
            References::read(study, members.first().map_or(Units::SI, |member| member.case.units))?;
        Ok(Self {
            study,
            members,
            options,
            references,
            axes: plan::axes(study),
            quantities,
            rows,
            petsc,
            place,
        })
    }

    /// Whether the results of a member exist and are complete, and were computed by this program
    /// from the same case and meshes with the same PETSc options. Damaged results are computed
    /// again, and the reason is printed.
    ///
    /// # Errors
    /// The folder of the study was replaced, or a damaged folder can not be emptied.
    fn is_done(&self, member: &Member) -> Result<bool> {
        self.place.check()?;
        let folder = member_folder(&self.options.folder, member);
        if ResultsFolder::reclaim(&folder)? {
            self.say(&format!(
                "  {}: its {RECORD} is damaged or missing: the member runs again",
                member.name
            ));
            return Ok(false);
        }
        let record = record(&folder);
        let is_done = self.has_ended(member, &record);
        match check_results(member, &record, &folder) {
            Err(error) if is_done => {
                self.say(&format!("  {}: {error}: the member runs again", member.name));
                Ok(false)
            }
            _ => Ok(is_done),
        }
    }

    /// Whether the record says that this member has ended.
    fn has_ended(&self, member: &Member, record: &Value) -> bool {
        let ended = match record["verdict"].as_str() {
            Some("completed") => true,
            Some("failed") => !self.options.rerun_failed && is_of_its_own(record),
            Some("stopped") => !self.options.rerun_failed && ran_out_of_time(record),
            _ => false,
        };
        let inputs = record["inputs"].as_array();
        let known = |key: &str, word: &str| inputs.into_iter().flatten().any(|input| input[key] == word);
        let same_files = || {
            member.case.files().all(|path| match InputRecord::of(&path) {
                Ok(input) => known("sha256", &input.sha256),
                // The file could not be read in the recorded run either.
                Err(_) => !known("path", &path.display().to_string()),
            })
        };
        ended
            && record["case_sha256"] == member.digest.as_str()
            && record["petsc_options"] == self.petsc.as_str()
            && record["versions"]["contact-petsc"] == env!("CARGO_PKG_VERSION")
            && same_files()
    }

    /// Adds the results of a member that has been run, and rewrites the table.
    fn enter(&mut self, index: usize, was_done: bool) -> Result<()> {
        self.place.check()?;
        let member = &self.members[index];
        self.rows[index] = StudyRow::read(member, &member_folder(&self.options.folder, member), self.study)?;
        self.references.compare(&mut self.rows, &self.study.quantities.value);
        let row = &self.rows[index];
        let what = match row.state {
            MemberState::Completed => {
                let errors = self.quantities.iter().zip(&row.errors).zip(&row.is_measure);
                let so_far = |index| match self.references.is_provisional(index, &self.rows) {
                    true => " against the finest so far",
                    false => "",
                };
                let known = errors.enumerate().filter_map(|(index, ((name, error), is_measure))| {
                    let error = error.filter(|_| !is_measure)?;
                    Some(format!("{name} {}{}", percent(error), so_far(index)))
                });
                std::iter::once(seconds(row.cost.cpu)).chain(known).collect::<Vec<_>>().join(", ")
            }
            _ => format!("failed: {}", row.reason),
        };
        let before = if was_done { " (before)" } else { "" };
        self.say(&format!("  [{}/{}] {}: {what}{before}", index + 1, self.members.len(), row.name));
        self.papers().write(MemberState::Waiting)
    }

    fn finish(&mut self) -> Result<Vec<String>> {
        self.place.check()?;
        if !self.rows.iter().any(|row| row.state == MemberState::Completed) {
            let text = "no member completed".to_owned();
            self.papers().write(MemberState::Failed)?;
            return Err(Error::not_converged(text).hint("the reasons are in study.csv"));
        }
        let papers = self.papers();
        papers.write(MemberState::Completed)?;
        let failed = self.rows.iter().filter(|row| row.state == MemberState::Failed).count();
        if failed > 0 {
            self.say(&format!(
                "{failed} of {} members failed: the reasons are in study.csv",
                self.rows.len()
            ));
        }
        let advice = papers.advice();
        advice.iter().for_each(|sentence| self.say(sentence));
        self.say(&format!("results in {}", self.options.folder.display()));
        Ok(advice)
    }

    fn papers(&self) -> Papers<'_> {
        let findings = StudyFindings { axes: &self.axes, quantities: &self.quantities, rows: &self.rows };
        Papers { folder: &self.options.folder, study: self.study, findings }
    }

    fn say(&self, text: &str) {
        if !self.options.is_quiet {
            say(text);
        }
    }
}
