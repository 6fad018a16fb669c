//! Errors of paths that cannot be read or written.

use std::io::ErrorKind;
use std::path::Path;

use crate::error::Error;

/// The error for a path that can not be written, with a hint if the cause is known.
pub(crate) fn unwritable(path: &Path, error: &std::io::Error) -> Error {
    let error_text = trouble(path, "write", error);
    match error.kind() {
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem | ErrorKind::NotFound => {
            error_text.hint("choose a writable folder with --output")
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            error_text.hint("free some space, or write fewer field steps (output: fields: every)")
        }
        ErrorKind::FileTooLarge => {
            error_text.hint("the file size is limited: remove the limit with `ulimit -f unlimited`")
        }
        ErrorKind::NotADirectory | ErrorKind::AlreadyExists => {
            error_text.hint("a parent folder in this path is a file")
        }
        _ => error_text,
    }
}

/// The error for a path on which the operation `what` failed.
pub(crate) fn trouble(path: &Path, what: &str, error: &std::io::Error) -> Error {
    Error::file(format!("{}: can not {what}: {error}", path.display()))
}
