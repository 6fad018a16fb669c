//! `contact-petsc check case.yml`: everything up to the first solve, told as a case file with remarks.

use std::path::Path;

use super::run::read;
use crate::error::Result;
use crate::petsc::Session;
use crate::simulation::{self, give_options};

/// The completed case and what follows from it, as YAML whose comments hold the derived numbers. Collective.
///
/// # Errors
/// The same on all ranks, and the same that a run would meet before its first solve.
pub fn check(path: &Path, petsc: &[String]) -> Result<String> {
    let session = Session::start(petsc)?;
    let case = read(&session, path)?;
    give_options(&session, &case)?;
    let derived = match case.dimension.value {
        2 => simulation::check::<2>(&session, &case)?,
        _ => simulation::check::<3>(&session, &case)?,
    };
    let remarks = derived.lines().map(|line| format!("# {line}\n"));
    Ok(format!("{}\n{}", case.to_yaml()?.trim_end(), remarks.collect::<String>().trim_end()))
}
