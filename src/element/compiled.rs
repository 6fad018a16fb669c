//! The kernels of two and three dimensions, compiled in this crate.
//!
//! A function that is generic over the dimension is compiled again by every crate that calls it. The
//! kernels take most of the time of a build. Behind the interface [`Compiled`] they are compiled once, for
//! the program and its tests. Plane stress and axisymmetry are compiled for two dimensions only.

use std::any::Any;

use super::energy::Energy;
use super::linearised_pressure::PressureChange;
use super::step::StepJob;
use super::viscous::{BranchEnergies, IsochoricEnergy, Stresses};
use super::workspace::Job;
use super::{Inverted, ViscousEnergies, energy, evaluate, linearised_pressure, step, viscous};

/// What is computed in lanes for a group of elements.
pub(super) trait Compiled<const D: usize>: Sync {
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
///
/// # Panics
/// `D` is neither 2 nor 3.
pub(super) fn compiled<const D: usize>() -> &'static dyn Compiled<D> {
    let both: [&'static dyn Any; 2] = [&PLANE, &SPACE];
    let found = both.iter().find_map(|entry| entry.downcast_ref::<Entry<D>>());
    found.expect("a body of two or three dimensions").0
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
