//! Damping of a contact: along the normal beside the normal law, and along the surface beside
//! friction (theory, section 2.13). One file each, one line in the table below.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::normal::NormalResponse;
use crate::reader::findings::Findings;
use crate::reader::laws::laws;
use crate::reader::quantity::AreaViscosity;

laws! {
    /// Damping of the motion along the normal.
    NormalDamping ("normal damping", schema "NormalDamping", table NORMAL_DAMPINGS) implements NormalDamper:
    "kelvin": kelvin::Kelvin,
    "hunt_crossley": hunt_crossley::HuntCrossley,
}

/// Damping of the relative motion in contact. The static scheme has no velocities and refuses it; a
/// static start ignores it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactDamping {
    /// Damping along the normal. It never pulls.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<NormalDamping>,
    /// Viscosity along the surface [Pa s/m], >= 0, of all closed points, beside friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tangential: Option<AreaViscosity>,
}

/// The part of the damping of a contact that acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ActiveDamping {
    /// Along the normal and along the surface.
    #[default]
    Whole,
    /// Along the normal, for the resultant of the pressure.
    Normal,
    /// No damping, in a static start.
    Off,
}

impl ContactDamping {
    /// The damping of which only a part acts.
    pub fn only(&self, part: ActiveDamping) -> Self {
        match part {
            ActiveDamping::Whole => *self,
            ActiveDamping::Normal => Self { tangential: None, ..*self },
            ActiveDamping::Off => Self::default(),
        }
    }

    /// Whether nothing is damped.
    pub fn is_none(&self) -> bool {
        self.normal.is_none() && self.tangential.is_none()
    }

    /// Viscosity along the surface [Pa s/m].
    pub fn tangential_viscosity(&self) -> f64 {
        self.tangential.map_or(0.0, |viscosity| viscosity.value)
    }

    /// Reports invalid parameters.
    pub fn check(&self, findings: &mut Findings) {
        self.normal.iter().for_each(|normal| normal.law().check(findings));
        if let Some(viscosity) = self.tangential {
            findings.not_negative("the tangential viscosity", viscosity.value, viscosity.place);
        }
    }

    /// The response of the normal law with damping along the normal.
    pub fn damped(&self, normal: NormalResponse, closing: &Closing) -> DampedNormal {
        let undamped = DampedNormal { normal, by_speed: 0.0, damping: 0.0 };
        let Some(law) = &self.normal else { return undamped };
        let damping = law.law().damp(&normal, closing);
        if normal.traction + damping.traction <= 0.0 {
            let normal = NormalResponse { traction: 0.0, derivative: 0.0, ..normal };
            return DampedNormal { normal, by_speed: 0.0, damping: -undamped.normal.traction };
        }
        let traction = normal.traction + damping.traction;
        let derivative = normal.derivative + damping.by_gap;
        DampedNormal {
            normal: NormalResponse { traction, derivative, ..normal },
            by_speed: damping.by_speed,
            damping: damping.traction,
        }
    }
}

/// Motion of a closed point along the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closing {
    /// Gap now \[m\], <= 0 up to rounding.
    pub gap: f64,
    /// Gap at the start of the step \[m\]; infinite if there was none.
    pub start: f64,
    /// Speed at which the gap closes \[m/s\]; negative if it opens.
    pub speed: f64,
}

impl Closing {
    /// The part of the motion of the step that lies in contact, and its derivative by the gap
    /// [1/m].
    ///
    /// It is 1 for a point that was in contact at the start. A point that closes within the step has
    /// `-g / (g_start - g)`, so that the traction of a dashpot begins at zero. With a jump at `g = 0` a
    /// step that ends there would have no solution.
    pub fn part_in_contact(&self) -> (f64, f64) {
        if self.start <= 0.0 {
            return (1.0, 0.0);
        }
        let travel = self.start - self.gap;
        let part = if travel > 0.0 { (-self.gap / travel).clamp(0.0, 1.0) } else { 0.0 };
        (part, if part > 0.0 { -(1.0 - part) / travel } else { 0.0 })
    }
}

/// Traction of a damper with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DampedTraction {
    /// \[Pa\], > 0 while the gap closes.
    pub traction: f64,
    /// By the gap at fixed speed \[Pa/m\].
    pub by_gap: f64,
    /// By the closing speed \[Pa s/m\].
    pub by_speed: f64,
}

/// Response of the normal law with damping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampedNormal {
    /// Traction >= 0 with its derivative by the gap at fixed speed; the potential is that of the
    /// normal law.
    pub normal: NormalResponse,
    /// Derivative of the traction by the closing speed \[Pa s/m\].
    pub by_speed: f64,
    /// Part of the traction that is not the normal law's \[Pa\]. Multiplied by the closing speed it is
    /// the dissipated power per area, which is never negative.
    pub damping: f64,
}

