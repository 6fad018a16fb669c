//! Reads and writes the bytes of a checkpoint on rank 0. The bytes are hashed while they are
//! written, and checked before any of them is used.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::files;

/// The format that this program writes, and the only one that it reads.
pub const FORMAT: u32 = 16;

const MAGIC: &[u8; 25] = b"contact-petsc checkpoint\n";
/// Magic, format and length of the header.
const HEAD: u64 = MAGIC.len() as u64 + 12;
const HASH: u64 = 32;
/// Upper limit of the length of a header. A longer one is damaged.
const LONGEST_HEADER: u64 = 1 << 26;

/// The header, which precedes the sections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Description of the run.
    pub state: Value,
    /// The sections in their order.
    pub sections: Vec<FileSection>,
}

/// A section.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileSection {
    /// Name.
    pub name: String,
    /// Names of the columns, without the key.
    pub columns: Vec<String>,
    /// Number of rows.
    pub rows: u64,
}

impl FileSection {
    fn bytes(&self) -> u64 {
        self.rows.saturating_mul(8 * (1 + self.columns.len() as u64))
    }
}

/// A file that is being written. It appears under its final name only when [`Writer::finish`]
/// returns.
pub(super) struct Writer {
    path: PathBuf,
    part: PathBuf,
    file: BufWriter<File>,
    hash: Sha256,
    done: bool,
}

impl Writer {
    pub fn create(path: &Path, header: &Header) -> Result<Self> {
        let part = path.with_extension("part");
        let opened = path.parent().map_or(Ok(()), make_folder).and_then(|()| File::create(&part));
        let file = opened.map_err(|error| unwritable(path, &error))?;
        let path = path.to_path_buf();
        let mut writer = Self {
            path,
            part,
            file: BufWriter::with_capacity(1 << 20, file),
            hash: Sha256::new(),
            done: false,
        };
        let text = serde_json::to_vec(header).map_err(|error| Error::internal(error.to_string()))?;
        writer.bytes(MAGIC)?;
        writer.bytes(&FORMAT.to_le_bytes())?;
        writer.bytes(&(text.len() as u64).to_le_bytes())?;
        writer.bytes(&text)?;
        Ok(writer)
    }

    fn bytes(&mut self, bytes: &[u8]) -> Result<()> {
        self.hash.update(bytes);
        self.file.write_all(bytes).map_err(|error| unwritable(&self.path, &error))
    }

    pub fn words(&mut self, words: &[u64]) -> Result<()> {
        words.iter().try_for_each(|word| self.bytes(&word.to_le_bytes()))
    }

    /// Flushes the file to the disk, then makes it visible.
    pub fn finish(mut self) -> Result<()> {
        let hash = std::mem::take(&mut self.hash).finalize();
        let flushed = self.file.write_all(&hash).and_then(|()| self.file.flush());
        let visible = flushed
            .and_then(|()| self.file.get_ref().sync_all())
            .and_then(|()| std::fs::rename(&self.part, &self.path))
            .and_then(|()| self.path.parent().map_or(Ok(()), |folder| File::open(folder)?.sync_all()));
        visible.map_err(|error| unwritable(&self.path, &error))?;
        self.done = true;
        Ok(())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        if !self.done {
            let _ = std::fs::remove_file(&self.part);
        }
    }
}

/// The sections of a file that [`verify`] has accepted.
pub(super) struct Reader<R> {
    path: PathBuf,
    file: R,
    pub header: Header,
}

impl Reader<BufReader<File>> {
    pub fn open(path: &Path) -> Result<Self> {
        Self::new(path, open(path)?)
    }
}

impl<R: Read> Reader<R> {
    /// A reader of any source. The path is used in errors only.
    pub fn new(path: &Path, mut file: R) -> Result<Self> {
        let (header, _) = head(path, &mut file)?;
        Ok(Self { path: path.to_path_buf(), file, header })
    }

    pub fn words(&mut self, words: &mut [u64]) -> Result<()> {
        let mut bytes = vec![0; words.len() * 8];
        self.file.read_exact(&mut bytes).map_err(|error| unreadable(&self.path, &error))?;
        for (word, bytes) in words.iter_mut().zip(bytes.as_chunks::<8>().0) {
            *word = u64::from_le_bytes(*bytes);
        }
        Ok(())
    }
}

/// Reads the whole file and compares its hash. Rank 0 only.
///
/// # Errors
/// The file can not be read, is not a checkpoint, has another format, or is truncated or damaged.
/// Each case has its own message.
pub fn verify(path: &Path) -> Result<Header> {
    let mut file = open(path)?;
    let length = file.get_ref().metadata().map_err(|error| unreadable(path, &error))?.len();
    examine(path, &mut file, length)
}

