//! Distributes external input to all ranks: texts of files, and PETSc options of a case.

use std::io::ErrorKind;
use std::path::Path;
use std::rc::Rc;

use mpi::traits::{Communicator, Root};

use crate::case::Case;
use crate::error::{Error, Result, agree};
use crate::files;
use crate::petsc::Session;

/// Broadcasts a text that rank 0 has read. The texts of other ranks are ignored. Collective.
///
/// # Errors
/// Returns the error of any rank, the same on all ranks.
pub fn shared_text(session: &Rc<Session>, own: Result<String>) -> Result<String> {
    let bytes = shared_bytes(session, own.map(String::into_bytes))?;
    String::from_utf8(bytes).map_err(|error| Error::internal(error.to_string()))
}

/// Broadcasts bytes that rank 0 holds. The bytes of other ranks are ignored. Collective.
///
/// # Errors
/// Returns the error of any rank, the same on all ranks.
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

/// Reads the surfaces of rigid bodies on rank 0, and passes them to all ranks. Collective.
///
/// # Errors
/// A file can not be read or bounds no solid. The error is the same on all ranks.
pub(super) fn share_surfaces(session: &Rc<Session>, case: &Case) -> Result<()> {
    let loaded = case.load_surfaces(|path| {
        let own = if session.rank() == 0 { surface_file(path) } else { Ok(Vec::new()) };
        shared_bytes(session, own)
    });
    agree(session.world(), loaded)
}

/// The content of the file of a surface.
pub(super) fn surface_file(path: &Path) -> Result<Vec<u8>> {
    files::read(path, files::LONGEST_SURFACE).map_err(|cause| {
        let error = Error::file(format!("the surface can not be read: {cause}"));
        let error = match cause.kind() {
            ErrorKind::NotFound => {
                error.hint("paths of surfaces are relative to the folder of the case file")
            }
            ErrorKind::IsADirectory => error.hint("name a file in this folder"),
            _ => error,
        };
        error.within(&path.display().to_string())
    })
}

/// Passes the PETSc options of the case to PETSc. Options on the command line take precedence.
/// Returns the names that were set.
///
/// # Errors
/// PETSc rejects a name.
pub fn set_options(session: &Session, case: &Case) -> Result<Vec<String>> {
    let mut taken = Vec::new();
    for (name, value) in case.petsc.iter() {
        if !session.is_given(&name.value) {
            taken.push(name.value.clone());
        }
        session.give(&name.value, value.0.as_deref().unwrap_or_default())?;
    }
    Ok(taken)
}

/// Removes the options of a case before the same process runs another case.
///
/// # Errors
/// PETSc rejects a name.
pub fn remove_options(session: &Session, taken: &[String]) -> Result<()> {
    taken.iter().try_for_each(|name| session.take_back(name))
}
