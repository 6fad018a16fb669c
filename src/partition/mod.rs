//! Who owns what: METIS parts, balanced node ownership, local numbering, and the journey of the mesh from rank 0.
//!
//! Rank 0 holds the whole mesh for as long as it takes to cut it up. Elements go to METIS parts; nodes go to one of the
//! parts that touch them; every rank receives all elements that touch one of its nodes, so that it assembles its rows
//! without a word from others. See [`distribute()`].

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
mod quality;
mod report;

pub use contact_graph::{Couple, contact_weights};
pub use distribute::distribute;
pub use graph::{ElementWeights, Graph, Pair, Weights};
pub use halo::Halo;
pub use index_map::IndexMap;
pub use metis::partition;
pub use ordering::Ordering;
pub use quality::Quality;
pub use report::Report;

use crate::error::Result;
use crate::mesh::Mesh;

/// How to partition and number a mesh.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// Loads of the elements and ties between them.
    pub weights: Weights,
    /// Order of the nodes of one rank.
    pub ordering: Ordering,
}

impl Plan {
    /// A plan that keeps together what may touch and shares out contact; without couples the plain one.
    ///
    /// `mesh` is there on rank 0 only, and so is what the plan says. Rigid targets need no couple: they tie no elements
    /// together, and their points cost too little to pay for a second balance, which lengthens the borders.
    ///
    /// # Errors
    /// When a set does not exist; on rank 0 alone, to be agreed upon.
    pub fn for_contact<const D: usize>(mesh: Option<&Mesh<D>>, couples: &[Couple<'_>]) -> Result<Self> {
        let weights = mesh.map_or_else(|| Ok(Weights::default()), |mesh| contact_weights(mesh, couples))?;
        Ok(Self { weights, ..Self::default() })
    }
}

/// What a rank holds of the mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalMesh<const D: usize> {
    /// Local numbering: owned nodes first, then ghosts by ascending global number; elements that touch an owned node
    /// first, then the rank's other elements. Every named set exists on every rank, restricted to what is local. Each
    /// set of facets or elements exists as a set of points as well, which holds all its local nodes, also those that
    /// belong to it only by an element that is not local.
    pub mesh: Mesh<D>,
    /// Elements `0..assembled` touch an owned node. All of them on all ranks: no row needs help from another rank.
    pub assembled: usize,
    /// For each element: is it this rank's own? Each element is some rank's own once: for energies, output, counts.
    pub mine: Vec<bool>,
    /// Global numbers of the nodes.
    pub index: IndexMap,
    /// Number of each local node in the input mesh.
    pub input_node: Vec<u32>,
    /// Number of each local element in the input mesh.
    pub input_element: Vec<u32>,
}
