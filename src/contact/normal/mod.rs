//! Normal contact laws: gap -> normal traction. One file each, one line in the table below.

use crate::reader::findings::Findings;
use crate::reader::laws::laws;

/// Response of a normal law at one gap.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NormalResponse {
    /// `t_n >= 0`, pressure on the contactor \[Pa\]; 0 at an open point.
    pub traction: f64,
    /// `dt_n/dg <= 0` \[Pa/m\]; 0 at an open point.
    pub derivative: f64,
    /// `w(g) >= 0` with `t_n = -dw/dg` (2.23): energy stored per reference area \[J/m^2\].
    pub potential: f64,
}

laws! {
    /// Normal law: normal traction as a function of the gap.
    NormalLaw ("normal law", schema "Normal", table NORMAL_LAWS) implements NormalContact:
    "penalty": penalty::Penalty,
    "power_law": power_law::NormalPowerLaw,
}

impl Default for NormalLaw {
    fn default() -> Self {
        Self::Penalty(Penalty::default())
    }
}

/// Properties of the surfaces in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressedSide {
    /// Young's modulus of the softer side \[Pa\].
    pub young_modulus: f64,
    /// Mean size of the contactor's facets \[m\].
    pub facet_size: f64,
}

/// A law of the normal traction.
pub trait NormalContact {
    /// Traction, its derivative and the potential at this penetration >= 0 \[m\].
    fn closed(&self, penetration: f64) -> NormalResponse;

    /// The penetration \[m\] at which the traction is `pressure` \[Pa\], >= 0: the inverse of the
    /// law.
    fn penetration(&self, pressure: f64) -> f64;

    /// Reports invalid parameters.
    fn check(&self, findings: &mut Findings);

    /// The law completed with parameters that the case does not give and the surfaces determine.
    /// `None` if the law is complete.
    fn completed(&self, _side: &PressedSide) -> Option<NormalLaw> {
        None
    }

    /// The accepted penetration that the case specifies \[m\], if the law is derived from it.
    fn accepted_penetration(&self) -> Option<f64> {
        None
    }

    /// Penetration divided by traction, for a law in which the ratio is constant [m/Pa].
    fn linear_compliance(&self) -> Option<f64> {
        None
    }

    /// The law stiffened by a factor; `None` for a law whose penetration is physical.
    fn stiffened(&self, _factor: f64) -> Option<NormalLaw> {
        None
    }
}

impl NormalLaw {
    /// The penalty law with this compliance [m/Pa].
    pub fn penalty(compliance: f64) -> Self {
        Self::Penalty(Penalty::of(compliance))
    }

    /// Whether this is a penalty law, which approximates contact without penetration.
    pub fn is_penalty(&self) -> bool {
        self.law().linear_compliance().is_some()
    }

    /// The penetration \[m\] at which the traction is `pressure` \[Pa\], >= 0: the inverse of the
    /// law.
    pub fn penetration(&self, pressure: f64) -> f64 {
        self.law().penetration(pressure)
    }

    /// The law completed with parameters that the case does not give and the surfaces determine.
    #[must_use]
    pub fn completed(self, side: &PressedSide) -> Self {
        self.law().completed(side).unwrap_or(self)
    }

    /// Whether the surfaces determine a parameter that the case does not give.
    pub fn follows_surfaces(&self) -> bool {
        self.law().completed(&PressedSide { young_modulus: 1.0, facet_size: 1.0 }).is_some()
    }

    /// Traction, its derivative and the potential at `gap` \[m\] (> 0 open).
    pub fn evaluate(&self, gap: f64) -> NormalResponse {
        if gap > 0.0 { NormalResponse::default() } else { self.law().closed(-gap) }
    }

    /// The mean of the traction between two gaps \[m\], `-(w(g_1) - w(g_0)) / (g_1 - g_0)`, and its
    /// derivative by the second gap. At equal gaps these are the traction and half of its
    /// derivative.
    pub fn between(&self, [start, end]: [f64; 2]) -> NormalResponse {
        let depth = [-start, -end];
        let potential = self.evaluate(end).potential;
        let (deeper, shallower) = (depth[0].max(depth[1]), depth[0].min(depth[1]));
        if deeper <= 0.0 {
            return NormalResponse::default();
        }
        if shallower > NEAR * deeper {
            return NormalResponse { potential, ..self.mean(depth) };
        }
        let (before, after) = (self.evaluate(start), self.evaluate(end));
        let change = end - start;
        let traction = (before.potential - after.potential) / change;
        NormalResponse { traction, derivative: (after.traction - traction) / change, potential }
    }

    /// The mean traction between two closed gaps of similar size, for which the quotient would
    /// suffer from cancellation.
    fn mean(&self, [start, end]: [f64; 2]) -> NormalResponse {
        let mut sum = NormalResponse::default();
        for (place, weight) in GAUSS {
            for (part, weight) in [(0.5 * (1.0 - place), weight), (0.5 * (1.0 + place), weight)] {
                let at = self.evaluate(-(start + part * (end - start)));
                sum.traction += 0.5 * weight * at.traction;
                sum.derivative += 0.5 * weight * part * at.derivative;
            }
        }
        sum
    }
}

/// If the ratio of the smaller to the larger depth is below this value, the quotient has full
/// precision.
const NEAR: f64 = 0.9;

