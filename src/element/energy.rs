//! The strain energy of a group, computed in lanes and at the samples of the forces.

use super::batch::Batch;
use super::group::{ElementGroup, Pass, Sampling};
use super::kinematics::Kinematics;
use super::projection::Dilatation;
use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};
use crate::material::{Hooke, IsotropicLaw, Law, LawPart, LawTask, PointEnergy, VolumeLaw};

/// The elements and displacements of a sum.
pub(super) struct Energy<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    pub u: &'a [f64],
    pub mine: &'a [bool],
}

/// Energy of a group in plane strain, plane stress or axisymmetry.
pub(super) fn in_plane(energy: Energy<'_, 2>) -> f64 {
    let formulation = energy.group.formulation();
    if formulation.plane.is_revolved() {
        return energy.group.axisymmetric_energy(energy.u, energy.mine);
    }
    match formulation.plane_stress() {
        None => solid(energy),
        Some(law) => energy.of(vec![Box::new(law)]),
    }
}

/// Energy of a group without strain across the plane, or in 3D.
pub(super) fn solid<const D: usize>(energy: Energy<'_, D>) -> f64 {
    let formulation = *energy.group.formulation();
    match formulation.kinematics {
        Kinematics::Linear => {
            let moduli = formulation.own_moduli();
            let parts = energy.group.parts(|part| Box::new(LawPart::<Hooke>(moduli.part(part))));
            energy.of(parts)
        }
        Kinematics::Finite => formulation.material.accept(energy),
    }
}

impl<const D: usize> Energy<'_, D> {
    fn of<K: PointEnergy + ?Sized>(self, parts: Vec<Box<K>>) -> f64 {
        dispatch(Sum { energy: self, parts })
    }
}

impl<const D: usize> LawTask for Energy<'_, D> {
    type Output = f64;

    fn run<P: Law>(self, law: &P) -> f64 {
        let parts = self.group.parts(|part| Box::new(LawPart::<P>(law.constants(part))));
        self.of(parts)
    }

    fn run_isotropic<P: IsotropicLaw>(self, law: &P) -> f64 {
        let parts = self.group.parts(|part| law.energy_of_part(part));
        self.of(parts)
    }
}

/// A sum with the parts of a law.
struct Sum<'a, K: ?Sized, const D: usize> {
    energy: Energy<'a, D>,
    /// One entry for each pass.
    parts: Vec<Box<K>>,
}

impl<K: PointEnergy + ?Sized, const D: usize> LaneTask for Sum<'_, K, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> f64 {
        let Energy { group, u, mine } = self.energy;
        let n = group.kind.nodes();
        let mut batch = Batch::<L, D, 1>::new(unit, group);
        let mut total = 0.0;
        let mut terms = Dilatation::new(unit, group);
        let volume_law = group.volume_law();
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for ((elements, nodes), points) in batches.zip(group.points.chunks_exact(n)) {
            batch.gather(unit, nodes, points, [u]);
            let mut sum = unit.constant(0.0);
            for (pass, law) in group.passes.iter().zip(&self.parts) {
                if let Sampling::Projected(_) = pass.sampling {
                    sum = sum + volume_energy(unit, &mut batch, pass, &mut terms, &volume_law);
                    continue;
                }
                for q in 0..pass.samples() {
                    let sample = batch.locate(unit, pass, q);
                    sum = law.energy(&sample.grad_u[0]).mul_add(sample.volume, sum);
                }
            }
            let own = elements.iter().zip(sum.lanes()).filter(|(element, _)| mine[**element as usize]);
            total += own.map(|(_, energy)| energy).sum::<f64>();
        }
        total
    }
}

/// Energy of the volume terms of a batch at the projected dilatation.
#[inline(always)]
fn volume_energy<L: Lane, const D: usize>(
    unit: L,
    batch: &mut Batch<L, D, 1>,
    pass: &Pass,
    terms: &mut Dilatation<L, D>,
    law: &VolumeLaw,
) -> L {
    for q in 0..pass.samples() {
        let sample = batch.locate(unit, pass, q);
        terms.projection.set(q, sample.volume, &batch.place(unit, pass, q));
        terms.dilatation[q] = law.dilatation(&sample.grad_u[0]);
    }
    terms.projection.orthogonalize();
    terms.projection.project(&mut terms.dilatation);
    let mut sum = unit.constant(0.0);
    for q in 0..pass.samples() {
        sum = law.energy(terms.dilatation[q]).mul_add(terms.projection.volumes()[q], sum);
    }
    sum
}
