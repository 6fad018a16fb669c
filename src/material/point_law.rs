//! Laws with their constants, as the element kernels evaluate them.
//!
//! A kernel is compiled for each type of [`PointLaw`]. All laws of the invariants share one type,
//! [`dyn InvariantEnergy`](super::InvariantEnergy); any other law `P` has [`LawPart<P>`](LawPart).

use super::{Law, Potential, Response, StepMotion};
use crate::composed::LaneWise;
use crate::lanes::{RatioSlope, Real};
use crate::square::Square;

/// The stored energy of a part of a law.
pub trait PointEnergy {
    /// [`Potential::energy`].
    fn energy<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> T;
}

/// A part of a law. Its functions are those of [`Law`] with the same name.
pub trait PointLaw: PointEnergy {
    /// [`Law::Tangent`].
    type Tangent<T: Real, const D: usize>: Copy;
    /// [`Law::StepTangent`].
    type StepTangent<T: Real, const D: usize>: Copy;

    /// [`Law::reserve`] at a gradient whose stress is known. If the stress is the solution of
    /// an equation, NaN there means that the equation has no solution.
    fn reserve<T: LaneWise, const D: usize>(
        &self,
        grad_u: &Square<T, D>,
        second_piola: &Square<T, D>,
    ) -> Option<T>;

    /// [`Law::stress`].
    fn stress<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> Square<T, D>;

    /// [`Law::respond`].
    fn respond<T: LaneWise, const D: usize>(
        &self,
        grad_u: &Square<T, D>,
    ) -> Response<T, Self::Tangent<T, D>, D>;

    /// [`Law::contract`].
    fn contract<T: Real, const D: usize>(
        tangent: &Self::Tangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D>;

    /// [`Law::stress_over_step`].
    fn stress_over_step<T: LaneWise + RatioSlope, const D: usize>(
        &self,
        motion: &StepMotion<T, D>,
    ) -> Square<T, D>;

    /// [`Law::respond_step`].
    fn respond_step<T: LaneWise + RatioSlope, const D: usize>(
        &self,
        motion: &StepMotion<T, D>,
    ) -> Response<T, Self::StepTangent<T, D>, D>;

    /// [`Law::contract_step`].
    fn contract_step<T: Real, const D: usize>(
        tangent: &Self::StepTangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D>;
}

/// A part of a law that is known at compile time, by its constants.
#[derive(Debug, Clone, Copy)]
pub struct LawPart<P: Potential>(pub P::Constants);

impl<P: Potential> PointEnergy for LawPart<P> {
    #[inline(always)]
    fn energy<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> T {
        P::energy(&self.0, grad_u)
    }
}

impl<P: Law> PointLaw for LawPart<P> {
    type Tangent<T: Real, const D: usize> = P::Tangent<T, D>;
    type StepTangent<T: Real, const D: usize> = P::StepTangent<T, D>;

    #[inline(always)]
    fn reserve<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>, _: &Square<T, D>) -> Option<T> {
        P::reserve(&self.0, grad_u)
    }

    #[inline(always)]
    fn stress<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> Square<T, D> {
        P::stress(&self.0, grad_u)
    }

    #[inline(always)]
    fn respond<T: LaneWise, const D: usize>(
        &self,
        grad_u: &Square<T, D>,
    ) -> Response<T, P::Tangent<T, D>, D> {
        P::respond(&self.0, grad_u)
    }

    #[inline(always)]
    fn contract<T: Real, const D: usize>(tangent: &P::Tangent<T, D>, strain: &Square<T, D>) -> Square<T, D> {
        P::contract(tangent, strain)
    }

    #[inline(always)]
    fn stress_over_step<T: LaneWise + RatioSlope, const D: usize>(
        &self,
        motion: &StepMotion<T, D>,
    ) -> Square<T, D> {
        P::stress_over_step(&self.0, motion)
    }

    #[inline(always)]
    fn respond_step<T: LaneWise + RatioSlope, const D: usize>(
        &self,
        motion: &StepMotion<T, D>,
    ) -> Response<T, P::StepTangent<T, D>, D> {
        P::respond_step(&self.0, motion)
    }

    #[inline(always)]
    fn contract_step<T: Real, const D: usize>(
        tangent: &P::StepTangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D> {
        P::contract_step(tangent, strain)
    }
}
