//! Steps as short as they may be: what a user should know of them, and when they lead nowhere.

use serde::{Deserialize, Serialize};

use crate::case::Units;
use crate::dynamics::Stage;
use crate::error::Error;

/// Counts of the steps that were as short as errors may ask for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shortest {
    /// All of them.
    steps: u32,
    /// Those that erred by more than they may all the same.
    missed: u32,
}

/// What may keep steps short.
#[derive(Debug, Clone, Copy)]
pub struct MinimumStepWatch {
    /// Largest displacement so far, root mean square \[m\].
    pub size: f64,
    /// How much stiffer than its law says the stiffest contact is.
    pub stiffer: f64,
    /// Whether the mass of a node can rattle on it.
    pub rattles: bool,
    /// Whether there is friction.
    pub rubs: bool,
}

impl Shortest {
    /// As many steps of the smallest length are no accident.
    const TOLD: u32 = 100;
    /// As many that missed what was asked are the rest of the run: two of the longest steps went by in them.
    const HOPELESS: u32 = 2048;

    /// Takes another one that used `ratio` of what it may err by.
    pub fn count(&mut self, ratio: f64) {
        self.steps += 1;
        self.missed += u32::from(ratio > 1.0);
    }

    /// What a user should know at once, once.
    pub fn remark(&self, plight: &MinimumStepWatch, units: Units) -> Option<String> {
        (self.steps == Self::TOLD).then(|| {
            let [why, cure] = plight.told(units);
            format!(
                "warning: {} steps were as short as they may be, and the accuracy may be missed all the same{why}\nhint: {cure}",
                self.steps
            )
        })
    }

    fn is_hopeless(&self) -> bool {
        self.missed >= Self::HOPELESS
    }

    /// The end of a run that asks for ever shorter steps, in the step of `stage`.
    pub fn hopeless(&self, plight: &MinimumStepWatch, stage: &Stage, units: Units) -> Option<Error> {
        self.is_hopeless().then(|| {
            let [why, cure] = plight.told(units);
            let s = units.of("s");
            let place = format!("t = {:.6e} {s}, step of {:.3e} {s}", stage.start.time, stage.dt);
            let Self { missed, .. } = self;
            let what = format!("{missed} steps were as short as they may be, and erred by more than was asked all the same{why}");
            Error::not_converged(what).within(&place).hint(&format!(
                "results up to this time are kept; {cure}; steps are no shorter than 1/1024 of `time.step`"
            ))
        })
    }
}

impl MinimumStepWatch {
    /// Why, and what helps.
    fn told(&self, units: Units) -> [String; 2] {
        let m = units.of("m");
        let Self { size, stiffer, rattles, rubs } = *self;
        let on = format!(
            "on a penalty {stiffer} times stiffer than that of the case, made so for accuracy.penetration"
        );
        match (rattles, stiffer > 1.0, rubs) {
            (true, ..) => [
                format!(": contact rattles {on}"),
                "take the mass off the nodes of contact surfaces, `mass: redistributed` of their bodies, use `scheme: \
                 conserving`, which keeps its energy with any step, or ask for less"
                    .to_owned(),
            ],
            (false, true, _) => [format!(" {on}"), "ask for less, or for a larger penetration".to_owned()],
            (false, false, true) => [
                format!(
                    ", over {size:.1e} {m}, the largest displacement so far: what slides under a constant coefficient of friction \
                     may flutter on its nodes, ever more the better its steps resolve it"
                ),
                "give such a scene a step that damps the flutter, `time: none` in `accuracy` and `generalized_alpha: { \
                 spectral_radius: 0.5 }`, or ask for less"
                    .to_owned(),
            ],
            (false, false, false) => [
                format!(", over {size:.1e} {m}, the largest displacement so far"),
                "ask for less, or write `time: none` for equal steps; for an impact `scheme: conserving` keeps its energy \
                 with any step"
                    .to_owned(),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// It is told once, with the cure that fits.
    #[test]
    fn is_told_once() {
        let plight = MinimumStepWatch { size: 1e-3, stiffer: 1.0, rattles: false, rubs: true };
        let mut shortest = Shortest::default();
        let mut told = Vec::new();
        for _ in 0..300 {
            shortest.count(0.5);
            told.extend(shortest.remark(&plight, Units::SI));
        }
        assert_eq!(told.len(), 1);
        assert!(told[0].contains("100 steps") && told[0].contains("flutter"), "{}", told[0]);
        let rattling = MinimumStepWatch { stiffer: 16.0, rattles: true, ..plight };
        assert!(rattling.told(Units::SI)[1].contains("mass: redistributed"));
        let smooth = MinimumStepWatch { rubs: false, ..plight };
        assert!(smooth.told(Units::SI)[1].contains("conserving"));
    }

    /// Short steps that err by no more than they may go on for ever, those that miss it do not.
    #[test]
    fn ends_where_what_is_asked_is_missed() {
        let mut shortest = Shortest::default();
        (0..10 * Shortest::HOPELESS).for_each(|_| shortest.count(1.0));
        assert!(!shortest.is_hopeless());
        (0..Shortest::HOPELESS).for_each(|_| shortest.count(1.5));
        assert!(shortest.is_hopeless());
    }
}
