//! Partitioning: parts by METIS or PT-Scotch, balanced node ownership, local numbering, and distribution of the
//! mesh from rank 0.
//!
//! Rank 0 holds the whole mesh until it is partitioned. Elements are assigned to parts, and
//! nodes to one of the parts that touch them. Every rank receives all elements that touch one of
//! its nodes, so that it assembles its rows without communication. See [`distribute()`].

mod aggregates;
mod contact_graph;
mod distribute;
pub mod exchange;
mod extract;
mod graph;
mod halo;
mod index_map;
mod lists;
mod message;
mod metis;
mod ordering;
mod ownership;
mod ptscotch;
mod quality;
mod report;

pub use aggregates::aggregates;
pub use contact_graph::{Couple, contact_weights};
pub use distribute::distribute;
pub use graph::{ElementWeights, Graph, Pair, Weights};
pub use halo::Halo;
pub use index_map::IndexMap;
pub use metis::partition;
pub use ordering::Ordering;
pub use quality::Quality;
pub use report::Report;

use crate::case::Partitioner;
use crate::error::Result;
use crate::mesh::Mesh;

/// Options for partitioning and numbering a mesh.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// Loads of the elements and ties between them.
    pub weights: Weights,
    /// The library that partitions, on all ranks.
    pub partitioner: Partitioner,
    /// Order of the nodes of one rank.
    pub ordering: Ordering,
    /// Number of nodes at the end of the mesh that belong to no element. Rank 0 owns them.
    pub loose_nodes: usize,
}

impl Plan {
    /// A plan that keeps elements together that may touch, and balances contact. Without couples it
    /// is the default plan.
    ///
    /// `mesh` is present on rank 0 only, and so is the content of the plan. Rigid targets need no
    /// couple. They tie no elements together, and their points are too inexpensive to justify a
    /// second balance, which lengthens the borders.
    ///
    /// # Errors
    /// A set does not exist. The error occurs on rank 0 only; the ranks must agree on it.
    pub fn for_contact<const D: usize>(mesh: Option<&Mesh<D>>, couples: &[Couple<'_>]) -> Result<Self> {
        let weights = mesh.map_or_else(|| Ok(Weights::default()), |mesh| contact_weights(mesh, couples))?;
        Ok(Self { weights, ..Self::default() })
    }
}

/// The part of the mesh on a rank.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalMesh<const D: usize> {
    /// Local numbering:
    ///
    /// - Nodes: owned nodes first, then ghosts by ascending global number.
    /// - Elements: those that touch an owned node first, then the rank's other elements.
    ///
    /// All ties of the owned nodes and all patches of the local elements are local, and so are their nodes.
    ///
    /// Every named set exists on every rank, restricted to its local members. Each set of facets or
    /// elements also exists as a set of points with all its local nodes. This includes nodes that
    /// belong to the set only through an element that is not local.
    pub mesh: Mesh<D>,
    /// Elements `0..assembled` touch an owned node. They are complete, so no row needs
    /// contributions from another rank.
    pub assembled: usize,
    /// For each element whether this rank owns it. Exactly one rank owns each element, for
    /// energies, output and counts.
    pub mine: Vec<bool>,
    /// Global numbers of the nodes.
    pub index: IndexMap,
    /// Number of each local node in the input mesh.
    pub input_node: Vec<u32>,
    /// Number of each local element in the input mesh.
    pub input_element: Vec<u32>,
}
