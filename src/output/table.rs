//! A CSV table that can be read while it grows: a header with units, then one write per row.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::files;

pub use crate::observe::quantity::Cell;

use super::anchor::require_same;
use super::folder::write_whole;
use super::io_error::{trouble, unwritable};

/// Hint for a result that is not finite.
const NOT_FINITE: &str =
    "the results are valid up to the step before; check the prescribed boundary values and the units";

/// Contents of a table at some instant, with which a reader checks that nothing is missing or
/// changed.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Mark {
    /// Rows below the header.
    pub rows: u64,
    /// Length of the file \[bytes\].
    pub bytes: u64,
    /// SHA-256 of the file in hexadecimal.
    pub sha256: String,
}

impl Mark {
    /// Compares the start of a file with the mark; later bytes are ignored.
    ///
    /// # Errors
    /// The file can not be read, is shorter, or has different contents.
    pub fn check_start(&self, path: &Path) -> Result<()> {
        let refuse = |why: String| Error::file(format!("{}: {why}", path.display()));
        let mut file = files::open(path).map_err(|e| trouble(path, "read", &e))?;
        let found = file.metadata().map_err(|e| trouble(path, "read", &e))?.len();
        if found < self.bytes {
            return Err(refuse(format!("rows are missing: {found} bytes instead of {}", self.bytes)));
        }
        let hash = hash_of(&mut file, self.bytes).map_err(|e| trouble(path, "read", &e))?;
        if hex(hash) != self.sha256 {
            return Err(refuse("damaged: its SHA-256 does not match".into()));
        }
        Ok(())
    }

    /// Compares a file with the mark.
    ///
    /// # Errors
    /// [`check_start`](Self::check_start) fails, or the file is longer.
    pub fn check(&self, path: &Path) -> Result<()> {
        self.check_start(path)?;
        let found = std::fs::metadata(path).map_err(|e| trouble(path, "read", &e))?.len();
        if found > self.bytes {
            let text = format!("{}: {found} bytes instead of {}", path.display(), self.bytes);
            return Err(Error::file(text));
        }
        Ok(())
    }
}

/// The hash of the next bytes of a file.
fn hash_of(file: &mut impl Read, mut bytes: u64) -> std::io::Result<Sha256> {
    let mut hash = Sha256::new();
    let mut piece = vec![0; 1 << 16];
    while bytes > 0 {
        let most = piece.len().min(usize::try_from(bytes).unwrap_or(usize::MAX));
        file.read_exact(&mut piece[..most])?;
        hash.update(&piece[..most]);
        bytes -= most as u64;
    }
    Ok(hash)
}

/// Formats a hash in hexadecimal.
pub(super) fn hex(hash: Sha256) -> String {
    hash.finalize().iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Marks of the tables of a results folder at a checkpoint or at the end, by file name.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Marks(pub BTreeMap<String, Mark>);

impl Marks {
    /// Adds a table, which is on the disk when this returns.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn add(&mut self, table: &Table) -> Result<()> {
        let name = table.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.0.insert(name, table.settle()?);
        Ok(())
    }

    /// Replaces the mark of a table by an earlier one, so that a restart removes the rows after it.
    pub fn cut(&mut self, table: &Table, before: &Mark) {
        let name = table.path.file_name().unwrap_or_default().to_string_lossy();
        self.0.entry(name.into_owned()).and_modify(|own| own.clone_from(before));
    }

    /// Checks that all tables of a folder still have the marked rows. Later rows are ignored.
    ///
    /// # Errors
    /// A table is missing, truncated, or has different rows.
    pub fn check_starts(&self, folder: &Path) -> Result<()> {
        self.0.keys().try_for_each(|name| self.check_file(&folder.join(name)).map(|_| ()))
    }

    /// Checks that all tables of a folder are unchanged.
    ///
    /// # Errors
    /// A table is missing or changed.
    pub fn check(&self, folder: &Path) -> Result<()> {
        self.0.iter().try_for_each(|(name, mark)| mark.check(&folder.join(name)))
    }

    fn check_file(&self, path: &Path) -> Result<&Mark> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let Some(mark) = self.0.get(&*name) else {
            return Err(Error::file(format!(
                "{}: the checkpoint has no record of this table",
                path.display()
            )));
        };
        let cure = "resume from an older checkpoint with --restart=FILE, or start again without --restart";
        mark.check_start(path).map_err(|error| error.hint(cure))?;
        Ok(mark)
    }
}

