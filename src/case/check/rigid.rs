//! Checks of `rigid`.

use super::super::{Rigid, Rotation};
use super::Check;
use crate::reader::at::At;
use crate::reader::function::Varying;

impl Check<'_> {
    pub(super) fn rigid(&mut self, name: &At<String>, body: &Rigid) {
        self.obstacle(&body.shape);
        let Some(motion) = &body.motion else { return };
        if motion.translation.is_none() && motion.rotation.is_none() {
            self.found.say(motion.place, format!("the motion of '{}' is empty", name.value));
            self.found.cure("give it `translation` or `rotation`, or remove `motion` for a body at rest");
        }
        let components = motion.components();
        if let Some(translation) = motion.translation.as_ref().filter(|_| components == [None; 3]) {
            self.found.say(translation.place, "the translation has no components");
            self.found.cure("write for example { x: \"0.2 * t\", y: -0.01 }");
        }
        if let (Some(2), Some(z)) = (self.dimension, components[2]) {
            self.found.say(z.place, "a 2D case has no z");
        }
        components.into_iter().flatten().for_each(|component| self.of_time(component));
        motion.rotation.iter().for_each(|rotation| self.rotation(rotation));
    }

    fn rotation(&mut self, rotation: &At<Rotation>) {
        self.of_time(&rotation.angle);
        rotation.about.iter().for_each(|about| self.size("the point of a rotation", about));
        match (self.dimension, &rotation.axis) {
            (Some(2), Some(axis)) => {
                self.found.say(axis.place, "a rotation in 2D is about z and has no axis");
                self.found.cure("remove `axis`; a negative angle rotates clockwise");
            }
            (Some(3), None) => {
                self.found.say(rotation.place, "a rotation in 3D needs an axis");
                self.found.cure("write for example axis: [0, 0, 1]");
            }
            (Some(3), Some(axis)) => {
                self.size("the axis of a rotation", axis);
                let length: f64 = axis.iter().map(|entry| entry.value.powi(2)).sum();
                let fits = length > 0.0 && length.is_finite();
                self.found.require(fits, axis.place, "the axis of a rotation must be finite and not zero");
            }
            _ => {}
        }
    }

    /// A rigid body has one motion, which does not vary in space.
    fn of_time<const KG: i8, const M: i8, const S: i8>(&mut self, varying: &Varying<KG, M, S>) {
        if !varying.is_constant_in_space() {
            self.found.say(varying.place, "the motion of a rigid body depends on t only, not on x, y, z");
            self.found.cure("write an expression in t, or a table");
        }
        self.finite(varying);
    }
}
