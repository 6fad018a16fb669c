//! A case as a tree whose every piece knows its file and place, so that a study can change keys before the case is read.

use std::cell::Cell;
use std::fmt;
use std::path::Path;
use std::rc::Rc;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde_saphyr::Spanned;

use super::diagnostics::{Complaint, Source};
use super::place::{At, Named, Place};
use crate::error::Result;

thread_local! {
    /// The file that is being read; a YAML reader does not carry it.
    static FILE: Cell<usize> = const { Cell::new(0) };
}

/// Mappings whose keys are names that the user chose: a path may not make an entry by the way.
const NAMES: [&str; 5] = ["bodies", "obstacles", "contact", "boundary", "output.probes"];

/// A file, by its number in the document, and a place in it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Origin {
    pub file: usize,
    pub place: Place,
}

/// A piece of YAML and where it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// What is written.
    pub tree: Tree,
    origin: Origin,
}

/// What a piece of YAML is.
#[derive(Debug, Clone, PartialEq)]
pub enum Tree {
    /// `null`: nothing.
    Null,
    /// `true` or `false`.
    Truth(bool),
    /// A whole number.
    Whole(i64),
    /// Any other number.
    Number(f64),
    /// A word or a sentence.
    Text(String),
    /// `[a, b]`
    List(Vec<Node>),
    /// `{ a: b }`, in the order of the file.
    Map(Vec<(At<String>, Node)>),
}

impl Node {
    /// Where it is written.
    pub fn place(&self) -> Place {
        self.origin.place
    }

    /// A short name for people and folders: the scalar itself, the entries of a list joined by `x`.
    pub fn label(&self) -> String {
        match &self.tree {
            Tree::Null => "none".into(),
            Tree::Truth(truth) => truth.to_string(),
            Tree::Whole(number) => number.to_string(),
            Tree::Number(number) if (1e-3..1e6).contains(&number.abs()) => number.to_string(),
            Tree::Number(number) => format!("{number:e}"),
            Tree::Text(text) => text.clone(),
            Tree::List(entries) => entries.iter().map(Self::label).collect::<Vec<_>>().join("x"),
            Tree::Map(entries) => {
                let entry = |(key, node): &(At<String>, Self)| format!("{} {}", key.value, node.label());
                entries.iter().map(entry).collect::<Vec<_>>().join(" ")
            }
        }
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let spanned = Spanned::<Tree>::deserialize(deserializer)?;
        let origin = Origin { file: FILE.get(), place: spanned.referenced.into() };
        Ok(Self { tree: spanned.value, origin })
    }
}

impl JsonSchema for Node {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Value".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        true.into()
    }
}

impl<'de> Deserialize<'de> for Tree {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(AnyTree)
    }
}

struct AnyTree;

impl<'de> Visitor<'de> for AnyTree {
    type Value = Tree;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a value")
    }
    fn visit_unit<E>(self) -> std::result::Result<Tree, E> {
        Ok(Tree::Null)
    }
    fn visit_none<E>(self) -> std::result::Result<Tree, E> {
        Ok(Tree::Null)
    }
    fn visit_some<D: Deserializer<'de>>(self, inner: D) -> std::result::Result<Tree, D::Error> {
        inner.deserialize_any(self)
    }
    fn visit_bool<E>(self, truth: bool) -> std::result::Result<Tree, E> {
        Ok(Tree::Truth(truth))
    }
    fn visit_i64<E>(self, number: i64) -> std::result::Result<Tree, E> {
        Ok(Tree::Whole(number))
    }
    fn visit_u64<E>(self, number: u64) -> std::result::Result<Tree, E> {
        Ok(i64::try_from(number).map_or(Tree::Number(number as f64), Tree::Whole))
    }
    fn visit_f64<E>(self, number: f64) -> std::result::Result<Tree, E> {
        Ok(Tree::Number(number))
    }
    fn visit_str<E>(self, text: &str) -> std::result::Result<Tree, E> {
        Ok(Tree::Text(text.to_owned()))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> std::result::Result<Tree, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = list.next_element()? {
            entries.push(entry);
        }
        Ok(Tree::List(entries))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Tree, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = map.next_entry()? {
            entries.push(entry);
        }
        Ok(Tree::Map(entries))
    }
}

/// Reads YAML whose nodes belong to the file of that number.
pub(crate) fn read_as<T: serde::de::DeserializeOwned>(file: usize, source: &Source) -> Result<T> {
    FILE.set(file);
    let options = serde_saphyr::options! { strict_booleans: true };
    let read = serde_saphyr::from_str_with_options(&source.text, options);
    FILE.set(0);
    read.map_err(|error| source.yaml_error(&error))
}

