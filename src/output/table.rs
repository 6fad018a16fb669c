//! A CSV table that can be read while it grows: a header with units, then one write per row.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

use super::folder::{trouble, unwritable, write_whole};

/// What a user can do about a result that is no number.
const NO_NUMBER: &str =
    "the step before is the last good one; look at what the boundaries prescribe and at the units";

/// One entry of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<'a> {
    /// A count or a step number.
    Count(u64),
    /// A quantity; must be finite.
    Number(f64),
    /// A name.
    Text(&'a str),
    /// Nothing to tell, as the gap of a point with no target opposite: an empty field.
    Absent,
}

impl From<Option<f64>> for Cell<'_> {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Cell::Absent, Cell::Number)
    }
}

/// Lengths of the tables of a results folder at a checkpoint \[bytes\], by the names of the files.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Lengths(pub BTreeMap<String, u64>);

impl Lengths {
    /// Adds a table, which is on the disk when this returns.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn add(&mut self, table: &Table) -> Result<()> {
        let name = table.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.0.insert(name, table.settle()?);
        Ok(())
    }

    /// Lets what a table has beyond `length` bytes be dropped by who goes on from here.
    pub fn cut(&mut self, table: &Table, length: u64) {
        let name = table.path.file_name().unwrap_or_default().to_string_lossy();
        self.0.entry(name.into_owned()).and_modify(|own| *own = length.min(*own));
    }

    /// Whether all tables of a folder still have the rows that they had.
    ///
    /// # Errors
    /// One is not there, or ends before.
    pub fn check(&self, folder: &Path) -> Result<()> {
        self.0.keys().try_for_each(|name| self.check_file(&folder.join(name)).map(|_| ()))
    }

    fn check_file(&self, path: &Path) -> Result<u64> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let Some(&length) = self.0.get(&*name) else {
            return Err(Error::file(format!("{}: the checkpoint knows no such table", path.display())));
        };
        let found = std::fs::metadata(path).map_err(|e| trouble(path, "read", &e))?.len();
        if found < length {
            let text = format!("{}: lacks rows that it had at the checkpoint", path.display());
            return Err(Error::file(text)
                .hint("go on from an older checkpoint by --restart=FILE, or start anew without --restart"));
        }
        Ok(length)
    }
}

/// A CSV file under way. The first column of every table of ours is the step.
#[derive(Debug)]
pub struct Table {
    path: PathBuf,
    file: File,
    columns: Vec<String>,
    line: String,
}

impl Table {
    /// Makes the file, or goes on with it from a checkpoint where it had its length of `past`. Rank 0 only.
    ///
    /// # Errors
    /// As [`create`](Self::create), or [`resume`](Self::resume).
    pub fn open(path: &Path, columns: Vec<String>, past: Option<&Lengths>) -> Result<Self> {
        match past {
            None => Self::create(path, columns),
            Some(lengths) => Self::resume(path, columns, lengths),
        }
    }

    /// Makes the file and writes the header. Rank 0 only.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn create(path: &Path, columns: Vec<String>) -> Result<Self> {
        write_whole(path, header(&columns).as_bytes())?;
        Self::at_end(path, columns)
    }

    /// Goes on with a table that had its length of `lengths` at a checkpoint: what came later is dropped.
    ///
    /// # Errors
    /// The file is not there, has other columns, ends before, or can not be written.
    pub fn resume(path: &Path, columns: Vec<String>, lengths: &Lengths) -> Result<Self> {
        let length = lengths.check_file(path)?;
        let head = header(&columns);
        let mut start = vec![0; head.len()];
        let read = File::open(path).and_then(|mut file| file.read_exact(&mut start));
        if read.is_err() || start != head.as_bytes() {
            return Err(Error::file(format!("{}: other columns than this case writes", path.display()))
                .hint("continue with the case that made the result, or start anew"));
        }
        let file = OpenOptions::new().write(true).open(path);
        file.and_then(|file| file.set_len(length)).map_err(|e| unwritable(path, &e))?;
        Self::at_end(path, columns)
    }

    /// Bytes of the file, which are on the disk when this returns.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn settle(&self) -> Result<u64> {
        let settled = self.file.sync_all().and_then(|()| self.file.metadata());
        settled.map(|data| data.len()).map_err(|e| unwritable(&self.path, &e))
    }

    /// Bytes of the file now, on the disk or not.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn length(&self) -> Result<u64> {
        self.file.metadata().map(|data| data.len()).map_err(|e| unwritable(&self.path, &e))
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn at_end(path: &Path, columns: Vec<String>) -> Result<Self> {
        let file = OpenOptions::new().append(true).open(path).map_err(|e| unwritable(path, &e))?;
        Ok(Self { path: path.to_path_buf(), file, columns, line: String::new() })
    }

    /// Appends one row and hands it to the system at once, so that it outlives this process.
    ///
    /// # Errors
    /// A number is not finite, so that the step came to nothing; the count of cells is wrong, an internal fault; or the
    /// disk refuses.
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
                return Err(Error::not_converged(text).hint(NO_NUMBER));
            }
            push(&mut self.line, cell);
            self.line.push(',');
        }
        self.line.pop();
        self.line.push('\n');
        self.file.write_all(self.line.as_bytes()).map_err(|e| unwritable(&self.path, &e))
    }
}

