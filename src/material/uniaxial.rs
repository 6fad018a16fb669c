//! The response of a law to a uniaxial test, found numerically: no law has to bring it.

use std::ops::Range;

use super::{Law, LawTask, Material, Part};
use crate::square::Square;

/// Stretches that [`Material::stable_stretches`] looks at.
const STRETCHES: Range<f64> = 0.25..4.0;

/// How many stretches are looked at, equal in their ratio: 4 % from one to the next.
///
/// Half as many find the end of stability to 8 %. It is printed with two digits.
const SAMPLES: i32 = 70;

/// State of a bar that is stretched along its axis and free at its sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uniaxial {
    /// Force over the reference area \[Pa\].
    pub nominal_stress: f64,
    /// Stretch across the axis.
    pub lateral_stretch: f64,
}

impl Material {
    /// The response to a stretch along the axis; `None` if no lateral stretch between 0.1 and 10 leaves the sides free.
    pub fn uniaxial(&self, stretch: f64) -> Option<Uniaxial> {
        self.accept(Stretched(stretch))
    }

    /// The stretches around one over which the nominal stress of a uniaxial test grows with the stretch. Stretches below 0.25 and above 4
    /// are not looked at.
    pub fn stable_stretches(&self) -> Range<f64> {
        let ratio = (STRETCHES.end / STRETCHES.start).powf(1.0 / f64::from(SAMPLES));
        let walk = |factor: f64| {
            let mut stretch = 1.0;
            let mut stress = 0.0;
            while STRETCHES.contains(&(stretch * factor)) {
                let next = self.uniaxial(stretch * factor).map(|found| found.nominal_stress);
                match next {
                    Some(next) if (next - stress) * (factor - 1.0) > 0.0 => stress = next,
                    _ => return stretch,
                }
                stretch *= factor;
            }
            stretch
        };
        walk(1.0 / ratio)..walk(ratio)
    }
}

struct Stretched(f64);

impl LawTask for Stretched {
    type Output = Option<Uniaxial>;

    fn run<P: Law>(self, law: &P) -> Option<Uniaxial> {
        let constants = law.constants(Part::Whole);
        let axial = self.0 - 1.0;
        let gradient = |lateral: f64| -> Square<f64, 3> {
            [[axial, 0.0, 0.0], [0.0, lateral, 0.0], [0.0, 0.0, lateral]]
        };
        let stress = |lateral: f64| P::stress(&constants, &gradient(lateral));
        let across = |lateral: f64| match P::reserve(&constants, &gradient(lateral)) {
            // Beyond the limit of the law; its energy falls towards equal stretches.
            Some(reserve) if reserve <= 0.0 => f64::INFINITY.copysign(lateral - axial),
            _ => stress(lateral)[1][1],
        };
        let (mut low, mut high) = bracket(across)?;
        // The stress grows with the lateral stretch between the two.
        while high - low > 4.0 * f64::EPSILON * low.abs().max(f64::EPSILON) {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if across(middle) < 0.0 { low = middle } else { high = middle }
        }
        let lateral = 0.5 * (low + high);
        Some(Uniaxial { nominal_stress: self.0 * stress(lateral)[0][0], lateral_stretch: 1.0 + lateral })
    }
}

/// Two lateral strains nearest to rest between which the stress grows through zero.
fn bracket(across: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let ratio = 1.05_f64;
    let at_rest = across(0.0);
    let mut last = 0.0;
    for step in 1..48 {
        let outer = if at_rest > 0.0 { ratio.powi(-step) - 1.0 } else { ratio.powi(step) - 1.0 };
        let stress = across(outer);
        if at_rest > 0.0 && stress <= 0.0 {
            return Some((outer, last));
        }
        if at_rest <= 0.0 && stress >= 0.0 {
            return Some((last, outer));
        }
        last = outer;
    }
    None
}