/// A law of the damping along the normal.
pub trait NormalDamper {
    /// Traction and derivatives beside this response of the normal law.
    fn damp(&self, normal: &NormalResponse, closing: &Closing) -> DampedTraction;

    /// Reports invalid parameters.
    fn check(&self, findings: &mut Findings);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::normal::{NORMAL_LAWS, NormalLaw};
    use crate::taylor::taylor_rate;

    fn all() -> Vec<ContactDamping> {
        let laws = NORMAL_DAMPINGS.iter().flat_map(|entry| (entry.samples)());
        laws.map(|law| ContactDamping { normal: Some(law), tangential: None }).collect()
    }

    fn normal_laws() -> Vec<NormalLaw> {
        NORMAL_LAWS.iter().flat_map(|entry| (entry.samples)()).collect()
    }

    fn at(damping: &ContactDamping, law: &NormalLaw, gap: f64, start: f64, speed: f64) -> DampedNormal {
        damping.damped(law.evaluate(gap), &Closing { gap, start, speed })
    }

    /// For every damping and normal law the derivatives by gap and speed have Taylor order two, for
    /// points that were in contact and for points that close within the step.
    #[test]
    fn derivatives_have_taylor_order_two() {
        for (damping, law) in all().iter().flat_map(|d| normal_laws().into_iter().map(move |law| (d, law))) {
            for (start, speed) in [(-3e-4, 0.4), (-1e-4, -0.01), (3e-4, 0.2), (f64::INFINITY, 0.2)] {
                let (gap, direction) = (-2e-4, [3e-5, 0.01]);
                let f = |x: &[f64]| vec![at(damping, &law, x[0], start, x[1]).normal.traction];
                let found = at(damping, &law, gap, start, speed);
                if found.normal.traction == 0.0 {
                    assert_eq!((found.normal.derivative, found.by_speed), (0.0, 0.0));
                    continue;
                }
                let df = |_: &[f64], d: &[f64]| vec![found.normal.derivative * d[0] + found.by_speed * d[1]];
                assert!(
                    taylor_rate(f, df, &[gap, speed], &direction) > 1.9,
                    "{start} {speed} {damping:?} {law:?}"
                );
            }
        }
    }

    /// Damping never pulls and never gives energy, however fast the gap opens or closes.
    #[test]
    fn never_pulls_and_never_gives_energy() {
        for (damping, law) in all().iter().flat_map(|d| normal_laws().into_iter().map(move |law| (d, law))) {
            for speed in [-1e6, -3.0, -1e-9, 0.0, 1e-9, 3.0, 1e6] {
                for (gap, start) in [(-1e-4, -1e-4), (-1e-4, 1.0), (-0.0, 1e-3), (0.0, 0.0), (1e-18, 1e-3)] {
                    let found = at(damping, &law, gap, start, speed);
                    assert!(found.normal.traction >= 0.0 && found.damping * speed >= 0.0, "{found:?}");
                    assert!(found.by_speed >= 0.0 && found.by_speed.is_finite());
                    let sum = law.evaluate(gap).traction + found.damping;
                    assert!((found.normal.traction - sum).abs() <= 1e-12 * sum.abs().max(1e-300));
                }
            }
        }
    }

    /// The traction of a point that closes within the step begins at zero; that of a point in contact
    /// is the full one.
    #[test]
    fn the_traction_begins_at_zero() {
        let damping = ContactDamping { normal: Some(Kelvin::of(10.0).into()), tangential: None };
        let law = NormalLaw::penalty(1e30);
        let traction = |gap, start| at(&damping, &law, gap, start, 2.0).normal.traction;
        assert_eq!([traction(0.0, 1e-3), traction(-1e-3, 0.0), traction(-1e-9, -1e-3)], [0.0, 20.0, 20.0]);
        assert!((traction(-3e-3, 1e-3) - 15.0).abs() < 1e-12);
    }

    /// Parameters that are not positive are rejected.
    #[test]
    fn refuses_what_does_not_damp() {
        for bad in [0.0, -1.0, f64::NAN] {
            for normal in [NormalDamping::from(Kelvin::of(bad)), HuntCrossley::of(bad).into()] {
                let mut findings = Findings::new(crate::reader::units::Units::SI);
                ContactDamping { normal: Some(normal), tangential: None }.check(&mut findings);
                assert!(!findings.is_empty(), "{normal:?}");
            }
        }
    }
}