/// A whole table as text, for those that are rewritten and not appended to.
///
/// # Errors
/// As [`Table::row`].
pub fn whole(name: &str, columns: &[String], rows: &[Vec<Cell>]) -> Result<String> {
    let mut text = header(columns);
    for cells in rows {
        let bad = cells.iter().any(|cell| matches!(cell, Cell::Number(value) if !value.is_finite()));
        if bad || cells.len() != columns.len() {
            return Err(Error::internal(format!("{name}: a row that does not fit its header, or no number")));
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
        Cell::Text(text) if text.contains([',', '"', '\n', '\r']) => {
            write!(line, "\"{}\"", text.replace('"', "\"\""))
        }
        Cell::Text(text) => write!(line, "{text}"),
        Cell::Absent => Ok(()),
    };
    debug_assert!(done.is_ok(), "writing to a string does not fail");
}

/// Column names from words.
pub(super) fn named(columns: &[&str]) -> Vec<String> {
    columns.iter().map(|&column| column.to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;
    use crate::error::Cause;

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

    /// A row is in the file as soon as it is written, names with commas are quoted, nothing is an empty
    /// field.
    #[test]
    fn rows_are_there_at_once() {
        let scratch = Scratch::new("table");
        let path = scratch.0.join("a.csv");
        let mut table = Table::create(&path, named(&["step", "name", "gap [m]"])).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "step,name,gap [m]\n");
        table.row(&[Cell::Count(1), Cell::Text("a, \"b\""), Cell::Absent]).unwrap();
        table.row(&[Cell::Count(2), Cell::Text("c"), Cell::Number(1e-10)]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "step,name,gap [m]\n1,\"a, \"\"b\"\"\",\n2,c,1e-10\n");
    }

    /// NaN and infinity end a run with words that name the file and the column, and leave no half row behind.
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

    /// A restart keeps what was there at the checkpoint and drops later rows, also one that was cut short; it refuses
    /// other columns and a table that lost rows.
    #[test]
    fn resumes_at_a_length() {
        let scratch = Scratch::new("resume");
        let path = scratch.0.join("a.csv");
        let columns = || named(&["step", "a"]);
        let mut table = Table::create(&path, columns()).unwrap();
        table.row(&[Cell::Count(0), Cell::Number(1.0)]).unwrap();
        let mut lengths = Lengths::default();
        lengths.add(&table).unwrap();
        table.row(&[Cell::Count(1), Cell::Number(2.0)]).unwrap();
        std::fs::write(&path, std::fs::read_to_string(&path).unwrap() + "2,").unwrap();
        let mut table = Table::resume(&path, columns(), &lengths).unwrap();
        table.row(&[Cell::Count(1), Cell::Number(7.0)]).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "step,a\n0,1\n1,7\n");
        assert_eq!(Table::resume(&path, named(&["step", "b"]), &lengths).unwrap_err().cause, Cause::File);
        std::fs::write(&path, "step,a\n").unwrap();
        assert!(lengths.check(&scratch.0).unwrap_err().message.contains("lacks rows"));
        std::fs::remove_file(&path).unwrap();
        assert!(lengths.check(&scratch.0).is_err());
    }
}
