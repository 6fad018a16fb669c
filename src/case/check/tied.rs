//! Checks of `tied`.

use super::super::{SetNames, Tied};
use super::Check;
use crate::reader::at::At;

impl Check<'_> {
    pub(super) fn tied(&mut self, name: &At<String>, tied: &Tied) {
        if self.case.boundary.get(name).is_some() {
            self.found.say(name.place, format!("'{}' also names a boundary", name.value));
            self.found.cure("choose another name: both have rows in reactions.csv");
        }
        for side in [&tied.contactor, &tied.target] {
            for name in side.names() {
                if self.case.shape(name).is_some() {
                    let is_rigid = self.case.rigid.get(name).is_some();
                    let kind = if is_rigid { "a rigid body" } else { "an obstacle" };
                    let message = format!("'{}' is {kind}; only surfaces of bodies can be tied", name.value);
                    self.found.say(name.place, message);
                    self.found.cure("prescribe the displacement of the surface in `boundary`");
                } else {
                    self.surface("a tied side", name);
                }
            }
        }
        self.own_surface(tied);
        tied.stiffness.iter().for_each(|&stiffness| self.found.positive("the stiffness", stiffness));
        tied.within.iter().for_each(|&within| self.found.positive("the distance", within));
    }

    /// A surface is not tied to itself.
    fn own_surface(&mut self, tied: &Tied) {
        let of = |side: &SetNames, name: &str| side.names().iter().any(|other| other.value == name);
        for name in tied.target.names() {
            if of(&tied.contactor, name) {
                self.found.say(name.place, format!("'{}' is on both sides", name.value));
                self.found.cure("name the two surfaces that face each other");
            }
        }
    }
}