/// The case that a study starts from, before it is read as a case.
#[derive(Debug, Clone)]
pub struct Document {
    root: Node,
    files: Rc<[Source; 2]>,
}

/// Where each line of a text that a document wrote comes from.
#[derive(Debug, Clone)]
pub(super) struct Origins {
    files: Rc<[Source; 2]>,
    lines: Vec<Origin>,
}

impl Origins {
    /// The file that a complaint about the written text is meant for, and the complaint there.
    pub(super) fn translate(&self, complaint: &Complaint) -> Option<(&Source, Complaint)> {
        let origin = self.lines.get(complaint.place.line.checked_sub(1)?)?;
        Some((&self.files[origin.file], complaint.clone().at(origin.place)))
    }
}

impl Document {
    /// Reads the text of a case as a tree; `overrides` is the file whose values are put in later.
    ///
    /// # Errors
    /// The text is no YAML.
    pub fn read(text: &str, path: &Path, overrides: Source) -> Result<Self> {
        let source = Source::new(text, path);
        let root = read_as(0, &source)?;
        Ok(Self { root, files: Rc::new([source, overrides]) })
    }

    /// Puts values at paths such as `contact.sole.normal.penalty.compliance` or `bodies.block.mesh.box.cells[0]`; `null`
    /// takes a key away.
    ///
    /// # Errors
    /// A path leads through what is no mapping or list, or by a name that the case has not; told with its place.
    pub fn put(&mut self, overrides: &Named<Node>) -> Result<()> {
        for (path, value) in overrides.iter() {
            put(&mut self.root, path, value).map_err(|complaint| self.files[1].error(&complaint))?;
        }
        Ok(())
    }

    /// The text of the case as it stands now, a token a line, with the origin of each line.
    pub(super) fn write(&self) -> (Source, Rc<Origins>) {
        let mut writer = Writer::default();
        writer.node(&self.root);
        let own = &self.files[0];
        let text = Source {
            name: own.name.clone(),
            text: writer.text,
            directory: own.directory.clone(),
            origins: None,
        };
        (text, Rc::new(Origins { files: Rc::clone(&self.files), lines: writer.lines }))
    }
}

#[derive(Default)]
struct Writer {
    text: String,
    lines: Vec<Origin>,
}

impl Writer {
    fn line(&mut self, token: &str, origin: Origin) {
        self.text.push(' ');
        self.text.push_str(token);
        self.text.push('\n');
        self.lines.push(origin);
    }

    fn node(&mut self, node: &Node) {
        let origin = node.origin;
        match &node.tree {
            Tree::Null => self.line("null", origin),
            Tree::Truth(truth) => self.line(&truth.to_string(), origin),
            Tree::Whole(number) => self.line(&number.to_string(), origin),
            Tree::Number(number) => self.line(&number_text(*number), origin),
            Tree::Text(text) => self.line(&quoted(text), origin),
            Tree::List(entries) => {
                self.line("[", origin);
                for entry in entries {
                    self.node(entry);
                    self.line(",", entry.origin);
                }
                self.line("]", origin);
            }
            Tree::Map(entries) => {
                self.line("{", origin);
                for (key, value) in entries {
                    // A key stands in the file of its value, whoever made the mapping around it.
                    let file = value.origin.file;
                    self.line(&format!("{}:", quoted(&key.value)), Origin { file, place: key.place });
                    self.node(value);
                    self.line(",", value.origin);
                }
                self.line("}", origin);
            }
        }
    }
}

/// A text between quotes; YAML knows the escapes of JSON.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn number_text(number: f64) -> String {
    match number {
        n if n.is_nan() => ".nan".into(),
        n if n.is_infinite() => if n > 0.0 { ".inf" } else { "-.inf" }.into(),
        n => format!("{n:?}"),
    }
}

/// A step of a path: a key or a position, with its first character within the path.
#[derive(Debug, Clone, PartialEq)]
enum Step {
    Key(String, usize),
    Entry(usize, usize),
}

