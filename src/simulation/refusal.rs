//! Records a run that could not begin, in a batch of runs that continues without it.

use std::rc::Rc;

use super::journal::record;
use super::place::{RunRequest, inputs};
use crate::case::Case;
use crate::error::{Error, Result, agree};
use crate::output::folder::ResultsFolder;
use crate::output::process::claim;
use crate::output::record::Verdict;
use crate::petsc::Session;

/// Creates a results folder that holds only a record with the reason why the run could not begin.
/// The record lists the input files that can be read. Collective among ranks that failed.
///
/// # Errors
/// The folder can not be written; the error is the same on all ranks.
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
