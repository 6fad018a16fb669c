//! Checks of `dimension: axisymmetric`: refuses keys that are undefined or not available there.

use super::super::{Action, FreeMotion, PrescribedMotion};
use super::Check;
use crate::reader::at::At;
use crate::reader::quantity::Length;

/// Cure of rotations in the meridian plane.
const NO_TURN: &str = "remove it: a body of revolution moves along its axis y only";

impl Check<'_> {
    pub(super) fn axisymmetric(&mut self) {
        let case = self.case;
        if !case.is_axisymmetric() {
            return;
        }
        let scheme = &case.time.scheme;
        if scheme.value.conserves() {
            self.found.say(
                scheme.place,
                "the conserving scheme has no axisymmetric bodies: its forces over a step do not contain the \
                 hoop stress",
            );
            self.found.cure("use the scheme midpoint or generalized_alpha");
        }
        for body in case.bodies.values() {
            let regions = body.regions.values().filter_map(|region| region.viscoelasticity.as_ref());
            for viscous in body.viscoelasticity.iter().chain(regions) {
                self.found.say(
                    viscous.place,
                    "viscoelasticity is not available for axisymmetric bodies: its history does not contain the \
                     hoop strain",
                );
                self.found.cure("use a sector of 3D elements with rollers, or remove the viscoelasticity");
            }
        }
        for (name, boundary) in case.boundary.iter() {
            for action in boundary.actions() {
                match action {
                    Action::Torque(_) => {
                        self.found.say(name.place, format!("the torque '{}' turns rings", name.value));
                        self.found.cure(NO_TURN);
                    }
                    Action::Motion(motion) => {
                        self.no_rotation(motion);
                        self.no_radial_motion(&name.value, motion);
                    }
                    Action::Force(force) => {
                        if let Some(at) = &force.at {
                            self.found.say(at.place, "a force on rings has no point of action");
                            self.found.cure("remove `at`: the force is that of the whole revolution");
                        }
                    }
                    _ => {}
                }
            }
        }
        for tied in case.tied.values() {
            let is_radial = |offset: &&At<Vec<_>>| offset.first().is_some_and(|x: &Length| x.value != 0.0);
            let offset = tied.offset.as_ref().filter(is_radial).map(|offset| offset.place);
            let jump = tied.jump.as_ref().and_then(|jump| jump.as_array()[0]).filter(|x| !x.is_zero());
            if let Some(place) = offset.or(jump.map(|x| x.place)) {
                self.found
                    .say(place, "periodic sides of bodies of revolution are apart along the axis y only");
                self.found.cure("remove x");
            }
        }
        for (name, body) in case.rigid.iter() {
            if let Some(motion) = &body.motion {
                self.no_rotation(motion);
                self.no_radial_motion(&name.value, motion);
            }
            body.free.iter().for_each(|free| self.free_ring(&name.value, free));
        }
    }

    fn no_radial_motion(&mut self, name: &str, motion: &At<PrescribedMotion>) {
        if let Some(x) = motion.components()[0].filter(|x| !x.is_zero()) {
            self.found.say(x.place, format!("the motion of '{name}' changes its radius, which needs strain"));
            self.found.cure("remove x; on a boundary, write a `displacement`");
        }
    }

    fn no_rotation(&mut self, motion: &At<PrescribedMotion>) {
        if let Some(rotation) = &motion.rotation {
            self.found.say(rotation.place, "a rotation in the meridian plane has no meaning in axisymmetry");
            self.found.cure(NO_TURN);
        }
    }

    /// A free rigid body moves along the axis only.
    fn free_ring(&mut self, name: &str, free: &At<FreeMotion>) {
        let fixes_radius = free.fixes(|degree| degree.direction() == Some(0));
        let fixes_rotation = free.fixes(|degree| degree.axis() == Some(2));
        if !(fixes_radius && fixes_rotation) {
            self.found.say(
                free.place,
                format!("the rigid body of revolution '{name}' moves along its axis y only"),
            );
            self.found.cure("write `fixed: [ux, rz]`");
        }
        let turns = free.torque.as_ref().map(|torque| torque.place);
        if let Some(place) = turns.or(free.initial_spin.as_ref().map(|spin| spin.place)) {
            self.found.say(place, format!("the rigid body of revolution '{name}' does not rotate"));
            self.found.cure(NO_TURN);
        }
        if let Some(density) = free.density {
            self.found.say(
                density.place,
                format!("the mass of the rigid body of revolution '{name}' does not follow from a density"),
            );
            self.found.cure("give `mass`, that of the whole revolution");
        }
    }
}
