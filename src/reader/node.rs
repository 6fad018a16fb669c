//! A file of YAML as a tree whose every piece knows its place.

use std::cell::Cell;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_saphyr::{Location, Spanned};

use super::at::At;
use super::context::NODE;
use super::place::Place;

thread_local! {
    /// The file that is being read; a YAML reader does not carry it.
    static FILE: Cell<usize> = const { Cell::new(0) };
    /// A node that is kept as it is, on its way through serde.
    static KEPT: Cell<Option<Node>> = const { Cell::new(None) };
}

/// Hands a node to the value that asked for it by [`NODE`].
pub(super) fn keep_node(node: &Node) {
    KEPT.set(Some(node.clone()));
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
                KEPT.take().ok_or_else(|| D::Error::custom("a node is read from a tree alone"))
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

/// The tree of a text that has that number among the files of a document.
///
/// # Errors
/// The text is no YAML.
pub(super) fn parse(file: usize, text: &str) -> std::result::Result<Node, serde_saphyr::Error> {
    FILE.set(file);
    let options = serde_saphyr::options! { strict_booleans: true };
    let read = serde_saphyr::from_str_with_options(text, options);
    FILE.set(0);
    read.map(|Written(root)| root)
}
