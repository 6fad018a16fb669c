//! One error type by cause, and the rule that one rank's error is every rank's error.

use crate::collective::Collective;
use mpi::collective::SystemOperation;
use mpi::traits::{CommunicatorCollectives, Root};

/// Why the program ends; each cause has its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Cause {
    /// The command line is wrong.
    Usage = 2,
    /// The case file is wrong.
    Case = 3,
    /// A mesh or another file can not be read or written.
    File = 4,
    /// The equations were not solved; results up to the last good step are kept.
    NotConverged = 5,
    /// A physics guard fired: inverted element, unexplained energy.
    Guard = 6,
    /// Asked to stop, by a signal or a wall-time limit; a checkpoint was written.
    Stopped = 7,
    /// A fault of the program or of a library below it.
    Internal = 70,
}

impl Cause {
    fn from_code(code: i32) -> Self {
        [Self::Usage, Self::Case, Self::File, Self::NotConverged, Self::Guard, Self::Stopped]
            .into_iter()
            .find(|cause| *cause as i32 == code)
            .unwrap_or(Self::Internal)
    }
}

/// What went wrong, where, and where known what to do about it.
///
/// `message` is one sentence or a rendered snippet; a cure stands on a line of its own that begins with `hint: `.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    /// Decides the exit code.
    pub cause: Cause,
    /// What the user reads.
    pub message: String,
}

/// Result with this program's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error of the given cause.
    pub fn new(cause: Cause, message: impl Into<String>) -> Self {
        Self { cause, message: bounded(message.into()) }
    }

    /// The command line is wrong.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(Cause::Usage, message)
    }

    /// The case is wrong.
    pub fn case(message: impl Into<String>) -> Self {
        Self::new(Cause::Case, message)
    }

    /// A mesh or file is wrong.
    pub fn file(message: impl Into<String>) -> Self {
        Self::new(Cause::File, message)
    }

    /// The equations were not solved.
    pub fn not_converged(message: impl Into<String>) -> Self {
        Self::new(Cause::NotConverged, message)
    }

    /// A physics guard fired.
    pub fn guard(message: impl Into<String>) -> Self {
        Self::new(Cause::Guard, message)
    }

    /// Stopped on request with a checkpoint.
    pub fn stopped(message: impl Into<String>) -> Self {
        Self::new(Cause::Stopped, message)
    }

    /// The program or a library is at fault.
    pub fn internal(message: impl Into<String>) -> Self {
        Self::new(Cause::Internal, message)
    }

    /// One error that says all of several, with the cause of the first.
    ///
    /// # Errors
    /// There is any.
    pub fn together(errors: Vec<Self>) -> Result<()> {
        let messages: Vec<&str> = errors.iter().map(|error| error.message.as_str()).collect();
        let text = messages.join("\n\n");
        errors.first().map_or(Ok(()), |first| Err(Self::new(first.cause, text)))
    }

    /// The same error with a line of context in front, as in `block.msh: line 12: ...`.
    #[must_use]
    pub fn within(mut self, context: &str) -> Self {
        self.message = format!("{context}: {}", self.message);
        self
    }

    /// The same error with a line that says what to do.
    #[must_use]
    pub fn hint(mut self, cure: &str) -> Self {
        self.message.push_str("\nhint: ");
        self.message.push_str(cure);
        self
    }

    /// What the user reads before the message: a run that stops as it was asked to is no error.
    pub fn label(&self) -> &'static str {
        if self.cause == Cause::Stopped { "stopped" } else { "error" }
    }

    /// Exit code of the process, see [`Cause`].
    pub fn exit_code(&self) -> i32 {
        self.cause as i32
    }
}

/// Most characters of a line of a message, so that no name or line of a user's file fills a terminal; a path and a command
/// have room.
const LONGEST_LINE: usize = 10_000;
/// Most lines of a message.
const MOST_LINES: usize = 400;
/// Most characters of a word that a message repeats.
const LONGEST_WORD: usize = 60;

/// A word of a user as a message repeats it: its start, where it is long, without control characters.
pub fn shown(word: &str) -> String {
    let mut short: String = word.chars().take(LONGEST_WORD).map(visible).collect();
    if word.chars().nth(LONGEST_WORD).is_some() {
        short.push_str(" ...");
    }
    short
}

