//! Friction: a bound on the tangential traction, a regularization of stick, and for some laws a
//! coefficient. Each law has its own file and one line in the table below.

pub mod coefficient;
pub mod regularization;
pub mod traction;
#[cfg(test)]
mod traction_tests;

use super::normal::NormalResponse;
use crate::reader::findings::Findings;
use crate::reader::laws::laws;
pub use regularization::Regularization;

/// Quantities on which a friction bound may depend.
#[derive(Debug, Clone, Copy)]
pub struct Pressed {
    /// Response of the normal law.
    pub normal: NormalResponse,
    /// Gap \[m\], negative in contact.
    pub gap: f64,
    /// `|v_T| >= 0` \[m/s\].
    pub slip_speed: f64,
}

/// The friction bound with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bound {
    /// `b >= 0` \[Pa\].
    pub value: f64,
    /// `db/dg` \[Pa/m\], including the dependence through the normal traction.
    pub by_gap: f64,
    /// `db/d|v_T|` \[Pa s/m\].
    pub by_speed: f64,
}

laws! {
    /// Friction law: the bound on the friction traction as a function of normal traction and slip.
    FrictionLaw ("friction law", schema "Friction", table FRICTION_LAWS) implements FrictionBound:
    "none": none::Frictionless,
    "coulomb": coulomb::Coulomb,
    "power_law": power_law::FrictionPowerLaw,
}

impl Default for FrictionLaw {
    fn default() -> Self {
        Self::Frictionless(Frictionless {})
    }
}

/// A law for the friction bound.
pub trait FrictionBound {
    /// Bound and derivatives at a closed point.
    fn bound(&self, at: Pressed) -> Bound;

    /// Regularization of stick below the bound; `None` without friction.
    fn regularization(&self) -> Option<Regularization>;

    /// Reports invalid parameters. The regularization is checked elsewhere.
    fn check(&self, findings: &mut Findings);

    /// Whether the bound depends on the slip speed, so that `C_mu` exists.
    fn depends_on_speed(&self) -> bool {
        false
    }

    /// Whether the ratio of bound to normal traction depends on the normal traction.
    fn coefficient_depends_on_pressure(&self) -> bool {
        false
    }
}

/// Derivatives are limited to this magnitude. Larger ones are effectively infinite, and a product
/// of zero and infinity would not be zero.
const STEEPEST: f64 = 1e200;

impl FrictionLaw {
    /// Bound and derivatives; zero at an open point.
    pub fn bound(&self, at: Pressed) -> Bound {
        if at.normal.traction <= 0.0 {
            return Bound::default();
        }
        let bound = self.law().bound(at);
        Bound { by_gap: bound.by_gap.clamp(-STEEPEST, STEEPEST), ..bound }
    }

    /// Derivative of the bound by the normal traction \[-\] at fixed gap.
    pub fn by_pressure(&self, at: Pressed) -> f64 {
        // The derivative by the gap is linear in that of the normal traction.
        let with = |derivative| {
            self.bound(Pressed { normal: NormalResponse { derivative, ..at.normal }, ..at }).by_gap
        };
        with(1.0) - with(0.0)
    }

    /// Whether the law has friction.
    pub fn rubs(&self) -> bool {
        self.law().regularization().is_some()
    }

    /// The friction of a contact; `None` if the contact is frictionless.
    pub fn friction(&self) -> Option<Friction> {
        self.law().regularization().map(|regularization| Friction { law: *self, regularization })
    }
}

/// Friction of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// The bound.
    pub law: FrictionLaw,
    /// Regularization of stick: that of the law, or a stiffer one.
    pub regularization: Regularization,
}

#[cfg(test)]
mod tests {
    use super::coefficient::{Constant, GroschSchallamach};
    use super::*;
    use crate::contact::normal::{NORMAL_LAWS, NormalLaw, NormalPowerLaw};
    use crate::taylor::taylor_rate;

    fn all() -> Vec<FrictionLaw> {
        FRICTION_LAWS.iter().flat_map(|entry| (entry.samples)()).collect()
    }

