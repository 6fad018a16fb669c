//! Checks of `obstacles` and `contact`.

use super::super::contact::ALL;
use super::super::{Coefficient, Contact, Friction, Normal, Obstacle, Regularization, Start};
use super::Check;
use crate::reader::at::At;
use crate::reader::complaint::Complaint;
use crate::reader::quantity::{Number, PowerStiffness};

impl Check<'_> {
    pub(super) fn obstacle(&mut self, obstacle: &Obstacle) {
        match obstacle {
            Obstacle::Plane { point, normal } => {
                self.size("the point of a plane", point);
                self.direction("the normal of a plane", normal);
            }
            Obstacle::Sphere { center, radius, .. } => {
                self.size("the centre of a sphere", center);
                self.positive("the radius", *radius);
            }
            Obstacle::Cylinder { point, .. } if self.dimension == Some(2) => {
                self.say(point.place, "a cylinder is an obstacle of 3D");
                self.cure("in 2D a `sphere` is a disc");
            }
            Obstacle::Cylinder { point, axis, radius, .. } => {
                self.size("the point of a cylinder", point);
                self.direction("the axis of a cylinder", axis);
                self.positive("the radius", *radius);
            }
        }
    }

    fn direction(&mut self, what: &str, direction: &At<Vec<Number>>) {
        self.size(what, direction);
        let length = direction.iter().map(|component| component.value.powi(2)).sum::<f64>();
        self.require(length > 0.0, direction.place, format!("{what} is zero"));
    }

    pub(super) fn contact(&mut self, contact: &Contact) {
        if self.case.obstacles.get(&contact.contactor).is_some() {
            self.say(
                contact.contactor.place,
                format!("'{}' is an obstacle; the contactor is a body's surface", contact.contactor.value),
            );
            self.cure("exchange contactor and target");
        } else if !contact.is_general() {
            self.surface("a contactor", &contact.contactor);
        }
        if self.case.obstacles.get(&contact.target).is_none() {
            self.target(contact);
        }
        self.quadrature(contact);
        match &contact.normal {
            Normal::Penalty(penalty) => {
                if let (Some(_), Some(penetration)) = (&penalty.compliance, &penalty.penetration) {
                    self.say(
                        penetration.place,
                        "a penalty is given by its compliance or by a penetration, not by both",
                    );
                }
                penalty.compliance.into_iter().for_each(|value| self.positive("the compliance", value));
                penalty.penetration.into_iter().for_each(|value| self.positive("the penetration", value));
            }
            Normal::PowerLaw { stiffness, exponent } => self.power_law(stiffness, *exponent),
        }
        match &contact.friction {
            Friction::None => {}
            Friction::Coulomb { coefficient, regularization } => {
                self.coefficient(coefficient);
                self.regularization(regularization);
            }
            Friction::PowerLaw { stiffness, exponent, regularization } => {
                self.power_law(stiffness, *exponent);
                self.regularization(regularization);
            }
        }
    }

    /// Contact points are the vertices of the contactor, whatever its facets.
    fn quadrature(&mut self, contact: &Contact) {
        let Some(quadrature) = &contact.quadrature else { return };
        self.say(
            quadrature.place,
            "`quadrature` is not a key of a contact: contact acts at the vertices of the contactor, each with the mean gap around it",
        );
        self.cure("leave it out");
    }

    /// The tractions of two contacts of the same sides would add up.
    pub(super) fn pairs(&mut self) {
        let mut before: Vec<(&str, &Contact)> = Vec::new();
        for (name, contact) in self.case.contact.iter() {
            let same = |other: &&(&str, &Contact)| {
                other.1.contactor == contact.contactor && other.1.target == contact.target
            };
            if let Some((first, _)) = before.iter().find(same) {
                let message = format!("contacts '{first}' and '{}' have the same two sides", name.value);
                self.say(contact.contactor.place, message);
                self.cure("their tractions would add up: keep one of them");
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
            let message = format!("contact '{}' acts where '{}' acts as well", name.value, general.value);
            self.say(contact.contactor.place, message);
            self.cure("their tractions would add up: keep one of them");
        }
    }

    fn target(&mut self, contact: &Contact) {
        let target = &contact.target;
        let of_bodies = target.contains('.') || self.case.bodies.get(target).is_some();
        if (target.value == ALL && !contact.is_general()) || (contact.is_general() && of_bodies) {
            let message = "`all` is the whole surface of all bodies, of which any other surface is a part";
            self.say(if contact.is_general() { target.place } else { contact.contactor.place }, message);
            self.cure(
                "write `all` for both sides, or for the contactor alone where the target is an obstacle",
            );
        } else if of_bodies {
            self.surface("a target", target);
        } else if target.value != ALL {
            let known = self.case.obstacles.names().chain(self.case.bodies.names());
            let complaint = Complaint::unknown("target", target, known);
            self.found.push(complaint.at(target.place));
        }
    }

    fn power_law(&mut self, stiffness: &PowerStiffness, exponent: Number) {
        self.require(
            stiffness.value > 0.0,
            stiffness.place,
            format!("the stiffness must be > 0, found {}", stiffness.value),
        );
        self.positive("the exponent", exponent);
        let expected = PowerStiffness::dimension_for(exponent.value);
        if let Some(found) = stiffness.dimension.filter(|found| *found != expected) {
            let units = &self.case.units;
            let (found, unit) = (units.describe(found), units.symbol(expected));
            self.say(stiffness.place, format!("the stiffness is {found}; expected one in {unit}"));
            self.cure(&format!("write a number in {unit}, or as in \"1 {unit}\""));
        }
    }

    fn coefficient(&mut self, coefficient: &At<Coefficient>) {
        match &coefficient.value {
            Coefficient::Constant(value) => {
                self.not_negative("the coefficient of friction", *value, coefficient.place);
            }
            Coefficient::GroschSchallamach { reference, modulus, exponent } => {
                self.not_negative("the reference coefficient", reference.value, reference.place);
                self.positive("the modulus", *modulus);
                let fits = exponent.value > -1.0 && exponent.value <= 1.0;
                let message = format!("the exponent must be > -1 and <= 1, found {}", exponent.value);
                self.require(fits, exponent.place, message);
            }
            Coefficient::Stribeck { rest, kinetic, decay_velocity } => {
                self.not_negative("the static coefficient", rest.value, rest.place);
                self.not_negative("the kinetic coefficient", kinetic.value, kinetic.place);
                self.positive("the decay velocity", *decay_velocity);
            }
        }
    }

    fn regularization(&mut self, regularization: &Regularization) {
        match regularization {
            Regularization::StickStiffness(stiffness) => self.positive("the stick stiffness", *stiffness),
            Regularization::StickVelocity(velocity) | Regularization::SmoothStickVelocity(velocity) => {
                self.positive("the stick velocity", *velocity);
                let sought = self.case.start.as_ref().map(|start| &start.value);
                let in_start = matches!(sought, Some(Start::Equilibrium { friction: true, .. }));
                if self.case.is_static() || in_start {
                    self.say(
                        velocity.place,
                        "statics knows no slip velocity, so a stick velocity would be no friction",
                    );
                    self.cure("use `stick_stiffness`");
                }
            }
        }
    }

    /// `body.set`; for a box the sets are known.
    fn surface(&mut self, what: &str, on: &At<String>) {
        if self.body_of(on) && !on.contains('.') {
            self.say(on.place, format!("{what} is a surface, '{}' is a whole body", on.value));
            self.cure(&format!("name a set of it, as in {}.bottom", on.value));
        }
    }
}
