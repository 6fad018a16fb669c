//! How the set-valued law of friction becomes a function: a stick velocity (2.8), or a stick stiffness.

use crate::contact::check::positive;
use crate::error::Result;

/// Regularisation of the stick branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regularization {
    /// The paper's `phi_eps`: linear in the slip velocity below `velocity` \[m/s\], on the bound above. Creeps.
    StickVelocity {
        /// `eps` of phi \[m/s\].
        velocity: f64,
    },
    /// The smooth `phi = 1 / sqrt(|v_T|^2 + velocity^2)` (2.29). Creeps, and approaches the bound only at speed.
    SmoothStickVelocity {
        /// `eps` of phi \[m/s\].
        velocity: f64,
    },
    /// Return map: elastic stick of this stiffness, slip on the bound. Does not creep.
    StickStiffness {
        /// `k_T` \[Pa/m\].
        stiffness: f64,
    },
}

/// `phi` and its slope, so that `t_T = -b phi v_T`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseSlipSpeed {
    /// `phi_eps` \[s/m\], finite at rest.
    pub value: f64,
    /// `dphi/d|v_T|` \[s^2/m^2\].
    pub derivative: f64,
}

impl Regularization {
    /// The paper's regularisation.
    ///
    /// # Errors
    /// When `velocity` \[m/s\] is not positive and finite.
    pub fn stick_velocity(velocity: f64) -> Result<Self> {
        Ok(Self::StickVelocity { velocity: positive("the stick velocity", velocity)? })
    }

    /// The smooth variant of the paper's regularisation.
    ///
    /// # Errors
    /// When `velocity` \[m/s\] is not positive and finite.
    pub fn smooth_stick_velocity(velocity: f64) -> Result<Self> {
        Ok(Self::SmoothStickVelocity { velocity: positive("the stick velocity", velocity)? })
    }

    /// The return map.
    ///
    /// # Errors
    /// When `stiffness` \[Pa/m\] is not positive and finite.
    pub fn stick_stiffness(stiffness: f64) -> Result<Self> {
        Ok(Self::StickStiffness { stiffness: positive("the stick stiffness", stiffness)? })
    }
}

/// `phi = 1 / max(speed, stick_velocity)` (2.8), the only division by a slip speed in the program.
pub fn inverse_slip_speed(speed: f64, stick_velocity: f64) -> InverseSlipSpeed {
    if speed <= stick_velocity {
        return InverseSlipSpeed { value: 1.0 / stick_velocity, derivative: 0.0 };
    }
    let value = 1.0 / speed;
    InverseSlipSpeed { value, derivative: -value * value }
}

/// `phi = 1 / sqrt(speed^2 + stick_velocity^2)`, differentiable everywhere.
pub fn smooth_inverse_slip_speed(speed: f64, stick_velocity: f64) -> InverseSlipSpeed {
    let value = 1.0 / speed.hypot(stick_velocity);
    InverseSlipSpeed { value, derivative: -(speed * value) * value * value }
}

/// A row of [`REGULARIZATIONS`].
pub struct RegularizationEntry {
    /// Name in the case file.
    pub name: &'static str,
    /// One line for `contact-petsc list`.
    pub summary: &'static str,
    /// Instances on which every test of derivatives runs.
    pub samples: fn() -> Vec<Regularization>,
}

/// Every regularisation there is: feeds `list`, the hints in errors and the tests.
pub const REGULARIZATIONS: &[RegularizationEntry] = &[
    RegularizationEntry {
        name: "stick_velocity",
        summary: "t_T = -b v_T / max(|v_T|, stick_velocity), (2.8); creeps",
        samples: || Regularization::stick_velocity(1e-2).into_iter().collect(),
    },
    RegularizationEntry {
        name: "smooth_stick_velocity",
        summary: "t_T = -b v_T / sqrt(|v_T|^2 + smooth_stick_velocity^2); creeps",
        samples: || Regularization::smooth_stick_velocity(1e-2).into_iter().collect(),
    },
    RegularizationEntry {
        name: "stick_stiffness",
        summary: "return map with elastic stick; does not creep",
        samples: || Regularization::stick_stiffness(1e9).into_iter().collect(),
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::taylor_rate;

    /// Both phi have slopes of Taylor order two on both sides of the stick velocity and are finite at rest.
    #[test]
    fn slopes_have_taylor_order_two() {
        for phi in [inverse_slip_speed, smooth_inverse_slip_speed] {
            for speed in [3e-4, 0.2] {
                let f = |x: &[f64]| vec![phi(x[0], 1e-3).value];
                let df = |_: &[f64], d: &[f64]| vec![phi(speed, 1e-3).derivative * d[0]];
                assert!(taylor_rate(f, df, &[speed], &[0.3 * speed]) > 1.9);
            }
            assert_eq!(phi(0.0, 1e-3).value, 1e3);
            assert!(phi(1e300, 1e-300).derivative.is_finite());
        }
    }

    /// A regularisation of zero is refused, since it would divide by it.
    #[test]
    fn refuses_zero() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Regularization::stick_velocity(bad).is_err());
            assert!(Regularization::smooth_stick_velocity(bad).is_err());
            assert!(Regularization::stick_stiffness(bad).is_err());
        }
        assert!(REGULARIZATIONS.iter().all(|entry| !(entry.samples)().is_empty()));
    }
}
