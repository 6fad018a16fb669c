//! What a cut of the mesh is worth: balance, and what it parts.

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
    /// Contact load of each part: its contactor facets; zeros where contact is no load.
    pub contact: Vec<u64>,
    /// Sides between elements of different parts.
    pub edge_cut: i64,
    /// Ties between elements that may touch.
    pub pairs: u64,
    /// Those of them between different parts.
    pub pairs_cut: u64,
}

impl Quality {
    /// Of the parts that a graph of this mesh and these weights was cut into.
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

    /// Of the parts into which `plan` cuts a mesh. Not collective.
    ///
    /// # Errors
    /// As [`partition`].
    pub fn of_plan<const D: usize>(mesh: &Mesh<D>, plan: &Plan, parts: usize) -> Result<Self> {
        let graph = Graph::dual(mesh, &plan.weights)?;
        Ok(Self::new(&graph, &plan.weights, &partition(&graph, parts)?, parts))
    }

    /// Of the parts that come out when METIS does not see contact, measured as those that `plan` makes: what the ties
    /// and loads of contact gain. Not collective.
    ///
    /// # Errors
    /// As [`partition`].
    pub fn of_plain<const D: usize>(mesh: &Mesh<D>, plan: &Plan, parts: usize) -> Result<Self> {
        let part = partition(&Graph::dual(mesh, &Weights::default())?, parts)?;
        Ok(Self::new(&Graph::dual(mesh, &plan.weights)?, &plan.weights, &part, parts))
    }

    /// Elements of the fullest part over the mean; 1 is perfect.
    pub fn element_imbalance(&self) -> f64 {
        imbalance(&self.elements)
    }

    /// Contact load of the most loaded part over the mean; 1 is perfect.
    pub fn contact_imbalance(&self) -> f64 {
        imbalance(&self.contact)
    }
}

/// The most over the mean; 1 where there is nothing.
pub(super) fn imbalance(loads: &[u64]) -> f64 {
    let total: u64 = loads.iter().sum();
    let most = loads.iter().max().copied().unwrap_or(0);
    if total == 0 { 1.0 } else { most as f64 * loads.len() as f64 / total as f64 }
}