/// A CSV file that is being written. The first column of every table of this program is the step.
#[derive(Debug)]
pub struct Table {
    path: PathBuf,
    file: File,
    columns: Vec<String>,
    line: String,
    rows: u64,
    bytes: u64,
    hash: Sha256,
}

impl Table {
    /// Creates the file, or continues it from a checkpoint if `past` holds its mark. Rank 0 only.
    ///
    /// # Errors
    /// See [`create`](Self::create) and [`resume`](Self::resume).
    pub fn open(path: &Path, columns: Vec<String>, past: Option<&Marks>) -> Result<Self> {
        match past {
            None => Self::create(path, columns),
            Some(marks) => Self::resume(path, columns, marks),
        }
    }

    /// Creates the file and writes the header. Rank 0 only.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn create(path: &Path, columns: Vec<String>) -> Result<Self> {
        let head = header(&columns);
        write_whole(path, head.as_bytes())?;
        Self::at_end(path, columns, 0, head.len() as u64)
    }

    /// Continues a table from its mark in `marks`, taken at a checkpoint. Later rows are removed.
    ///
    /// # Errors
    /// The file is missing, truncated, has other columns or different rows, or can not be written.
    pub fn resume(path: &Path, columns: Vec<String>, marks: &Marks) -> Result<Self> {
        let mark = marks.check_file(path)?;
        let head = header(&columns);
        let mut start = vec![0; head.len()];
        let read = files::open(path).and_then(|mut file| file.read_exact(&mut start));
        if read.is_err() || start != head.as_bytes() {
            return Err(Error::file(format!(
                "{}: its columns differ from those of this case",
                path.display()
            ))
            .hint("resume with the case that wrote the result, or start again"));
        }
        let file = OpenOptions::new().write(true).open(path);
        file.and_then(|file| file.set_len(mark.bytes)).map_err(|e| unwritable(path, &e))?;
        Self::at_end(path, columns, mark.rows, mark.bytes)
    }

    /// Mark of the file, whose contents are on the disk when this returns.
    ///
    /// # Errors
    /// The disk can not be written, or another process has moved or changed the file.
    pub fn settle(&self) -> Result<Mark> {
        self.check()?;
        self.file.sync_all().map_err(|e| unwritable(&self.path, &e))?;
        Ok(self.mark())
    }

    /// Mark of the present contents, which need not be on the disk yet.
    pub fn mark(&self) -> Mark {
        Mark { rows: self.rows, bytes: self.bytes, sha256: hex(self.hash.clone()) }
    }

    /// Checks that the file is in place and holds exactly what was written.
    ///
    /// # Errors
    /// It was moved, deleted or replaced, or another process has written to it.
    pub fn check(&self) -> Result<()> {
        require_same(&self.file, &self.path)?;
        let found = self.file.metadata().map_err(|e| trouble(&self.path, "find", &e))?.len();
        if found == self.bytes {
            return Ok(());
        }
        let text = format!(
            "{}: changed during the run: {found} bytes instead of {}",
            self.path.display(),
            self.bytes
        );
        Err(Error::file(text).hint(
            "do not modify the tables during a run; resume from an older checkpoint with --restart=FILE, or \
             start again",
        ))
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn at_end(path: &Path, columns: Vec<String>, rows: u64, bytes: u64) -> Result<Self> {
        let mut start = files::open(path).map_err(|e| trouble(path, "read", &e))?;
        let hash = hash_of(&mut start, bytes).map_err(|e| trouble(path, "read", &e))?;
        let file = OpenOptions::new().append(true).open(path).map_err(|e| unwritable(path, &e))?;
        Ok(Self { path: path.to_path_buf(), file, columns, line: String::new(), rows, bytes, hash })
    }

    /// Appends one row and passes it to the operating system at once, so that it survives a crash
    /// of this process.
    ///
    /// # Errors
    /// A number is not finite, so that the step is invalid; the number of cells is wrong, an
    /// internal fault; or the disk can not be written.
    pub fn row(&mut self, cells: &[Cell]) -> Result<()> {
        if cells.len() != self.columns.len() {
            let text =
                format!("{}: {} cells for {} columns", self.path.display(), cells.len(), self.columns.len());
            return Err(Error::internal(text));
        }
        self.line.clear();
        for (cell, column) in cells.iter().zip(&self.columns) {
            if let Cell::Number(value) = cell
                && !value.is_finite()
            {
                let text = format!("{}: the value {value} in column `{column}`", self.path.display());
                return Err(Error::not_converged(text).hint(NOT_FINITE));
            }
            push(&mut self.line, cell);
            self.line.push(',');
        }
        self.line.pop();
        self.line.push('\n');
        if let Err(error) = self.file.write_all(self.line.as_bytes()) {
            // A part of the row may have been written.
            let _ = self.file.set_len(self.bytes);
            return Err(unwritable(&self.path, &error));
        }
        self.rows += 1;
        self.bytes += self.line.len() as u64;
        self.hash.update(&self.line);
        Ok(())
    }
}