/// No word within a sentence is longer unless it is a path \[bytes\]: no name of a file is.
const LONGEST_WORD_IN_TEXT: usize = 300;

/// A line whose long words are cut as [`shown`] cuts them; paths stay.
fn terse(sentence: &str) -> String {
    let is_long = |word: &str| word.len() > LONGEST_WORD_IN_TEXT && !word.contains('/');
    let words = sentence.split(' ').map(|word| if is_long(word) { shown(word) } else { word.to_owned() });
    words.collect::<Vec<_>>().join(" ")
}

/// What moves the cursor or colours the text is no part of a word.
fn visible(letter: char) -> char {
    if letter.is_control() { char::REPLACEMENT_CHARACTER } else { letter }
}

/// A message that a terminal can show.
fn bounded(message: String) -> String {
    let is_plain = |letter: char| !letter.is_control() || letter == '\n' || letter == '\t';
    if message.len() <= LONGEST_WORD_IN_TEXT
        && message.chars().all(is_plain)
        && message.lines().count() <= MOST_LINES
    {
        return message;
    }
    let mut lines: Vec<String> = Vec::new();
    for line in message.split('\n').take(MOST_LINES) {
        let plain = |letter: char| if is_plain(letter) { letter } else { visible(letter) };
        let line = terse(line);
        let mut short: String = line.chars().take(LONGEST_LINE).map(plain).collect();
        if line.chars().nth(LONGEST_LINE).is_some() {
            short.push_str(" ...");
        }
        lines.push(short);
    }
    if message.split('\n').nth(MOST_LINES).is_some() {
        lines.push("...".to_owned());
    }
    lines.join("\n")
}

/// Makes the error of the lowest failing rank the error of all ranks. Collective.
///
/// # Errors
/// The same [`Error`] on every rank, when any rank brought one.
pub fn agree<T>(world: &impl CommunicatorCollectives, result: Result<T>) -> Result<T> {
    let mine = if result.is_err() { world.rank() } else { i32::MAX };
    let mut first = i32::MAX;
    world.reduce_all(&mine, &mut first, SystemOperation::min());
    if first == i32::MAX {
        return result;
    }
    let own = result.err();
    let root = world.process_at_rank(first);
    let speaks = own.as_ref().filter(|_| world.rank() == first);
    let mut head = [speaks.map_or(0, Error::exit_code), speaks.map_or(0, |e| e.message.len() as i32)];
    root.broadcast_into(&mut head);
    let mut text = speaks.map_or_else(|| vec![0u8; head[1] as usize], |e| e.message.clone().into_bytes());
    root.broadcast_into(&mut text);
    Err(Error::new(Cause::from_code(head[0]), String::from_utf8_lossy(&text)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Long words and lines are cut, control characters are replaced, all else is left as it is.
    #[test]
    fn messages_fit_a_terminal() {
        assert_eq!(shown("short"), "short");
        assert_eq!(shown(&"é".repeat(61)), format!("{} ...", "é".repeat(60)));
        assert_eq!(shown("a\u{1b}[2J\nb"), "a\u{fffd}[2J\u{fffd}b");
        let plain = "a: b\n  1 | é\t|\nhint: c";
        assert_eq!(Error::case(plain).message, plain);
        assert_eq!(
            terse(&format!("no '{0}' here: /{0}", "x".repeat(300))),
            format!("no '{} ... here: /{}", "x".repeat(59), "x".repeat(300))
        );
        let long = Error::case(format!("unknown '{}'\nhint: c", "x".repeat(1 << 20))).message;
        assert!(long.len() < 100 && long.ends_with(" ...\nhint: c"));
        assert!(Error::case("x ".repeat(1 << 20)).message.len() < 11_000);
        let path = format!("{}: no such file", "/long".repeat(800));
        assert_eq!(Error::file(path.clone()).message, path);
        assert!(Error::case("x\n".repeat(1 << 20)).message.len() < 1000);
        assert_eq!(Error::case("a\u{1b}[2Jb").message, "a\u{fffd}[2Jb");
    }
}
