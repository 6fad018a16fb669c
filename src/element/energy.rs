//! The strain energy of a group, in the lanes and at the samples of its forces.

use std::marker::PhantomData;

use super::batch::Batch;
use super::group::ElementGroup;
use super::kinematics::Kinematics;
use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};
use crate::material::{Hooke, Law, Model, NeoHookean, SaintVenantKirchhoff};

impl<const D: usize> ElementGroup<D> {
    /// Strain energy \[J\] (in 2D per metre of depth) of the elements for which `mine[element]` holds.
    pub fn strain_energy(&self, u: &[f64], mine: &[bool]) -> f64 {
        match (self.formulation.kinematics, self.formulation.material.model) {
            (Kinematics::Linear, _) => dispatch(Energy::<Hooke, D>::new(self, u, mine)),
            (Kinematics::Finite, Model::SaintVenantKirchhoff) => {
                dispatch(Energy::<SaintVenantKirchhoff, D>::new(self, u, mine))
            }
            (Kinematics::Finite, Model::NeoHookean) => dispatch(Energy::<NeoHookean, D>::new(self, u, mine)),
        }
    }
}

/// A sum whose law is known to the compiler.
struct Energy<'a, P, const D: usize> {
    group: &'a ElementGroup<D>,
    u: &'a [f64],
    mine: &'a [bool],
    law: PhantomData<P>,
}

impl<'a, P, const D: usize> Energy<'a, P, D> {
    fn new(group: &'a ElementGroup<D>, u: &'a [f64], mine: &'a [bool]) -> Self {
        Self { group, u, mine, law: PhantomData }
    }
}

impl<P: Law, const D: usize> LaneTask for Energy<'_, P, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> f64 {
        let Self { group, u, mine, .. } = self;
        let n = group.kind.nodes();
        let mut batch = Batch::<L, D, 1>::new(unit, group);
        let mut total = 0.0;
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for ((elements, nodes), points) in batches.zip(group.points.chunks_exact(n)) {
            batch.gather(unit, nodes, points, [u]);
            let mut sum = unit.constant(0.0);
            for pass in &group.passes {
                let moduli = pass.moduli.in_lanes(unit);
                for q in 0..pass.samples() {
                    let sample = batch.locate(unit, pass, q);
                    sum = P::energy(&moduli, &sample.grad_u[0]).mul_add(sample.volume, sum);
                }
            }
            let own = elements.iter().zip(sum.lanes()).filter(|(element, _)| mine[**element as usize]);
            total += own.map(|(_, energy)| energy).sum::<f64>();
        }
        total
    }
}
