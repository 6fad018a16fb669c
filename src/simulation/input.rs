//! What comes from outside, brought to all ranks: texts of files, PETSc's options of a case.

use std::rc::Rc;

use mpi::traits::{Communicator, Root};

use crate::case::Case;
use crate::error::{Error, Result, agree};
use crate::petsc::Session;

/// A text that rank 0 has read, on all ranks; what other ranks bring does not count. Collective.
///
/// # Errors
/// The one that any rank brings, the same on all ranks.
pub fn shared_text(session: &Rc<Session>, own: Result<String>) -> Result<String> {
    let bytes = shared_bytes(session, own.map(String::into_bytes))?;
    String::from_utf8(bytes).map_err(|error| Error::internal(error.to_string()))
}

/// Bytes that rank 0 has, on all ranks; what other ranks bring does not count. Collective.
///
/// # Errors
/// The one that any rank brings, the same on all ranks.
pub(super) fn shared_bytes(session: &Rc<Session>, own: Result<Vec<u8>>) -> Result<Vec<u8>> {
    let world = session.world();
    let mut text = agree(world, own)?;
    let mut length = text.len() as u64;
    world.process_at_rank(0).broadcast_into(&mut length);
    text.resize(length as usize, 0);
    if length > 0 {
        world.process_at_rank(0).broadcast_into(&mut text[..]);
    }
    Ok(text)
}

/// Hands the options that stand in the case to PETSc; those of the command line win. Returns the names that were taken.
///
/// # Errors
/// When PETSc refuses a name.
pub fn give_options(session: &Session, case: &Case) -> Result<Vec<String>> {
    let mut taken = Vec::new();
    for (name, value) in case.petsc.iter() {
        if !session.is_given(&name.value) {
            taken.push(name.value.clone());
        }
        session.give(&name.value, value.0.as_deref().unwrap_or_default())?;
    }
    Ok(taken)
}

/// Takes back the options of a case, before another case is run by the same process.
///
/// # Errors
/// When PETSc refuses a name.
pub fn take_back_options(session: &Session, taken: &[String]) -> Result<()> {
    taken.iter().try_for_each(|name| session.take_back(name))
}
