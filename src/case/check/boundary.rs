//! Checks of `boundary`.

use super::super::{Action, Boundary};
use super::Check;
use crate::reader::at::At;
use crate::reader::function::{Function, Varying};

impl Check<'_> {
    pub(super) fn boundary(&mut self, name: &At<String>, boundary: &Boundary) {
        for on in boundary.on.names() {
            self.acts_on(boundary, on);
        }
        let actions: Vec<Action> = boundary.actions().collect();
        if actions.len() != 1 {
            let does = if actions.is_empty() { "has no action" } else { "has more than one action" };
            self.found.say(name.place, format!("the boundary '{}' {does}", name.value));
            self.found.cure("give it exactly one of displacement, gravity, traction, pressure");
        }
        for action in &actions {
            match action {
                Action::Displacement(components) => self.components(name, components),
                Action::Gravity(components) => {
                    components.iter().for_each(|component| self.finite(component));
                    boundary.gravity.iter().for_each(|gravity| self.size("gravity", gravity));
                }
                Action::Traction(components) => self.components(name, components),
                Action::Pressure(pressure) => self.finite(pressure),
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
                Action::Displacement(_) => (true, ""),
                Action::Gravity(_) => (whole, "gravity acts on a whole body, not on one of its sets"),
                Action::Traction(_) => (!whole, "a traction acts on a surface, such as body.set"),
                Action::Pressure(_) => (!whole, "a pressure acts on a surface, such as body.set"),
            };
            self.found.require(fits, on.place, message);
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

    pub(super) fn doubly_prescribed(&mut self) {
        let mut seen: Vec<((&str, usize), &Function)> = Vec::new();
        for boundary in self.case.boundary.values() {
            let Some(displacement) = &boundary.displacement else { continue };
            for (direction, component) in displacement.as_array().into_iter().enumerate() {
                let Some(component) = component else { continue };
                let function: &Function = component;
                for on in boundary.on.names() {
                    let entry = (on.value.as_str(), direction);
                    if seen.iter().any(|(other, motion)| *other == entry && *motion != function) {
                        let axis = ["x", "y", "z"][direction];
                        let on = entry.0;
                        let message = format!(
                            "the displacement {axis} of '{on}' is prescribed twice with different values"
                        );
                        self.found.say(component.place, message);
                    }
                    seen.push((entry, function));
                }
            }
        }
    }
}
