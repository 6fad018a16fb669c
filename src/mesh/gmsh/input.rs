//! The bytes of an MSH file with a read position: words of text, or numbers in either byte order.

use crate::error::{Error, Result};
use crate::mesh::source::error_in_bytes;

/// Encoding of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// A file in memory, read from front to back. An announced size is accepted only after a check that
/// the file is long enough.
pub(super) struct GmshInput<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Start of the last item, for messages.
    start: usize,
    pub encoding: Encoding,
}

/// Maximum length of a section name \[bytes\]. The search for the end of a section takes this
/// length times that of the file.
const NAME: usize = 256;

/// Minimum size of one entry in the file.
pub(super) struct Least {
    pub words: u64,
    pub bytes: u64,
}

impl<'a> GmshInput<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, start: 0, encoding: Encoding::Text }
    }

    /// Start of the last item, for [`error_at`](Self::error_at).
    pub fn place(&self) -> usize {
        self.start
    }

    /// An error at the last item.
    pub fn error(&self, message: impl AsRef<str>) -> Error {
        self.error_at(self.start, message)
    }

    /// An error at an earlier position: a line of a text file, a byte of a binary one.
    pub fn error_at(&self, place: usize, message: impl AsRef<str>) -> Error {
        error_in_bytes(self.bytes, self.encoding == Encoding::Text, place, message.as_ref())
    }

    fn ends(&self, what: &str) -> Error {
        let message = format!("the file ends where {what} is expected: it is truncated");
        self.error_at(self.bytes.len(), message).hint("save or copy the mesh again")
    }

    fn skip_space(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(rest.len());
        self.start = self.at;
    }

    fn text(&self, from: usize, to: usize, what: &str) -> Result<&'a str> {
        std::str::from_utf8(&self.bytes[from..to]).map_err(|_| self.error(format!("{what} is not text")))
    }

    /// The next word of text.
    pub fn word(&mut self, what: &str) -> Result<&'a str> {
        self.skip_space();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.ends(what));
        }
        self.at += length;
        self.text(self.start, self.at, what)
    }

    /// The rest of this line or, at its end, the next line that is not blank. The line end is
    /// consumed.
    pub fn line(&mut self, what: &str) -> Result<&'a str> {
        self.skip_space();
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return Err(self.ends(what));
        }
        let length = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        Ok(self.text(self.start, self.start + length, what)?.trim_end())
    }

    /// A number that is text in binary files too, on a line of its own.
    pub fn line_size(&mut self, what: &str) -> Result<u64> {
        let line = self.line(what)?;
        line.parse().map_err(|_| self.error(format!("expected {what}, found '{}'", shortened(line))))
    }

    fn number<T: std::str::FromStr, const N: usize>(
        &mut self,
        what: &str,
        little: fn([u8; N]) -> T,
        big: fn([u8; N]) -> T,
    ) -> Result<T> {
        if self.encoding == Encoding::Text {
            let word = self.word(what)?;
            return word
                .parse()
                .map_err(|_| self.error(format!("expected {what}, found '{}'", shortened(word))));
        }
        self.start = self.at;
        let Some(bytes) = self.bytes[self.at..].first_chunk::<N>() else {
            return Err(self.ends(what));
        };
        self.at += N;
        Ok(if self.encoding == Encoding::LittleEndian { little(*bytes) } else { big(*bytes) })
    }

    /// The next integer of four bytes.
    pub fn int(&mut self, what: &str) -> Result<i32> {
        self.number(what, i32::from_le_bytes, i32::from_be_bytes)
    }

    /// The next unsigned integer of eight bytes.
    pub fn size(&mut self, what: &str) -> Result<u64> {
        self.number(what, u64::from_le_bytes, u64::from_be_bytes)
    }

    /// The next real number of eight bytes.
    pub fn real(&mut self, what: &str) -> Result<f64> {
        self.number(what, f64::from_le_bytes, f64::from_be_bytes)
    }

    /// The next count or identifier. In binary it is an integer of four bytes, in text an integer
    /// of up to eight.
    pub fn label(&mut self, what: &str) -> Result<u64> {
        if self.encoding == Encoding::Text {
            return self.size(what);
        }
        let int = self.int(what)?;
        u64::try_from(int).map_err(|_| self.error(format!("expected {what}, found {int}")))
    }

    /// Checks that the rest of the file can hold `count` entries.
    pub fn afford(&self, count: u64, least: &Least, what: &str) -> Result<()> {
        let left = (self.bytes.len() - self.at) as u64;
        let each = if self.encoding == Encoding::Text { 2 * least.words } else { least.bytes };
        // The last word of a file needs no space after it.
        if count.saturating_mul(each) > left.saturating_add(1) {
            let message = format!(
                "{count} {what} are declared, but only {left} bytes follow: the file is truncated or damaged"
            );
            return Err(self.error(message).hint("save or copy the mesh again"));
        }
        Ok(())
    }

    /// Start of the next entry, for [`end_entry`](Self::end_entry).
    pub fn begin_entry(&mut self) -> usize {
        if self.encoding == Encoding::Text {
            self.skip_space();
        }
        self.at
    }

    /// Checks that an entry of a text file is on exactly one line. Otherwise numbers would shift
    /// into neighbouring fields.
    pub fn end_entry(&self, begin: usize, what: &str) -> Result<()> {
        if self.encoding != Encoding::Text {
            return Ok(());
        }
        if self.bytes[begin..self.at].contains(&b'\n') {
            return Err(self.error_at(begin, format!("{what} has too few numbers")));
        }
        let rest = &self.bytes[self.at..];
        match rest.iter().find(|byte| **byte == b'\n' || !byte.is_ascii_whitespace()) {
            None | Some(b'\n') => Ok(()),
            Some(_) => Err(self.error_at(begin, format!("{what} has too many numbers"))),
        }
    }

    /// The name of the next section, `Nodes` of `$Nodes`; `None` at the end of the file.
    pub fn next_section(&mut self) -> Result<Option<&'a str>> {
        self.skip_space();
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        let line = self.line("a section")?;
        match line.strip_prefix('$') {
            Some(name) if !name.starts_with("End") && name.len() <= NAME => Ok(Some(name)),
            _ => Err(self.error(format!("expected the start of a section, found '{}'", shortened(line)))),
        }
    }

    /// Reads `$EndNodes` after the last entry of `Nodes`.
    pub fn end_section(&mut self, name: &str) -> Result<()> {
        let end = format!("$End{name}");
        self.skip_space();
        let rest = &self.bytes[self.at..];
        if rest.is_empty() || (rest.len() < end.len() && end.as_bytes().starts_with(rest)) {
            return Err(self.ends(&end));
        }
        if !rest.starts_with(end.as_bytes()) {
            let message = format!("expected {end}: the section holds more than it declares, or is damaged");
            return Err(self.error(message));
        }
        self.at += end.len();
        Ok(())
    }

    /// Skips a section that is not needed.
    pub fn skip_section(&mut self, name: &str) -> Result<()> {
        let end = format!("$End{name}");
        let found = self.bytes[self.at..].windows(end.len()).position(|window| window == end.as_bytes());
        self.at += found.ok_or_else(|| self.ends(&end))? + end.len();
        Ok(())
    }
}

/// At most the first 20 characters, for messages about damaged files.
pub(super) fn shortened(text: &str) -> String {
    let mut short: String = text.chars().take(20).map(|c| if c.is_control() { '?' } else { c }).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    short
}
