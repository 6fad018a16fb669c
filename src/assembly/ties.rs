//! Ties between surfaces whose meshes do not match (theory, section 3.16).

use super::scatter::{LiftTarget, MatrixSink, ScatterMap};
use crate::case::PlacedFunction;
use crate::dynamics::Sides;
use crate::element::ElementSink;
use crate::error::Result;
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
    /// Area of each tie, `A` [m, m^2].
    areas: Vec<f64>,
    /// Stiffness over area, `eps / A`.
    factors: Vec<f64>,
    /// The same, at most as stiff as an element beneath.
    soft: Vec<f64>,
    /// Whether this rank counts the tie in sums over all ranks.
    counted: Vec<bool>,
    /// `eps (sum_a w_a u_a / A + g)` of each tie at the last evaluation \[Pa\].
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

    /// Traction `eps (sum_a w_a u_a / A + g)` with the prescribed jumps `g` \[m\] of all pairs \[Pa\].
    fn traction<const D: usize>(&self, tie: usize, u: &[f64], jumps: &[[f64; D]]) -> [f64; D] {
        let sum = self.sum::<D>(tie, u);
        let jump = jumps[self.pairs[tie] as usize];
        std::array::from_fn(|i| self.factors[tie] * (sum[i] + self.areas[tie] * jump[i]))
    }
}

/// A tie that resists rotations, because its sides are apart.
pub(super) struct Restraint<'a> {
    pub nodes: &'a [u32],
    pub weights: &'a [f64],
    pub area: f64,
}

/// All ties at the nodes of a rank.
pub struct Ties<const D: usize> {
    patches: Vec<Patch>,
    names: Vec<String>,
    /// Prescribed jump of each pair.
    jumps: Vec<[Option<PlacedFunction>; 3]>,
    /// Whether the sides of each pair are apart.
    periodic: Vec<bool>,
    /// Number of nodes that the rank owns.
    owned: usize,
}