/// Six-point Gauss rule, by pairs. Between depths in the ratio of [`NEAR`] it is exact to rounding
/// for any power.
const GAUSS: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::units::Units;
    use crate::taylor::taylor_rate;

    fn all() -> Vec<NormalLaw> {
        let laws: Vec<_> = NORMAL_LAWS.iter().flat_map(|entry| (entry.samples)()).collect();
        assert!(laws.len() >= 2 * NORMAL_LAWS.len(), "every law brings samples that its constructor accepts");
        laws
    }

    /// In every normal law the slope is the derivative of the traction, and the traction is that of
    /// the potential.
    #[test]
    fn derivatives_have_taylor_order_two() {
        for law in all() {
            for gap in [-1e-4, -0.3] {
                let direction = [-0.37 * gap];
                let f = |x: &[f64]| vec![law.evaluate(x[0]).traction];
                let df = |_: &[f64], d: &[f64]| vec![law.evaluate(gap).derivative * d[0]];
                assert!(taylor_rate(f, df, &[gap], &direction) > 1.9, "{law:?}");
                let w = |x: &[f64]| vec![law.evaluate(x[0]).potential];
                let dw = |_: &[f64], d: &[f64]| vec![-law.evaluate(gap).traction * d[0]];
                assert!(taylor_rate(w, dw, &[gap], &direction) > 1.9, "{law:?}");
            }
        }
    }

    /// Between any two gaps, near or far, closed or open, the mean traction does the work of the
    /// potential. Its slope is its derivative by the second gap.
    #[test]
    fn mean_traction_does_the_work_of_the_potential() {
        for law in all() {
            for start in [-1e-3, -0.98e-3, -1e-5, 0.0, 4e-4] {
                for end in [-1e-3, -1.02e-3, -0.93e-3, -1e-4, 3e-4] {
                    let mean = law.between([start, end]);
                    let [before, after] = [start, end].map(|gap| law.evaluate(gap));
                    let work = -mean.traction * (end - start);
                    let digits = 1e-14 * before.potential.max(after.potential);
                    assert!(
                        (work - (after.potential - before.potential)).abs() <= digits,
                        "{law:?} {start} {end}"
                    );
                    assert!(
                        mean.potential == after.potential && mean.traction >= 0.0 && mean.derivative <= 0.0
                    );
                    let f = |x: &[f64]| vec![law.between([start, x[0]]).traction];
                    let slope = mean.derivative;
                    let h = 1e-7;
                    let rise = (f(&[end + h])[0] - f(&[end - h])[0]) / (2.0 * h);
                    let scale = law.evaluate(-1.1e-3).derivative.abs();
                    assert!((rise - slope).abs() < 1e-5 * scale, "{law:?} {start} {end}: {rise} {slope}");
                }
            }
            let at = law.evaluate(-1e-3);
            let still = law.between([-1e-3; 2]);
            assert!((still.traction / at.traction - 1.0).abs() < 1e-14);
            assert!((still.derivative / at.derivative - 0.5).abs() < 1e-14);
        }
    }

    /// Tractions push, increase with penetration, vanish at open points and stay finite at any gap.
    #[test]
    fn pushes_and_never_pulls() {
        for law in all() {
            assert_eq!(law.evaluate(1e-300), NormalResponse::default());
            for gap in [-0.0, 0.0, -1e-308, -1e-300, -1e-9, -1.0] {
                let r = law.evaluate(gap);
                assert!(r.traction >= 0.0 && r.derivative <= 0.0 && r.potential >= 0.0, "{law:?} at {gap}");
                assert!(r.traction.is_finite() && r.derivative.is_finite() && r.potential.is_finite());
            }
        }
    }

    /// The penetration of a pressure is that at which the law gives this pressure.
    #[test]
    fn penetration_inverts_the_law() {
        for law in all() {
            for pressure in [1.0, 1e4, 1e7] {
                let traction = law.evaluate(-law.penetration(pressure)).traction;
                assert!((traction / pressure - 1.0).abs() < 1e-12, "{law:?} at {pressure} Pa: {traction}");
            }
        }
    }

    /// The power law with exponent 1 is the penalty with the inverse compliance.
    #[test]
    fn power_law_of_exponent_one_is_the_penalty() {
        let penalty = Penalty::of(1e-10);
        let power = NormalPowerLaw::of(1e10, 1.0);
        for penetration in [1e-9, 1e-5, 1e-2] {
            let (a, b) = (penalty.closed(penetration), power.closed(penetration));
            assert!((a.traction / b.traction - 1.0).abs() < 1e-14);
            assert!((a.derivative / b.derivative - 1.0).abs() < 1e-14);
            assert!((a.potential / b.potential - 1.0).abs() < 1e-14);
        }
    }

    /// A law that cannot resist penetration is rejected.
    #[test]
    fn refuses_what_is_not_a_law() {
        let refused = |law: NormalLaw| {
            let mut findings = Findings::new(Units::SI);
            law.law().check(&mut findings);
            !findings.is_empty()
        };
        assert!(all().into_iter().all(|law| !refused(law)));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(refused(Penalty::of(bad).into()));
            assert!(refused(NormalPowerLaw::of(bad, 1.0).into()));
            assert!(refused(NormalPowerLaw::of(1e10, bad).into()));
        }
        assert!(
            refused(NormalPowerLaw::of(1e10, 0.9).into()),
            "an exponent below 1 has an infinite slope at g = 0"
        );
    }
}
