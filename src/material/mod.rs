//! Hyperelastic laws: pure functions of the displacement gradient at one point.
//!
//! A law is one file and one line in the table below. Its struct is what a case writes: reading, the schema, checks and physics
//! follow from it. Reading, `contact-petsc list`, hints, element kernels and the derivative tests all use the table.
//!
//! * [`Isotropic`] is for laws of the invariants of the stretch: one function, the energy. Stress, tangent and the stress over a step
//!   that conserves energy follow from it by numbers that carry derivatives.
//!   Element kernels see all these laws as one type, [`InvariantEnergy`], and are compiled once for them.
//! * [`Law`] is the interface for laws with another form. Element kernels are compiled for each.
//! * [`MetricLaw`] is a form of the tangent that the kernels sum three times as fast.

mod axisymmetric;
mod check;
mod deviator;
mod hooke;
mod invariant_energy;
mod invariants;
mod isotropic;
mod law;
mod metric;
mod moduli;
mod plane_stress;
mod point_law;
mod potential;
mod prony;
pub mod step;
#[cfg(test)]
mod tests;
mod uniaxial;
mod volumetric;

pub use axisymmetric::{Axisymmetric, HOOP_COMPONENTS, HoopGradient, HoopResponse};
pub use deviator::{Deviator, DeviatorTangent, FiniteDeviator, LinearDeviator};
pub use hooke::Hooke;
pub use invariant_energy::{InvariantEnergy, PackedEnergy, PackedInvariants, Wanted};
pub use invariants::{Invariants, Isochoric, Isotropic, polynomial};
pub use isotropic::IsotropicTangent;
pub use law::{IsotropicLaw, Law, LawTask, Parameters, Response};
pub use metric::{Metric, MetricLaw, MetricResponse, MetricTangent};
pub use moduli::{Moduli, Part};
pub use plane_stress::{PlaneStress, PlaneTangent};
pub use point_law::{LawPart, PointEnergy, PointLaw};
pub use potential::Potential;
pub use prony::{GivenModuli, MaxwellBranch, Overstress, PronySeries};
pub use step::StepMotion;
pub use uniaxial::Uniaxial;
pub use volumetric::{VolumeLaw, VolumeStep, Volumetric};

use crate::error::{Error, Result};
use crate::reader::findings::Findings;
use crate::reader::laws::family;

/// Defines the enum of the laws, its table (see [`family`]), and the access for kernels and checks.
macro_rules! materials {
    ($($name:literal: $file:ident::$law:ident),+ $(,)?) => {
        family! {
            /// Hyperelastic law.
            Material ("material", schema "Material", table MATERIALS):
            $($name: $file::$law),+
        }

        impl Copy for Material {}

        impl Material {
            /// The law of that name in case files with these moduli at small strain; `None` if there is no such law.
            pub fn with_moduli(name: &str, moduli: Moduli<f64>) -> Option<Self> {
                match name {
                    $($name => Some(Self::$law($law::from_moduli(moduli))),)+
                    _ => None,
                }
            }

            /// Does a task with the law.
            pub fn accept<K: LawTask>(&self, task: K) -> K::Output {
                match self {
                    $(Self::$law(law) => law.accept(task),)+
                }
            }

            /// Says what is wrong with its parameters.
            pub fn check(&self, findings: &mut Findings) {
                match self {
                    $(Self::$law(law) => law.check(findings),)+
                }
            }

            /// Moduli at small strain.
            pub fn moduli(&self) -> Moduli<f64> {
                match self {
                    $(Self::$law(law) => law.moduli(),)+
                }
            }

            /// The law with this bulk modulus at small strain \[Pa\], and the same energy of [`Part::Shear`].
            pub fn with_bulk_modulus(&self, bulk: f64) -> Self {
                match self {
                    $(Self::$law(law) => Self::$law(law.with_bulk_modulus(bulk)),)+
                }
            }

            /// Form of the volumetric energy.
            pub fn volumetric(&self) -> Volumetric {
                match self {
                    $(Self::$law(_) => <$law as Parameters>::VOLUMETRIC,)+
                }
            }
        }
    };
}

materials! {
    "neo_hookean": neo_hookean::NeoHookean,
    "saint_venant_kirchhoff": saint_venant_kirchhoff::SaintVenantKirchhoff,
    "mooney_rivlin": mooney_rivlin::MooneyRivlin,
    "yeoh": yeoh::Yeoh,
    "arruda_boyce": arruda_boyce::ArrudaBoyce,
    "gent": gent::Gent,
    "ogden": ogden::Ogden,
}

/// Moduli of the samples of all laws \[Pa\].
const SAMPLE: Moduli<f64> = Moduli { lambda: 1.7, mu: 0.6 };

impl Material {
    /// The law of that name in case files, with these parameters at small strain.
    ///
    /// # Errors
    /// An unknown name (the hint lists the known ones) and parameters out of range.
    pub fn named(name: &str, young_modulus: f64, poisson_ratio: f64) -> Result<Self> {
        let moduli = Moduli::from_engineering(young_modulus, poisson_ratio)?;
        Self::with_moduli(name, moduli).ok_or_else(|| {
            let known: Vec<_> = MATERIALS.iter().map(|entry| entry.name).collect();
            Error::case(format!("unknown material '{name}'")).hint(&format!("known: {}", known.join(", ")))
        })
    }
}
