//! Reads the tables of this program, including those of a killed or running process.

use std::path::Path;

use crate::error::{Error, Result, shown};
use crate::files;
use crate::output::io_error::trouble;

/// A table as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Csv {
    path: String,
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Whether the last row was truncated and therefore dropped.
    pub is_cut: bool,
}

impl Csv {
    /// Reads a table; `None` if there is no file or no complete header yet.
    ///
    /// # Errors
    /// The file can not be read, or a row other than the last does not fit the header.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        match files::read(path, files::LONGEST_TABLE) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(trouble(path, "read", &e)),
            Ok(bytes) => Self::parse(path, &bytes),
        }
    }

    /// Parses a table from the bytes of a file, see [`read`](Self::read). The path is used in
    /// errors only.
    ///
    /// # Errors
    /// A row other than the last does not fit the header.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Option<Self>> {
        // A byte order mark, which some programs write, does not belong to the first name.
        let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        let text = String::from_utf8_lossy(bytes);
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut lines = text[..whole].lines();
        let Some(header) = lines.next() else { return Ok(None) };
        let wrong = |line: usize, what: String| {
            let text = format!("{}: line {line}: {what}", path.display());
            Error::file(text)
                .hint("the table is damaged or was not written by this program: create or copy it again")
        };
        let read =
            |line: usize, text: &str| fields(text).ok_or_else(|| wrong(line, "an unmatched quote".into()));
        let columns = read(1, header)?;
        if let Some(twice) = columns.iter().enumerate().find(|(k, name)| columns[..*k].contains(name)) {
            return Err(wrong(1, format!("the column '{}' occurs twice", shown(twice.1))));
        }
        let mut rows = Vec::new();
        for (index, line) in lines.enumerate() {
            let row = read(index + 2, line)?;
            if row.len() != columns.len() {
                return Err(wrong(index + 2, format!("{} fields for {} columns", row.len(), columns.len())));
            }
            rows.push(row);
        }
        Ok(Some(Self { path: path.display().to_string(), columns, rows, is_cut: whole < text.len() }))
    }

    /// Names of the columns, units included.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// A text column; `None` if there is no such column.
    pub fn words(&self, column: &str) -> Option<Vec<&str>> {
        let index = self.columns.iter().position(|name| name == column)?;
        Some(self.rows.iter().map(|row| row[index].as_str()).collect())
    }

    /// A numeric column, NaN where a field is empty; `None` if there is no such column.
    ///
    /// # Errors
    /// A field is not a number.
    pub fn numbers(&self, column: &str) -> Result<Option<Vec<f64>>> {
        let Some(index) = self.columns.iter().position(|name| name == column) else { return Ok(None) };
        let number = |(line, row): (usize, &Vec<String>)| match row[index].as_str() {
            "" => Ok(f64::NAN),
            text => text.parse().map_err(|_| {
                let (text, column) = (shown(text), shown(column));
                Error::file(format!("{}: line {}: `{text}` in column `{column}`", self.path, self.line(line)))
                    .hint("expected a number or an empty field")
            }),
        };
        self.rows.iter().enumerate().map(number).collect::<Result<_>>().map(Some)
    }

    /// The line of the file that holds a row, counted from zero.
    pub fn line(&self, row: usize) -> usize {
        row + 2
    }
}

/// The fields of a line. A quoted field may contain commas, and a doubled quote stands for one
/// quote. `None` if a quote is not closed.
fn fields(line: &str) -> Option<Vec<String>> {
    let mut fields = vec![String::new()];
    let mut is_quoted = false;
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        let end = fields.len() - 1;
        match letter {
            '"' if is_quoted && letters.next_if_eq(&'"').is_some() => fields[end].push('"'),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(String::new()),
            _ => fields[end].push(letter),
        }
    }
    (!is_quoted).then_some(fields)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::tests::Scratch;

    /// All complete rows of a truncated table are read, and a truncated last row is dropped.
    #[test]
    fn reads_every_beginning_of_a_table() {
        let scratch = Scratch::new("csv");
        let path = scratch.0.join("a.csv");
        let text = "step,\"a, b [m]\"\n0,1.5\n1,\n2,-3e-4\n";
        for end in 0..=text.len() {
            std::fs::write(&path, &text[..end]).unwrap();
            let Some(csv) = Csv::read(&path).unwrap() else {
                assert!(end < 16);
                continue;
            };
            let values = csv.numbers("a, b [m]").unwrap().unwrap();
            assert_eq!(values.len() + 1, text[..end].matches('\n').count());
            assert_eq!(csv.is_cut, !text[..end].ends_with('\n'));
        }
        let values = Csv::read(&path).unwrap().unwrap().numbers("a, b [m]").unwrap().unwrap();
        assert!(values[0] == 1.5 && values[1].is_nan() && values[2] == -3e-4);
        assert_eq!(Csv::read(&scratch.0.join("absent.csv")).unwrap(), None);
    }

    /// A broken row in the middle, and a word among numbers, are errors that name the line.
    #[test]
    fn names_the_broken_line() {
        let scratch = Scratch::new("csv-broken");
        let path = scratch.0.join("a.csv");
        std::fs::write(&path, "step,a\n0,1\n1\n2,3\n").unwrap();
        assert!(Csv::read(&path).unwrap_err().message.contains("line 3"));
        std::fs::write(&path, "step,a\n0,1\n1,x\n").unwrap();
        let csv = Csv::read(&path).unwrap().unwrap();
        assert!(csv.numbers("a").unwrap_err().message.contains("line 3"));
        assert_eq!(csv.numbers("b").unwrap(), None);
        std::fs::write(&path, "\u{feff}step,a\n0,1\n").unwrap();
        assert_eq!(Csv::read(&path).unwrap().unwrap().columns(), ["step", "a"]);
        for (text, words) in [
            ("step,a\n0,1\n1,\"2\n3,4\n", "line 3: an unmatched quote"),
            ("step,\"a\n0,1\n", "line 1: an unmatched quote"),
            ("a,b,a\n0,1,2\n", "line 1: the column 'a' occurs twice"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = Csv::read(&path).unwrap_err();
            assert!(error.message.contains(words), "{words}: {error}");
        }
    }
}