/// A whole table as text, for tables that are rewritten instead of appended to.
///
/// # Errors
/// See [`Table::row`].
pub fn whole(name: &str, columns: &[String], rows: &[Vec<Cell>]) -> Result<String> {
    let mut text = header(columns);
    for cells in rows {
        let bad = cells.iter().any(|cell| matches!(cell, Cell::Number(value) if !value.is_finite()));
        if bad || cells.len() != columns.len() {
            return Err(Error::internal(format!(
                "{name}: a row that does not fit its header, or a value that is not finite"
            )));
        }
        for cell in cells {
            push(&mut text, cell);
            text.push(',');
        }
        text.pop();
        text.push('\n');
    }
    Ok(text)
}

fn header(columns: &[String]) -> String {
    let mut line = String::new();
    for column in columns {
        push(&mut line, &Cell::Text(column));
        line.push(',');
    }
    line.pop();
    line.push('\n');
    line
}

/// Numbers are written with the fewest digits that read back as the same number.
fn push(line: &mut String, cell: &Cell) {
    let done = match cell {
        Cell::Count(count) => write!(line, "{count}"),
        Cell::Number(value) if *value == 0.0 => write!(line, "0"),
        Cell::Number(value) if (1e-4..1e7).contains(&value.abs()) => write!(line, "{value}"),
        Cell::Number(value) => write!(line, "{value:e}"),
        Cell::Text(text) => write!(line, "{}", field(text)),
        Cell::Absent => Ok(()),
    };
    debug_assert!(done.is_ok(), "writing to a string does not fail");
}

