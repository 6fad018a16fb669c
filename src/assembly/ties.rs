//! Ties between surfaces whose meshes do not match (theory, section 3.16).

use super::scatter::{LiftTarget, MatrixSink, ScatterMap};
use crate::element::ElementSink;
use crate::mesh::Tie;
use crate::model::TieModel;
use crate::partition::{IndexMap, LocalMesh};
use crate::petsc::{BlockPattern, BlockValues};
use crate::space::Held;

/// Ties with equal numbers of nodes.
struct Patch {
    map: ScatterMap,
    /// Weights of the nodes of each tie [m, m^2].
    weights: Vec<f64>,
    /// Pair of surfaces of each tie.
    pairs: Vec<u32>,
    /// Number of nodes of the contactor.
    contactors: Vec<u32>,
    /// Stiffness over area, `eps / A`.
    factors: Vec<f64>,
    /// The same, at most as stiff as an element beneath.
    soft: Vec<f64>,
    /// Whether this rank counts the tie in sums over all ranks.
    counted: Vec<bool>,
    /// `eps sum_a w_a u_a / A` of each tie at the last evaluation \[Pa\].
    tractions: Vec<f64>,
}

impl Patch {
    fn weights(&self, tie: usize) -> &[f64] {
        &self.weights[tie * self.map.width..][..self.map.width]
    }

    /// Weighted sum of a field over the nodes of a tie.
    fn sum<const D: usize>(&self, tie: usize, field: &[f64]) -> [f64; D] {
        let mut sum = [0.0; D];
        for (&node, weight) in self.map.nodes(tie).iter().zip(self.weights(tie)) {
            let value = &field[node as usize * D..][..D];
            sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight * value);
        }
        sum
    }
}

/// All ties at the nodes of a rank.
pub struct Ties<const D: usize> {
    patches: Vec<Patch>,
    names: Vec<String>,
    /// Number of nodes that the rank owns.
    owned: usize,
}

impl<const D: usize> Ties<D> {
    /// The ties of the rank's mesh, which belong to these pairs.
    pub(super) fn new(
        local: &LocalMesh<D>,
        pairs: &[TieModel],
        pattern: &BlockPattern,
        held: &Held<D>,
    ) -> Self {
        let ties = &local.mesh.ties;
        let mut widths: Vec<usize> = ties.iter().map(|tie| tie.nodes.len()).collect();
        widths.sort_unstable();
        widths.dedup();
        let patch = |width: usize| {
            let of_width = || ties.iter().filter(move |tie| tie.nodes.len() == width);
            let nodes = of_width().flat_map(|tie| tie.nodes.iter().copied()).collect();
            let factor = |tie: &Tie| tie.stiffness / tie.area;
            let soft = |tie: &Tie| tie.stiffness.min(tie.element_stiffness) / tie.area;
            Patch {
                map: ScatterMap::new::<D>(width, nodes, pattern, &local.index, held),
                weights: of_width().flat_map(|tie| tie.weights.iter().copied()).collect(),
                pairs: of_width().map(|tie| tie.pair).collect(),
                contactors: of_width().map(|tie| tie.contactor).collect(),
                factors: of_width().map(factor).collect(),
                soft: of_width().map(soft).collect(),
                counted: of_width().map(|tie| local.index.owns(tie.nodes[0])).collect(),
                tractions: vec![0.0; of_width().count() * D],
            }
        };
        Self {
            patches: widths.into_iter().map(patch).collect(),
            names: pairs.iter().map(|pair| pair.name.clone()).collect(),
            owned: local.index.owned,
        }
    }

    /// Whether the case ties surfaces.
    pub fn has_pairs(&self) -> bool {
        !self.names.is_empty()
    }

    /// Recomputes the positions of all entries for another pattern.
    pub(super) fn relocate(&mut self, pattern: &BlockPattern, index: &IndexMap) {
        self.patches.iter_mut().for_each(|patch| patch.map.relocate(pattern, index));
    }