/// Verifies any source that can be read and rewound, of the given length \[bytes\]. The path is
/// used in errors only.
///
/// # Errors
/// See [`verify`].
pub fn examine(path: &Path, file: &mut (impl Read + Seek), length: u64) -> Result<Header> {
    let (header, start) = head(path, file)?;
    let sections = header.sections.iter().fold(0u64, |sum, section| sum.saturating_add(section.bytes()));
    let whole = start.saturating_add(sections).saturating_add(HASH);
    if length != whole {
        let text = format!("{}: truncated: {length} bytes instead of {whole}", path.display());
        return Err(Error::file(text));
    }
    file.seek(SeekFrom::Start(0)).map_err(|error| unreadable(path, &error))?;
    let mut hash = Sha256::new();
    let mut left = length - HASH;
    let mut piece = vec![0; 1 << 16];
    while left > 0 {
        let most = piece.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        file.read_exact(&mut piece[..most]).map_err(|error| unreadable(path, &error))?;
        hash.update(&piece[..most]);
        left -= most as u64;
    }
    let mut told = [0; HASH as usize];
    file.read_exact(&mut told).map_err(|error| unreadable(path, &error))?;
    if hash.finalize()[..] != told {
        return Err(Error::file(format!("{}: damaged: its SHA-256 does not match", path.display())));
    }
    Ok(header)
}

/// Reads the header and returns it with the position of the first section.
fn head(path: &Path, file: &mut impl Read) -> Result<(Header, u64)> {
    let name = path.display();
    let short = |_| Error::file(format!("{name}: truncated within its header"));
    let mut magic = [0; MAGIC.len()];
    file.read_exact(&mut magic).map_err(short)?;
    if magic != *MAGIC {
        return Err(Error::file(format!("{name}: not a checkpoint of this program, or damaged")));
    }
    let (mut format, mut length) = ([0; 4], [0; 8]);
    file.read_exact(&mut format).and_then(|()| file.read_exact(&mut length)).map_err(short)?;
    let (format, length) = (u32::from_le_bytes(format), u64::from_le_bytes(length));
    if format != FORMAT {
        let text = format!("{name}: a checkpoint of format {format}; this program reads format {FORMAT}");
        return Err(Error::file(text));
    }
    if length > LONGEST_HEADER {
        return Err(Error::file(format!("{name}: damaged: a header of {length} bytes")));
    }
    // The buffer grows with the data read, because the length comes from a file that may be
    // damaged.
    let mut text = Vec::new();
    let read = file.take(length).read_to_end(&mut text).map_err(short)?;
    if (read as u64) < length {
        return Err(Error::file(format!("{name}: truncated within its header")));
    }
    let damaged = |error| Error::file(format!("{name}: damaged: its header can not be read ({error})"));
    Ok((serde_json::from_slice(&text).map_err(damaged)?, HEAD + length))
}

/// Creates the folder of the checkpoints, but not the results folder, which must not be created
/// again if it was deleted.
fn make_folder(path: &Path) -> std::io::Result<()> {
    match std::fs::create_dir(path) {
        Err(error) if !path.is_dir() => Err(error),
        _ => Ok(()),
    }
}

fn open(path: &Path) -> Result<BufReader<File>> {
    files::open(path).map(|file| BufReader::with_capacity(1 << 20, file)).map_err(|e| unreadable(path, &e))
}

pub(super) fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    Error::file(format!("{}: can not read: {error}", path.display()))
}

fn unwritable(path: &Path, error: &std::io::Error) -> Error {
    Error::file(format!("{}: can not write the checkpoint: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn sample(path: &Path) -> Header {
        let section = FileSection { name: "nodes".into(), columns: vec!["u_x".into()], rows: 2 };
        let header = Header { state: json!({"step": 3, "time": 0.1 + 0.2}), sections: vec![section] };
        let mut writer = Writer::create(path, &header).unwrap();
        writer.words(&[0, 1.5f64.to_bits(), 1, f64::INFINITY.to_bits()]).unwrap();
        assert!(!path.exists(), "not before it is whole");
        writer.finish().unwrap();
        header
    }

    fn scratch(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("contact-petsc-{}-checkpoint", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder.join(name)
    }

    /// Data are read back bit by bit.
    #[test]
    fn comes_back() {
        let path = scratch("a.ckpt");
        let header = sample(&path);
        assert_eq!(verify(&path).unwrap(), header);
        let mut reader = Reader::open(&path).unwrap();
        let mut words = [0; 4];
        reader.words(&mut words).unwrap();
        assert_eq!(words, [0, 1.5f64.to_bits(), 1, f64::INFINITY.to_bits()]);
        assert!(!path.with_extension("part").exists());
    }

    /// Any changed byte and any changed length is detected.
    #[test]
    fn every_damage_is_found() {
        let path = scratch("b.ckpt");
        sample(&path);
        let whole = std::fs::read(&path).unwrap();
        for place in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[place] ^= 0x10;
            std::fs::write(&path, &bytes).unwrap();
            assert!(verify(&path).is_err(), "byte {place}");
            std::fs::write(&path, &whole[..place]).unwrap();
            let error = verify(&path).unwrap_err();
            assert!(error.message.contains("truncated"), "{place} bytes: {error}");
        }
        std::fs::write(&path, [&whole[..], b"more"].concat()).unwrap();
        assert!(verify(&path).is_err());
        let mut later = whole.clone();
        later[MAGIC.len()] = FORMAT as u8 + 1;
        std::fs::write(&path, &later).unwrap();
        assert!(
            verify(&path)
                .unwrap_err()
                .message
                .contains(&format!("format {}; this program reads format {FORMAT}", FORMAT + 1))
        );
    }

    /// A writer that is dropped before it finishes leaves no file.
    #[test]
    fn nothing_is_left_of_half_a_file() {
        let path = scratch("c.ckpt");
        let header = Header { state: Value::Null, sections: vec![] };
        drop(Writer::create(&path, &header).unwrap());
        assert!(!path.exists() && !path.with_extension("part").exists());
    }
}
