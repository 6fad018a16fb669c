//! What a user reads when the case file is wrong: place, sentence, the line itself, a cure.

use std::fmt;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use serde_saphyr::Error as Yaml;

use super::place::Place;
use crate::error::{Error, shown};

/// Text of a case file and its name, kept so that later checks can still point into it.
///
/// Two sources are always equal: the text does not distinguish two cases that say the same.
#[derive(Debug, Clone, Default)]
pub struct Source {
    /// Name as the user gave it.
    pub name: String,
    /// The whole text.
    pub text: String,
    /// Folder of the file, which paths in it are relative to.
    pub directory: PathBuf,
    /// The study that changed keys of it, which places of file 1 are meant for.
    pub(super) overrides: Option<Rc<Source>>,
}

impl PartialEq for Source {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// What is wrong with a piece of the file, where, and what to do about it.
///
/// serde carries errors of our own as text only, hence `Display` writes what `Complaint::from_text` reads.
#[derive(Debug, Clone, Default)]
pub struct Complaint {
    /// Where; unknown lets the YAML reader's own position stand.
    pub place: Place,
    /// Characters from the start of the place to the fault inside it.
    pub offset: usize,
    /// One sentence.
    pub message: String,
    /// The cure; empty if the sentence says it.
    pub hint: String,
    /// How reading can go on behind it.
    pub(super) repair: Repair,
}

/// What lets the rest of a file be read although something in it is wrong.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) enum Repair {
    /// The value at the place can be anything.
    #[default]
    Replace,
    /// The key at the place goes.
    Remove,
    /// The key or the word at the place was meant to be this one.
    Rename(String),
    /// The mapping at the place has this key as well.
    Insert(&'static str),
}

/// Errors of one file that are shown at once.
pub(super) const MOST_SHOWN: usize = 20;

/// Separates the parts of a complaint in transit; control characters can not stand in YAML.
const PART: char = '\u{1}';

impl Complaint {
    /// A complaint without a place.
    pub fn new(message: String) -> Self {
        Self { message, ..Self::default() }
    }

    /// An unknown word among known ones, with the nearest of them.
    pub fn unknown<'a>(noun: &str, word: &str, known: impl Iterator<Item = &'a str>) -> Self {
        let known: Vec<&str> = known.collect();
        let mut hint = match known.as_slice() {
            [] => format!("there is no {noun} here"),
            names => format!("known: {}", listed(names)),
        };
        if let Some(name) = nearest(word, &known) {
            hint.push_str(&format!("; did you mean '{}'?", shown(name)));
        }
        let repair = nearest(word, &known).map_or(Repair::Replace, |name| Repair::Rename(name.to_owned()));
        Self { repair, ..Self::new(format!("unknown {noun} '{}'", shown(word))).hint(hint) }
    }

    /// The same of a word that was meant to be another one.
    #[must_use]
    pub(super) fn renamed(mut self, meant: String) -> Self {
        self.repair = Repair::Rename(meant);
        self
    }

    /// The same with its place.
    #[must_use]
    pub fn at(mut self, place: Place) -> Self {
        self.place = place;
        self
    }

    /// The same with its place, unless it has one.
    #[must_use]
    pub fn or_at(self, place: Place) -> Self {
        if self.place.line == 0 { self.at(place) } else { self }
    }

    /// The same with a cure.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = hint.into();
        self
    }

    /// The same with the fault some characters into the place.
    #[must_use]
    pub fn offset(mut self, offset: usize) -> Self {
        self.offset = offset;
        self
    }

    fn from_text(text: &str) -> Option<Self> {
        let parts: Vec<&str> = text.split(PART).collect();
        let [_, file, line, column, length, offset, message, hint, ..] = parts[..] else { return None };
        let number = |text: &str| text.parse().ok();
        let (file, line, column, length) = (number(file)?, number(line)?, number(column)?, number(length)?);
        let place = Place { file, line, column, length };
        let repair = parts.get(8).filter(|name| !name.is_empty());
        let repair = repair.map_or(Repair::Replace, |name| Repair::Rename((*name).to_owned()));
        Some(Self { place, offset: number(offset)?, message: message.into(), hint: hint.into(), repair })
    }
}

