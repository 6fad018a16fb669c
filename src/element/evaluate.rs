//! Internal force and stiffness of a group, with the kernel selected by its law.

use super::compiled::compiled;
use super::general::General;
use super::group::ElementGroup;
use super::kinematics::Kinematics;
use super::linearised_pressure::PressureChange;
use super::solid::Solid;
use super::workspace::Job;
use super::{ElementSink, Inverted, Request};
use crate::lanes::dispatch;
use crate::material::{
    Hooke, IsotropicLaw, Law, LawPart, LawTask, MetricLaw, Overstress, Part, PlaneStress, PointLaw,
};

impl<const D: usize> ElementGroup<D> {
    /// Internal force (and, on request, its derivative) of each element at the nodal displacements
    /// `u` (`u[node * D + i]`, local nodes, \[m\]).
    ///
    /// On one processor the result of an element is bitwise identical in any group.
    ///
    /// # Errors
    /// The first element of the group with `det F <= 0` or NaN at a quadrature point. The sink has
    /// then received a part of the group, and its content is invalid.
    pub fn evaluate(&self, u: &[f64], request: Request, sink: &mut dyn ElementSink) -> Result<(), Inverted> {
        self.evaluate_viscous(u, None, request, sink)
    }

    /// Like [`evaluate`](Self::evaluate) with the stress of a Prony series, which is added at the
    /// points of the full rule.
    ///
    /// # Errors
    /// The first inverted element of the group.
    pub fn evaluate_viscous(
        &self,
        u: &[f64],
        viscous: Option<&Overstress>,
        request: Request,
        sink: &mut dyn ElementSink,
    ) -> Result<(), Inverted> {
        compiled().evaluate(Job { group: self, u, viscous, request, sink })
    }

    /// Force of the difference between the pressure linearised at the displacements `earlier` and that at `u`.
    /// Elements in patches contribute nothing.
    pub fn pressure_change(&self, u: &[f64], earlier: &[f64], sink: &mut dyn ElementSink) {
        compiled().pressure_change(PressureChange { group: self, u, earlier, sink });
    }
}

/// Evaluates a group in plane strain, plane stress or axisymmetry.
pub(super) fn in_plane(job: Job<'_, 2>) -> Result<(), Inverted> {
    let formulation = job.group.formulation();
    if formulation.plane.is_revolved() {
        return ElementGroup::evaluate_axisymmetric(job);
    }
    match formulation.plane_stress() {
        None => solid(job),
        Some(law) => dispatch(General::<PlaneStress, 2, false>::of_one(job, Box::new(law))),
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
    match job.viscous {
        None => dispatch(General::<K, D, false>::new(job, part)),
        Some(_) => dispatch(General::<K, D, true>::new(job, part)),
    }
}
