//! Checks of `obstacles` and `contact`.

use super::super::contact::ALL;
use super::super::{Contact, SetNames, Start};
use super::Check;
use crate::contact::friction::Regularization;
use crate::contact::obstacle::Obstacle;
use crate::reader::at::At;
use crate::reader::complaint::Complaint;

impl Check<'_> {
    pub(super) fn obstacle(&mut self, obstacle: &Obstacle) {
        if let Some(dimension) = self.dimension {
            obstacle.check(dimension, &mut self.found);
        }
    }

    pub(super) fn contact(&mut self, contact: &Contact) {
        for contactor in contact.contactor.names() {
            if self.case.obstacles.get(contactor).is_some() {
                self.found.say(
                    contactor.place,
                    format!(
                        "'{}' is an obstacle; the contactor must be a surface of a body",
                        contactor.value
                    ),
                );
                self.found.cure("exchange contactor and target");
            } else if self.case.rigid.get(contactor).is_some() {
                self.rigid_contactor(contactor, &contact.target);
            } else if !contact.is_general() && !self.is_all_in_list(&contact.contactor, contactor) {
                self.surface("a contactor", contactor);
            }
        }
        for target in contact.target.names() {
            let is_rigid = self.case.shape(target).is_some();
            if is_rigid && contact.target.is_list() {
                let kind = if self.case.rigid.get(target).is_some() { "a rigid body" } else { "an obstacle" };
                let message = format!("'{}' is {kind} and can not be one of several targets", target.value);
                self.found.say(target.place, message);
                self.found
                    .cure(&format!("write a contact of its own for {kind}; a list of sets is one surface"));
            } else if !is_rigid && !self.is_all_in_list(&contact.target, target) {
                self.target(contact, target);
            }
        }
        self.quadrature(contact);
        contact.normal.law().check(&mut self.found);
        contact.friction.law().check(&mut self.found);
        if let Some(regularization) = contact.friction.law().regularization() {
            regularization.check(&mut self.found);
            self.slip_velocity(&regularization);
        }
        if let Some(damping) = &contact.damping {
            damping.check(&mut self.found);
            if damping.is_none() {
                self.found.say(damping.place, "the damping has neither `normal` nor `tangential`");
                self.found
                    .cure("write for example { normal: { kelvin: { viscosity: 1.0e4 } } }, or remove it");
            }
            self.dashpots_move(damping.place);
        }
    }

    /// A rigid body can not be the contactor.
    fn rigid_contactor(&mut self, contactor: &At<String>, target: &SetNames) {
        let name = &contactor.value;
        let (message, cure) = if self.case.shape(target).is_some() {
            let message = format!(
                "'{name}' and '{}' are both rigid: contact acts between a deformable body and another body",
                target.value
            );
            (message, "make one of them an elastic body of a high modulus, or remove the contact")
        } else {
            let message =
                format!("'{name}' is a rigid body; the contactor must be a surface of a deformable body");
            (message, "exchange contactor and target")
        };
        self.found.say(contactor.place, message);
        self.found.cure(cure);
    }

    /// Contact points are the vertices of the contactor, whatever its facets.
    fn quadrature(&mut self, contact: &Contact) {
        let Some(quadrature) = &contact.quadrature else { return };
        self.found.say(
            quadrature.place,
            "`quadrature` is not a key of a contact: contact points are the vertices of the contactor, with \
             the mean gap around each",
        );
        self.found.cure("remove it");
    }

    /// The tractions of two contacts of the same sides would add up.
    pub(super) fn pairs(&mut self) {
        let mut before: Vec<(&str, &Contact)> = Vec::new();
        for (name, contact) in self.case.contact.iter() {
            let same = |other: &&(&str, &Contact)| {
                other.1.contactor.value == contact.contactor.value
                    && other.1.target.value == contact.target.value
            };
            if let Some((first, _)) = before.iter().find(same) {
                let message = format!("contacts '{first}' and '{}' have the same two sides", name.value);
                self.found.say(contact.contactor.place, message);
                self.found.cure("their tractions would be added: keep only one of them");
            }
            before.push((&name.value, contact));
        }
        self.parts_of_general_contacts();
    }

    /// Between `all` and `all`, and between `all` and an obstacle, no other contact has anything left to do.
    fn parts_of_general_contacts(&mut self) {
        let case = self.case;
        let covers = |general: &Contact, other: &Contact| {
            general.is_general()
                && !other.is_general()
                && (general.target.value == ALL || general.target.value == other.target.value)
        };
        for (name, contact) in case.contact.iter() {
            let Some((general, _)) = case.contact.iter().find(|(_, general)| covers(general, contact)) else {
                continue;
            };
            let message = format!(
                "contact '{}' acts on surfaces that contact '{}' also covers",
                name.value, general.value
            );
            self.found.say(contact.contactor.place, message);
            self.found.cure("their tractions would be added: keep only one of them");
        }
    }

    /// Whether a name of a list is `all`, which is an error: the whole surface of all bodies needs no others beside it.
    fn is_all_in_list(&mut self, list: &SetNames, name: &At<String>) -> bool {
        let found = list.is_list() && name.value == ALL;
        if found {
            self.found.say(name.place, "`all` contains every other surface and can not be one of several");
            self.found.cure("write `all` alone, or name the sets");
        }
        found
    }

    fn target(&mut self, contact: &Contact, target: &At<String>) {
        let of_bodies = target.contains('.') || self.case.bodies.get(target).is_some();
        if (target.value == ALL && !contact.is_general()) || (contact.is_general() && of_bodies) {
            let message = "`all` is the whole surface of all bodies and contains every other surface";
            self.found
                .say(if contact.is_general() { target.place } else { contact.contactor.place }, message);
            self.found
                .cure("write `all` for both sides, or only for the contactor if the target is an obstacle");
        } else if of_bodies {
            self.surface("a target", target);
        } else if target.value != ALL {
            let rigid = self.case.shapes().map(|(name, _)| name.as_str());
            let known = rigid.chain(self.case.bodies.names());
            let complaint = Complaint::unknown("target", target, known);
            self.found.push(complaint.at(target.place));
        }
    }

    /// Statics has no velocities.
    fn slip_velocity(&mut self, regularization: &Regularization) {
        let Some(velocity) = regularization.slip_velocity() else { return };
        let sought = self.case.start.as_ref().map(|start| &start.value);
        let in_start = matches!(sought, Some(Start::Equilibrium { friction: true, .. }));
        if self.case.is_static() || in_start {
            let message = "statics has no slip velocity, so a stick velocity would give no friction";
            self.found.say(velocity.place, message);
            self.found.cure("use `stick_stiffness`");
        }
    }

    /// `body.set`; for a box the sets are known.
    pub(super) fn surface(&mut self, what: &str, on: &At<String>) {
        if self.body_of(on) && !on.contains('.') {
            self.found.say(on.place, format!("{what} must be a surface, but '{}' is a whole body", on.value));
            self.found.cure(&format!("name one of its sets, for example {}.bottom", on.value));
        }
    }
}