/// Changes of one pair of tied surfaces in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JumpChange<const D: usize> {
    /// Change of the force of the ties \[N\].
    pub force: [f64; D],
    /// Increment of the prescribed jump \[m\].
    pub jump: [f64; D],
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
                areas: of_width().map(|tie| tie.area).collect(),
                factors: of_width().map(factor).collect(),
                soft: of_width().map(soft).collect(),
                counted: of_width().map(|tie| local.index.owns(tie.nodes[0])).collect(),
                tractions: vec![0.0; of_width().count() * D],
            }
        };
        Self {
            patches: widths.into_iter().map(patch).collect(),
            names: pairs.iter().map(|pair| pair.name.clone()).collect(),
            jumps: pairs.iter().map(|pair| pair.jump.clone()).collect(),
            periodic: pairs.iter().map(|pair| pair.offset.is_some()).collect(),
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

    /// Prescribed jump of each pair at a time \[m\].
    ///
    /// # Errors
    /// A value is not finite, at its position in the case.
    fn jumps_at(&self, time: f64) -> Result<Vec<[f64; D]>> {
        let of_pair = |functions: &[Option<PlacedFunction>; 3]| {
            let mut jump = [0.0; D];
            for (jump, function) in jump.iter_mut().zip(functions) {
                let Some(function) = function else { continue };
                let motion = function.motion([0.0; 3], time);
                function.require_sound(&motion, &[0.0; D], time)?;
                *jump = motion.value;
            }
            Ok(jump)
        };
        self.jumps.iter().map(of_pair).collect()
    }

    /// Evaluates the tractions at the local displacement `u` \[m\], with the mean of the prescribed
    /// jumps at two times.
    ///
    /// # Errors
    /// A prescribed jump is not finite, at its position in the case.
    pub(super) fn evaluate(&mut self, u: &[f64], times: [f64; 2]) -> Result<()> {
        let [mut jumps, others] = [self.jumps_at(times[0])?, self.jumps_at(times[1])?];
        for (jump, other) in jumps.iter_mut().flatten().zip(others.iter().flatten()) {
            *jump = 0.5 * (*jump + other);
        }
        for patch in &mut self.patches {
            for tie in 0..patch.factors.len() {
                let traction = patch.traction(tie, u, &jumps);
                patch.tractions[tie * D..][..D].copy_from_slice(&traction);
            }
        }
        Ok(())
    }

    /// Work of the prescribed jumps on the ties that this rank counts, from the displacement `before`
    /// at the time `start` to `u` at the time `end` \[J\]. Ties are linear, so the trapezoidal rule
    /// takes exactly the energy that they store or give to the bodies.
    ///
    /// # Errors
    /// A prescribed jump is not finite, at its position in the case.
    pub fn work_of_jumps(&self, before: &[f64], start: f64, u: &[f64], end: f64) -> Result<f64> {
        let jumps = [self.jumps_at(start)?, self.jumps_at(end)?];
        let of_patch = |patch: &Patch| -> f64 {
            let work = |tie: usize| -> f64 {
                let pair = patch.pairs[tie] as usize;
                let tractions = [patch.traction(tie, before, &jumps[0]), patch.traction(tie, u, &jumps[1])];
                let moved = |i: usize| jumps[1][pair][i] - jumps[0][pair][i];
                let mean = |i: usize| 0.5 * (tractions[0][i] + tractions[1][i]);
                patch.areas[tie] * (0..D).map(|i| mean(i) * moved(i)).sum::<f64>()
            };
            (0..patch.factors.len()).filter(|&tie| patch.counted[tie]).map(work).sum()
        };
        Ok(self.patches.iter().map(of_patch).sum())
    }

    /// Change of the force on each pair by the ties that this rank counts \[N\], and the increment of
    /// its prescribed jump \[m\], as in [`Self::work_of_jumps`].
    ///
    /// # Errors
    /// A prescribed jump is not finite, at its position in the case.
    pub fn changes(&self, before: &[f64], start: f64, u: &[f64], end: f64) -> Result<Vec<JumpChange<D>>> {
        let jumps = [self.jumps_at(start)?, self.jumps_at(end)?];
        let moved = |pair: usize| std::array::from_fn(|i| jumps[1][pair][i] - jumps[0][pair][i]);
        let at_rest = |pair| JumpChange { force: [0.0; D], jump: moved(pair) };
        let mut changes: Vec<JumpChange<D>> = (0..self.jumps.len()).map(at_rest).collect();
        for patch in &self.patches {
            for tie in (0..patch.factors.len()).filter(|&tie| patch.counted[tie]) {
                let [first, last] =
                    [patch.traction(tie, before, &jumps[0]), patch.traction(tie, u, &jumps[1])];
                let force = &mut changes[patch.pairs[tie] as usize].force;
                (0..D).for_each(|i| force[i] += patch.areas[tie] * (last[i] - first[i]));
            }
        }
        Ok(changes)
    }

    /// Ties that this rank counts and whose sides are apart.
    pub(super) fn restraints(&self) -> impl Iterator<Item = Restraint<'_>> {
        self.patches.iter().flat_map(|patch| {
            let counts = |&tie: &usize| patch.counted[tie] && self.periodic[patch.pairs[tie] as usize];
            let restraint = |tie: usize| Restraint {
                nodes: patch.map.nodes(tie),
                weights: patch.weights(tie),
                area: patch.areas[tie],
            };
            (0..patch.factors.len()).filter(counts).map(restraint)
        })
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

    /// Energy of the ties that this rank counts, `A |t|^2 / (2 eps)`, at a displacement \[m\] and a time
    /// \[J\].
    ///
    /// # Errors
    /// A prescribed jump is not finite, at its position in the case.
    pub fn stored_energy(&self, u: &[f64], time: f64) -> Result<f64> {
        let jumps = self.jumps_at(time)?;
        let of_patch = |patch: &Patch| -> f64 {
            let energy = |tie: usize| {
                let square: f64 = patch.traction(tie, u, &jumps).iter().map(|t| t * t).sum();
                0.5 * square / patch.factors[tie]
            };
            (0..patch.factors.len()).filter(|&tie| patch.counted[tie]).map(energy).sum()
        };
        Ok(self.patches.iter().map(of_patch).sum())
    }

    /// Marks the owned nodes of these sides of ties.
    pub(super) fn mark(&self, sides: Sides, marks: &mut [bool]) {
        for patch in &self.patches {
            for tie in 0..patch.factors.len() {
                let nodes = patch.map.nodes(tie);
                let count = match sides {
                    Sides::Both => nodes.len(),
                    Sides::Contactor => patch.contactors[tie] as usize,
                };
                for &node in &nodes[..count] {
                    if let Some(mark) = marks.get_mut(node as usize) {
                        *mark = true;
                    }
                }
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
