//! Quality of a partition: balance, and cut edges and ties.

use super::graph::{ElementWeights, Graph, Pair};
use super::metis::partition;
use super::{Plan, Weights};
use crate::error::Result;
use crate::mesh::Mesh;

/// Balance and cost of the parts of a mesh.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Quality {
    /// Elements of each part.
    pub elements: Vec<u64>,
    /// Contact load of each part: its contactor facets; zeros if contact is not a load.
    pub contact: Vec<u64>,
    /// Sides between elements of different parts.
    pub edge_cut: i64,
    /// Ties between elements that may touch.
    pub pairs: u64,
    /// Ties between different parts.
    pub pairs_cut: u64,
}

impl Quality {
    /// Quality of the parts of a graph with these weights.
    pub(super) fn new(graph: &Graph, weights: &Weights, part: &[u32], parts: usize) -> Self {
        let apart = |pair: &&Pair| part[pair.elements[0] as usize] != part[pair.elements[1] as usize];
        let parted = || weights.pairs.iter().filter(apart);
        let ties: i64 = parted().map(|pair| i64::from(pair.weight)).sum();
        let mut quality = Self {
            elements: vec![0; parts],
            contact: vec![0; parts],
            edge_cut: graph.cut(part) - ties,
            pairs: weights.pairs.len() as u64,
            pairs_cut: parted().count() as u64,
        };
        part.iter().for_each(|&part| quality.elements[part as usize] += 1);
        if let Some(ElementWeights { constraints: 2, loads }) = &weights.elements {
            let contact = loads.iter().skip(1).step_by(2);
            part.iter().zip(contact).for_each(|(&p, &load)| quality.contact[p as usize] += load as u64);
        }
        quality
    }

    /// Quality of the parts into which `plan` divides a mesh. Not collective.
    ///
    /// # Errors
    /// The errors of [`partition`].
    pub fn of_plan<const D: usize>(mesh: &Mesh<D>, plan: &Plan, parts: usize) -> Result<Self> {
        let graph = Graph::dual(mesh, &plan.weights)?;
        Ok(Self::new(&graph, &plan.weights, &partition(&graph, parts)?, parts))
    }

    /// Quality of the parts without contact in the graph, measured with the ties and loads of
    /// `plan`. A comparison shows the gain from contact weights. Not collective.
    ///
    /// # Errors
    /// The errors of [`partition`].
    pub fn of_plain<const D: usize>(mesh: &Mesh<D>, plan: &Plan, parts: usize) -> Result<Self> {
        let part = partition(&Graph::dual(mesh, &Weights::default())?, parts)?;
        Ok(Self::new(&Graph::dual(mesh, &plan.weights)?, &plan.weights, &part, parts))
    }

    /// Largest number of elements of a part divided by the mean; 1 is perfect.
    pub fn element_imbalance(&self) -> f64 {
        imbalance(&self.elements)
    }

    /// Largest contact load of a part divided by the mean; 1 is perfect.
    pub fn contact_imbalance(&self) -> f64 {
        imbalance(&self.contact)
    }
}

/// Maximum divided by the mean; 1 if there is no load.
pub(super) fn imbalance(loads: &[u64]) -> f64 {
    let total: u64 = loads.iter().sum();
    let most = loads.iter().max().copied().unwrap_or(0);
    if total == 0 { 1.0 } else { most as f64 * loads.len() as f64 / total as f64 }
}
