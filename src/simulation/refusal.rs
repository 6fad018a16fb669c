//! What is left of a run that could not begin, where many are run and one of them is no reason to end.

use std::rc::Rc;

use super::journal::record;
use super::place::{RunRequest, inputs};
use crate::case::Case;
use crate::error::{Error, Result, agree};
use crate::output::folder::ResultsFolder;
use crate::output::process::claim;
use crate::output::record::Verdict;
use crate::petsc::Session;

/// Leaves a results folder with nothing but a record that says why the run could not begin; of its files, those that can be
/// read are in it. Collective among ranks that failed.
///
/// # Errors
/// The same on all ranks: the folder can not be written.
pub fn refuse(session: &Rc<Session>, case: &Case, place: &RunRequest, why: &Error) -> Result<()> {
    session.meet(why);
    let own = || -> Result<()> {
        let inputs = inputs(case, place).filter_map(Result::ok).collect();
        let mut record = record(session, case, inputs)?;
        record.verdict = Verdict::of(why);
        claim(&place.folder)?;
        let (folder, _lock) = ResultsFolder::create(&place.folder)?;
        record.write(folder.path())
    };
    agree(session.world(), if session.rank() == 0 { own() } else { Ok(()) })
}
