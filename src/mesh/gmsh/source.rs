//! Locations of the nodes and elements of a mesh in its file, for messages about errors found after
//! reading.

use super::input::{Encoding, GmshInput};
use super::raw::coordinates;
use crate::error::Error;
use crate::mesh::Mesh;

/// Number of a node or element in the file, and its location.
#[derive(Debug, Clone, Copy)]
pub(super) struct Label {
    pub id: u64,
    pub place: usize,
}

/// Labels of all nodes and elements of a mesh, in the order of the mesh.
#[derive(Debug, Clone, Default)]
pub(super) struct Labels {
    pub nodes: Vec<Label>,
    pub elements: Vec<Label>,
}

/// The file from which a mesh was read.
#[derive(Debug, Clone)]
pub struct GmshFile {
    pub(super) name: String,
    pub(super) bytes: Vec<u8>,
    pub(super) encoding: Encoding,
    pub(super) labels: Labels,
}

impl GmshFile {
    /// Number of a node in the file.
    pub fn node(&self, node: u32) -> u64 {
        self.labels.nodes[node as usize].id
    }

    /// Number of an element in the file.
    pub fn element(&self, element: usize) -> u64 {
        self.labels.elements[element].id
    }

    /// An error that begins with file, line, number and coordinates of a node.
    pub fn error_at_node<const D: usize>(&self, mesh: &Mesh<D>, node: u32, message: &str) -> Error {
        let label = self.labels.nodes[node as usize];
        let place = coordinates(&mesh.points[node as usize]);
        self.error(label, &format!("node {} at {place} {message}", label.id))
    }

    /// An error that begins with file, line, number, kind and middle of an element.
    pub fn error_at_element<const D: usize>(&self, mesh: &Mesh<D>, element: usize, message: &str) -> Error {
        let label = self.labels.elements[element];
        let kind = mesh.kinds[element];
        let place = coordinates(&mesh.element_centre(element));
        self.error(label, &format!("element {} ({kind}) at {place} {message}", label.id))
    }

    fn error(&self, label: Label, message: &str) -> Error {
        let mut input = GmshInput::new(&self.bytes);
        input.encoding = self.encoding;
        input.error_at(label.place, message).within(&self.name)
    }
}
