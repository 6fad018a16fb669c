//! `contact-petsc check case.yml`: everything up to the first solve, printed as a case file with
//! remarks. For a study it prints the list of its members, after reading all their cases.

use std::path::Path;

use crate::case::Case;
use crate::error::{Result, agree};
use crate::petsc::Session;
use crate::simulation::{self, set_options, shared_text};
use crate::study::Study;

/// The completed case with derived quantities, as YAML whose comments hold the derived numbers. For
/// a study, the output of `study --dry-run`. Collective.
///
/// # Errors
/// Any error that a run would return before its first solve, the same on all ranks.
pub fn check(path: &Path, petsc: &[String]) -> Result<String> {
    let session = Session::start(petsc)?;
    let own = if session.rank() == 0 { Case::load(path) } else { Ok(String::new()) };
    let text = shared_text(&session, own)?;
    if Study::is_meant(&text) {
        return super::study::listing(&session, path);
    }
    let case = agree(session.world(), Case::parse(&text, &path.display().to_string()))?;
    set_options(&session, &case)?;
    let derived = match case.dimension.value.coordinates() {
        2 => simulation::check::<2>(&session, &case)?,
        _ => simulation::check::<3>(&session, &case)?,
    };
    let remarks = derived.lines().map(|line| format!("# {line}\n"));
    Ok(format!("{}\n{}", case.to_yaml()?.trim_end(), remarks.collect::<String>().trim_end()))
}
