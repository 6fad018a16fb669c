//! What a group computes in lanes, and the kernels of two and three dimensions, compiled in this crate.
//!
//! A function that is generic over the dimension is compiled again by every crate that calls it. Behind the
//! interface [`Compiled`] the kernels, which are large, are compiled once, for the program and its tests. Plane
//! stress and axisymmetry are compiled for two dimensions only.

use std::any::Any;

use super::energy::Energy;
use super::group::ElementGroup;
use super::kinematics::Kinematics;
use super::linearised_pressure::PressureChange;
use super::step::StepJob;
use super::viscous::{
    BranchEnergies, IsochoricEnergy, Stresses, ViscousEnergies, ViscousHistory, components,
};
use super::workspace::Job;
use super::{ElementSink, Inverted, Request, energy, evaluate, linearised_pressure, step, viscous};
use crate::lanes::Pack;
use crate::material::{Overstress, PronySeries};

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

    /// Like [`evaluate`](Self::evaluate) at the displacements `middle`, but with forces whose work
    /// over the step from `start` to `2 middle - start` equals the change of the strain energy. In
    /// linear kinematics the two are identical.
    ///
    /// # Errors
    /// The first element of the group that is inverted at the end of the step.
    pub fn evaluate_step(
        &self,
        start: &[f64],
        middle: &[f64],
        request: Request,
        sink: &mut dyn ElementSink,
    ) -> Result<(), Inverted> {
        if self.formulation.kinematics == Kinematics::Linear {
            return self.evaluate(middle, request, sink);
        }
        compiled().evaluate_step(StepJob { group: self, u: [start, middle], request, sink })
    }

    /// Strain energy \[J\] (in 2D per metre of depth, in axisymmetry of the whole revolution) of the elements with `mine[element]`.
    pub fn strain_energy(&self, u: &[f64], mine: &[bool]) -> f64 {
        compiled().strain_energy(Energy { group: self, u, mine })
    }

    /// Isochoric stress of the law at all points of the full rule \[Pa\], in the order of
    /// [`Overstress`].
    pub fn isochoric_stress(&self, u: &[f64]) -> Vec<Pack> {
        let mut out = Vec::with_capacity(self.points_of_batches() * components(D));
        compiled().isochoric_stress(Stresses { group: self, u, out: &mut out });
        out
    }

    /// Isochoric energy of the law \[J\] (in 2D per metre of depth) of the elements with
    /// `mine[element]`.
    pub fn isochoric_energy(&self, u: &[f64], mine: &[bool]) -> f64 {
        compiled().isochoric_energy(IsochoricEnergy { group: self, u, mine })
    }

    /// Energies of the branches in a step of length `elapsed` \[s\] from the displacements `u[0]` to
    /// `u[1]` that began with this history, of the elements with `mine[element]`.
    pub fn viscous_energies(
        &self,
        series: &PronySeries,
        history: &ViscousHistory,
        elapsed: f64,
        u: [&[f64]; 2],
        mine: &[bool],
    ) -> ViscousEnergies {
        let mu = self.formulation.moduli().mu;
        compiled().branch_energies(BranchEnergies { group: self, series, history, elapsed, u, mine, mu })
    }
}

/// What is computed in lanes for a group of elements.
trait Compiled<const D: usize>: Sync {
    /// Force and stiffness.
    fn evaluate(&self, job: Job<'_, D>) -> Result<(), Inverted>;
    /// Force and stiffness over a step.
    fn evaluate_step(&self, job: StepJob<'_, D>) -> Result<(), Inverted>;
    /// Force of a change of the pressure.
    fn pressure_change(&self, change: PressureChange<'_, D>);
    /// Strain energy \[J\].
    fn strain_energy(&self, energy: Energy<'_, D>) -> f64;
    /// Isochoric stress at all points.
    fn isochoric_stress(&self, stresses: Stresses<'_, D>);
    /// Isochoric energy \[J\].
    fn isochoric_energy(&self, energy: IsochoricEnergy<'_, D>) -> f64;
    /// Energies of the branches of a Prony series.
    fn branch_energies(&self, energies: BranchEnergies<'_, D>) -> ViscousEnergies;
}

/// The kernels of dimension `D`.
fn compiled<const D: usize>() -> &'static dyn Compiled<D> {
    const { assert!(D == 2 || D == 3, "kernels have two or three dimensions") };
    let both: [&'static dyn Any; 2] = [&PLANE, &SPACE];
    let found = both.iter().find_map(|entry| entry.downcast_ref::<Entry<D>>());
    found.expect("one entry for each dimension").0
}

/// The kernels of one dimension; a type of its own for each dimension.
struct Entry<const D: usize>(&'static dyn Compiled<D>);

static PLANE: Entry<2> = Entry(&Kernels);
static SPACE: Entry<3> = Entry(&Kernels);

struct Kernels;

impl Compiled<2> for Kernels {
    fn evaluate(&self, job: Job<'_, 2>) -> Result<(), Inverted> {
        evaluate::in_plane(job)
    }

    fn evaluate_step(&self, job: StepJob<'_, 2>) -> Result<(), Inverted> {
        step::in_plane(job)
    }

    fn pressure_change(&self, change: PressureChange<'_, 2>) {
        linearised_pressure::in_plane(change);
    }

    fn strain_energy(&self, energy: Energy<'_, 2>) -> f64 {
        energy::in_plane(energy)
    }

    fn isochoric_stress(&self, stresses: Stresses<'_, 2>) {
        viscous::compute(stresses);
    }

    fn isochoric_energy(&self, energy: IsochoricEnergy<'_, 2>) -> f64 {
        viscous::compute(energy)
    }

    fn branch_energies(&self, energies: BranchEnergies<'_, 2>) -> ViscousEnergies {
        viscous::compute(energies)
    }
}

impl Compiled<3> for Kernels {
    fn evaluate(&self, job: Job<'_, 3>) -> Result<(), Inverted> {
        evaluate::solid(job)
    }

    fn evaluate_step(&self, job: StepJob<'_, 3>) -> Result<(), Inverted> {
        step::solid(job)
    }

    fn pressure_change(&self, change: PressureChange<'_, 3>) {
        linearised_pressure::solid(change);
    }

    fn strain_energy(&self, energy: Energy<'_, 3>) -> f64 {
        energy::solid(energy)
    }

    fn isochoric_stress(&self, stresses: Stresses<'_, 3>) {
        viscous::compute(stresses);
    }

    fn isochoric_energy(&self, energy: IsochoricEnergy<'_, 3>) -> f64 {
        viscous::compute(energy)
    }

    fn branch_energies(&self, energies: BranchEnergies<'_, 3>) -> ViscousEnergies {
        viscous::compute(energies)
    }
}