    /// Evaluates the tractions at the local displacement `u` \[m\].
    pub(super) fn evaluate(&mut self, u: &[f64]) {
        for patch in &mut self.patches {
            for tie in 0..patch.factors.len() {
                let sum = patch.sum::<D>(tie, u);
                let factor = patch.factors[tie];
                let traction = &mut patch.tractions[tie * D..][..D];
                traction.iter_mut().zip(sum).for_each(|(traction, sum)| *traction = factor * sum);
            }
        }
    }

    /// Adds the forces at the last evaluation, `w_a t`, to owned rows \[N\].
    pub(super) fn add_forces(&self, force: &mut [f64]) {
        for patch in &self.patches {
            for (tie, traction) in patch.tractions.chunks_exact(D).enumerate() {
                for (&node, weight) in patch.map.nodes(tie).iter().zip(patch.weights(tie)) {
                    let Some(entries) = force.get_mut(node as usize * D..(node as usize + 1) * D) else {
                        continue;
                    };
                    entries.iter_mut().zip(traction).for_each(|(entry, t)| *entry += weight * t);
                }
            }
        }
    }

    /// Adds the stiffness `eps w_a w_b / A` of all ties to the matrix. `soft` ones are at most as stiff
    /// as the elements beneath.
    pub(super) fn add_stiffness(
        &self,
        soft: bool,
        held: &Held<D>,
        values: &mut BlockValues,
        mut lift: Option<LiftTarget>,
    ) {
        let mut block = Vec::new();
        for patch in &self.patches {
            let lift = lift.as_mut().map(LiftTarget::reborrow);
            let mut sink = MatrixSink::<D>::new(&patch.map, held, values, lift);
            let width = patch.map.width;
            let factors = if soft { &patch.soft } else { &patch.factors };
            for (tie, factor) in factors.iter().enumerate() {
                block.clear();
                block.resize(width * width * D * D, 0.0);
                let weights = patch.weights(tie);
                for (pair, entries) in block.chunks_exact_mut(D * D).enumerate() {
                    let entry = factor * weights[pair / width] * weights[pair % width];
                    (0..D).for_each(|i| entries[i * D + i] = entry);
                }
                sink.element(tie, &[], Some(&block));
            }
        }
    }

    /// Energy of the ties that this rank counts, `A eps jump^2 / 2` \[J\].
    pub fn stored_energy(&self, u: &[f64]) -> f64 {
        let of_patch = |patch: &Patch| -> f64 {
            let energy = |tie: usize| {
                let square: f64 = patch.sum::<D>(tie, u).iter().map(|sum| sum * sum).sum();
                0.5 * patch.factors[tie] * square
            };
            (0..patch.factors.len()).filter(|&tie| patch.counted[tie]).map(energy).sum()
        };
        self.patches.iter().map(of_patch).sum()
    }

    /// Marks the owned nodes of ties.
    pub(super) fn mark(&self, marks: &mut [bool]) {
        let patches = self.patches.iter();
        for &node in patches.flat_map(|patch| (0..patch.factors.len()).flat_map(|tie| patch.map.nodes(tie))) {
            if let Some(mark) = marks.get_mut(node as usize) {
                *mark = true;
            }
        }
    }

    /// For each pair of surfaces its name, and the owned nodes of its contactor with the forces of its
    /// ties on them at the last evaluation \[N\]. A node occurs once for each of its ties.
    pub fn forces(&self) -> impl Iterator<Item = (&str, Vec<(usize, [f64; D])>)> {
        self.names.iter().enumerate().map(|(pair, name)| {
            let mut forces = Vec::new();
            for patch in &self.patches {
                let of_pair = |tie: &usize| patch.pairs[*tie] as usize == pair;
                for tie in (0..patch.factors.len()).filter(of_pair) {
                    let traction = &patch.tractions[tie * D..][..D];
                    let own = patch.map.nodes(tie).iter().zip(patch.weights(tie));
                    let own = own.take(patch.contactors[tie] as usize);
                    let own = own.filter(|(node, _)| (**node as usize) < self.owned);
                    let force = |weight: f64| std::array::from_fn(|i| -weight * traction[i]);
                    forces.extend(own.map(|(&node, &weight)| (node as usize, force(weight))));
                }
            }
            (name.as_str(), forces)
        })
    }
}
