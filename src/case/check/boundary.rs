//! Checks of `boundary`.

use super::super::{Action, Boundary, Directional, Force, Foundation, PrescribedMotion, Roller, Spring};
use super::Check;
use crate::reader::at::At;
use crate::reader::function::{Function, Varying};
use crate::reader::place::Place;

impl Check<'_> {
    pub(super) fn boundary(&mut self, name: &At<String>, boundary: &Boundary) {
        for on in boundary.on.names() {
            self.acts_on(boundary, on);
        }
        let actions: Vec<Action> = boundary.actions().collect();
        if actions.len() != 1 {
            let does = if actions.is_empty() { "has no action" } else { "has more than one action" };
            self.found.say(name.place, format!("the boundary '{}' {does}", name.value));
            self.found.cure(
                "give it exactly one of displacement, motion, roller, gravity, traction, pressure, line_force, force, torque, foundation, spring",
            );
        }
        for action in &actions {
            match action {
                Action::Displacement(components) => self.components(name, components),
                Action::Roller(roller) => self.roller(roller),
                Action::Motion(motion) => self.motion_of_support(name, motion),
                Action::Gravity(components) => {
                    components.iter().for_each(|component| self.finite(component));
                    boundary.gravity.iter().for_each(|gravity| self.size("gravity", gravity));
                }
                Action::Traction(components) => self.components(name, components),
                Action::Pressure(pressure) => self.finite(pressure),
                Action::LineForce(components) => {
                    self.components(name, components);
                    if self.dimension == Some(2) {
                        self.found.say(name.place, "a line force acts in 3D only");
                        self.found.cure("in 2D use a `force` on points: it is per metre of depth");
                    }
                }
                Action::Force(force) => self.force(name, force),
                Action::Torque(torque) => self.torque(name, torque),
                Action::Foundation(foundation) => self.foundation(name, foundation),
                Action::Spring(spring) => self.spring(name, spring),
            }
        }
    }

    /// Whether the actions of a boundary can act on a body or a set.
    fn acts_on(&mut self, boundary: &Boundary, on: &At<String>) {
        if !self.body_of(on) {
            return;
        }
        let whole = !on.contains('.');
        for action in boundary.actions() {
            let (fits, message) = match action {
                Action::Displacement(_) | Action::Motion(_) => (true, ""),
                Action::Roller(roller) => {
                    let fits = !whole || roller.direction.is_some();
                    (fits, "a roller without a direction acts on a surface, such as body.set")
                }
                Action::Gravity(_) => (whole, "gravity acts on a whole body, not on one of its sets"),
                Action::Traction(_) => (!whole, "a traction acts on a surface, such as body.set"),
                Action::Pressure(_) => (!whole, "a pressure acts on a surface, such as body.set"),
                Action::LineForce(_) => (!whole, "a line force acts on a set of points, such as body.set"),
                Action::Force(_) => (!whole, "a force acts on a surface or on points, such as body.set"),
                Action::Torque(_) => (!whole, "a torque acts on a surface, such as body.set"),
                Action::Foundation(_) => (!whole, "a foundation acts on a surface, such as body.set"),
                Action::Spring(_) => (!whole, "springs act on the nodes of a set, such as body.set"),
            };
            self.found.require(fits, on.place, message);
        }
    }

    /// A boundary has no centre, so its rotation needs a point of the axis.
    fn motion_of_support(&mut self, name: &At<String>, motion: &At<PrescribedMotion>) {
        self.motion(name, motion);
        if let Some(rotation) = motion.rotation.as_ref().filter(|rotation| rotation.about.is_none()) {
            self.found.say(rotation.place, "the rotation of a boundary needs a point of its axis");
            let point = if self.dimension == Some(3) { "[0, 0, 0]" } else { "[0, 0]" };
            self.found.cure(&format!("write for example about: {point}"));
        }
    }

    fn components<const KG: i8, const M: i8, const S: i8>(
        &mut self,
        name: &At<String>,
        components: &[Option<&Varying<KG, M, S>>; 3],
    ) {
        if components.iter().all(Option::is_none) {
            self.found.say(name.place, format!("the boundary '{}' has no components", name.value));
            self.found.cure("write for example { x: 0, y: \"1.0 * t\" }");
        }
        if let (Some(2), Some(z)) = (self.dimension, components[2]) {
            self.found.say(z.place, "a 2D case has no z");
        }
        components.iter().flatten().for_each(|component| self.finite(component));
    }

    fn roller(&mut self, roller: &Roller) {
        roller.displacement.iter().for_each(|displacement| self.finite(displacement));
        let Some(direction) = &roller.direction else { return };
        self.size("the direction of a roller", direction);
        let length: f64 = direction.iter().map(|entry| entry.value.powi(2)).sum();
        let fits = length > 0.0 && length.is_finite();
        self.found.require(fits, direction.place, "the direction of a roller must be finite and not zero");
    }

    fn force(&mut self, name: &At<String>, force: &Force) {
        self.components(name, &force.as_array());
        force.as_array().into_iter().flatten().for_each(|component| self.total(component));
        force.at.iter().for_each(|at| self.size("the point 'at'", at));
    }

    fn torque<const KG: i8, const M: i8, const S: i8>(
        &mut self,
        name: &At<String>,
        torque: &[Option<&Varying<KG, M, S>>; 3],
    ) {
        if torque.iter().all(Option::is_none) {
            self.found.say(name.place, format!("the boundary '{}' has no components", name.value));
            self.found.cure("write for example { z: \"10 N m\" }");
        }
        if self.dimension == Some(2) {
            for component in torque[..2].iter().flatten() {
                self.found.say(component.place, "in 2D a torque acts about z only");
            }
        }
        for component in torque.iter().flatten() {
            self.finite(component);
            self.total(component);
        }
    }

    /// A total has no place.
    fn total<const KG: i8, const M: i8, const S: i8>(&mut self, component: &Varying<KG, M, S>) {
        let constant = component.is_constant_in_space();
        self.found.require(constant, component.place, "a total force or torque can not depend on x, y or z");
        if !constant {
            self.found.cure("write a function of t, or use `traction`");
        }
    }

    fn foundation(&mut self, name: &At<String>, foundation: &Foundation) {
        if foundation.stiffness.is_none() && foundation.damping.is_none() {
            self.without_coefficients(name);
        }
        if let Some(stiffness) = &foundation.stiffness {
            self.directional("stiffness", stiffness);
        }
        if let Some(damping) = &foundation.damping {
            self.directional("damping", damping);
            self.dashpots_move(damping.place);
        }
    }

    pub(super) fn spring(&mut self, name: &At<String>, spring: &Spring) {
        if spring.stiffness.is_none() && spring.damping.is_none() {
            self.without_coefficients(name);
        }
        if let Some(stiffness) = &spring.stiffness {
            self.coefficients("stiffness", stiffness.place, &stiffness.as_array());
        }
        if let Some(damping) = &spring.damping {
            self.coefficients("damping", damping.place, &damping.as_array());
            self.dashpots_move(damping.place);
        }
    }

    fn without_coefficients(&mut self, name: &At<String>) {
        let message = format!("'{}' has neither stiffness nor damping", name.value);
        self.found.say(name.place, message);
        self.found.cure("write for example { stiffness: { x: 1.0e6 } }");
    }

    /// The static scheme has no velocities.
    pub(super) fn dashpots_move(&mut self, place: Place) {
        let moves = !self.case.is_static();
        self.found.require(moves, place, "damping is not allowed with the static scheme");
        if !moves {
            self.found.cure("remove it, or use a dynamic scheme");
        }
    }

    fn directional<const KG: i8, const M: i8, const S: i8>(
        &mut self,
        what: &str,
        given: &At<Directional<KG, M, S>>,
    ) {
        let [normal, tangential] = given.of_surface();
        let [x, y, z] = given.of_axes();
        let of_axes = given.of_axes().into_iter().flatten().next();
        if let (true, Some(axis)) = (normal.is_some() || tangential.is_some(), of_axes) {
            self.found.say(axis.place, format!("the {what} mixes directions of the surface and of the axes"));
            self.found.cure("give either normal and tangential, or x, y and z");
        }
        let all = [normal, tangential, x, y, z];
        self.coefficients(what, given.place, &all);
    }

    /// Checks that coefficients are constant in time and, if they do not depend on the position, not
    /// negative. Otherwise they are checked on the mesh.
    fn coefficients<const KG: i8, const M: i8, const S: i8>(
        &mut self,
        what: &str,
        place: Place,
        given: &[Option<&Varying<KG, M, S>>],
    ) {
        let all = || given.iter().flatten();
        let zero = all().all(|coefficient| coefficient.is_zero());
        self.found.require(!zero, place, format!("the {what} is zero"));
        if zero {
            self.found.cure("give a direction a value above zero, or remove it");
        }
        if let (Some(2), Some(Some(z))) = (self.dimension, given.last()) {
            self.found.say(z.place, "a 2D case has no z");
        }
        for coefficient in all() {
            self.finite(coefficient);
            let constant = coefficient.is_constant_in_time();
            self.found.require(constant, coefficient.place, format!("the {what} can not depend on t"));
            if constant && coefficient.is_constant_in_space() {
                let value = coefficient.value([0.0; 3], 0.0);
                self.found.not_negative(&format!("the {what}"), value, coefficient.place);
            }
        }
    }

    pub(super) fn doubly_prescribed(&mut self) {
        let mut seen: Vec<((&str, usize), &str, Function)> = Vec::new();
        for (name, boundary) in self.case.boundary.iter() {
            let given = boundary.displacement.as_ref().map_or([None; 3], |given| given.as_array());
            let written = |i: usize| given[i].map(|component| (component.place, component.function.clone()));
            let moved = |i: usize| boundary.motion.as_ref().map(|motion| (motion.place, motion.along(i)));
            for direction in 0..self.dimension.unwrap_or(0) {
                let Some((place, function)) = written(direction).or_else(|| moved(direction)) else {
                    continue;
                };
                for on in boundary.on.names() {
                    let entry = (on.value.as_str(), direction);
                    let other = seen.iter().find(|(other, _, motion)| *other == entry && *motion != function);
                    if let Some((_, before, _)) = other {
                        let axis = ["x", "y", "z"][direction];
                        let on = entry.0;
                        let message = format!(
                            "the displacement {axis} of '{on}' is prescribed twice with different values"
                        );
                        self.found.say(place, message);
                        self.found.cure(&format!("remove it here or in '{before}'"));
                    }
                    seen.push((entry, &name.value, function.clone()));
                }
            }
        }
    }
}
