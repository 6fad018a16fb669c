//! Files that come from outside: only regular ones are read, and only up to a bound.
//!
//! A named pipe without a writer would block a reader for ever, and a device such as `/dev/zero` never ends. The case file
//! is the one exception: a user may give it by a pipe, and its reader has a bound of its own.

use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// No table or field file is read beyond this size \[bytes\].
pub const LONGEST_TABLE: u64 = 1 << 31;

/// No surface of a rigid tool is read beyond this size \[bytes\]: ten million triangles as binary
/// STL.
pub const LONGEST_SURFACE: u64 = 1 << 29;

/// No record or marker is read beyond this size \[bytes\].
pub const LONGEST_RECORD: u64 = 1 << 26;

/// Opens a regular file for reading.
///
/// # Errors
/// There is no such file, it can not be read, or it is a folder, a pipe, a socket or a device.
pub fn open(path: &Path) -> Result<File> {
    require_regular(&std::fs::metadata(path)?)?;
    // Without waiting for a writer, in case the file has become a pipe since.
    let file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path)?;
    require_regular(&file.metadata()?)?;
    Ok(file)
}

fn require_regular(found: &std::fs::Metadata) -> Result<()> {
    let kind = found.file_type();
    let what = match () {
        () if kind.is_file() => return Ok(()),
        () if kind.is_dir() => return Err(Error::from_raw_os_error(libc::EISDIR)),
        () if kind.is_fifo() => "a named pipe",
        () if kind.is_socket() => "a socket",
        () => "a device",
    };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is {what}, not a regular file")))
}

/// Reads a regular file of at most `most` bytes.
///
/// # Errors
/// As [`open`]; the file is longer, or does not fit into the memory.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    let file = open(path)?;
    let too_long = || Error::new(ErrorKind::FileTooLarge, format!("it is longer than {most} bytes"));
    let length = file.metadata()?.len();
    if length > most {
        return Err(too_long());
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))?;
    // The file may grow while it is read.
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_long()) } else { Ok(bytes) }
}

/// Reads a regular file of at most `most` bytes as text.
///
/// # Errors
/// As [`read`]; the file is not UTF-8.
pub fn read_text(path: &Path, most: u64) -> Result<String> {
    String::from_utf8(read(path, most)?).map_err(|error| Error::new(ErrorKind::InvalidData, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder, a device and a link to one are refused at once, a file up to its bound is read.
    #[test]
    fn only_regular_files_of_bounded_size_are_read() {
        let folder = std::env::temp_dir().join(format!("contact-petsc-{}-files", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a");
        std::fs::write(&path, "12345").unwrap();
        assert_eq!(read_text(&path, 5).unwrap(), "12345");
        assert!(read(&path, 4).unwrap_err().to_string().contains("longer than 4 bytes"));
        assert_eq!(read(&folder, 9).unwrap_err().kind(), ErrorKind::IsADirectory);
        assert_eq!(read(&folder.join("no"), 9).unwrap_err().kind(), ErrorKind::NotFound);
        let link = folder.join("link");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        assert!(read(&link, 9).unwrap_err().to_string().contains("a device, not a regular file"));
        let pipe = folder.join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(read(&pipe, 9).unwrap_err().to_string().contains("a named pipe, not a regular file"));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
