//! Small-strain moduli of an isotropic solid, and their parts under a cure for locking.

use crate::error::{Error, Result};
use crate::lanes::Real;

/// Lame's parameters \[Pa\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli<T> {
    /// First parameter, `lambda`.
    pub lambda: T,
    /// Shear modulus, `mu`.
    pub mu: T,
}

/// Part of a law that one quadrature rule integrates.
///
/// At small strain the parts of every law are those of Hooke's law: the terms with `mu` and the terms with `lambda`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    Whole,
    /// What does not lock: at small strain the terms with `mu`.
    Shear,
    /// What locks in a nearly incompressible solid: at small strain the terms with `lambda`.
    Volume,
}

impl Part {
    /// All parts.
    pub const ALL: [Self; 3] = [Self::Whole, Self::Shear, Self::Volume];
}

impl Moduli<f64> {
    /// From Young's modulus \[Pa\] and Poisson's ratio of the solid, also in 2D.
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
        Ok(Self::of(young_modulus, poisson_ratio))
    }

    /// From Young's modulus \[Pa\] and Poisson's ratio that are known to be in their ranges.
    pub fn of(young_modulus: f64, poisson_ratio: f64) -> Self {
        let mu = young_modulus / (2.0 * (1.0 + poisson_ratio));
        Self { lambda: 2.0 * mu * poisson_ratio / (1.0 - 2.0 * poisson_ratio), mu }
    }

    /// From the shear and the bulk modulus \[Pa\].
    pub fn of_shear_and_bulk(mu: f64, bulk: f64) -> Self {
        Self { lambda: bulk - 2.0 / 3.0 * mu, mu }
    }

    /// Bulk modulus, `lambda + 2/3 mu` \[Pa\].
    pub fn bulk(self) -> f64 {
        self.lambda + 2.0 / 3.0 * self.mu
    }

    /// Young's modulus \[Pa\].
    pub fn young_modulus(self) -> f64 {
        self.mu * (3.0 * self.lambda + 2.0 * self.mu) / (self.lambda + self.mu)
    }

    /// Poisson's ratio.
    pub fn poisson_ratio(self) -> f64 {
        self.lambda / (2.0 * (self.lambda + self.mu))
    }

    /// Modulus of uniaxial strain, `lambda + 2 mu` \[Pa\]: density times the square of the pressure wave's speed.
    pub fn uniaxial_strain(self) -> f64 {
        self.lambda + 2.0 * self.mu
    }

    /// Ratio of the strain across the plane to minus the trace of the strain in the plane under plane stress.
    pub fn thickness_ratio(self) -> f64 {
        self.lambda / self.uniaxial_strain()
    }

    /// The moduli in the plane under plane stress: with `lambda* = 2 lambda mu / (lambda + 2 mu)` Hooke's law in
    /// the plane is that of the solid whose stress across the plane is zero (3.34).
    pub fn plane_stress(self) -> Self {
        Self { lambda: 2.0 * self.mu * self.thickness_ratio(), mu: self.mu }
    }

    /// The terms that belong to a part, the others zero.
    pub fn part(self, part: Part) -> Self {
        match part {
            Part::Whole => self,
            Part::Shear => Self { lambda: 0.0, ..self },
            Part::Volume => Self { mu: 0.0, ..self },
        }
    }

    /// The same in the lanes of `unit`.
    #[inline(always)]
    pub fn in_lanes<T: Real>(self, unit: T) -> Moduli<T> {
        Moduli { lambda: unit.constant(self.lambda), mu: unit.constant(self.mu) }
    }
}