fn steps(path: &At<String>) -> std::result::Result<Vec<Step>, Complaint> {
    let wrong = |offset: usize, message: String| {
        Err(Complaint::new(message)
            .at(path.place)
            .offset(offset)
            .hint("a path is `key.key[0].key`, as in bodies.block.mesh.box.cells[0]"))
    };
    let mut steps = Vec::new();
    let mut offset = 0;
    for part in path.value.split('.') {
        let (key, rest) = part.find('[').map_or((part, ""), |at| part.split_at(at));
        if key.is_empty() {
            return wrong(offset, format!("a key is missing in the path '{}'", path.value));
        }
        steps.push(Step::Key(key.to_owned(), offset));
        let mut inner = offset + key.chars().count();
        for entry in rest.split_inclusive(']').filter(|entry| !entry.is_empty()) {
            let number =
                entry.strip_prefix('[').and_then(|e| e.strip_suffix(']')).and_then(|e| e.parse().ok());
            let Some(number) = number else {
                return wrong(inner, format!("'{entry}' is no position in a list"));
            };
            steps.push(Step::Entry(number, inner));
            inner += entry.chars().count();
        }
        offset += part.chars().count() + 1;
    }
    Ok(steps)
}

fn put(root: &mut Node, path: &At<String>, value: &Node) -> std::result::Result<(), Complaint> {
    let steps = steps(path)?;
    let takes_away = value.tree == Tree::Null;
    let mut node = root;
    let mut so_far = String::new();
    for (index, step) in steps.iter().enumerate() {
        let is_last = index + 1 == steps.len();
        let at = |offset: usize, length: usize| Origin {
            file: value.origin.file,
            place: Place { column: path.place.column + offset + quotes(path), length, ..path.place },
        };
        node = match step {
            Step::Key(key, offset) => {
                let origin = at(*offset, key.chars().count());
                let entry = Entry { key, parent: &so_far, origin, is_last };
                if is_last && takes_away {
                    return entry.take_away(node);
                }
                let inner = entry.find(node)?;
                so_far = if so_far.is_empty() { key.clone() } else { format!("{so_far}.{key}") };
                inner
            }
            Step::Entry(position, offset) => {
                let place = at(*offset, 1).place;
                so_far.push_str(&format!("[{position}]"));
                let Tree::List(entries) = &mut node.tree else {
                    return Err(Complaint::new(format!("'{so_far}': this is no list in the case")).at(place));
                };
                let count = entries.len();
                entries.get_mut(*position).ok_or_else(|| {
                    let message = format!("'{so_far}': the list in the case has {count} entries");
                    Complaint::new(message).at(place).hint("the first entry is [0]")
                })?
            }
        };
    }
    *node = value.clone();
    Ok(())
}

/// A key on the way of a path.
struct Entry<'a> {
    key: &'a str,
    /// The path before it.
    parent: &'a str,
    origin: Origin,
    is_last: bool,
}

impl Entry<'_> {
    /// The node under the key, made where the case leaves it to a default.
    fn find<'n>(&self, node: &'n mut Node) -> std::result::Result<&'n mut Node, Complaint> {
        let entries = self.entries(node)?;
        let at = match entries.iter().position(|(name, _)| name.value == self.key) {
            Some(found) => found,
            None if !self.is_last && NAMES.contains(&self.parent) => {
                let noun = format!("name under {}", self.parent);
                return Err(self.unknown(&noun, entries));
            }
            None => {
                let key = At { value: self.key.to_owned(), place: self.origin.place };
                entries.push((key, Node { tree: Tree::Map(Vec::new()), origin: self.origin }));
                entries.len() - 1
            }
        };
        let (key, inner) = &mut entries[at];
        if self.is_last {
            key.place = self.origin.place;
        }
        Ok(inner)
    }

    fn take_away(&self, node: &mut Node) -> std::result::Result<(), Complaint> {
        let entries = self.entries(node)?;
        let before = entries.len();
        entries.retain(|(name, _)| name.value != self.key);
        if entries.len() == before { Err(self.unknown("key to take away", entries)) } else { Ok(()) }
    }

    fn entries<'n>(
        &self,
        node: &'n mut Node,
    ) -> std::result::Result<&'n mut Vec<(At<String>, Node)>, Complaint> {
        if node.tree == Tree::Null {
            node.tree = Tree::Map(Vec::new());
        }
        let label = node.label();
        match &mut node.tree {
            Tree::Map(entries) => Ok(entries),
            _ => Err(no_mapping(self.parent, self.key, &label).at(self.origin.place)),
        }
    }

    fn unknown(&self, noun: &str, entries: &[(At<String>, Node)]) -> Complaint {
        let names = entries.iter().map(|(name, _)| name.value.as_str());
        Complaint::unknown(noun, self.key, names).at(self.origin.place)
    }
}

/// A quoted path begins a character later than its place.
fn quotes(path: &At<String>) -> usize {
    usize::from(path.place.length == path.value.chars().count() + 2)
}

