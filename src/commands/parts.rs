//! `contact-petsc parts case.yml 2 64 1024`: the cost of partitions with these numbers of parts, as
//! a table.

use std::path::Path;

use crate::case::Case;
use crate::error::Result;
use crate::simulation;

/// A table with a row for each number of parts. It needs one process and no MPI.
///
/// # Errors
/// Any error that a run would return before its mesh is distributed.
pub fn parts(path: &Path, counts: &[u32]) -> Result<String> {
    let case = Case::parse(&Case::load(path)?, &path.display().to_string())?;
    match case.dimension.value.coordinates() {
        2 => simulation::parts::<2>(&case, counts),
        _ => simulation::parts::<3>(&case, counts),
    }
}
