//! Checks of `accuracy`.

use super::super::PenetrationTolerance;
use super::Check;
use crate::reader::quantity::Number;

/// Smallest relative error that may be requested: rounding alone may be larger than a smaller one.
const FINEST: f64 = 1e-12;

impl Check<'_> {
    pub(super) fn accuracy(&mut self) {
        let Some(accuracy) = &self.case.accuracy else { return };
        if let Some(penetration) = &accuracy.penetration {
            let (value, at) = penetration.value();
            self.found.require(value > 0.0, at, format!("the penetration must be > 0, found {value}"));
            if let PenetrationTolerance::Relative(part) = penetration {
                self.above_rounding("the penetration", *part);
            }
            let given = at.line > 0;
            let power = self.case.contact.values().any(|c| !c.normal.is_penalty());
            if given && power {
                self.found.say(
                    at,
                    "a contact has a power law, whose penetration represents the roughness and can not be \
                     reduced by multipliers",
                );
                self.found.cure("write `penetration: none`, or `normal: penalty`");
            }
        }
        self.part("the slip", accuracy.slip);
        self.part("the error in time", accuracy.time);
        self.part("the energy", accuracy.energy);
        let massless = self.case.time.scheme.value.is_static();
        let timed = accuracy.time.filter(|time| massless && time.place.line > 0);
        if let Some(time) = timed {
            self.found.say(
                time.place,
                "statics has no error in time: its step length follows the number of Newton iterations",
            );
            self.found.cure("remove `time`, or write `time: none` for equal steps");
        }
    }

    fn part(&mut self, what: &str, value: Option<Number>) {
        let Some(value) = value else { return };
        let fits = value.value > 0.0 && value.value < 1.0;
        self.found.require(fits, value.place, format!("{what} must be > 0 and < 1, found {:e}", value.value));
        self.above_rounding(what, value);
    }

    fn above_rounding(&mut self, what: &str, value: Number) {
        if value.value > 0.0 && value.value < FINEST {
            self.found.say(
                value.place,
                format!("{what} of {:e} is below the rounding errors of a result", value.value),
            );
            self.found.cure(&format!("request {FINEST:e} or more"));
        }
    }
}