fn no_mapping(parent: &str, key: &str, label: &str) -> Complaint {
    Complaint::new(format!("'{parent}' is '{label}' in the case, no mapping with '{key}'"))
        .hint(format!("set the whole of it, as in `{parent}: {{ {key}: ... }}`"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    const CASE: &str = "dimension: 2\nbodies:\n  block:\n    mesh: { box: { min: [0, 0], max: [1, 1], cells: [2, 2] } }\n    \
        material: { neo_hookean: { young_modulus: \"5 MPa\", poisson_ratio: 0.3 } }\n    density: 1.7e3\nboundary:\n  \
        clamp: { on: block.top, displacement: { x: \"1.0 * t\", y: -0.05 } }\ntime: { end: 0.01, step: 1.0e-3 }\n";

    fn changed(overrides: &str) -> Result<Case> {
        let source = Source::new(overrides, Path::new("study.yml"));
        let overrides: Named<Node> = read_as(1, &source)?;
        let mut document = Document::read(CASE, Path::new("folder/case.yml"), source)?;
        document.put(&overrides)?;
        Case::from_document(&document)
    }

    /// Without changes the case is the same as read directly, to the last bit; with them it is the one that says so.
    #[test]
    fn overrides_are_as_if_written() {
        let plain = Case::parse(CASE, "folder/case.yml").unwrap();
        assert_eq!(
            changed("{}").unwrap().to_json().unwrap().to_string(),
            plain.to_json().unwrap().to_string()
        );
        let case = changed(
            "time.step: 0.5 ms\nbodies.block.mesh.box.cells[1]: 7\nsolver.newton.max_iterations: 9\n\"time.scheme\": \
             midpoint\nbodies.block.mesh.box.element: quad9\n",
        );
        let text = CASE
            .replace("step: 1.0e-3", "step: 5.0e-4, scheme: midpoint")
            .replace("cells: [2, 2]", "cells: [2, 7], element: quad9")
            + "solver: { newton: { max_iterations: 9 } }\n";
        let direct = Case::parse(&text, "case.yml").unwrap();
        let case = case.unwrap();
        assert_eq!(case, direct);
        assert_eq!(case.digest().unwrap(), direct.digest().unwrap());
        assert_ne!(case.digest().unwrap(), plain.digest().unwrap());
        assert_eq!(case.resolve("a.msh"), Path::new("folder/a.msh"));
    }

    /// `null` takes a key away, so that its default stands.
    #[test]
    fn null_takes_away() {
        let case =
            changed("bodies.block.density: 2\ntime.end: 1\nbodies.block.mesh.box.cells: [1, 1]\n").unwrap();
        assert_eq!(case.time.end.si, 1.0);
        let text = changed("time.step: null").unwrap_err().message;
        assert!(text.contains("'step'"), "{text}");
        let text = changed("time.stepp: null").unwrap_err().message;
        assert!(text.contains("did you mean 'step'") && text.contains("study.yml:1:6"), "{text}");
    }

    /// What is wrong is told where the user wrote it: overrides in the study, the rest in the case; with the nearest key.
    #[test]
    fn errors_point_into_the_right_file() {
        for (overrides, place, words) in [
            ("time.stepp: 1", "study.yml:1:6", "did you mean 'step'"),
            ("\ntime.step: -1", "study.yml:2:12", "step"),
            ("a: 1\n", "study.yml:1:1", "unknown key 'a'"),
            ("bodies.blok.density: 1", "study.yml:1:8", "did you mean 'block'"),
            ("dimension.x: 1", "study.yml:1:11", "'dimension' is '2'"),
            ("bodies.block.mesh.box.cells[2]: 1", "study.yml:1:28", "2 entries"),
            ("bodies.block.density[0]: 1", "study.yml:1:21", "no list"),
            ("bodies..density: 1", "study.yml:1:8", "a key is missing"),
            ("bodies.block.mesh.box.cells[x]: 1", "study.yml:1:28", "no position"),
            ("boundary.clamp.on: blok.top", "study.yml:1:20", "blok"),
            ("bodies.block.mesh.box.element: quad7", "study.yml:1:32", "quad7"),
            ("bodies: { b: 1 }", "study.yml:1:14", "expected"),
        ] {
            let text = changed(overrides).map(|_| "read".to_owned()).unwrap_or_else(|e| e.message);
            assert!(text.contains(place) && text.contains(words), "{overrides}: {text}");
        }
        let broken = CASE.replace("density", "densty");
        let document =
            Document::read(&broken, Path::new("case.yml"), Source::new("", Path::new("study.yml"))).unwrap();
        let text = Case::from_document(&document).unwrap_err().message;
        assert!(text.contains("case.yml:6:5") && text.contains("did you mean 'density'"), "{text}");
        assert!(text.contains("densty: 1.7e3"), "the line itself: {text}");
    }
}
