//! The lines of an input file and of the files that it includes: keywords with parameters, and
//! data.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result, shown};
use crate::files;
use crate::mesh::source::Segments;

/// A keyword with its parameters, `*ELEMENT, TYPE=C3D8, ELSET=block`.
#[derive(Debug, Clone)]
pub(super) struct Card {
    /// Name in upper case, without the asterisk and with single spaces.
    pub name: String,
    /// Names in upper case, and values without quotation marks.
    parameters: Vec<(String, Option<String>)>,
    /// Location of its first line.
    pub place: usize,
}

impl Card {
    /// Value of a parameter; `None` if the parameter is absent or has no value.
    pub fn value(&self, name: &str) -> Option<&str> {
        let found = self.parameters.iter().find(|(known, _)| known == name);
        found.and_then(|(_, value)| value.as_deref())
    }

    pub fn has(&self, name: &str) -> bool {
        self.parameters.iter().any(|(known, _)| known == name)
    }
}

/// The next item of a file.
pub(super) enum Item {
    Keyword(Card),
    /// A line of data, see [`Deck::data`].
    Data,
    End,
}

/// A file that is being read.
struct Source {
    name: String,
    bytes: Vec<u8>,
    at: usize,
    /// Number of the next line, from one.
    line: usize,
}

impl Source {
    /// The next line, without its end.
    fn next(&mut self) -> Option<&[u8]> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        self.line += 1;
        Some(rest[..length].trim_ascii())
    }

    /// Whether the next line continues a keyword: it begins with a letter.
    fn continues(&self) -> bool {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let first = rest.iter().find(|byte| **byte == b'\n' || !byte.is_ascii_whitespace());
        first.is_some_and(u8::is_ascii_alphabetic)
    }
}

/// An input file with the files that it includes, read from front to back.
pub(super) struct Deck {
    open: Vec<Source>,
    /// Folder of the first file, to which paths of included files are relative. Without a folder no
    /// file is included.
    folder: Option<PathBuf>,
    included: BTreeSet<PathBuf>,
    pub segments: Segments,
    /// Number of lines read so far, in all files.
    lines: usize,
    data: String,
}

impl Deck {
    /// Reads the bytes of a file. `name` stands in its errors and is empty for bytes without a file.
    pub fn new(name: &str, bytes: Vec<u8>, folder: Option<PathBuf>) -> Self {
        let mut segments = Segments::default();
        segments.begin(0, name, 1);
        let first = Source { name: name.to_owned(), bytes, at: 0, line: 1 };
        Self { open: vec![first], folder, included: BTreeSet::new(), segments, lines: 0, data: String::new() }
    }

    /// Location of the last line.
    pub fn place(&self) -> usize {
        self.lines.saturating_sub(1)
    }

    /// The last line of data.
    pub fn data(&self) -> &str {
        &self.data
    }

    /// An error at the last line.
    pub fn error(&self, message: impl AsRef<str>) -> Error {
        self.error_at(self.place(), message)
    }

    /// An error at an earlier line.
    pub fn error_at(&self, place: usize, message: impl AsRef<str>) -> Error {
        self.segments.error(place, message.as_ref())
    }

    /// The next keyword or line of data. Comments and blank lines are passed. Unless data is
    /// `wanted`, its content is not looked at.
    pub fn next(&mut self, wanted: bool) -> Result<Item> {
        loop {
            let Some(source) = self.open.last_mut() else { return Ok(Item::End) };
            let Some(line) = source.next() else {
                self.open.pop();
                if let Some(outer) = self.open.last() {
                    self.segments.begin(self.lines, &outer.name, outer.line);
                }
                continue;
            };
            self.lines += 1;
            if line.is_empty() || line.starts_with(b"**") {
                continue;
            }
            let is_keyword = line.starts_with(b"*");
            if !is_keyword && !wanted {
                return Ok(Item::Data);
            }
            match std::str::from_utf8(line) {
                Ok(text) => text.clone_into(&mut self.data),
                Err(_) => return Err(self.error("the line is not UTF-8 text").hint(ENCODING)),
            }
            return if is_keyword { self.card().map(Item::Keyword) } else { Ok(Item::Data) };
        }
    }

    /// The keyword that begins on the last line. A comma at the end of a line continues it.
    fn card(&mut self) -> Result<Card> {
        let place = self.place();
        let mut text = std::mem::take(&mut self.data);
        while text.ends_with(',') && self.open.last().is_some_and(Source::continues) {
            let line = self.open.last_mut().and_then(Source::next).unwrap_or_default();
            let line = std::str::from_utf8(line).map(str::to_owned);
            self.lines += 1;
            let Ok(line) = line else {
                return Err(self.error("the line is not UTF-8 text").hint(ENCODING));
            };
            text.push_str(&line);
        }
        let mut parts = unquoted_commas(text.trim_start_matches('*'));
        let name = parts.next().unwrap_or_default().to_ascii_uppercase();
        let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
        let parameters = parts.filter(|part| !part.trim().is_empty()).map(|part| {
            let (key, value) = part.split_once('=').map_or((part, None), |(key, value)| (key, Some(value)));
            (key.trim().to_ascii_uppercase(), value.map(|value| unquoted(value).to_owned()))
        });
        Ok(Card { name, parameters: parameters.collect(), place })
    }

    /// Continues with the file that `*INCLUDE` names, and then with the current one.
    pub fn include(&mut self, card: &Card) -> Result<()> {
        let input = card.value("INPUT").filter(|input| !input.is_empty()).ok_or_else(|| {
            self.error_at(card.place, "*INCLUDE has no file").hint("*INCLUDE, INPUT=mesh.inp")
        })?;
        let Some(folder) = &self.folder else {
            return Err(self.error_at(card.place, "*INCLUDE is not possible here"));
        };
        let path = folder.join(input);
        let name = path.display().to_string();
        let segments = self.segments.clone();
        let refused =
            |message: String| segments.error(card.place, &format!("*INCLUDE of {}: {message}", shown(input)));
        // A file that includes itself would never end.
        let real = path.canonicalize().unwrap_or_else(|_| path.clone());
        if !self.included.insert(real) {
            return Err(refused("the file was included before".to_owned()).hint("include each file once"));
        }
        let bytes = whole(&path).map_err(|error| {
            refused(format!("the file can not be read: {error}"))
                .hint("paths of included files are relative to the folder of the mesh file")
        })?;
        self.segments.begin(self.lines, &name, 1);
        self.open.push(Source { name, bytes, at: 0, line: 1 });
        Ok(())
    }

    /// States that this file is read already.
    pub fn visited(&mut self, path: &Path) {
        self.included.insert(path.canonicalize().unwrap_or_else(|_| path.to_owned()));
    }
}

const ENCODING: &str = "save the file as UTF-8, for example with `iconv -f latin1 -t utf8`";

/// All bytes of a regular file.
pub(super) fn whole(path: &Path) -> std::io::Result<Vec<u8>> {
    files::read(path, u64::MAX - 1)
}

/// The parts of a line between commas that are not within quotation marks.
fn unquoted_commas(text: &str) -> impl Iterator<Item = &str> {
    let mut within = false;
    text.split(move |c| {
        within ^= c == '"';
        c == ',' && !within
    })
}

/// A value without spaces around it and without its quotation marks.
fn unquoted(value: &str) -> &str {
    let value = value.trim();
    value.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(value)
}

/// A name as sets are compared: without quotation marks, in upper case.
pub(super) fn key(name: &str) -> String {
    unquoted(name).to_uppercase()
}

/// A field of data that is a name, as the user wrote it.
pub(super) fn name(field: &str) -> &str {
    unquoted(field)
}
