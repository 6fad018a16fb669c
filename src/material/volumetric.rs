//! The volumetric energy of a law as a function of one number, the dilatation.
//!
//! Elements that treat locking by a mean dilatation evaluate this energy at a dilatation that is projected
//! on a space of few functions per element (theory, section 3.8). The energy is that of
//! [`Part::Volume`](super::Part), which for every law is a function of one scalar:
//!
//! | Law | Dilatation `s` | Energy |
//! |---|---|---|
//! | Laws of rubber | `J - 1` | `lambda/4 (J^2 - 1 - 2 ln J)` |
//! | neo-Hookean | `J - 1` | `lambda/2 (ln J)^2` |
//! | Saint Venant-Kirchhoff | `tr E` | `lambda/2 s^2` |
//! | Hooke | `tr eps` | `lambda/2 s^2` |

use super::step::{StepMotion, mean_cofactor_minus_one};
use crate::lanes::{RatioSlope, Real};
use crate::square::{
    Square, cofactor, cofactor_change, det_minus_one, diagonal, double_dot, green_strain, plus_one,
    scale_all, sum, trace,
};

/// Form of the volumetric energy of a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Volumetric {
    /// `lambda/4 (J^2 - 1 - 2 ln J)`, see [`Invariants::volumetric`](super::Invariants::volumetric).
    Rubber,
    /// `lambda/2 (ln J)^2`.
    Logarithmic,
    /// `lambda/2 (tr E)^2`.
    GreenTrace,
    /// `lambda/2 (tr eps)^2`.
    SmallTrace,
}

/// The volumetric energy of a law with its modulus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumeLaw {
    /// Form of the energy.
    pub form: Volumetric,
    /// Lame's first parameter \[Pa\].
    pub lambda: f64,
}

/// The mean over a step of the derivative of the dilatation by Green's strain, and its change.
#[derive(Debug, Clone, Copy)]
pub struct VolumeStep<T, const D: usize> {
    /// `G`, symmetric, with `s_end - s_start = G : (E_end - E_start)`.
    pub gradient: Square<T, D>,
    /// `dG = shape (slope : dE) + bend dcof(stretch)`.
    shape: Square<T, D>,
    slope: Square<T, D>,
    bend: T,
    stretch: Square<T, D>,
}

impl Volumetric {
    /// Whether the dilatation is `J - 1`.
    fn is_ratio(self) -> bool {
        matches!(self, Self::Rubber | Self::Logarithmic)
    }
}

impl VolumeLaw {
    /// The dilatation `s` at a displacement gradient. No digits are lost at small strain.
    #[inline(always)]
    pub fn dilatation<T: Real, const D: usize>(&self, grad_u: &Square<T, D>) -> T {
        match self.form {
            Volumetric::Rubber | Volumetric::Logarithmic => det_minus_one(grad_u),
            Volumetric::GreenTrace => trace(&green_strain(grad_u)),
            Volumetric::SmallTrace => trace(grad_u),
        }
    }

    /// `ds/dF`: the cofactors of `F`, `F`, or the identity. Row = component, column = reference
    /// direction.
    #[inline(always)]
    pub fn gradient<T: Real, const D: usize>(&self, grad_u: &Square<T, D>) -> Square<T, D> {
        match self.form {
            Volumetric::Rubber | Volumetric::Logarithmic => cofactor(&plus_one(grad_u)),
            Volumetric::GreenTrace => plus_one(grad_u),
            Volumetric::SmallTrace => diagonal(grad_u[0][0].constant(1.0)),
        }
    }

    /// Ratio of volumes at a dilatation, which must be positive; one for laws of a trace (NaN if the
    /// dilatation is).
    #[inline(always)]
    pub fn volume_ratio<T: Real>(&self, dilatation: T) -> T {
        let part = if self.form.is_ratio() { dilatation } else { dilatation.scale(0.0) };
        part + dilatation.constant(1.0)
    }

    /// Energy per reference volume [J/m^3].
    #[inline(always)]
    pub fn energy<T: Real>(&self, dilatation: T) -> T {
        match self.form {
            Volumetric::Rubber => {
                let growth = dilatation * (dilatation + dilatation.constant(2.0));
                growth.ln_1p_remainder().scale(0.25 * self.lambda)
            }
            Volumetric::Logarithmic => {
                let logarithm = dilatation.ln_1p();
                (logarithm * logarithm).scale(0.5 * self.lambda)
            }
            Volumetric::GreenTrace | Volumetric::SmallTrace => {
                (dilatation * dilatation).scale(0.5 * self.lambda)
            }
        }
    }

