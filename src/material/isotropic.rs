//! Laws that are functions of the invariants of the stretch: one function gives everything that the program needs of them.
//!
//! With `e = C - 1 = 2 E` and its invariants `i_1 = tr e`, `i_2 = (tr^2 e - e : e) / 2`, `i_3 = det e`, the stress is
//! `S = 2 sum w_k G_k` with the derivatives `w_k` of the energy and
//!
//! `G_1 = 1`, `G_2 = tr(e) 1 - e`, `G_3 = cof e`.
//!
//! A [`Dual`](crate::derivatives::Dual) number gives `w_k`, and a [`Jet`](crate::derivatives::Jet) their derivatives as well, for the
//! tangent. Over a step `w_k` are the slopes of a [`Secant`](crate::derivatives::Secant) and `G_k` their means over the step, with which `i_k(end) - i_k(start) = G_k : (e_end - e_start)` holds exactly:
//! `G_2` is linear in `e`, and Simpson's rule is exact for `G_3`. So `S : (E_end - E_start)` is the change of the energy to rounding,
//! and nothing is divided by the size of the step.
//!
//! In the plane `e` has two rows, and `i_3` is zero.

use super::Part;
use super::invariant_energy::{EnergyOf, INVARIANTS, InvariantEnergy, PackedInvariants, Wanted};
use super::invariants::{Invariants, Isotropic};
use super::law::{IsotropicLaw, Law, LawTask, Parameters, Response};
use super::point_law::{PointEnergy, PointLaw};
use super::potential::Potential;
use super::step::StepMotion;
use crate::composed::{Composed, LaneWise};
use crate::lanes::{RatioSlope, Real};
use crate::square::{Square, cofactor, cofactor_change, double_dot, green_strain, scale_all, sum, trace};

/// `e = C - 1` and the derivatives of its invariants.
#[derive(Debug, Clone, Copy)]
struct Stretch<T, const D: usize> {
    e: Square<T, D>,
    /// `G_2`
    second: Square<T, D>,
    /// `G_3`; zero in the plane.
    third: Square<T, D>,
}

impl<T: Real, const D: usize> Stretch<T, D> {
    #[inline(always)]
    fn new(grad_u: &Square<T, D>) -> Self {
        let e = scale_all(&green_strain(grad_u), grad_u[0][0].constant(2.0));
        let zero = e[0][0].constant(0.0);
        let third = if D == 2 { [[zero; D]; D] } else { cofactor(&e) };
        Self { e, second: complement(&e), third }
    }

    /// The three invariants.
    #[inline(always)]
    fn invariants(&self) -> [T; INVARIANTS] {
        let half = self.e[0][0].constant(0.5);
        let third = if D == 2 {
            self.e[0][0].constant(0.0)
        } else {
            let mut sum = self.e[0][0] * self.third[0][0];
            for j in 1..D {
                sum = self.e[0][j].mul_add(self.third[0][j], sum);
            }
            sum
        };
        // e : G_2 = tr^2 e - e : e
        [trace(&self.e), half * double_dot(&self.e, &self.second), third]
    }
}

/// `tr(e) 1 - e`
#[inline(always)]
fn complement<T: Real, const D: usize>(e: &Square<T, D>) -> Square<T, D> {
    let size = trace(e);
    let mut out = *e;
    for i in 0..D {
        for j in 0..D {
            out[i][j] = -e[i][j];
        }
        out[i][i] = out[i][i] + size;
    }
    out
}

/// `2 sum w_k G_k`
#[inline(always)]
fn combine<T: Real, const D: usize>(
    w: &[T; INVARIANTS],
    second: &Square<T, D>,
    third: &Square<T, D>,
) -> Square<T, D> {
    let [w_1, w_2, w_3] = [w[0] + w[0], w[1] + w[1], w[2] + w[2]];
    let mut out = scale_all(second, w_2);
    for i in 0..D {
        out[i][i] = out[i][i] + w_1;
        if D == 3 {
            for j in 0..D {
                out[i][j] = w_3.mul_add(third[i][j], out[i][j]);
            }
        }
    }
    out
}

/// Change of the stress of a law of invariants with the strain, at a point or over a step.
#[derive(Debug, Clone, Copy)]
pub struct IsotropicTangent<T, const D: usize> {
    /// Derivatives of `w_k` by the invariants, over a step by those at its end.
    derivatives: [[T; INVARIANTS]; INVARIANTS],
    /// `G_2` of the stress.
    second: Square<T, D>,
    /// `G_3` of the stress.
    third: Square<T, D>,
    /// `G_2` at the end, by which the invariants change there.
    second_end: Square<T, D>,
    /// `G_3` at the end.
    third_end: Square<T, D>,
    /// `2 w_2 dG_2 = turn (tr(de) 1 - de)`.
    turn: T,
    /// `2 w_3 dG_3` is the change of the cofactors of this matrix.
    bend: Square<T, D>,
}

