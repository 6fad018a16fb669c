//! Content common to both formats: numbered nodes, numbered elements with their physical groups,
//! and names of groups.

use std::collections::{BTreeMap, HashMap};

use super::input::GmshInput;
use crate::error::{Error, Result};
use crate::mesh::ElementKind;
use crate::mesh::numbering::{FileNumbers, MAX_NODES};

/// Point element of MSH files.
const POINT: i32 = 15;

/// Content of a file, with the numbers used in the file.
#[derive(Default)]
pub(super) struct Raw {
    nodes: FileNumbers,
    pub points: Vec<[f64; 3]>,
    /// Location of each node in the file.
    pub node_places: Vec<usize>,
    pub elements: Vec<RawElement>,
    /// Node numbers of all elements, in Gmsh's order.
    pub element_nodes: Vec<u64>,
    /// Distinct lists of physical tags.
    groups: Vec<Vec<u32>>,
    group_index: HashMap<Vec<u32>, u32>,
    /// Names by dimension and physical tag.
    pub names: BTreeMap<(usize, u32), String>,
}

/// One element, or point, of any dimension.
pub(super) struct RawElement {
    pub id: u64,
    /// `None` for a point.
    pub kind: Option<ElementKind>,
    groups: u32,
    first: usize,
    /// Location in the file.
    pub place: usize,
}

impl RawElement {
    pub fn dimension(&self) -> usize {
        self.kind.map_or(0, ElementKind::dimension)
    }
}

impl Raw {
    /// An error at an element, which is named by number and kind with its location in the file.
    pub fn error(&self, input: &GmshInput, element: &RawElement, message: impl AsRef<str>) -> Error {
        let kind = element.kind.map_or("point", ElementKind::name);
        input.error_at(element.place, format!("element {} ({kind}) {}", element.id, message.as_ref()))
    }

    /// Indices of an element's nodes, in Gmsh's order.
    pub fn resolve(&self, input: &GmshInput, element: &RawElement) -> Result<Vec<u32>> {
        let ids =
            &self.element_nodes[element.first..element.first + element.kind.map_or(1, ElementKind::nodes)];
        let mut nodes = Vec::with_capacity(ids.len());
        for &id in ids {
            let Some(node) = self.node(id) else {
                let message = format!("uses node {id}, which is not defined");
                return Err(self
                    .error(input, element, message)
                    .hint("save the mesh again: nodes are missing"));
            };
            if nodes.contains(&node) {
                return Err(self.error(input, element, format!("uses node {id} twice")).hint("mesh again"));
            }
            nodes.push(node);
        }
        Ok(nodes)
    }

    pub fn groups_of(&self, element: &RawElement) -> &[u32] {
        &self.groups[element.groups as usize]
    }

    /// Index of a list of physical tags. Tag 0 means no group, and the sign of a tag is the
    /// orientation.
    pub fn group_list(&mut self, tags: impl IntoIterator<Item = i32>) -> u32 {
        let mut tags: Vec<u32> = tags.into_iter().map(i32::unsigned_abs).filter(|&tag| tag != 0).collect();
        tags.sort_unstable();
        tags.dedup();
        let next = self.groups.len() as u32;
        *self.group_index.entry(tags).or_insert_with_key(|tags| {
            self.groups.push(tags.clone());
            next
        })
    }

    /// Index of a node by its number in the file.
    pub fn node(&self, id: u64) -> Option<u32> {
        self.nodes.index(id)
    }

    /// Number in the file of each node.
    pub fn node_ids(&self) -> &[u64] {
        self.nodes.ids()
    }

    /// Adds the node that was just read from `input`.
    pub fn add_node(&mut self, input: &GmshInput, id: u64, point: [f64; 3]) -> Result<()> {
        for (value, axis) in point.iter().zip(["x", "y", "z"]) {
            if !value.is_finite() {
                return Err(input.error(format!("node {id}: {axis} is {value}, not a finite number")));
            }
        }
        if self.points.len() >= MAX_NODES {
            return Err(input.error(format!("the mesh has more than {MAX_NODES} nodes")));
        }
        if self.node(id).is_some() {
            let message = format!("node {id} is defined twice");
            return Err(input
                .error(message)
                .hint("give each node a unique number; in Gmsh `Save` renumbers the nodes"));
        }
        self.nodes.push(id);
        self.node_places.push(input.place());
        self.points.push(point);
        Ok(())
    }

    /// Adds the element whose number was just read from `input`. The caller then pushes its nodes
    /// to `element_nodes`.
    pub fn add_element(&mut self, input: &GmshInput, id: u64, kind: Option<ElementKind>, groups: u32) {
        let first = self.element_nodes.len();
        self.elements.push(RawElement { id, kind, groups, first, place: input.place() });
    }
}

/// The kind of an MSH element type; `None` is a point. If the type is unknown, the error message
/// begins with `whose`.
pub(super) fn kind_of(
    input: &GmshInput,
    whose: std::fmt::Arguments,
    code: i32,
) -> Result<Option<ElementKind>> {
    if code == POINT {
        return Ok(None);
    }
    if let Some(kind) = ElementKind::from_gmsh(code) {
        return Ok(Some(kind));
    }
    let name = match code {
        13 | 18 => " (a prism of second order)",
        14 | 19 => " (a pyramid of second order)",
        20..=25 => " (a triangle of third or higher order)",
        26..=28 => " (a line of third or higher order)",
        29..=31 => " (a tetrahedron of third or higher order)",
        36..=38 => " (a quadrilateral of third or higher order)",
        92..=98 => " (a hexahedron of third or higher order)",
        _ => "",
    };
    let known = ElementKind::ALL.map(ElementKind::name).join(", ");
    let message = format!("{whose}: unknown type {code}{name}");
    Err(input.error(message).hint(&format!("known: {known}; `-order 1` or `-order 2` sets Gmsh's order")))
}
