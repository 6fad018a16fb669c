//! Nodes as contacts see them: the rank's own, its ghosts, then *foreign* nodes of targets on other
//! ranks.

use crate::partition::IndexMap;

/// Numbers of the nodes that field arrays of contacts hold.
#[derive(Debug, Clone, Copy)]
pub struct Numbering<'a> {
    /// Owned nodes and ghosts.
    pub index: &'a IndexMap,
    /// Global numbers of the foreign nodes, ascending.
    pub foreign: &'a [i32],
}

impl Numbering<'_> {
    /// Nodes in all.
    pub fn count(&self) -> usize {
        self.index.local_count() + self.foreign.len()
    }

    /// Whether the node's rows are this rank's.
    pub fn is_owned(&self, node: u32) -> bool {
        (node as usize) < self.index.owned
    }

    /// Global number of a node.
    pub fn global(&self, node: u32) -> i32 {
        match (node as usize).checked_sub(self.index.local_count()) {
            Some(foreign) => self.foreign[foreign],
            None => self.index.global(node),
        }
    }
}
