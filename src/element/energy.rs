//! The strain energy of a group, computed in lanes and at the samples of the forces.

use super::batch::Batch;
use super::group::ElementGroup;
use super::kinematics::Kinematics;
use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};
use crate::material::{Hooke, Law, LawTask, Part, Potential};

impl<const D: usize> ElementGroup<D> {
    /// Strain energy \[J\] (in 2D per metre of depth) of the elements with `mine[element]`.
    pub fn strain_energy(&self, u: &[f64], mine: &[bool]) -> f64 {
        let formulation = &self.formulation;
        let energy = Energy { group: self, u, mine };
        match formulation.kinematics {
            Kinematics::Linear => energy.of::<Hooke>(|part| formulation.moduli().part(part)),
            Kinematics::Finite => formulation.material.accept(energy),
        }
    }
}

/// The elements and displacements of a sum.
struct Energy<'a, const D: usize> {
    group: &'a ElementGroup<D>,
    u: &'a [f64],
    mine: &'a [bool],
}

impl<const D: usize> Energy<'_, D> {
    fn of<P: Potential>(self, constants: impl Fn(Part) -> P::Constants) -> f64 {
        let constants = self.group.passes.iter().map(|pass| constants(pass.part)).collect();
        dispatch(Sum::<P, D> { energy: self, constants })
    }
}

impl<const D: usize> LawTask for Energy<'_, D> {
    type Output = f64;

    fn run<P: Law>(self, law: &P) -> f64 {
        self.of::<P>(|part| law.constants(part))
    }
}

/// A sum with a law known at compile time.
struct Sum<'a, P: Potential, const D: usize> {
    energy: Energy<'a, D>,
    /// One entry for each pass.
    constants: Vec<P::Constants>,
}

impl<P: Potential, const D: usize> LaneTask for Sum<'_, P, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> f64 {
        let Energy { group, u, mine } = self.energy;
        let n = group.kind.nodes();
        let mut batch = Batch::<L, D, 1>::new(unit, group);
        let mut total = 0.0;
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for ((elements, nodes), points) in batches.zip(group.points.chunks_exact(n)) {
            batch.gather(unit, nodes, points, [u]);
            let mut sum = unit.constant(0.0);
            for (pass, constants) in group.passes.iter().zip(&self.constants) {
                for q in 0..pass.samples() {
                    let sample = batch.locate(unit, pass, q);
                    sum = P::energy(constants, &sample.grad_u[0]).mul_add(sample.volume, sum);
                }
            }
            let own = elements.iter().zip(sum.lanes()).filter(|(element, _)| mine[**element as usize]);
            total += own.map(|(_, energy)| energy).sum::<f64>();
        }
        total
    }
}
