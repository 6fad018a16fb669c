//! Runs a study: one member after the other on all ranks, each into a folder of its own; goes on where it was left.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use mpi::traits::{Communicator, Root};

use super::advice::{Findings, percent, seconds};
use super::file::Study;
use super::folder::{self, Papers};
use super::plan::{self, Member};
use super::row::{References, Row, State, record};
use crate::case::Mesh;
use crate::error::{Cause, Error, Result, agree};
use crate::output::console::Verbosity;
use crate::output::record::Input;
use crate::petsc::Session;
use crate::simulation::{self, Place, give_options, take_back_options};

/// How a study is run.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the study's results.
    pub folder: PathBuf,
    /// Whether members that failed before are run once more.
    pub rerun_failed: bool,
    /// How much each member says.
    pub members: Verbosity,
    /// Whether the study says nothing but errors.
    pub is_quiet: bool,
}

/// The study, read and planned; the same on all ranks.
pub struct Planned {
    /// The file.
    pub study: Study,
    /// Its members.
    pub members: Vec<Member>,
}

impl Planned {
    /// Reads a study and all its cases from their texts.
    ///
    /// # Errors
    /// Anything wrong in the study or in the case of any member.
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
        let members = plan::members(&study, &text)?;
        Ok(Self { study, members })
    }

    /// What would be run, as text.
    pub fn listing(&self) -> String {
        let quantities: Vec<&str> = self.study.quantities.value.names().collect();
        let mut text = format!("{} members; quantities: {}", self.members.len(), quantities.join(", "));
        self.members.iter().for_each(|member| text.push_str(&format!("\n  {}", member.name)));
        text
    }
}

/// Runs all members that are not done. Collective. Returns what the study comes to, on rank 0.
///
/// # Errors
/// The same on all ranks: what is no failure of a single member, or that no member completed.
pub fn run(session: &Rc<Session>, planned: &Planned, options: &Options) -> Result<Vec<String>> {
    let Planned { study, members } = planned;
    let is_first = session.rank() == 0;
    let root = || -> Result<Option<Ledger>> {
        if !is_first {
            return Ok(None);
        }
        folder::prepare(&options.folder)?;
        Ledger::open(study, members, options, session.options_at_the_start()).map(Some)
    };
    let mut ledger = agree(session.world(), root())?;
    if let Some(ledger) = &ledger {
        ledger.say(&format!("study of {}: {} members", study.case.value, members.len()));
    }
    for (index, member) in members.iter().enumerate() {
        let mut is_done = ledger.as_ref().is_some_and(|ledger| ledger.is_done(member));
        session.world().process_at_rank(0).broadcast_into(&mut is_done);
        if !is_done {
            match compute(session, planned, member, options) {
                Ok(()) => {}
                Err(error) if matches!(error.cause, Cause::NotConverged | Cause::Guard) => {}
                Err(error) => return Err(error.within(&format!("member {}", member.name))),
            }
        }
        let told = ledger.as_mut().map_or(Ok(()), |ledger| ledger.enter(index, is_done));
        agree(session.world(), told)?;
    }
    let advice = ledger.as_mut().map_or(Ok(Vec::new()), Ledger::finish);
    agree(session.world(), advice)
}

fn compute(session: &Rc<Session>, planned: &Planned, member: &Member, options: &Options) -> Result<()> {
    let case = &member.case;
    let case_file = planned.study.source().directory.join(&planned.study.case.value);
    let place = Place::anew(case_file, member_folder(&options.folder, member), options.members);
    session.measure_anew();
    let taken = give_options(session, case)?;
    let outcome = match case.dimension.value {
        2 => simulation::run::<2>(session, case, &place),
        _ => simulation::run::<3>(session, case, &place),
    };
    take_back_options(session, &taken)?;
    outcome
}

fn member_folder(folder: &Path, member: &Member) -> PathBuf {
    folder.join("members").join(&member.name)
}

/// What rank 0 keeps of a study.
struct Ledger<'a> {
    study: &'a Study,
    members: &'a [Member],
    options: &'a Options,
    references: References,
    axes: Vec<String>,
    quantities: Vec<String>,
    rows: Vec<Row>,
    /// PETSc's options of the command line.
    petsc: String,
}

impl<'a> Ledger<'a> {
    fn open(study: &'a Study, members: &'a [Member], options: &'a Options, petsc: String) -> Result<Self> {
        let quantities: Vec<String> = study.quantities.value.names().map(str::to_owned).collect();
        let rows = members.iter().map(|member| Row::waiting(member, quantities.len())).collect();
        let references = References::read(study)?;
        Ok(Self { study, members, options, references, axes: plan::axes(study), quantities, rows, petsc })
    }

    /// Whether the results of a member are there, made by this program from the same case and meshes with the same
    /// options of PETSc.
    fn is_done(&self, member: &Member) -> bool {
        let record = record(&member_folder(&self.options.folder, member));
        let ended = match record["verdict"].as_str() {
            Some("completed") => true,
            Some("failed") => {
                let code = record["exit_code"].as_i64().unwrap_or(0);
                let of_its_own = [Cause::NotConverged as i64, Cause::Guard as i64].contains(&code);
                of_its_own && !self.options.rerun_failed
            }
            _ => false,
        };
        let inputs = record["inputs"].as_array();
        let known = |hash: &str| inputs.into_iter().flatten().any(|input| input["sha256"] == hash);
        let same_meshes = || {
            member.case.bodies.values().all(|body| match &body.mesh {
                Mesh::File(file) => {
                    Input::of(&member.case.resolve(&file.file.value)).is_ok_and(|input| known(&input.sha256))
                }
                _ => true,
            })
        };
        ended
            && record["case_sha256"] == member.digest.as_str()
            && record["petsc_options"] == self.petsc.as_str()
            && record["versions"]["contact-petsc"] == env!("CARGO_PKG_VERSION")
            && same_meshes()
    }

    /// Takes up a member that has been run, and rewrites the table.
    fn enter(&mut self, index: usize, was_done: bool) -> Result<()> {
        let member = &self.members[index];
        self.rows[index] = Row::read(member, &member_folder(&self.options.folder, member), self.study)?;
        self.references.compare(&mut self.rows, &self.study.quantities.value);
        let row = &self.rows[index];
        let what = match row.state {
            State::Completed => {
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
        self.papers().write(State::Waiting)
    }

    fn finish(&mut self) -> Result<Vec<String>> {
        if !self.rows.iter().any(|row| row.state == State::Completed) {
            let text = "no member completed".to_owned();
            self.papers().write(State::Failed)?;
            return Err(Error::not_converged(text).hint("the reasons stand in study.csv"));
        }
        let papers = self.papers();
        papers.write(State::Completed)?;
        let advice = papers.advice();
        advice.iter().for_each(|sentence| self.say(sentence));
        self.say(&format!("results in {}", self.options.folder.display()));
        Ok(advice)
    }

    fn papers(&self) -> Papers<'_> {
        let findings = Findings { axes: &self.axes, quantities: &self.quantities, rows: &self.rows };
        Papers { folder: &self.options.folder, study: self.study, findings }
    }

    fn say(&self, text: &str) {
        if !self.options.is_quiet {
            use std::io::Write;
            let mut out = std::io::stdout();
            let _ = writeln!(out, "{text}").and_then(|()| out.flush());
        }
    }
}
