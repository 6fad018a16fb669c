//! The files of a run: its inputs, its results folder, and the tables in it.

use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::begin::Begin;
use super::input::{shared_bytes, shared_text};
use super::tables::{OptionalTables, Tables};
use crate::case::Case;
use crate::error::{Error, Result, agree};
use crate::output::console::Verbosity;
use crate::output::folder::ResultsFolder;
use crate::output::io_error::trouble;
use crate::output::lock::Lock;
use crate::output::process::{self, claim};
use crate::output::record::InputRecord;
use crate::output::table::Marks;
use crate::petsc::Session;

/// The inputs and the results folder of a run.
#[derive(Debug, Clone)]
pub struct RunRequest {
    /// The case file.
    pub case_file: PathBuf,
    /// The results folder.
    pub folder: PathBuf,
    /// Verbosity of the console.
    pub verbosity: Verbosity,
    /// From the start, or from a checkpoint.
    pub begin: Begin,
    /// Wall-time limit of this process, which replaces that of the case.
    pub wall_time: Option<Duration>,
}

impl RunRequest {
    /// A run from the start of the case.
    pub fn anew(case_file: PathBuf, folder: PathBuf, verbosity: Verbosity) -> Self {
        Self { case_file, folder, verbosity, begin: Begin::Anew, wall_time: None }
    }

    /// The command that resumes this run on `ranks` ranks, without `--restart`.
    pub fn command(&self, ranks: usize) -> String {
        let on_ranks = if ranks > 1 { format!("mpirun -n {ranks} ") } else { String::new() };
        format!("{on_ranks}contact-petsc {} --output {}", quoted(&self.case_file), quoted(&self.folder))
    }
}

/// Quotes a path so that a shell reads it as one word.
pub(super) fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_./+=:@,%".contains(letter);
    if text.contains(char::is_control) {
        let escaped = text.replace('\\', "\\\\").replace('\'', "\\'");
        let letters = escaped.chars().map(|letter| match letter.is_control() {
            true if (letter as u32) < 0x80 => format!("\\x{:02x}", letter as u32),
            true => format!("\\u{:04x}", letter as u32),
            false => letter.to_string(),
        });
        return format!("$'{}'", letters.collect::<String>());
    }
    if !text.is_empty() && text.chars().all(is_plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// Case file, mesh files and files of surfaces with their hashes, if they can be read. The hash of the
/// case is that of the text that was read.
pub(super) fn inputs(case: &Case, place: &RunRequest) -> impl Iterator<Item = Result<InputRecord>> {
    let files = case.files().map(|path| InputRecord::of(&path));
    std::iter::once(Ok(InputRecord::of_text(&place.case_file, case.text()))).chain(files)
}

/// Creates the results folder, or opens it to resume, with its tables and the inputs. Rank 0 only.
pub(super) fn prepare<const D: usize>(
    case: &Case,
    place: &RunRequest,
    past: Option<&Marks>,
) -> Result<(Option<Tables<D>>, Vec<InputRecord>)> {
    let inputs = inputs(case, place).collect::<Result<_>>()?;
    claim(&place.folder)?;
    let (folder, lock) = match past {
        Some(_) => {
            let folder = ResultsFolder::open(&place.folder)?;
            let lock = Lock::take(folder.path())?;
            (folder, lock)
        }
        None => ResultsFolder::create(&place.folder)?,
    };
    let optional = OptionalTables {
        rigid: !case.rigid.is_empty(),
        bodies: case.output.bodies,
        loads: case.output.loads,
        lines: case.output.lines.names().next().is_some(),
        derived: case.output.derived.names().map(str::to_owned).collect(),
    };
    Ok((Some(Tables::open(folder.path(), case.units, lock, optional, past)?), inputs))
}

/// How long a rank waits for the results folder. It may appear on another host a moment later.
const DELAY: Duration = Duration::from_secs(5);

/// The absolute path of the results folder, as decided by rank 0. If every rank writes there, each
/// rank checks that it finds the folder that rank 0 has locked with `token`. Collective.
///
/// # Errors
/// A rank finds no such folder, or a different one of that name. The error is the same on all
/// ranks.
pub(super) fn shared_folder(
    session: &Rc<Session>,
    folder: &Path,
    token: &str,
    is_needed: bool,
) -> Result<PathBuf> {
    let own = std::path::absolute(folder).map_err(|e| trouble(folder, "resolve", &e));
    let own = if session.rank() == 0 { own } else { Ok(PathBuf::new()) };
    let path = shared_bytes(session, own.map(|path| path.into_os_string().into_vec()))?;
    let path = PathBuf::from(OsString::from_vec(path));
    let token = shared_text(session, Ok(token.to_owned()))?;
    if is_needed {
        agree(session.world(), require_seen(&path, &token, session.rank(), DELAY))?;
    }
    Ok(path)
}

fn require_seen(path: &Path, token: &str, rank: i32, delay: Duration) -> Result<()> {
    let deadline = Instant::now() + delay;
    while Lock::token_of(path) != token {
        if Instant::now() >= deadline {
            let host = process::host();
            let text = format!(
                "{}: rank {rank} on {host} can not find the results folder of rank 0",
                path.display()
            );
            let cure = "choose with --output a folder that all hosts share, or write no fields: `output: { \
                        fields: { every: 0 } }`";
            return Err(Error::file(text).hint(cure));
        }
        sleep(Duration::from_millis(50));
        // A host that mounts the folder over the network refreshes its view when the parent folder
        // is opened.
        let _ = path.parent().map(std::fs::read_dir);
    }
    Ok(())
}

/// Names and versions of the program and its libraries.
pub(super) fn versions() -> Vec<(String, String)> {
    let own = ("contact-petsc".to_owned(), env!("CARGO_PKG_VERSION").to_owned());
    let perturbed = crate::rounding::perturbed().map(|ways| ("rounding perturbed".to_owned(), ways));
    std::iter::once(own).chain(crate::petsc::versions()).chain(perturbed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The command that resumes a run of several ranks names the number of ranks.
    #[test]
    fn the_command_names_the_ranks() {
        let place = RunRequest::anew("a.yml".into(), "results/a".into(), Verbosity::Silent);
        assert_eq!(place.command(1), "contact-petsc a.yml --output results/a");
        let place = RunRequest::anew("a b.yml".into(), "it's".into(), Verbosity::Silent);
        assert_eq!(place.command(1), "contact-petsc 'a b.yml' --output 'it'\\''s'");
        let place = RunRequest::anew("é.yml".into(), "a\n'b".into(), Verbosity::Silent);
        assert_eq!(place.command(1), "contact-petsc é.yml --output $'a\\x0a\\'b'");
        let place = RunRequest::anew("a.yml".into(), "results/a".into(), Verbosity::Silent);
        assert_eq!(place.command(4), "mpirun -n 4 contact-petsc a.yml --output results/a");
    }
}