/// What serde finds wrong as data is read from a tree.
impl serde::de::Error for Complaint {
    fn custom<T: fmt::Display>(message: T) -> Self {
        let text = message.to_string();
        Self::from_text(&text).unwrap_or_else(|| Self::new(text))
    }
    fn unknown_field(key: &str, known: &'static [&'static str]) -> Self {
        unknown_key(key, known)
    }
    fn unknown_variant(variant: &str, known: &'static [&'static str]) -> Self {
        Self::unknown("value", variant, known.iter().copied())
    }
    fn missing_field(key: &'static str) -> Self {
        Self { repair: Repair::Insert(key), ..Self::new(format!("the key '{key}' is missing here")) }
    }
    fn duplicate_field(key: &'static str) -> Self {
        let twice = Self::new(format!("the key '{key}' occurs twice")).hint("keep one of the two");
        Self { repair: Repair::Remove, ..twice }
    }
}

impl std::error::Error for Complaint {}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Place { file, line, column, length } = self.place;
        let (offset, message, hint) = (self.offset, &self.message, &self.hint);
        let meant = if let Repair::Rename(name) = &self.repair { name } else { "" };
        write!(
            f,
            "{PART}{file}{PART}{line}{PART}{column}{PART}{length}{PART}{offset}{PART}{message}{PART}{hint}{PART}{meant}{PART}"
        )
    }
}

/// Most names that a message lists.
const MOST_NAMES: usize = 60;

/// Names in a row, the first of them where there are many.
pub fn listed(names: &[&str]) -> String {
    let mut text = names.iter().take(MOST_NAMES).map(|name| shown(name)).collect::<Vec<_>>().join(", ");
    if names.len() > MOST_NAMES {
        text.push_str(&format!(" and {} more", names.len() - MOST_NAMES));
    }
    text
}

/// Longer words are not compared: the time grows with the product of their lengths \[bytes\].
const LONGEST_MISSPELT: usize = 200;

/// The known word that a misspelt one is nearest to, if it is near at all.
pub fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let is_short = |name: &&&str| name.len() <= LONGEST_MISSPELT;
    if word.len() > LONGEST_MISSPELT {
        return None;
    }
    let known: Vec<&str> = known.iter().filter(is_short).copied().collect();
    let distance = |name: &&str| strsim::damerau_levenshtein(&word.to_lowercase(), name);
    let limit = (word.chars().count() / 3).max(1);
    let near = known.iter().copied().min_by_key(distance).filter(|name| distance(name) <= limit);
    let extends = |name: &&&str| word.len() > 2 && (name.starts_with(word) || name.ends_with(word));
    near.or_else(|| known.iter().find(extends).copied())
}

impl Source {
    /// The text of a file.
    pub fn new(text: &str, path: &Path) -> Self {
        let directory = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Self { name: path.display().to_string(), text: text.to_owned(), directory, overrides: None }
    }

    /// The error that shows a complaint: `name:line:column: message`, the line, the hint.
    pub fn error(&self, complaint: &Complaint) -> Error {
        if let (1, Some(overrides)) = (complaint.place.file, &self.overrides) {
            return overrides.error(complaint);
        }
        let mut place = complaint.place;
        if place.line == 0 {
            let error = Error::case(format!("{}: {}", self.name, complaint.message));
            return with_hint(error, &complaint.hint);
        }
        if complaint.offset > 0 {
            let quoted = self.line(place.line).chars().nth(place.column - 1);
            place.column += complaint.offset + usize::from(matches!(quoted, Some('"' | '\'')));
            place.length = 1;
        }
        let Place { line, column, .. } = place;
        let snippet = self.snippet(place);
        let message = format!("{}:{line}:{column}: {}{snippet}", self.name, complaint.message);
        with_hint(Error::case(message), &complaint.hint)
    }

    /// One error that shows all complaints in the order of the files, up to [`MOST_SHOWN`].
    pub(crate) fn errors(&self, mut complaints: Vec<Complaint>) -> Error {
        complaints
            .sort_by_key(|Complaint { place, offset, .. }| (place.file, place.line, place.column, *offset));
        let mut shown: Vec<String> = Vec::new();
        let mut left = 0;
        for complaint in &complaints {
            let message = self.error(complaint).message;
            match shown.len() < MOST_SHOWN {
                _ if shown.contains(&message) => {}
                true => shown.push(message),
                false => left += 1,
            }
        }
        if left > 0 {
            shown.push(format!("further errors of {} are not shown", self.name));
        }
        Error::case(shown.join("\n\n"))
    }

    fn line(&self, line: usize) -> &str {
        self.text.lines().nth(line - 1).unwrap_or_default()
    }

