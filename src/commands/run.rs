//! `contact-petsc case.yml`: reads the case once, sends it to all ranks, and runs it in its
//! dimension.

use std::path::Path;
use std::rc::Rc;

use crate::case::Case;
use crate::cli::{self, RunArguments};
use crate::error::{Result, agree};
use crate::output::console::{Verbosity, require_printed};
use crate::output::folder::default_folder;
use crate::petsc::Session;
use crate::simulation::{self, Begin, RunRequest, set_options, shared_text};

/// Runs a case. Collective.
///
/// # Errors
/// The case is invalid or the run fails; the error is the same on all ranks.
pub fn run(arguments: &RunArguments) -> Result<()> {
    let session = Session::start(&arguments.petsc)?;
    let computed = compute(&session, arguments).and_then(|()| agree(session.world(), require_printed()));
    computed.map_err(|error| session.report(&error))
}

fn compute(session: &Rc<Session>, arguments: &RunArguments) -> Result<()> {
    let case = read(session, &arguments.case)?;
    set_options(session, &case)?;
    if arguments.verbosity() == cli::Detail::Linear {
        monitor_linear_solvers(session)?;
    }
    let folder = arguments.output.clone().map_or_else(|| default_folder(&arguments.case), Ok)?;
    let place = RunRequest {
        case_file: arguments.case.clone(),
        folder,
        verbosity: verbosity(arguments),
        begin: begin(arguments),
        wall_time: arguments.wall_time,
    };
    match case.dimension.value.coordinates() {
        2 => simulation::run::<2>(session, &case, &place),
        _ => simulation::run::<3>(session, &case, &place),
    }
}

/// `-vv`: every linear solver prints the residual of each iteration, and why it stopped.
fn monitor_linear_solvers(session: &Session) -> Result<()> {
    for prefix in simulation::SOLVER_PREFIXES {
        session.set_default(&format!("{prefix}ksp_monitor"), "")?;
        session.set_default(&format!("{prefix}ksp_converged_reason"), "")?;
    }
    Ok(())
}

/// Reads the case on rank 0 and parses it on all ranks. Collective.
///
/// # Errors
/// The case can not be read or is invalid; the error is the same on all ranks.
pub fn read(session: &Rc<Session>, path: &Path) -> Result<Case> {
    let own = if session.rank() == 0 {
        Case::load(path).map_err(|error| cli::mistyped(path).unwrap_or(error))
    } else {
        Ok(String::new())
    };
    let text = shared_text(session, own)?;
    agree(session.world(), Case::parse(&text, &path.display().to_string()))
}

fn begin(arguments: &RunArguments) -> Begin {
    match &arguments.restart {
        None if arguments.anew => Begin::Anew,
        None => Begin::Fresh,
        Some(None) => Begin::Newest,
        Some(Some(path)) => Begin::From(path.clone()),
    }
}

fn verbosity(arguments: &RunArguments) -> Verbosity {
    match arguments.verbosity() {
        cli::Detail::Quiet => Verbosity::Warnings,
        cli::Detail::Normal => Verbosity::Normal,
        cli::Detail::Newton | cli::Detail::Linear => Verbosity::Verbose,
    }
}
