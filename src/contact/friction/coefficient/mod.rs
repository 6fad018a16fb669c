//! Coefficients of friction `mu(t_n, |v_T|)`. One file each, one line in [`COEFFICIENTS`].

mod constant;
mod grosch_schallamach;
mod stribeck;

pub use constant::Constant;
pub use grosch_schallamach::GroschSchallamach;
pub use stribeck::Stribeck;

/// A coefficient at one state, with its slopes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CoefficientValue {
    /// `mu >= 0` \[-\].
    pub value: f64,
    /// `t_n dmu/dt_n` \[-\]: the slope times the traction, which stays finite as `t_n -> 0`.
    pub by_traction: f64,
    /// `dmu/d|v_T|` \[s/m\].
    pub by_speed: f64,
}

/// A coefficient of friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coefficient {
    /// See [`Constant`].
    Constant(Constant),
    /// See [`GroschSchallamach`].
    GroschSchallamach(GroschSchallamach),
    /// See [`Stribeck`].
    Stribeck(Stribeck),
}

impl Coefficient {
    /// Coefficient and slopes at `normal_traction > 0` \[Pa\] and `speed >= 0` \[m/s\].
    pub fn evaluate(&self, normal_traction: f64, speed: f64) -> CoefficientValue {
        match self {
            Self::Constant(law) => law.evaluate(),
            Self::GroschSchallamach(law) => law.evaluate(normal_traction),
            Self::Stribeck(law) => law.evaluate(speed),
        }
    }

    /// Whether the coefficient depends on the slip speed, so that `C_mu` exists.
    pub fn depends_on_speed(&self) -> bool {
        matches!(self, Self::Stribeck(_))
    }
}

/// A row of [`COEFFICIENTS`].
pub struct CoefficientEntry {
    /// Name in the case file; a bare number is the constant one.
    pub name: &'static str,
    /// One line for `contact-petsc list`.
    pub summary: &'static str,
    /// Instances on which every test of derivatives runs.
    pub samples: fn() -> Vec<Coefficient>,
}

/// Every coefficient there is: feeds `list`, the hints in errors and the tests.
pub const COEFFICIENTS: &[CoefficientEntry] = &[
    CoefficientEntry {
        name: "constant",
        summary: "mu (a bare number in the case file)",
        samples: || {
            [0.3, 1e3]
                .into_iter()
                .filter_map(|mu| Constant::new(mu).ok())
                .map(Coefficient::Constant)
                .collect()
        },
    },
    CoefficientEntry {
        name: "grosch_schallamach",
        summary: "mu = reference (t_n / modulus)^exponent, exponent -1/9 by default",
        samples: || {
            let rubber = |e| GroschSchallamach::new(1.0, 5e6, e).ok();
            [-1.0 / 9.0, 1.0 / 9.0, -0.5]
                .into_iter()
                .filter_map(rubber)
                .map(Coefficient::GroschSchallamach)
                .collect()
        },
    },
    CoefficientEntry {
        name: "stribeck",
        summary: "mu = kinetic + (static - kinetic) exp(-|v_T| / decay_velocity)",
        samples: || {
            let sets = [(1.2, 0.8, 0.1), (0.5, 0.9, 1e-3)];
            sets.into_iter()
                .filter_map(|(s, k, v)| Stribeck::new(s, k, v).ok())
                .map(Coefficient::Stribeck)
                .collect()
        },
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::taylor_rate;

    fn all() -> impl Iterator<Item = Coefficient> {
        COEFFICIENTS.iter().flat_map(|entry| {
            let samples = (entry.samples)();
            assert!(samples.len() >= 2, "{} brings samples that its constructor accepts", entry.name);
            samples
        })
    }

    /// In every coefficient the slopes by traction and by speed have Taylor order two (or are exact).
    #[test]
    fn derivatives_have_taylor_order_two() {
        for law in all() {
            for (t, s) in [(7e5, 2e-4), (3.0, 0.07)] {
                let f = |x: &[f64]| vec![law.evaluate(x[0], x[1]).value];
                let at = law.evaluate(t, s);
                let df = |_: &[f64], d: &[f64]| vec![at.by_traction / t * d[0] + at.by_speed * d[1]];
                assert!(taylor_rate(f, df, &[t, s], &[0.3 * t, -0.4 * s]) > 1.9, "{law:?}");
                let by_speed = |_: &[f64], d: &[f64]| vec![at.by_speed * d[1]];
                assert!(taylor_rate(f, by_speed, &[t, s], &[0.0, -0.4 * s]) > 1.9, "{law:?}");
                assert_eq!(at.by_speed != 0.0, law.depends_on_speed());
            }
        }
    }

    /// Coefficients stay finite and not negative at vanishing and at huge tractions and speeds.
    #[test]
    fn finite_at_the_extremes() {
        for law in all() {
            for t in [0.0, 5e-324, 1e-308, 1e-300, 1e300] {
                for s in [0.0, 1e-300, 1e300] {
                    let c = law.evaluate(t, s);
                    assert!(c.value >= 0.0 && c.value.is_finite(), "{law:?} at {t}, {s}");
                    assert!(c.by_traction.is_finite() && c.by_speed.is_finite(), "{law:?} at {t}, {s}");
                }
            }
        }
    }

    /// At `t_n = 0.14 E` the coefficient is 1.24 with the exponent -1/9, and 0.80 with the printed +1/9
    /// (theory, section 2.8).
    #[test]
    fn grosch_schallamach_has_the_published_values() {
        let mu = |e| GroschSchallamach::new(1.0, 5e6, e).unwrap().evaluate(0.14 * 5e6).value;
        assert!((mu(-1.0 / 9.0) - 1.24).abs() < 5e-3);
        assert!((mu(1.0 / 9.0) - 0.80).abs() < 5e-3);
        assert_eq!(GroschSchallamach::EXPONENT, -1.0 / 9.0);
    }

    /// Stribeck's coefficient falls from the static to the kinetic value.
    #[test]
    fn stribeck_runs_from_static_to_kinetic() {
        let law = Stribeck::new(1.2, 0.8, 0.1).unwrap();
        assert_eq!(law.evaluate(0.0).value, 1.2);
        assert!((law.evaluate(100.0).value - 0.8).abs() < 1e-15);
        assert!(law.evaluate(0.05).by_speed < 0.0);
    }

    /// Numbers that are no coefficient are refused.
    #[test]
    fn refuses_what_is_not_a_coefficient() {
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(Constant::new(bad).is_err());
            assert!(GroschSchallamach::new(bad, 5e6, -0.1).is_err());
            assert!(GroschSchallamach::new(1.0, bad, -0.1).is_err());
            assert!(Stribeck::new(bad, 0.8, 0.1).is_err());
            assert!(Stribeck::new(1.2, bad, 0.1).is_err());
            assert!(Stribeck::new(1.2, 0.8, bad).is_err());
        }
        assert!(
            GroschSchallamach::new(1.0, 5e6, -1.0).is_err(),
            "the bound would not vanish with the pressure"
        );
        assert!(Stribeck::new(1.2, 0.8, 0.0).is_err());
    }
}