    fn bound(law: &FrictionLaw, normal: &NormalLaw, gap: f64, slip_speed: f64) -> Bound {
        law.bound(Pressed { normal: normal.evaluate(gap), gap, slip_speed })
    }

    /// For every combination of friction law and normal law, the derivatives by gap and by speed
    /// have Taylor order two.
    #[test]
    fn bounds_have_taylor_order_two() {
        for normal in NORMAL_LAWS.iter().flat_map(|entry| (entry.samples)()) {
            for law in all() {
                let gap = -2e-4;
                let speed = 0.03;
                let f = |x: &[f64]| vec![bound(&law, &normal, x[0], x[1]).value];
                let at = bound(&law, &normal, gap, speed);
                let df = |_: &[f64], d: &[f64]| vec![at.by_gap * d[0] + at.by_speed * d[1]];
                assert!(taylor_rate(f, df, &[gap, speed], &[3e-5, 0.01]) > 1.9, "{law:?} {normal:?}");
                assert!(taylor_rate(f, df, &[gap, speed], &[0.0, 0.01]) > 1.9, "{law:?} {normal:?}");
            }
        }
    }

    /// Analytical check: with c_N = 1/eps_n, m_N = 1, c_T = c_N^(8/9) E^(1/9), m_T = 8/9 the power
    /// law equals Grosch(-1/9).
    #[test]
    fn power_law_is_grosch_schallamach() {
        let (modulus, stiffness) = (5e6, 1e10);
        let grosch = GroschSchallamach::of(1.0, modulus, GroschSchallamach::EXPONENT);
        let stick = Regularization::stick_stiffness(1e9);
        let coulomb = FrictionLaw::from(Coulomb::of(grosch, stick));
        let tangential = f64::powf(stiffness, 8.0 / 9.0) * f64::powf(modulus, 1.0 / 9.0);
        let power = FrictionLaw::from(FrictionPowerLaw::of(tangential, 8.0 / 9.0, stick));
        let penalty = NormalLaw::penalty(1.0 / stiffness);
        let linear = NormalLaw::from(NormalPowerLaw::of(stiffness, 1.0));
        for gap in [-1e-9, -1e-6, -7e-5, -1e-3] {
            let (a, b) = (bound(&coulomb, &penalty, gap, 0.1), bound(&power, &linear, gap, 0.1));
            assert!((a.value / b.value - 1.0).abs() < 1e-12);
            assert!((a.by_gap / b.by_gap - 1.0).abs() < 1e-12);
        }
    }

    /// Bounds vanish at open points. They stay finite at vanishing pressure, at rest and at any
    /// speed.
    #[test]
    fn finite_at_the_extremes() {
        for normal in NORMAL_LAWS.iter().flat_map(|entry| (entry.samples)()) {
            for law in all() {
                assert_eq!(bound(&law, &normal, 1e-9, 0.0), Bound::default());
                assert_eq!(bound(&law, &normal, 0.0, 0.0), Bound::default());
                for gap in [-5e-324, -1e-310, -1e-300, -1e-150, -1e-9, -1.0] {
                    for speed in [0.0, 1e-300, 1.0, 1e10] {
                        let b = bound(&law, &normal, gap, speed);
                        assert!(b.value >= 0.0 && b.value.is_finite(), "{law:?} {normal:?} {gap} {b:?}");
                        assert!(
                            b.by_gap.is_finite() && b.by_speed.is_finite(),
                            "{law:?} {normal:?} {gap} {b:?}"
                        );
                    }
                }
            }
        }
    }

    /// The bound scales with its parameter. Derivative tests would not detect a bound that ignores
    /// it.
    #[test]
    fn bound_notices_the_coefficient() {
        let normal = NormalLaw::penalty(1e-10);
        let of = |mu| {
            let law = Coulomb::of(Constant(mu), Regularization::stick_stiffness(1e9));
            bound(&law.into(), &normal, -1e-5, 0.0).value
        };
        assert!((of(0.3) - 0.3e5).abs() < 1e-9);
        assert!((of(0.6) / of(0.3) - 2.0).abs() < 1e-14);
    }
}
