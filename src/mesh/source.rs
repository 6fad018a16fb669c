//! Locations of the nodes and elements of a mesh in its file, for messages about errors found after
//! reading.

use std::io::ErrorKind;

use super::Mesh;
use super::spelling::coordinates;
use crate::error::Error;

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

/// The meaning of a location.
#[derive(Debug, Clone)]
pub(super) enum Places {
    /// An offset in the bytes of a file.
    Bytes { file: String, bytes: Vec<u8>, is_text: bool },
    /// A line of a file that may include others.
    Lines(Segments),
}

/// Lines of several files in the order in which they were read.
///
/// Location `k` is the line read as number `k`, counted from zero over all files.
#[derive(Debug, Clone, Default)]
pub(super) struct Segments(Vec<Segment>);

/// Lines of one file that were read one after another.
#[derive(Debug, Clone)]
struct Segment {
    /// Location of the first line.
    place: usize,
    file: String,
    /// Number of the first line in its file.
    line: usize,
}

impl Segments {
    /// From location `place` on, lines come from `file`, beginning with line `line`.
    pub fn begin(&mut self, place: usize, file: &str, line: usize) {
        self.0.push(Segment { place, file: file.to_owned(), line });
    }

    /// An error that begins with the first file.
    pub fn error_in_file(&self, message: &str) -> Error {
        let error = Error::file(message);
        match self.0.first() {
            Some(first) if !first.file.is_empty() => error.within(&first.file),
            _ => error,
        }
    }

    /// Number of a line in its file.
    pub fn line(&self, place: usize) -> usize {
        let next = self.0.partition_point(|segment| segment.place <= place);
        let segment = next.checked_sub(1).and_then(|index| self.0.get(index));
        segment.map_or(place + 1, |segment| segment.line + (place - segment.place))
    }

    /// An error that begins with file and line.
    pub fn error(&self, place: usize, message: &str) -> Error {
        let next = self.0.partition_point(|segment| segment.place <= place);
        let error = Error::file(message);
        match next.checked_sub(1).and_then(|index| self.0.get(index)) {
            Some(segment) => {
                let line = format!("line {}", self.line(place));
                let error = error.within(&line);
                if segment.file.is_empty() { error } else { error.within(&segment.file) }
            }
            None => error,
        }
    }
}

/// An error at an offset: a line of a text file, a byte of a binary one.
pub(super) fn error_in_bytes(bytes: &[u8], is_text: bool, place: usize, message: &str) -> Error {
    let context = if is_text {
        let before = &bytes[..place.min(bytes.len())];
        format!("line {}", before.iter().filter(|&&byte| byte == b'\n').count() + 1)
    } else {
        format!("byte {place}")
    };
    Error::file(message).within(&context)
}

/// The file from which a mesh was read.
#[derive(Debug, Clone)]
pub struct MeshFile {
    pub(super) places: Places,
    pub(super) labels: Labels,
    pub(super) remarks: Vec<String>,
}

impl MeshFile {
    /// Remarks for the user: what was left out of the mesh, or read as something else.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

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
        match &self.places {
            Places::Bytes { file, bytes, is_text } => {
                error_in_bytes(bytes, *is_text, label.place, message).within(file)
            }
            Places::Lines(segments) => segments.error(label.place, message),
        }
    }
}

/// The error of a mesh file that the system does not let the program read.
pub(super) fn unreadable(name: &str, cause: &std::io::Error) -> Error {
    let error = Error::file(format!("the mesh can not be read: {cause}"));
    let error = match cause.kind() {
        ErrorKind::IsADirectory => error.hint("name a file in this folder"),
        ErrorKind::NotFound => error.hint("paths of meshes are relative to the folder of the case file"),
        _ => error,
    };
    error.within(name)
}