    /// First and second derivative of the energy by the dilatation \[Pa\]. The first is the mean
    /// Cauchy stress of the volumetric part, where the dilatation is `J - 1`.
    #[inline(always)]
    pub fn slope_and_curvature<T: Real>(&self, dilatation: T) -> [T; 2] {
        let one = dilatation.constant(1.0);
        match self.form {
            Volumetric::Rubber => {
                let inverse = (dilatation + one).recip();
                let slope = dilatation * (dilatation + dilatation.constant(2.0)) * inverse;
                let half = 0.5 * self.lambda;
                [slope.scale(half), inverse.mul_add(inverse, one).scale(half)]
            }
            Volumetric::Logarithmic => {
                let inverse = (dilatation + one).recip();
                let logarithm = dilatation.ln_1p();
                let scaled = inverse.scale(self.lambda);
                [logarithm * scaled, (one - logarithm) * inverse * scaled]
            }
            Volumetric::GreenTrace | Volumetric::SmallTrace => {
                [dilatation.scale(self.lambda), one.scale(self.lambda)]
            }
        }
    }

    /// The slope `(U_end - U_start) / (s_end - s_start)` of the energy over a step \[Pa\], and its
    /// derivative by the dilatation at the end.
    #[inline(always)]
    pub fn slope_over_step<T: RatioSlope>(&self, start: T, end: T) -> [T; 2] {
        let one = start.constant(1.0);
        match self.form {
            Volumetric::Rubber | Volumetric::Logarithmic => {
                // l = ln(J_end / J_start) / (J_end - J_start) = (1 + ratio) / J_start
                let inverse = (start + one).recip();
                let [ratio, ratio_slope] = ((end - start) * inverse).ln_1p_ratio_and_slope();
                let by_end = ratio_slope * inverse * inverse;
                if self.form == Volumetric::Rubber {
                    let rest = (start - ratio) * inverse;
                    let quarter = 0.25 * self.lambda;
                    [(start + end + rest + rest).scale(quarter), (one - by_end - by_end).scale(quarter)]
                } else {
                    let quotient = (ratio + one) * inverse;
                    let logarithms = start.ln_1p() + end.ln_1p();
                    let half = 0.5 * self.lambda;
                    let slope = logarithms.mul_add(by_end, quotient * (end + one).recip());
                    [(logarithms * quotient).scale(half), slope.scale(half)]
                }
            }
            Volumetric::GreenTrace | Volumetric::SmallTrace => {
                let half = 0.5 * self.lambda;
                [(start + end).scale(half), one.scale(half)]
            }
        }
    }

    /// The mean derivative of the dilatation by Green's strain over a step. The dilatation of linear
    /// kinematics is not one of Green's strain.
    #[inline(always)]
    pub fn over_step<T: Real, const D: usize>(&self, motion: &StepMotion<T, D>) -> VolumeStep<T, D> {
        let zero = motion.start[0][0].constant(0.0);
        let one = zero.constant(1.0);
        let nothing = [[zero; D]; D];
        if !self.form.is_ratio() {
            let gradient = diagonal(one);
            return VolumeStep { gradient, shape: nothing, slope: nothing, bend: zero, stretch: nothing };
        }
        // The difference of J^2 = det C is (G_I : dC), and J_end - J_start that over J_start + J_end.
        let two = zero.constant(2.0);
        let low = scale_all(&green_strain(&motion.start), two);
        let high = scale_all(&green_strain(&motion.end), two);
        let mean = scale_all(&sum(&low, &high), zero.constant(0.5));
        let cofactors = plus_one(&mean_cofactor_minus_one(&low, &mean, &high));
        let det_start = det_minus_one(&motion.start) + one;
        let det_end = det_minus_one(&motion.end) + one;
        let inverse = (det_start + det_end).recip();
        let bend = inverse + inverse;
        let gradient = scale_all(&cofactors, bend);
        let slope = scale_all(&cofactor(&plus_one(&high)), det_end.recip());
        let third = sum(&low, &scale_all(&high, two));
        let stretch = plus_one(&scale_all(&third, zero.constant(1.0 / 3.0)));
        VolumeStep { gradient, shape: scale_all(&gradient, -inverse), slope, bend, stretch }
    }
}

impl<T: Real, const D: usize> VolumeStep<T, D> {
    /// Change of the mean derivative with a symmetric change of Green's strain at the end.
    #[inline(always)]
    pub fn contract(&self, strain: &Square<T, D>) -> Square<T, D> {
        let along = scale_all(&self.shape, double_dot(&self.slope, strain));
        sum(&along, &scale_all(&cofactor_change(&self.stretch, strain), self.bend))
    }
}
