//! Node numbering of contacts: the rank's own nodes, its ghosts, then *foreign* nodes of targets on
//! other ranks.

use crate::partition::IndexMap;

/// Numbers of the nodes in field arrays of contacts.
#[derive(Debug, Clone, Copy)]
pub struct Numbering<'a> {
    /// Owned nodes and ghosts.
    pub index: &'a IndexMap,
    /// Global numbers of the foreign nodes, in ascending order.
    pub foreign: &'a [i32],
}

impl Numbering<'_> {
    /// Total number of nodes.
    pub fn count(&self) -> usize {
        self.index.local_count() + self.foreign.len()
    }

    /// Whether this rank owns the node's rows.
    pub fn is_owned(&self, node: u32) -> bool {
        (node as usize) < self.index.owned
    }

    /// Number of the node with this global number, which is among the nodes.
    pub fn node(&self, global: i32) -> u32 {
        let foreign = || self.index.local_count() + self.foreign.partition_point(|&other| other < global);
        self.index.local(global).unwrap_or_else(|| foreign() as u32)
    }

    /// Global number of a node.
    pub fn global(&self, node: u32) -> i32 {
        match (node as usize).checked_sub(self.index.local_count()) {
            Some(foreign) => self.foreign[foreign],
            None => self.index.global(node),
        }
    }
}
