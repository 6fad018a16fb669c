//! Reader of meshes in input files of Abaqus and CalculiX.
//!
//! Element sets become regions (element sets), surfaces of element faces become facet sets, node
//! sets and surfaces of nodes become point sets. Materials, steps and everything else that is not
//! the mesh is skipped, and a remark lists it.

mod build;
mod content;
mod lines;
mod names;
mod sets;
mod types;

use std::io::Read;
use std::path::Path;

use super::source::{Labels, MeshFile, Places, unreadable};
use super::{Mesh, PlaneState};
use crate::error::{Error, Result};
use crate::files;
use lines::{Deck, whole};

/// The first keyword is within this number of bytes.
const HEAD: u64 = 4096;

/// Reads a mesh of `D` dimensions, with the locations of its nodes and elements in the file. With
/// `region`, only the elements of this element set and their nodes are kept. Plane elements must be of the
/// state `plane`.
///
/// # Errors
/// - The file cannot be read, or is not an input file.
/// - The element set does not exist.
/// - An element is unknown, of another state across the plane, incomplete, inverted or degenerate.
/// - A set or surface refers to a node, element or set that does not exist.
/// - A face of a surface is inside the mesh.
/// - The file has several parts or instances, or an instance that is moved.
pub fn read_with_source<const D: usize>(
    path: &Path,
    region: Option<&str>,
    plane: PlaneState,
) -> Result<(Mesh<D>, MeshFile)> {
    let name = path.display().to_string();
    let unreadable = |e| unreadable(&name, &e);
    // A file that is not an input file is not read further, regardless of its length.
    let mut head = Vec::new();
    files::open(path).map_err(unreadable)?.take(HEAD).read_to_end(&mut head).map_err(unreadable)?;
    if !is_input(&head) {
        let message = "this is not an input file of Abaqus or CalculiX: it does not begin with a keyword, such as *NODE";
        return Err(Error::file(message).within(&name));
    }
    let bytes = whole(path).map_err(unreadable)?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut deck = Deck::new(&name, bytes, Some(folder));
    deck.visited(path);
    let Parsed { mesh, labels, remarks } = labelled(&mut deck, region, plane)?;
    Ok((mesh, MeshFile { places: Places::Lines(deck.segments), labels, remarks }))
}

/// Reads the mesh from the bytes of a file for plane strain, see [`read_with_source`]. Other files
/// cannot be included.
///
/// # Errors
/// The errors of [`read_with_source`], with a line and without the name of the file.
pub fn parse<const D: usize>(bytes: &[u8], region: Option<&str>) -> Result<Mesh<D>> {
    let mut deck = Deck::new("", bytes.to_vec(), None);
    labelled(&mut deck, region, PlaneState::Strain).map(|parsed| parsed.mesh)
}

/// Whether a file begins like an input file: with a keyword or a comment.
pub(super) fn is_input(head: &[u8]) -> bool {
    head.trim_ascii_start().first() == Some(&b'*')
}

struct Parsed<const D: usize> {
    mesh: Mesh<D>,
    labels: Labels,
    remarks: Vec<String>,
}

fn labelled<const D: usize>(deck: &mut Deck, region: Option<&str>, plane: PlaneState) -> Result<Parsed<D>> {
    let content = content::read(deck, D, plane)?;
    let (mesh, labels, remarks) = build::mesh(deck, &content, region)?;
    Ok(Parsed { mesh, labels, remarks })
}

#[cfg(test)]
mod tests;