impl<T: Real, const D: usize> IsotropicTangent<T, D> {
    #[inline(always)]
    fn contract(&self, strain: &Square<T, D>) -> Square<T, D> {
        let e = scale_all(strain, strain[0][0].constant(2.0));
        let change = [trace(&e), double_dot(&self.second_end, &e), double_dot(&self.third_end, &e)];
        let mut w = change;
        for k in 0..INVARIANTS {
            let derivatives = &self.derivatives[k];
            w[k] = derivatives[0].mul_add(change[0], derivatives[1] * change[1]);
            if D == 3 {
                w[k] = derivatives[2].mul_add(change[2], w[k]);
            }
        }
        let out = combine(&w, &self.second, &self.third);
        let turned = sum(&out, &scale_all(&complement(&e), self.turn));
        if D == 2 { turned } else { sum(&turned, &cofactor_change(&self.bend, &e)) }
    }
}

/// The stretch at both ends of a step, and the means of `G_2` and `G_3` over it.
#[derive(Debug, Clone, Copy)]
struct StretchOverStep<T, const D: usize> {
    start: Stretch<T, D>,
    end: Stretch<T, D>,
    second: Square<T, D>,
    third: Square<T, D>,
}

impl<T: Real, const D: usize> StretchOverStep<T, D> {
    #[inline(always)]
    fn new(motion: &StepMotion<T, D>) -> Self {
        let start = Stretch::new(&motion.start);
        let end = Stretch::new(&motion.end);
        let mean = scale_all(&sum(&start.e, &end.e), start.e[0][0].constant(0.5));
        let mut third = start.third;
        if D == 3 {
            let sixth = mean[0][0].constant(1.0 / 6.0);
            let four = mean[0][0].constant(4.0);
            let ends = sum(&start.third, &end.third);
            third = scale_all(&sum(&ends, &scale_all(&cofactor(&mean), four)), sixth);
        }
        Self { start, end, second: complement(&mean), third }
    }
}

impl<P: Isotropic> Potential for P {
    type Constants = P::Coefficients;

    #[inline(always)]
    fn energy<T: Composed, const D: usize>(coefficients: &P::Coefficients, grad_u: &Square<T, D>) -> T {
        let [first, second, third] = Stretch::new(grad_u).invariants();
        P::energy_of(coefficients, &Invariants::new(first, second, third))
    }
}

/// First derivatives of an energy by the invariants, and the derivatives of these.
struct Slopes<T> {
    first: [T; INVARIANTS],
    second: [[T; INVARIANTS]; INVARIANTS],
}

/// Evaluates an energy and unpacks its derivatives.
#[inline(always)]
fn slopes<T: LaneWise>(energy: &dyn InvariantEnergy, wanted: Wanted<'_>, at: &[T; INVARIANTS]) -> Slopes<T> {
    let found = energy.evaluate(at[0].kind(), wanted, &pack(at));
    let mut out = Slopes { first: *at, second: [*at; INVARIANTS] };
    for k in 0..INVARIANTS {
        out.first[k] = at[0].unpack(&found.first[k]);
        for l in 0..INVARIANTS {
            out.second[k][l] = at[0].unpack(&found.second[k][l]);
        }
    }
    out
}

#[inline(always)]
fn pack<T: LaneWise>(at: &[T; INVARIANTS]) -> PackedInvariants {
    [at[0].pack(), at[1].pack(), at[2].pack()]
}

impl PointEnergy for dyn InvariantEnergy + '_ {
    #[inline(always)]
    fn energy<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> T {
        let at = Stretch::new(grad_u).invariants();
        at[0].unpack(&self.evaluate(at[0].kind(), Wanted::Energy, &pack(&at)).value)
    }
}