/// Formats a text as a field. Line breaks, which a label of a study may contain, become spaces. A
/// text with a comma or a quote is quoted.
fn field(text: &str) -> String {
    let plain = text.replace(char::is_control, " ");
    if plain.contains([',', '"']) { format!("\"{}\"", plain.replace('"', "\"\"")) } else { plain }
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;
    use crate::error::Cause;

    fn named(columns: &[&str]) -> Vec<String> {
        columns.iter().map(|&column| column.to_string()).collect()
    }

    /// Every finite number reads back as the same bits.
    #[test]
    fn numbers_survive_the_round_trip() {
        let values =
            [0.1 + 0.2, 1.0 / 3.0, -1e-300, 5e-324, 1.7976931348623157e308, 12345678.9, 0.0005, -2.5e5, 1e7];
        for value in values {
            let mut line = String::new();
            push(&mut line, &Cell::Number(value));
            assert_eq!(line.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{line}");
            assert!(line.len() < 25, "{line}");
        }
    }

    /// A row is in the file as soon as it is written. Names with commas are quoted, and an absent
    /// value is an empty field.
    #[test]
    fn rows_are_there_at_once() {
        let scratch = Scratch::new("table");
        let path = scratch.0.join("a.csv");
        let mut table = Table::create(&path, named(&["step", "name", "gap [m]"])).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "step,name,gap [m]\n");
        table.row(&[Cell::Count(1), Cell::Text("a, \"b\""), Cell::Absent]).unwrap();
        table.row(&[Cell::Count(2), Cell::Text("c\n\"d"), Cell::Number(1e-10)]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "step,name,gap [m]\n1,\"a, \"\"b\"\"\",\n2,\"c \"\"d\",1e-10\n");
    }

    /// NaN and infinity end a run with a message that names the file and the column, and leave no
    /// incomplete row.
    #[test]
    fn refuses_what_is_not_a_number() {
        let scratch = Scratch::new("nan");
        let path = scratch.0.join("a.csv");
        let mut table = Table::create(&path, named(&["step", "gap [m]"])).unwrap();
        for value in [f64::NAN, f64::INFINITY] {
            let error = table.row(&[Cell::Count(1), Cell::Number(value)]).unwrap_err();
            assert_eq!(error.cause, Cause::NotConverged);
            assert!(error.message.contains("gap [m]") && error.message.contains("a.csv"), "{error}");
        }
        assert_eq!(table.row(&[Cell::Count(1)]).unwrap_err().cause, Cause::Internal);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "step,gap [m]\n");
    }

    /// A restart keeps the rows at the checkpoint and removes later rows, including a truncated
    /// one. It refuses other columns and a table that lost rows.
    #[test]
    fn resumes_at_a_length() {
        let scratch = Scratch::new("resume");
        let path = scratch.0.join("a.csv");
        let columns = || named(&["step", "a"]);
        let mut table = Table::create(&path, columns()).unwrap();
        table.row(&[Cell::Count(0), Cell::Number(1.0)]).unwrap();
        let mut marks = Marks::default();
        marks.add(&table).unwrap();
        assert_eq!((marks.0["a.csv"].rows, marks.0["a.csv"].bytes), (1, 11));
        table.row(&[Cell::Count(1), Cell::Number(2.0)]).unwrap();
        assert!(marks.check(&scratch.0).is_err() && marks.check_starts(&scratch.0).is_ok());
        std::fs::write(&path, std::fs::read_to_string(&path).unwrap() + "2,").unwrap();
        let mut table = Table::resume(&path, columns(), &marks).unwrap();
        table.row(&[Cell::Count(1), Cell::Number(7.0)]).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "step,a\n0,1\n1,7\n");
        assert_eq!(Table::resume(&path, named(&["step", "b"]), &marks).unwrap_err().cause, Cause::File);
        assert_eq!(table.mark().rows, 2);
        table.check().unwrap();
        let mut all = Marks::default();
        all.add(&table).unwrap();
        all.check(&scratch.0).unwrap();
        std::fs::write(&path, "step,a\n0,2\n1,7\n").unwrap();
        for damaged in [all.check(&scratch.0), all.check_starts(&scratch.0), marks.check(&scratch.0)] {
            assert!(damaged.unwrap_err().message.contains("SHA-256"));
        }
        std::fs::write(&path, "step,a\n").unwrap();
        assert!(marks.check(&scratch.0).unwrap_err().message.contains("rows are missing"));
        std::fs::remove_file(&path).unwrap();
        assert!(marks.check(&scratch.0).is_err());
    }

    /// A table that was emptied, moved or replaced while it grew is detected.
    #[test]
    fn a_table_that_was_touched_is_found_out() {
        let scratch = Scratch::new("touched");
        let path = scratch.0.join("a.csv");
        let mut table = Table::create(&path, named(&["step"])).unwrap();
        table.row(&[Cell::Count(1)]).unwrap();
        table.check().unwrap();
        OpenOptions::new().write(true).open(&path).unwrap().set_len(0).unwrap();
        table.row(&[Cell::Count(2)]).unwrap();
        let error = table.check().unwrap_err();
        assert!(error.message.contains("a.csv: changed during the run: 2 bytes instead of 9"), "{error}");
        std::fs::rename(&path, scratch.0.join("b.csv")).unwrap();
        assert!(table.check().unwrap_err().message.contains("a.csv: moved"));
        std::fs::copy(scratch.0.join("b.csv"), &path).unwrap();
        assert!(table.settle().unwrap_err().message.contains("a.csv: moved"));
    }
}
