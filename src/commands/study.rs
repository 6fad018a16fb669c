//! `contact-petsc study study.yml`: reads study and case once, sends them to all ranks, and runs
//! every member.

use std::path::Path;
use std::rc::Rc;

use crate::case::Case;
use crate::cli::{Detail, StudyArguments};
use crate::error::{Result, agree};
use crate::output::console::{Verbosity, require_printed};
use crate::petsc::Session;
use crate::simulation::shared_text;
use crate::study::{self, Planned, StudyOptions};

/// Runs a study, or lists its members. Collective.
///
/// # Errors
/// The study is invalid or fails; the error is the same on all ranks.
pub fn study(arguments: &StudyArguments) -> Result<()> {
    let session = Session::start(&arguments.petsc)?;
    let computed = compute(&session, arguments).and_then(|()| agree(session.world(), require_printed()));
    computed.map_err(|error| session.report(&error))
}

fn compute(session: &Rc<Session>, arguments: &StudyArguments) -> Result<()> {
    if arguments.dry_run {
        let text = listing(session, &arguments.study)?;
        return agree(session.world(), super::print(&text));
    }
    let planned = read(session, &arguments.study)?;
    let folder = arguments.output.clone().map_or_else(|| study::default_place(&arguments.study), Ok)?;
    let options = StudyOptions {
        folder,
        rerun_failed: arguments.rerun_failed,
        members: match arguments.verbosity() {
            Detail::Quiet | Detail::Normal => Verbosity::Silent,
            Detail::Newton => Verbosity::Normal,
            Detail::Linear => Verbosity::Verbose,
        },
        is_quiet: arguments.quiet,
    };
    study::run(session, &planned, &options).map(drop)
}

/// Lists the members that the study at `path` would run, as text. Collective.
///
/// # Errors
/// The study or the case of a member is invalid; the error is the same on all ranks.
pub fn listing(session: &Rc<Session>, path: &Path) -> Result<String> {
    read(session, path).map(|planned| planned.listing())
}

/// Reads the study and its cases on rank 0 and parses them on all ranks. Collective.
fn read(session: &Rc<Session>, path: &Path) -> Result<Planned> {
    let load = |path: &Path| {
        let own = if session.rank() == 0 { Case::load(path) } else { Ok(String::new()) };
        shared_text(session, own)
    };
    let text = load(path)?;
    agree(session.world(), Planned::read(&text, path, load))
}
