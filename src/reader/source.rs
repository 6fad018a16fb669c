//! The text of a file, and errors that show a line of it.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use serde_saphyr::Error as Yaml;

use super::complaint::Complaint;
use super::place::Place;
use crate::error::{Error, shown};

/// Errors of one file that are shown at once.
pub(super) const MOST_SHOWN: usize = 20;

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
            Yaml::Eof { .. } => say("the case ends unexpectedly".into()),
            Yaml::MultipleDocuments { .. } => say("a second document begins here, but a case file holds \
                                                   only one case"
                .into()),
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
                say(format!("the case is nested or aliased too deeply: {}", bare(error)))
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
