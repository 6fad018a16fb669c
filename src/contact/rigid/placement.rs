//! Position and velocity of a rigid body at an instant.

use crate::tensor::{Tensor, Vector};

/// Position and velocity of a rigid body at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement<const D: usize> {
    /// Displacement of the reference point \[m\].
    pub translation: Vector<D>,
    /// Rotation `R` since the reference configuration.
    pub rotation: Tensor<D>,
    /// Velocity of the reference point \[m/s\].
    pub velocity: Vector<D>,
    /// Angular velocity in the body frame as a skew tensor, `R^T dR/dt` \[rad/s\].
    pub spin: Tensor<D>,
}

impl<const D: usize> Default for Placement<D> {
    fn default() -> Self {
        Self {
            translation: Vector::zeros(),
            rotation: Tensor::identity(),
            velocity: Vector::zeros(),
            spin: Tensor::zeros(),
        }
    }
}

impl<const D: usize> Placement<D> {
    /// All numbers.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let Self { translation, rotation, velocity, spin } = self;
        translation.iter().chain(velocity.iter()).chain(rotation.iter()).chain(spin.iter()).copied()
    }
}

/// The rotation by an angle \[rad\] about the unit axis with this generator.
pub(super) fn rotation_about<const D: usize>(generator: &Tensor<D>, angle: f64) -> Tensor<D> {
    // The half angle loses no digits in 1 - cos.
    let half = (0.5 * angle).sin();
    Tensor::identity() + generator * angle.sin() + generator * generator * (2.0 * half * half)
}
