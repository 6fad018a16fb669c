//! `contact-petsc parts case.yml 2 64 1024`: what numbers of parts would cost, as a table.

use std::path::Path;

use crate::case::Case;
use crate::error::Result;
use crate::simulation;

/// A table with a row for each number of parts. One process does it, without MPI.
///
/// # Errors
/// Those that a run meets before its mesh is shared out.
pub fn parts(path: &Path, counts: &[u32]) -> Result<String> {
    let case = Case::parse(&Case::load(path)?, &path.display().to_string())?;
    match case.dimension.value {
        2 => simulation::parts::<2>(&case, counts),
        _ => simulation::parts::<3>(&case, counts),
    }
}
