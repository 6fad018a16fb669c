//! `contact-petsc case.yml`: reads the case once, gives it to all ranks, runs it in its dimension.

use std::path::Path;
use std::rc::Rc;

use mpi::traits::{Communicator, Root};

use crate::case::Case;
use crate::cli::{self, RunArguments};
use crate::error::{Error, Result, agree};
use crate::output::console::Verbosity;
use crate::output::folder::default_folder;
use crate::petsc::Session;
use crate::simulation::{self, Place};

/// Runs a case. Collective.
///
/// # Errors
/// The same on all ranks.
pub fn run(arguments: &RunArguments) -> Result<()> {
    let session = Session::start(&arguments.petsc)?;
    compute(&session, arguments).map_err(|error| session.tell(&error))
}

fn compute(session: &Rc<Session>, arguments: &RunArguments) -> Result<()> {
    let case = read(session, &arguments.case)?;
    for (name, value) in case.petsc.iter() {
        session.set_default(&name.value, value.0.as_deref().unwrap_or_default())?;
    }
    let folder = arguments.output.clone().map_or_else(|| default_folder(&arguments.case), Ok)?;
    let place = Place { case_file: arguments.case.clone(), folder, verbosity: verbosity(arguments) };
    match case.dimension.value {
        2 => simulation::run::<2>(session, &case, &place),
        _ => simulation::run::<3>(session, &case, &place),
    }
}

/// The case, read on rank 0 and parsed by all. Collective.
///
/// # Errors
/// The same on all ranks.
pub fn read(session: &Rc<Session>, path: &Path) -> Result<Case> {
    let world = session.world();
    let name = path.display().to_string();
    let own = if session.rank() == 0 { Case::load(path) } else { Ok(String::new()) };
    let mut text = agree(world, own)?.into_bytes();
    let mut length = text.len() as u64;
    world.process_at_rank(0).broadcast_into(&mut length);
    text.resize(length as usize, 0);
    world.process_at_rank(0).broadcast_into(&mut text[..]);
    let text = String::from_utf8(text).map_err(|error| Error::internal(error.to_string()))?;
    agree(world, Case::parse(&text, &name))
}

fn verbosity(arguments: &RunArguments) -> Verbosity {
    match arguments.verbosity() {
        cli::Verbosity::Quiet => Verbosity::Silent,
        cli::Verbosity::Normal => Verbosity::Normal,
        cli::Verbosity::Newton | cli::Verbosity::Linear => Verbosity::Verbose,
    }
}
