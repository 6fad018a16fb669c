//! A file of YAML as a tree whose every piece knows its place: what cases and studies are read from, and what a study
//! changes keys in before its case is read.

use std::cell::Cell;
use std::fmt;
use std::path::Path;
use std::rc::Rc;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde::de::{DeserializeOwned, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_saphyr::{Location, Spanned};

use super::diagnostics::{Complaint, Source};
use super::path::put;
use super::place::{At, Named, Place};
use super::recovery::{read_checked, units_of};
use super::tree::{NODE, kept_node};
use super::units::Units;
use crate::error::Result;

thread_local! {
    /// The file that is being read; a YAML reader does not carry it.
    static FILE: Cell<usize> = const { Cell::new(0) };
}

/// A piece of YAML and where it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// What is written.
    pub tree: Tree,
    /// Where it is written.
    pub place: Place,
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
    /// Stands for what could not be read, so that the rest can be; where a number is wanted it is this one.
    Anything(f64),
}

impl Node {
    /// A short name for people and folders: the scalar itself, the entries of a list joined by `x`.
    pub fn label(&self) -> String {
        match &self.tree {
            Tree::Null => "none".into(),
            Tree::Anything(_) => "anything".into(),
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

/// A value that is kept as it is written, such as one that a study sets.
impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Kept;
        impl<'de> Visitor<'de> for Kept {
            type Value = Node;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a value")
            }
            fn visit_newtype_struct<D: Deserializer<'de>>(self, _: D) -> std::result::Result<Node, D::Error> {
                kept_node().ok_or_else(|| D::Error::custom("a node is read from a tree alone"))
            }
        }
        deserializer.deserialize_newtype_struct(NODE, Kept)
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

/// A node as the YAML reader hands it over.
struct Written(Node);

impl<'de> Deserialize<'de> for Written {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let spanned = Spanned::<Tree>::deserialize(deserializer)?;
        Ok(Self(Node { tree: spanned.value, place: here(spanned.referenced) }))
    }
}

/// A place in the file that is being read.
fn here(location: Location) -> Place {
    Place { file: FILE.get(), ..location.into() }
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
        while let Some(Written(entry)) = list.next_element()? {
            entries.push(entry);
        }
        Ok(Tree::List(entries))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Tree, A::Error> {
        let mut entries = Vec::new();
        while let Some((key, Written(value))) = map.next_entry::<Spanned<String>, _>()? {
            entries.push((At { value: key.value, place: here(key.referenced) }, value));
        }
        Ok(Tree::Map(entries))
    }
}

/// The tree of a file that has that number among the files of a document.
fn tree_of(file: usize, source: &Source) -> Result<Node> {
    FILE.set(file);
    let options = serde_saphyr::options! { strict_booleans: true };
    let read = serde_saphyr::from_str_with_options(&source.text, options);
    FILE.set(0);
    let Written(root) = read.map_err(|error| source.yaml_error(&error))?;
    if root.tree == Tree::Null { Err(source.nothing()) } else { Ok(root) }
}

/// Reads YAML whose nodes belong to the file of that number and whose plain numbers are in `units`, or in those that it
/// names, and checks it.
///
/// # Errors
/// All that is wrong, as [`read_checked`].
pub(crate) fn read_as<T: DeserializeOwned>(
    file: usize,
    source: &Source,
    units: Option<Units>,
    check: impl Fn(&T) -> Vec<Complaint>,
) -> Result<T> {
    let root = tree_of(file, source)?;
    read_checked(&root, source, units.unwrap_or_else(|| units_of(&root)), check)
}

/// The case that a study starts from, before it is read as a case.
#[derive(Debug, Clone)]
pub struct Document {
    root: Node,
    source: Source,
}

impl Document {
    /// Reads the text of a case as a tree; `overrides` is the file whose values are put in later.
    ///
    /// # Errors
    /// The text is no YAML.
    pub fn read(text: &str, path: &Path, overrides: Source) -> Result<Self> {
        let source = Source { overrides: Some(Rc::new(overrides)), ..Source::new(text, path) };
        Ok(Self { root: tree_of(0, &source)?, source })
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
            if path.split(['.', '[']).next() == Some("units") {
                let complaint = Complaint::new("members of a study have the units of its case".into());
                let complaint = complaint.at(path.place).hint("write other units into the case itself");
                return Err(self.source.error(&complaint));
            }
            put(&mut self.root, path, value).map_err(|complaint| self.source.error(&complaint))?;
        }
        Ok(())
    }

    /// The document as what it means, checked.
    pub(super) fn read_as<T: DeserializeOwned>(&self, check: impl Fn(&T) -> Vec<Complaint>) -> Result<T> {
        read_checked(&self.root, &self.source, self.units(), check)
    }

    /// The units of the case.
    pub fn units(&self) -> Units {
        units_of(&self.root)
    }

    /// Its files.
    pub(super) fn source(&self) -> &Source {
        &self.source
    }
}
