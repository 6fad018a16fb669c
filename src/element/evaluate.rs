//! Internal force and stiffness of a group, with the kernel selected by its law.

use super::Inverted;
use super::general::General;
use super::group::ElementGroup;
use super::kinematics::Kinematics;
use super::solid::Solid;
use super::workspace::Job;
use crate::lanes::dispatch;
use crate::material::{Hooke, IsotropicLaw, Law, LawPart, LawTask, MetricLaw, Part, PlaneStress, PointLaw};

/// Evaluates a group in plane strain, plane stress or axisymmetry.
pub(super) fn in_plane(job: Job<'_, 2>) -> Result<(), Inverted> {
    let formulation = job.group.formulation();
    if formulation.plane.is_revolved() {
        return ElementGroup::evaluate_axisymmetric(job);
    }
    match formulation.plane_stress() {
        None => solid(job),
        Some(law) => dispatch(General::<PlaneStress, 2>::of_one(job, Box::new(law))),
    }
}

/// Evaluates a group without strain across the plane, or in 3D.
pub(super) fn solid<const D: usize>(job: Job<'_, D>) -> Result<(), Inverted> {
    let formulation = *job.group.formulation();
    match formulation.kinematics {
        Kinematics::Linear => dispatch(Solid::<Hooke, D>::new(job, formulation.own_moduli())),
        Kinematics::Finite => formulation.material.accept(Evaluate(job)),
    }
}

/// Selects the kernel for the law of a group.
struct Evaluate<'a, const D: usize>(Job<'a, D>);

impl<const D: usize> LawTask for Evaluate<'_, D> {
    type Output = Result<(), Inverted>;

    fn run<P: Law>(self, law: &P) -> Self::Output {
        run_general(self.0, |part| Box::new(LawPart::<P>(law.constants(part))))
    }

    fn run_isotropic<P: IsotropicLaw>(self, law: &P) -> Self::Output {
        run_general(self.0, |part| law.energy_of_part(part))
    }

    fn run_metric<P: Law + MetricLaw>(self, law: &P) -> Self::Output {
        match self.0.viscous {
            None => dispatch(Solid::<P, D>::new(self.0, law.constants(Part::Whole))),
            // The tangent of the viscous stress does not have the fast form.
            Some(_) => self.run(law),
        }
    }
}

/// Runs the kernel for any law, of which `part` gives the parts.
fn run_general<K: PointLaw + ?Sized, const D: usize>(
    job: Job<D>,
    part: impl Fn(Part) -> Box<K>,
) -> Result<(), Inverted> {
    dispatch(General::<K, D>::new(job, part))
}
