//! Edges of elements in space.

use super::{ElementKind, Mesh};

/// An edge of one or more elements of a body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edge {
    /// `line2` or `line3`.
    pub kind: ElementKind,
    /// Body of its elements.
    pub body: u16,
    /// Nodes in the order of the kind.
    pub nodes: Vec<u32>,
}

impl<const D: usize> Mesh<D> {
    /// Edges of elements whose nodes are all in the sorted list `nodes`, each once; none in the plane,
    /// where edges are facets. An edge has its elements' order.
    pub fn edges_within(&self, nodes: &[u32]) -> Vec<Edge> {
        if D < 3 {
            return Vec::new();
        }
        let mut found: Vec<([u32; 2], Edge)> = Vec::new();
        let inside = |node: &u32| nodes.binary_search(node).is_ok();
        for (element, &kind) in self.kinds.iter().enumerate() {
            let of_element = self.element_nodes(element);
            // An edge has two nodes in the list, which most elements do not have.
            if of_element.iter().filter(|node| inside(node)).count() < 2 {
                continue;
            }
            for (number, side) in kind.sides().iter().enumerate() {
                let face = kind.side_kind(number);
                for (at, local) in face.sides().iter().enumerate() {
                    let line = face.side_kind(at);
                    let edge = || local.iter().map(|&k| of_element[side[k as usize] as usize]);
                    if !edge().all(|node| inside(&node)) {
                        continue;
                    }
                    let nodes: Vec<u32> = edge().collect();
                    let ends = [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])];
                    found.push((ends, Edge { kind: line, body: self.body[element], nodes }));
                }
            }
        }
        found.sort_by_key(|(ends, _)| *ends);
        found.dedup_by_key(|(ends, _)| *ends);
        found.into_iter().map(|(_, edge)| edge).collect()
    }
}
