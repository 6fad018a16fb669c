//! What is wrong with a piece of a file: place, sentence, cure.

use std::fmt;

use super::place::Place;
use crate::error::shown;

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
    /// How the rest of the file can be read.
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
    /// This key at the place goes. None of the keys that are known there resembles it, but another block may know it.
    RemoveStray(String),
    /// The key or the word at the place was meant to be this one.
    Rename(String),
    /// The mapping at the place has this key as well.
    Insert(&'static str),
}

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
            [] => format!("no {noun} is defined"),
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

    /// This complaint with another sentence.
    #[must_use]
    pub fn saying(mut self, message: String) -> Self {
        self.message = message;
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

    pub(super) fn from_text(text: &str) -> Option<Self> {
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
        let offset = self.offset;
        let message = &self.message;
        let hint = &self.hint;
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

/// An unknown key.
fn unknown_key(key: &str, known: &[&'static str]) -> Complaint {
    let mut complaint = Complaint::unknown("key", key, known.iter().copied());
    if complaint.repair == Repair::Replace {
        complaint.repair = Repair::RemoveStray(key.to_owned());
    }
    if known.is_empty() { complaint.hint("nothing can be set here; remove the key") } else { complaint }
}
