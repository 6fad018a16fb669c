//! Monitors steps of the minimum length: when to warn the user, and when to stop the run.

use serde::{Deserialize, Serialize};

use crate::case::Units;
use crate::dynamics::Stage;
use crate::error::Error;

/// Counts of the steps that had the minimum length of the error control.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shortest {
    /// Number of all such steps.
    steps: u32,
    /// Number of those whose error still exceeded the allowance.
    missed: u32,
}

/// Conditions that may keep steps short.
#[derive(Debug, Clone, Copy)]
pub struct MinimumStepWatch {
    /// Largest displacement so far, root mean square \[m\].
    pub size: f64,
    /// Largest ratio of a contact's present stiffness to that of its law.
    pub stiffer: f64,
    /// Whether nodal masses can chatter on the contact stiffness.
    pub rattles: bool,
    /// Whether there is friction.
    pub rubs: bool,
    /// Whether the scheme `conserving` accepts the bodies.
    pub may_conserve: bool,
}

impl Shortest {
    /// Number of steps of the minimum length after which a warning is printed: that many are not
    /// accidental.
    const TOLD: u32 = 100;
    /// Number of steps of the minimum length with too large an error after which the run stops. It
    /// corresponds to two steps of the maximum length.
    const HOPELESS: u32 = 2048;

    /// Counts another step that used the fraction `ratio` of its allowed error.
    pub fn count(&mut self, ratio: f64) {
        self.steps += 1;
        self.missed += u32::from(ratio > 1.0);
    }

    /// The warning to print now. It is returned once.
    pub fn remark(&self, plight: &MinimumStepWatch, units: Units) -> Option<String> {
        (self.steps == Self::TOLD).then(|| {
            let [why, cure] = plight.cause_and_hint(units);
            format!(
                "warning: {} steps had the minimum length, and the requested accuracy may still not be \
                 reached{why}\n\
                 hint: {cure}",
                self.steps
            )
        })
    }

    fn is_hopeless(&self) -> bool {
        self.missed >= Self::HOPELESS
    }

    /// The error that ends a run with too many steps of the minimum length, in the step of `stage`.
    pub fn hopeless(&self, plight: &MinimumStepWatch, stage: &Stage, units: Units) -> Option<Error> {
        self.is_hopeless().then(|| {
            let [why, cure] = plight.cause_and_hint(units);
            let s = units.of("s");
            let place = format!("t = {:.6e} {s}, step of {:.3e} {s}", stage.start.time, stage.dt);
            let Self { missed, .. } = self;
            let what = format!(
                "{missed} steps had the minimum length, and their error still exceeded the tolerance{why}"
            );
            Error::not_converged(what).within(&place).hint(&format!(
                "results up to this time are kept; {cure}; the minimum step length is 1/1024 of `time.step`"
            ))
        })
    }
}

impl MinimumStepWatch {
    /// The cause and the hint.
    fn cause_and_hint(&self, units: Units) -> [String; 2] {
        let m = units.of("m");
        let Self { size, stiffer, rattles, rubs, may_conserve } = *self;
        let on = format!(
            "on a penalty that accuracy.penetration made {stiffer} times stiffer than that of the case"
        );
        match (rattles, stiffer > 1.0, rubs) {
            (true, ..) => [
                format!(": contact chatters {on}"),
                format!(
                    "make the nodes of contact surfaces massless with `mass: redistributed` of their bodies, \
                     {}or relax the tolerance",
                    if may_conserve {
                        "use `scheme: conserving`, which conserves energy with any step, "
                    } else {
                        ""
                    }
                ),
            ],
            (false, true, _) => {
                [format!(" {on}"), "relax the tolerance, or request a larger penetration".to_owned()]
            }
            (false, false, true) => [
                format!(
                    ", relative to {size:.1e} {m}, the largest displacement so far: bodies that slide with \
                     a constant coefficient of friction may flutter on their nodes, increasingly so the \
                     better the steps resolve it"
                ),
                "damp the flutter by equal steps and a dissipative scheme, `time: none` in `accuracy` and \
                 `generalized_alpha: { spectral_radius: 0.5 }`, or relax the tolerance"
                    .to_owned(),
            ],
            (false, false, false) => [
                format!(", relative to {size:.1e} {m}, the largest displacement so far"),
                format!(
                    "relax the tolerance, or write `time: none` for equal steps{}",
                    if may_conserve {
                        "; for an impact `scheme: conserving` conserves energy with any step"
                    } else {
                        ""
                    }
                ),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The warning is returned once, with the hint that fits.
    #[test]
    fn is_told_once() {
        let plight =
            MinimumStepWatch { size: 1e-3, stiffer: 1.0, rattles: false, rubs: true, may_conserve: true };
        let mut shortest = Shortest::default();
        let mut told = Vec::new();
        for _ in 0..300 {
            shortest.count(0.5);
            told.extend(shortest.remark(&plight, Units::SI));
        }
        assert_eq!(told.len(), 1);
        assert!(told[0].contains("100 steps") && told[0].contains("flutter"), "{}", told[0]);
        let rattling = MinimumStepWatch { stiffer: 16.0, rattles: true, ..plight };
        assert!(rattling.cause_and_hint(Units::SI)[1].contains("mass: redistributed"));
        let smooth = MinimumStepWatch { rubs: false, ..plight };
        assert!(smooth.cause_and_hint(Units::SI)[1].contains("conserving"));
        for refused in [
            MinimumStepWatch { may_conserve: false, ..smooth },
            MinimumStepWatch { may_conserve: false, ..rattling },
        ] {
            assert!(!refused.cause_and_hint(Units::SI)[1].contains("conserving"));
        }
    }

    /// Short steps with acceptable errors may continue indefinitely. Short steps with too large
    /// errors end the run.
    #[test]
    fn ends_where_what_is_asked_is_missed() {
        let mut shortest = Shortest::default();
        (0..10 * Shortest::HOPELESS).for_each(|_| shortest.count(1.0));
        assert!(!shortest.is_hopeless());
        (0..Shortest::HOPELESS).for_each(|_| shortest.count(1.5));
        assert!(shortest.is_hopeless());
    }
}
