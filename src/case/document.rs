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
use super::path::put;
use super::place::{At, Named, Place};
use crate::error::Result;

thread_local! {
    /// The file that is being read; a YAML reader does not carry it.
    static FILE: Cell<usize> = const { Cell::new(0) };
}

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
    pub(super) origin: Origin,
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

    /// Whether there is such a key at the top.
    pub fn has(&self, key: &str) -> bool {
        matches!(&self.root.tree, Tree::Map(entries) if entries.iter().any(|(name, _)| name.value == key))
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
