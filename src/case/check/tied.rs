//! Checks of `tied`.

use super::super::{Components, SetNames, Tied};
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
        if let Some(offset) = &tied.offset {
            self.size("the offset", offset);
            let zero = offset.iter().all(|entry| entry.value == 0.0);
            self.found.require(!zero, offset.place, "the offset is zero");
            if zero {
                self.found.cure("give the vector from the contactor to the target, or remove `offset`");
            }
        }
        tied.jump.iter().for_each(|jump| self.jump(jump));
        tied.within.iter().for_each(|&within| self.found.positive("the distance", within));
    }

    /// A prescribed jump is a function of time that starts at zero.
    fn jump(&mut self, jump: &At<Components<0, 1, 0>>) {
        let components = jump.as_array();
        if components == [None; 3] {
            self.found.say(jump.place, "the jump has no components");
            self.found.cure("write for example { x: \"0.1 * t\" }");
        }
        if let (Some(2), Some(z)) = (self.dimension, components[2]) {
            self.found.say(z.place, "a 2D case has no z");
        }
        for component in components.into_iter().flatten() {
            self.of_time(component);
            let starts = component.value([0.0; 3], 0.0);
            self.found.require(starts == 0.0, component.place, format!("the jump is {starts} at t = 0"));
            if starts != 0.0 {
                self.found.cure("let it begin at zero, for example \"0.1 * t\" or a table from [0, 0]");
            }
        }
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
