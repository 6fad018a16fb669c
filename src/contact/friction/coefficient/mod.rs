//! Coefficients of friction `mu(t_n, |v_T|)`. One file each, one line in the table below.

use crate::reader::findings::Findings;
use crate::reader::laws::laws;
use crate::reader::place::Place;

/// Value of a coefficient at one state, with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CoefficientValue {
    /// `mu >= 0` \[-\].
    pub value: f64,
    /// `t_n dmu/dt_n` \[-\]. Unlike the derivative alone, the product stays finite as `t_n -> 0`.
    pub by_traction: f64,
    /// `dmu/d|v_T|` \[s/m\].
    pub by_speed: f64,
}

laws! {
    /// Coefficient of friction.
    Coefficient ("coefficient of friction", schema "Coefficient", table COEFFICIENTS) implements CoefficientOfFriction:
    "constant": constant::Constant,
    "grosch_schallamach": grosch_schallamach::GroschSchallamach,
    "stribeck": stribeck::Stribeck,
}

/// A law for the coefficient of friction.
pub trait CoefficientOfFriction {
    /// Coefficient and derivatives at `normal_traction` > 0 \[Pa\] and `speed` >= 0 \[m/s\].
    fn evaluate(&self, normal_traction: f64, speed: f64) -> CoefficientValue;

    /// Whether the coefficient depends on the slip speed, so that `C_mu` exists.
    fn depends_on_speed(&self) -> bool {
        false
    }

    /// Whether it depends on the normal traction.
    fn depends_on_pressure(&self) -> bool {
        false
    }

    /// Reports invalid parameters. `place` is the location of the whole coefficient.
    fn check(&self, place: Place, findings: &mut Findings);
}

impl Coefficient {
    /// Coefficient and derivatives at `normal_traction` > 0 \[Pa\] and `speed` >= 0 \[m/s\].
    pub fn evaluate(&self, normal_traction: f64, speed: f64) -> CoefficientValue {
        self.law().evaluate(normal_traction, speed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::units::Units;
    use crate::taylor::taylor_rate;

    fn all() -> impl Iterator<Item = Coefficient> {
        COEFFICIENTS.iter().flat_map(|entry| {
            let samples = (entry.samples)();
            assert!(samples.len() >= 2, "{} brings samples", entry.name);
            samples
        })
    }

    /// The derivatives of every coefficient by traction and by speed have Taylor order two, or are
    /// exact.
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
                assert_eq!(at.by_speed != 0.0, law.law().depends_on_speed());
                assert_eq!(at.by_traction != 0.0, law.law().depends_on_pressure());
            }
        }
    }

    /// Coefficients stay finite and nonnegative at vanishing and at huge tractions and speeds.
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

    /// At `t_n = 0.14 E` the coefficient is 1.24 with the exponent -1/9, and 0.80 with the printed
    /// +1/9 (theory, section 2.8).
    #[test]
    fn grosch_schallamach_has_the_published_values() {
        let mu = |e| GroschSchallamach::of(1.0, 5e6, e).evaluate(0.14 * 5e6, 0.0).value;
        assert!((mu(-1.0 / 9.0) - 1.24).abs() < 5e-3);
        assert!((mu(1.0 / 9.0) - 0.80).abs() < 5e-3);
        assert_eq!(GroschSchallamach::EXPONENT, -1.0 / 9.0);
    }

    /// Stribeck's coefficient falls from the static to the kinetic value.
    #[test]
    fn stribeck_runs_from_static_to_kinetic() {
        let law = Coefficient::from(Stribeck::of(1.2, 0.8, 0.1));
        assert_eq!(law.evaluate(1e5, 0.0).value, 1.2);
        assert!((law.evaluate(1e5, 100.0).value - 0.8).abs() < 1e-15);
        assert!(law.evaluate(1e5, 0.05).by_speed < 0.0);
    }

    /// Invalid parameters of a coefficient are rejected.
    #[test]
    fn refuses_what_is_not_a_coefficient() {
        let refused = |law: Coefficient| {
            let mut findings = Findings::new(Units::SI);
            law.law().check(Place::default(), &mut findings);
            !findings.is_empty()
        };
        assert!(all().all(|law| !refused(law)));
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(refused(Constant(bad).into()));
            assert!(refused(GroschSchallamach::of(bad, 5e6, -0.1).into()));
            assert!(refused(GroschSchallamach::of(1.0, bad, -0.1).into()));
            assert!(refused(Stribeck::of(bad, 0.8, 0.1).into()));
            assert!(refused(Stribeck::of(1.2, bad, 0.1).into()));
            assert!(refused(Stribeck::of(1.2, 0.8, bad).into()));
        }
        assert!(
            refused(GroschSchallamach::of(1.0, 5e6, -1.0).into()),
            "the bound would not vanish with the pressure"
        );
        assert!(refused(Stribeck::of(1.2, 0.8, 0.0).into()));
    }
}