impl PointLaw for dyn InvariantEnergy + '_ {
    type Tangent<T: Real, const D: usize> = IsotropicTangent<T, D>;
    type StepTangent<T: Real, const D: usize> = IsotropicTangent<T, D>;

    #[inline(always)]
    fn reserve<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>, _: &Square<T, D>) -> Option<T> {
        if !self.is_limited() {
            return None;
        }
        let at = Stretch::new(grad_u).invariants();
        self.left_to_limit(at[0].kind(), &pack(&at)).map(|left| at[0].unpack(&left))
    }

    #[inline(always)]
    fn stress<T: LaneWise, const D: usize>(&self, grad_u: &Square<T, D>) -> Square<T, D> {
        let stretch = Stretch::new(grad_u);
        let w = slopes(self, Wanted::First, &stretch.invariants()).first;
        combine(&w, &stretch.second, &stretch.third)
    }

    #[inline(always)]
    fn respond<T: LaneWise, const D: usize>(
        &self,
        grad_u: &Square<T, D>,
    ) -> Response<T, IsotropicTangent<T, D>, D> {
        let stretch = Stretch::new(grad_u);
        let Slopes { first: w, second } = slopes(self, Wanted::Second, &stretch.invariants());
        let tangent = IsotropicTangent {
            derivatives: second,
            second: stretch.second,
            third: stretch.third,
            second_end: stretch.second,
            third_end: stretch.third,
            turn: w[1] + w[1],
            bend: scale_all(&stretch.e, w[2] + w[2]),
        };
        Response { second_piola: combine(&w, &stretch.second, &stretch.third), tangent }
    }

    #[inline(always)]
    fn contract<T: Real, const D: usize>(
        tangent: &IsotropicTangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D> {
        tangent.contract(strain)
    }

    #[inline(always)]
    fn stress_over_step<T: LaneWise + RatioSlope, const D: usize>(
        &self,
        motion: &StepMotion<T, D>,
    ) -> Square<T, D> {
        let stretch = StretchOverStep::new(motion);
        let start = pack(&stretch.start.invariants());
        let w = slopes(self, Wanted::Slopes(&start), &stretch.end.invariants()).first;
        combine(&w, &stretch.second, &stretch.third)
    }

    #[inline(always)]
    fn respond_step<T: LaneWise + RatioSlope, const D: usize>(
        &self,
        motion: &StepMotion<T, D>,
    ) -> Response<T, IsotropicTangent<T, D>, D> {
        let stretch = StretchOverStep::new(motion);
        let start = pack(&stretch.start.invariants());
        let wanted = Wanted::SlopeDerivatives(&start);
        let Slopes { first: w, second } = slopes(self, wanted, &stretch.end.invariants());
        // The mean of the cofactors changes as the cofactors at (e_start + 2 e_end) / 6.
        let both = sum(&stretch.start.e, &scale_all(&stretch.end.e, w[0].constant(2.0)));
        let tangent = IsotropicTangent {
            derivatives: second,
            second: stretch.second,
            third: stretch.third,
            second_end: stretch.end.second,
            third_end: stretch.end.third,
            turn: w[1],
            bend: scale_all(&both, w[2].scale(1.0 / 3.0)),
        };
        Response { second_piola: combine(&w, &stretch.second, &stretch.third), tangent }
    }

    #[inline(always)]
    fn contract_step<T: Real, const D: usize>(
        tangent: &IsotropicTangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D> {
        tangent.contract(strain)
    }
}

impl<P> IsotropicLaw for P
where
    P: Isotropic + Parameters + Potential<Constants = <P as Isotropic>::Coefficients>,
{
    fn energy_of_part(&self, part: Part) -> Box<dyn InvariantEnergy> {
        Box::new(EnergyOf::<P>(self.constants(part)))
    }
}

impl<P> Law for P
where
    P: Isotropic + Parameters + Potential<Constants = <P as Isotropic>::Coefficients>,
{
    type Tangent<T: Real, const D: usize> = IsotropicTangent<T, D>;
    type StepTangent<T: Real, const D: usize> = IsotropicTangent<T, D>;

    fn reserve<T: LaneWise, const D: usize>(
        coefficients: &P::Coefficients,
        grad_u: &Square<T, D>,
    ) -> Option<T> {
        dynamic(&EnergyOf::<P>(*coefficients)).reserve(grad_u, grad_u)
    }

    fn stress<T: LaneWise, const D: usize>(
        coefficients: &P::Coefficients,
        grad_u: &Square<T, D>,
    ) -> Square<T, D> {
        dynamic(&EnergyOf::<P>(*coefficients)).stress(grad_u)
    }

    fn respond<T: LaneWise, const D: usize>(
        coefficients: &P::Coefficients,
        grad_u: &Square<T, D>,
    ) -> Response<T, IsotropicTangent<T, D>, D> {
        dynamic(&EnergyOf::<P>(*coefficients)).respond(grad_u)
    }

    fn contract<T: Real, const D: usize>(
        tangent: &IsotropicTangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D> {
        tangent.contract(strain)
    }

    fn stress_over_step<T: LaneWise + RatioSlope, const D: usize>(
        coefficients: &P::Coefficients,
        motion: &StepMotion<T, D>,
    ) -> Square<T, D> {
        dynamic(&EnergyOf::<P>(*coefficients)).stress_over_step(motion)
    }

    fn respond_step<T: LaneWise + RatioSlope, const D: usize>(
        coefficients: &P::Coefficients,
        motion: &StepMotion<T, D>,
    ) -> Response<T, IsotropicTangent<T, D>, D> {
        dynamic(&EnergyOf::<P>(*coefficients)).respond_step(motion)
    }

    fn contract_step<T: Real, const D: usize>(
        tangent: &IsotropicTangent<T, D>,
        strain: &Square<T, D>,
    ) -> Square<T, D> {
        tangent.contract(strain)
    }

    fn accept<K: LawTask>(&self, task: K) -> K::Output {
        task.run_isotropic(self)
    }
}

fn dynamic<P: Isotropic>(energy: &EnergyOf<P>) -> &dyn InvariantEnergy {
    energy
}
