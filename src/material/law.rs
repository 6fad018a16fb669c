//! What the program needs of a hyperelastic law. All of it is a pure function of the displacement gradient at one point.

use super::step::StepMotion;
use super::{InvariantEnergy, MetricLaw, Moduli, Part, Potential, SAMPLE, Volumetric};
use crate::composed::LaneWise;
use crate::lanes::{RatioSlope, Real};
use crate::reader::findings::Findings;
use crate::square::Square;

/// The parameters of a law as a case writes them.
pub trait Parameters: Potential + Copy + 'static {
    /// Form of the energy of [`Part::Volume`], whose modulus is `lambda` of [`moduli`](Self::moduli).
    const VOLUMETRIC: Volumetric = Volumetric::Rubber;

    /// Says what is wrong with the parameters. A law whose parameters passed has a positive shear and bulk modulus.
    fn check(&self, findings: &mut Findings);

    /// Moduli at small strain.
    fn moduli(&self) -> Moduli<f64>;

    /// The constants of a part of the law. The energies of [`Part::Shear`] and [`Part::Volume`] sum up to that of
    /// [`Part::Whole`], and at small strain each is that of Hooke's law with [`Moduli::part`].
    fn constants(&self, part: Part) -> Self::Constants;

    /// The law with this bulk modulus at small strain \[Pa\]. The energy of [`Part::Shear`] stays.
    fn with_bulk_modulus(&self, bulk: f64) -> Self;

    /// A law of this kind with these moduli at small strain, for comparisons between laws.
    fn from_moduli(moduli: Moduli<f64>) -> Self;

    /// Laws of this kind on which every test of the family runs.
    fn samples() -> Vec<Self> {
        vec![Self::from_moduli(SAMPLE)]
    }
}

/// A hyperelastic law.
///
/// Most laws are functions of the invariants of the stretch. Such a law implements [`Isotropic`](super::Isotropic), which is one
/// function, and is then a `Law`.
pub trait Law: Parameters {
    /// What [`contract`](Self::contract) needs.
    type Tangent<T: Real, const D: usize>: Copy;
    /// What [`contract_step`](Self::contract_step) needs.
    type StepTangent<T: Real, const D: usize>: Copy;

    /// Second Piola stress and tangent at a displacement gradient. No digits of the stress may be lost at small strain.
    fn respond<T: LaneWise, const D: usize>(
        constants: &Self::Constants,
        grad_u: &Square<T, D>,
    ) -> Response<T, Self::Tangent<T, D>, D>;

    /// What is left to the limit of the law, for a law that has no energy beyond a stretch. A trial state where it is not positive is
    /// rejected like an inverted one. `None` for a law without limit.
    #[inline(always)]
    fn reserve<T: LaneWise, const D: usize>(_: &Self::Constants, _: &Square<T, D>) -> Option<T> {
        None
    }

    /// The second Piola stress alone.
    #[inline(always)]
    fn stress<T: LaneWise, const D: usize>(
        constants: &Self::Constants,
        grad_u: &Square<T, D>,
    ) -> Square<T, D> {
        Self::respond(constants, grad_u).second_piola
    }

    /// `dS = C : dE` for a symmetric change `dE` of Green's strain.
    fn contract<T: Real, const D: usize>(
        tangent: &Self::Tangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D>;

    /// A symmetric stress `S` over a step with `S : (E_end - E_start) = W_end - W_start`, see [`step`](super::step), and its
    /// tangent.
    fn respond_step<T: LaneWise + RatioSlope, const D: usize>(
        constants: &Self::Constants,
        motion: &StepMotion<T, D>,
    ) -> Response<T, Self::StepTangent<T, D>, D>;

    /// The stress over a step alone.
    #[inline(always)]
    fn stress_over_step<T: LaneWise + RatioSlope, const D: usize>(
        constants: &Self::Constants,
        motion: &StepMotion<T, D>,
    ) -> Square<T, D> {
        Self::respond_step(constants, motion).second_piola
    }

    /// Change of the stress over a step with a symmetric change `dE` of Green's strain at its end.
    fn contract_step<T: Real, const D: usize>(
        tangent: &Self::StepTangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D>;

    /// Does a task with this law. A [`MetricLaw`] calls [`LawTask::run_metric`] instead, and an [`IsotropicLaw`]
    /// [`LawTask::run_isotropic`].
    #[inline(always)]
    fn accept<K: LawTask>(&self, task: K) -> K::Output {
        task.run(self)
    }
}

/// A law of the invariants with its parameters. Every [`Isotropic`](super::Isotropic) law of the table is one.
pub trait IsotropicLaw: Law {
    /// The energy of a part of the law.
    fn energy_of_part(&self, part: Part) -> Box<dyn InvariantEnergy>;
}

/// A law's answer at one point.
#[derive(Debug, Clone, Copy)]
pub struct Response<T, C, const D: usize> {
    /// `S` \[Pa\], symmetric.
    pub second_piola: Square<T, D>,
    /// What the contraction with a strain needs.
    pub tangent: C,
}

/// Something to be done with a law that is known at run time only. The compiler makes one copy for each law of the
/// table, except for what is behind an interface as in [`run_isotropic`](Self::run_isotropic).
pub trait LawTask: Sized {
    /// What it returns.
    type Output;
    /// Does it with any law.
    fn run<P: Law>(self, law: &P) -> Self::Output;
    /// Does it with a law that has the fast form of the tangent.
    fn run_metric<P: Law + MetricLaw>(self, law: &P) -> Self::Output {
        self.run(law)
    }
    /// Does it with a law of the invariants. A kernel takes the law's [`IsotropicLaw::energy_of_part`], so that it is
    /// compiled once for all these laws.
    fn run_isotropic<P: IsotropicLaw>(self, law: &P) -> Self::Output {
        self.run(law)
    }
}
