//! A case before it is read as one: a study changes keys in it.

use std::path::Path;
use std::rc::Rc;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::at::Named;
use super::complaint::Complaint;
use super::node::{Node, Tree, parse};
use super::path::put;
use super::recovery::{read_checked, units_of};
use super::source::Source;
use super::units::Units;
use crate::error::Result;

/// The tree of a file that has that number among the files of a document.
fn tree_of(file: usize, source: &Source) -> Result<Node> {
    let root = parse(file, &source.text).map_err(|error| source.yaml_error(&error))?;
    if root.tree == Tree::Null { Err(source.nothing()) } else { Ok(root) }
}

/// Reads YAML whose nodes belong to the file of that number and whose plain numbers are in `units`, or in those that it
/// names, and checks it.
///
/// # Errors
/// All that is wrong, in the order of the file.
pub fn read_as<T: DeserializeOwned + JsonSchema>(
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
    /// A path leads through a value that is neither a mapping nor a list, or names a key that the case does not have.
    /// The error has the place of the path.
    pub fn put(&mut self, overrides: &Named<Node>) -> Result<()> {
        for (path, value) in overrides.iter() {
            if path.split(['.', '[']).next() == Some("units") {
                let complaint = Complaint::new("members of a study have the units of its case".into());
                let complaint = complaint.at(path.place).hint("change the units in the case file");
                return Err(self.source.error(&complaint));
            }
            put(&mut self.root, path, value).map_err(|complaint| self.source.error(&complaint))?;
        }
        Ok(())
    }

    /// Reads the document as typed data and checks it.
    pub fn read_as<T: DeserializeOwned + JsonSchema>(
        &self,
        check: impl Fn(&T) -> Vec<Complaint>,
    ) -> Result<T> {
        read_checked(&self.root, &self.source, self.units(), check)
    }

    /// The units of the case.
    pub fn units(&self) -> Units {
        units_of(&self.root)
    }

    /// Its files.
    pub fn source(&self) -> &Source {
        &self.source
    }
}
