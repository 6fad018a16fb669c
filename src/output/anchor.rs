//! Whether a path still refers to the file or folder into which the program writes.

use std::fs::{File, metadata};
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::io_error::trouble;

/// A file or folder that is held open while its path is in use.
///
/// While it is open, the operating system assigns its inode to no other file. A comparison of
/// device and inode therefore detects a folder that was moved, deleted or created again.
#[derive(Debug)]
pub struct Anchor {
    path: PathBuf,
    file: File,
}

impl Anchor {
    /// Opens the file or folder to which the path refers now.
    ///
    /// # Errors
    /// It can not be opened.
    pub fn of(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| trouble(path, "open", &e))?;
        Ok(Self { path: path.to_path_buf(), file })
    }

    /// Checks that the path still refers to it.
    ///
    /// # Errors
    /// The path refers to another file, or to no file.
    pub fn check(&self) -> Result<()> {
        require_same(&self.file, &self.path)
    }

    /// The outcome of writing below this folder. If writing failed because the folder was moved or
    /// deleted, the error says so, instead of naming the file that could not be opened.
    ///
    /// # Errors
    /// Writing failed.
    pub fn explain<T>(&self, written: Result<T>) -> Result<T> {
        written.or_else(|error| self.check().and(Err(error)))
    }
}

/// Checks that the path of an open file still refers to it.
///
/// # Errors
/// The path refers to another file, or to no file.
pub(super) fn require_same(file: &File, path: &Path) -> Result<()> {
    let same = is_same(file, path).map_err(|e| trouble(path, "find", &e))?;
    same.then_some(()).ok_or_else(|| {
        Error::file(format!("{}: moved, deleted or replaced during the run", path.display())).hint(
            "results up to the last output are in the moved folder; move it back and resume from a \
             checkpoint with --restart, or start again",
        )
    })
}

/// Whether the path of an open file refers to it.
///
/// # Errors
/// The operating system can not look the path up.
pub(super) fn is_same(file: &File, path: &Path) -> std::io::Result<bool> {
    let own = file.metadata()?;
    match metadata(path) {
        Ok(found) => Ok((own.dev(), own.ino()) == (found.dev(), found.ino())),
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(false),
        Err(e) => Err(e),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::folder::tests::Scratch;
    use super::*;

    /// A folder that was moved, deleted, or deleted and created again is detected. A folder that
    /// gained files counts as the same.
    #[test]
    fn another_folder_of_the_same_name_is_found_out() {
        let scratch = Scratch::new("anchor");
        let path = scratch.0.join("out");
        fs::create_dir(&path).unwrap();
        let anchor = Anchor::of(&path).unwrap();
        fs::write(path.join("a"), "").unwrap();
        anchor.check().unwrap();
        fs::rename(&path, scratch.0.join("other")).unwrap();
        assert!(anchor.check().unwrap_err().message.contains("out: moved, deleted or replaced"));
        fs::rename(scratch.0.join("other"), &path).unwrap();
        anchor.check().unwrap();
        let full = || Err::<(), _>(Error::file("the disk is full"));
        assert_eq!(anchor.explain(full()).unwrap_err().message, "the disk is full");
        fs::remove_dir_all(&path).unwrap();
        assert!(anchor.explain(full()).unwrap_err().message.contains("moved, deleted or replaced"));
        fs::create_dir(&path).unwrap();
        assert!(anchor.check().is_err());
        assert!(anchor.explain(Ok(())).is_ok());
    }
}
