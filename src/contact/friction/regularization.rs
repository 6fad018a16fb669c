//! Regularization of the set-valued friction law by a stick velocity (2.8), or by a stick
//! stiffness.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::findings::Findings;
use crate::reader::quantity::{Stiffness, Velocity};
use crate::reader::tagged::tagged;

/// How stick is approximated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "Regularization")]
pub enum Regularization {
    /// Slip speed below which friction is proportional to the slip speed \[m/s\], > 0; a sticking point
    /// creeps at most at this speed. t_T = -b v_T / max(|v_T|, stick_velocity), (2.8).
    StickVelocity(Velocity),
    /// Slip speed of the smooth law (2.29) \[m/s\], > 0: friction reaches its bound only at speeds well
    /// above it.
    SmoothStickVelocity(Velocity),
    /// Tangential stiffness of stick \[Pa/m\], > 0: return map, no creep.
    StickStiffness(Stiffness),
}
tagged!(Regularization, "regularization");

/// `phi` and its derivative, so that `t_T = -b phi v_T`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseSlipSpeed {
    /// `phi_eps` \[s/m\], finite at rest.
    pub value: f64,
    /// `dphi/d|v_T|` \[s^2/m^2\].
    pub derivative: f64,
}

impl Regularization {
    /// The paper's regularization, with a stick velocity \[m/s\].
    pub fn stick_velocity(velocity: f64) -> Self {
        Self::StickVelocity(Velocity::new(velocity))
    }

    /// The smooth variant, with a stick velocity \[m/s\].
    pub fn smooth_stick_velocity(velocity: f64) -> Self {
        Self::SmoothStickVelocity(Velocity::new(velocity))
    }

    /// The return map, with a stick stiffness \[Pa/m\].
    pub fn stick_stiffness(stiffness: f64) -> Self {
        Self::StickStiffness(Stiffness::new(stiffness))
    }

    /// The slip velocity below which points stick; `None` for a stick stiffness.
    pub fn slip_velocity(&self) -> Option<Velocity> {
        match *self {
            Self::StickVelocity(velocity) | Self::SmoothStickVelocity(velocity) => Some(velocity),
            Self::StickStiffness(_) => None,
        }
    }

    /// The stick stiffness; `None` for a stick velocity.
    pub fn stiffness(&self) -> Option<Stiffness> {
        match *self {
            Self::StickStiffness(stiffness) => Some(stiffness),
            Self::StickVelocity(_) | Self::SmoothStickVelocity(_) => None,
        }
    }

    /// Number in [`REGULARIZATIONS`] and the parameter.
    pub fn numbered(&self) -> (usize, f64) {
        match *self {
            Self::StickVelocity(velocity) => (0, velocity.value),
            Self::SmoothStickVelocity(velocity) => (1, velocity.value),
            Self::StickStiffness(stiffness) => (2, stiffness.value),
        }
    }

    /// The regularization with this number in [`REGULARIZATIONS`]; `None` if the number is unknown.
    pub fn from_number(number: usize, parameter: f64) -> Option<Self> {
        REGULARIZATIONS.get(number).map(|entry| (entry.of)(parameter))
    }

    /// Reports an invalid parameter.
    pub fn check(&self, findings: &mut Findings) {
        self.stiffness().into_iter().for_each(|value| findings.positive("the stick stiffness", value));
        self.slip_velocity().into_iter().for_each(|value| findings.positive("the stick velocity", value));
    }
}

/// `phi = 1 / max(speed, stick_velocity)` (2.8). This is the only division by a slip speed in the
/// program.
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
#[derive(Debug)]
pub struct RegularizationEntry {
    /// Name in the case file.
    pub name: &'static str,
    /// One line for `contact-petsc list`.
    pub about: &'static str,
    /// Creates the regularization with this parameter.
    pub of: fn(f64) -> Regularization,
    /// Parameter with which the derivative tests run.
    pub sample: f64,
}

/// All regularizations, for `list` and the tests.
pub const REGULARIZATIONS: &[RegularizationEntry] = &[
    RegularizationEntry {
        name: "stick_velocity",
        about: "t_T = -b v_T / max(|v_T|, stick_velocity), (2.8); creeps",
        of: Regularization::stick_velocity,
        sample: 1e-2,
    },
    RegularizationEntry {
        name: "smooth_stick_velocity",
        about: "t_T = -b v_T / sqrt(|v_T|^2 + smooth_stick_velocity^2); creeps",
        of: Regularization::smooth_stick_velocity,
        sample: 1e-2,
    },
    RegularizationEntry {
        name: "stick_stiffness",
        about: "return map with elastic stick; does not creep",
        of: Regularization::stick_stiffness,
        sample: 1e9,
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::taylor_rate;

    /// The derivatives of both phi have Taylor order two on either side of the stick velocity and
    /// are finite at rest.
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

    /// A regularization parameter of zero is rejected, because the law divides by it.
    #[test]
    fn refuses_zero() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            for entry in REGULARIZATIONS {
                let mut findings = Findings::new(crate::reader::units::Units::SI);
                (entry.of)(bad).check(&mut findings);
                assert!(!findings.is_empty(), "{} {bad}", entry.name);
            }
        }
    }
}
