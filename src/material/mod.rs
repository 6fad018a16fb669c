//! Elastic laws: pure functions of the displacement gradient at one point.
//!
//! Every law here has a second Piola stress and a tangent of the form
//! `C = lam m (x) m + 2 q I_m`, `(I_m)_IJKL = (m_IK m_JL + m_IL m_JK) / 2`, with `m` either the identity or `C^-1`. The
//! element kernel lives on that form: it never builds a strain operator or a Voigt matrix.
//!
//! A new law is one file and one line in [`MATERIALS`] and in [`Material`]'s `match`; the derivative tests find it there.

mod hooke;
mod neo_hookean;
mod saint_venant_kirchhoff;
mod step;
#[cfg(test)]
mod step_tests;
#[cfg(test)]
mod tests;

pub use hooke::Hooke;
pub use neo_hookean::NeoHookean;
pub use saint_venant_kirchhoff::SaintVenantKirchhoff;
pub use step::{StepLaw, StepResponse, StepTangent};

use crate::error::{Error, Result};
use crate::lanes::Real;
use crate::square::Square;

/// Lame's parameters \[Pa\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli<T> {
    /// First parameter, `lambda`.
    pub lambda: T,
    /// Shear modulus, `mu`.
    pub mu: T,
}

impl Moduli<f64> {
    /// From Young's modulus \[Pa\] and Poisson's ratio; in 2D they are those of the solid in plane strain.
    ///
    /// # Errors
    /// When not `young_modulus > 0` and `-1 < poisson_ratio < 1/2`.
    pub fn from_engineering(young_modulus: f64, poisson_ratio: f64) -> Result<Self> {
        if !(young_modulus > 0.0 && young_modulus.is_finite()) {
            return Err(Error::case(format!("young_modulus: {young_modulus} is not positive")));
        }
        if !(poisson_ratio > -1.0 && poisson_ratio < 0.5) {
            let cure = "for nearly incompressible rubber use 0.45 to 0.4999";
            return Err(
                Error::case(format!("poisson_ratio: {poisson_ratio} is not between -1 and 0.5")).hint(cure)
            );
        }
        let mu = young_modulus / (2.0 * (1.0 + poisson_ratio));
        Ok(Self { lambda: 2.0 * mu * poisson_ratio / (1.0 - 2.0 * poisson_ratio), mu })
    }

    /// The same in the lanes of `unit`.
    #[inline(always)]
    pub fn in_lanes<T: Real>(self, unit: T) -> Moduli<T> {
        Moduli { lambda: unit.constant(self.lambda), mu: unit.constant(self.mu) }
    }

    /// Only the terms with `lambda`; with [`shear_part`](Self::shear_part) the two halves of selective integration.
    pub fn volumetric_part(self) -> Self {
        Self { mu: 0.0, ..self }
    }

    /// Only the terms with `mu`.
    pub fn shear_part(self) -> Self {
        Self { lambda: 0.0, ..self }
    }

    /// Modulus of uniaxial strain, `lambda + 2 mu` \[Pa\]: density times the square of the pressure wave's speed.
    pub fn uniaxial_strain(self) -> f64 {
        self.lambda + 2.0 * self.mu
    }
}

/// Which metric a law's tangent has; known at compile time, so that what is the identity costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// `m = 1`, `F m F^T = F F^T`.
    Reference,
    /// `m = C^-1`, `F m F^T = 1`.
    Current,
    /// Linear kinematics: both are the identity and the stress does not stiffen.
    Linear,
}

/// A law's answer at one point.
#[derive(Debug, Clone, Copy)]
pub struct Response<T, const D: usize> {
    /// `S` \[Pa\], symmetric (for linear kinematics the one stress there is).
    pub second_piola: Square<T, D>,
    /// `P = F S` \[Pa\]; row = component, column = reference direction. The paper's `T_R` is its transpose.
    pub first_piola: Square<T, D>,
    /// `F m`: takes the reference gradient of a shape function to `h`, with `h . du` = `m : dE`.
    pub gradient_map: Square<T, D>,
    /// `lam` of the tangent \[Pa\].
    pub lam: T,
    /// `q` of the tangent \[Pa\].
    pub q: T,
    /// `det F`, not positive or NaN where the point is inverted; 1 in linear kinematics (NaN if the gradient is).
    pub det_f: T,
}

/// An elastic law.
pub trait Law {
    /// The metric of the tangent.
    const METRIC: Metric;
    /// Stress and tangent at the displacement gradient `grad_u` (row = component, column = reference direction).
    fn respond<T: Real, const D: usize>(moduli: &Moduli<T>, grad_u: &Square<T, D>) -> Response<T, D>;
    /// Strain energy per reference volume [J/m^3]; its derivative with respect to `grad_u` is `P`.
    fn energy<T: Real, const D: usize>(moduli: &Moduli<T>, grad_u: &Square<T, D>) -> T;
}

/// A law that a case can name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// [`SaintVenantKirchhoff`]
    SaintVenantKirchhoff,
    /// [`NeoHookean`]
    NeoHookean,
}

/// One row of [`MATERIALS`].
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// The name in case files.
    pub name: &'static str,
    /// One sentence for `contact-petsc list`.
    pub about: &'static str,
    /// The law.
    pub model: Model,
}

/// The laws; `list`, the hints in errors and the derivative tests iterate it.
pub const MATERIALS: &[Entry] = &[
    Entry {
        name: "saint_venant_kirchhoff",
        about: "linear between Green's strain and the second Piola stress: large rotations, small strains (fails in strong compression)",
        model: Model::SaintVenantKirchhoff,
    },
    Entry {
        name: "neo_hookean",
        about: "compressible neo-Hookean, mu/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2: rubber, large strains",
        model: Model::NeoHookean,
    },
];

/// A law with its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// The law.
    pub model: Model,
    /// Its parameters.
    pub moduli: Moduli<f64>,
}

impl Material {
    /// The material called `name` in case files.
    ///
    /// # Errors
    /// An unknown name (the hint lists the known ones) and parameters out of range.
    pub fn named(name: &str, young_modulus: f64, poisson_ratio: f64) -> Result<Self> {
        let entry = MATERIALS.iter().find(|entry| entry.name == name).ok_or_else(|| {
            let known: Vec<_> = MATERIALS.iter().map(|entry| entry.name).collect();
            Error::case(format!("unknown material '{name}'")).hint(&format!("known: {}", known.join(", ")))
        })?;
        Ok(Self { model: entry.model, moduli: Moduli::from_engineering(young_modulus, poisson_ratio)? })
    }
}