    fn snippet(&self, place: Place) -> String {
        let line = self.line(place.line);
        if line.trim().is_empty() {
            return String::new();
        }
        let byte = |column: usize| line.char_indices().nth(column).map_or(line.len(), |(at, _)| at);
        let start = byte(place.column - 1);
        let end = byte(place.column - 1 + place.length.max(1)).max(start);
        let mark = AnnotationKind::Primary.span(start..end);
        let source = Snippet::source(line).line_start(place.line).annotation(mark);
        let report = [Group::with_level(Level::ERROR).element(source)];
        format!("\n{}", Renderer::plain().term_width(110).render(&report))
    }

    /// The error that shows what the YAML reader or serde found wrong.
    pub fn yaml_error(&self, error: &Yaml) -> Error {
        let error = error.without_snippet();
        let mut place = error.location().map(Place::from).unwrap_or_default();
        if place.line == 0 {
            place = Place { line: 1, column: 1, length: 1, ..place };
        }
        let mut complaint = self.sentence(error);
        complaint = complaint.or_at(place);
        if let (true, Some(hint)) = (complaint.hint.is_empty(), self.tab_hint(complaint.place)) {
            complaint = complaint.hint(hint);
        }
        self.error(&complaint)
    }

    /// The error of a file without a word in it.
    pub(super) fn nothing(&self) -> Error {
        let place = Place { line: 1, column: 1, length: 1, ..Place::default() };
        let what = if self.text.trim().is_empty() { "is empty" } else { "holds only comments" };
        let complaint = Complaint::new(format!("the case {what}")).at(place);
        self.error(&complaint.hint("start from a case file in meshes/"))
    }

    fn sentence(&self, error: &Yaml) -> Complaint {
        let say = |message: String| Complaint::new(message);
        match error {
            Yaml::Message { msg, .. } => Complaint::from_text(msg).unwrap_or_else(|| say(msg.clone())),
            Yaml::AliasError { error, .. } => self.sentence(error),
            Yaml::Eof { .. } => say("the case ends too early".into()),
            Yaml::MultipleDocuments { .. } => say("one case a file: a second document begins here".into()),
            Yaml::DuplicateMappingKey { key, .. } => {
                let key = key.as_deref().unwrap_or("of this mapping");
                say(format!("the key '{}' occurs twice", shown(key))).hint("keep one of the two")
            }
            Yaml::InvalidBooleanStrict { .. } => say("expected true or false".into()),
            Yaml::NonFiniteFloat { value, .. } => say(format!("expected a finite number, found {value}")),
            Yaml::InvalidScalar { ty, .. } => say(format!("expected {}", scalar_name(ty))),
            Yaml::Unexpected { expected, .. } => say(format!("expected {}", plain_name(expected))),
            Yaml::Budget { .. }
            | Yaml::AliasReplayLimitExceeded { .. }
            | Yaml::AliasExpansionLimitExceeded { .. } => {
                say(format!("the case is nested or aliased beyond reason: {}", bare(error)))
            }
            other => say(bare(other)),
        }
    }

    /// Editors show a tab as blanks, and YAML's complaint about it speaks of anything but tabs.
    fn tab_hint(&self, place: Place) -> Option<&'static str> {
        let line = self.line(place.line);
        let indent = &line[..line.len() - line.trim_start().len()];
        indent.contains('\t').then_some("YAML is indented with spaces; this line begins with a tab")
    }
}

fn with_hint(error: Error, hint: &str) -> Error {
    if hint.is_empty() { error } else { error.hint(hint) }
}

/// An unknown key; where another block knows it, the hint says which.
fn unknown_key(key: &str, known: &[&'static str]) -> Complaint {
    let mut complaint = Complaint::unknown("key", key, known.iter().copied());
    if complaint.repair == Repair::Replace {
        complaint.repair = Repair::Remove;
    }
    let owners = super::schema::owners_of(key);
    if !owners.is_empty() && nearest(key, known).is_none() {
        complaint.hint.push_str(&format!("; '{key}' belongs to {}", owners.join(", ")));
    }
    complaint
}

fn scalar_name(ty: &str) -> &str {
    match ty {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, zero or more",
        "f32" | "f64" | "floating point" => "a number",
        "bool" | "boolean" => "true or false",
        other => other,
    }
}

fn plain_name(expected: &str) -> &str {
    match expected {
        "mapping start" => "a mapping, `key: value`",
        "sequence start" => "a list, `[a, b]`",
        "string scalar" => "a word",
        other => other,
    }
}

/// The library's own sentence without its position.
fn bare(error: &Yaml) -> String {
    let text = error.to_string();
    let first = text.lines().next().unwrap_or_default();
    first.split(" at line ").next().unwrap_or(first).to_string()
}
