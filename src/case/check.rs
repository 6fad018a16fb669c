//! Checks that need no mesh: ranges, names, dimensions, options that exclude each other.

use super::diagnostics::Complaint;
use super::function::{Function, Varying};
use super::quantity::{PowerStiffness, Quantity};
use super::{
    Action, At, Body, Boundary, BoxMesh, Case, Coefficient, Contact, Element, Friction, Locking, Mesh,
    Normal, Obstacle, Place, Regularization, Scheme, Start,
};

/// All that is wrong with the case, in no particular order.
pub(super) fn complaints(case: &Case) -> Vec<Complaint> {
    let mut check = Check { case, dimension: case.dimension.value as usize, found: Vec::new() };
    if !(2..=3).contains(&check.dimension) {
        let place = case.dimension.place;
        check.say(place, format!("the dimension is 2 or 3, not {}", case.dimension.value));
        return check.found;
    }
    check.names();
    for (name, body) in case.bodies.iter() {
        check.body(name, body);
    }
    case.obstacles.iter().for_each(|(_, obstacle)| check.obstacle(obstacle));
    case.contact.iter().for_each(|(_, contact)| check.contact(contact));
    case.boundary.iter().for_each(|(name, boundary)| check.boundary(name, boundary));
    check.doubly_prescribed();
    check.time();
    check.start();
    check.solver();
    check.output();
    check.found
}

struct Check<'a> {
    case: &'a Case,
    dimension: usize,
    found: Vec<Complaint>,
}

impl Check<'_> {
    fn say(&mut self, place: Place, message: impl Into<String>) {
        self.found.push(Complaint::new(message.into()).at(place));
    }

    fn require(&mut self, holds: bool, place: Place, message: impl Into<String>) {
        if !holds {
            self.say(place, message);
        }
    }

    fn cure(&mut self, hint: &str) {
        if let Some(complaint) = self.found.last_mut() {
            complaint.hint = hint.to_string();
        }
    }

    fn positive<const KG: i8, const M: i8, const S: i8>(&mut self, what: &str, value: Quantity<KG, M, S>) {
        self.require(value.si > 0.0, value.place, format!("{what} must be > 0, found {}", value.si));
    }

    fn not_negative(&mut self, what: &str, value: f64, place: Place) {
        self.require(value >= 0.0, place, format!("{what} must be >= 0, found {value}"));
    }

    fn at_least_one(&mut self, what: &str, value: &At<u32>) {
        self.require(value.value >= 1, value.place, format!("{what} must be >= 1, found 0"));
    }

    fn size<T>(&mut self, what: &str, list: &At<Vec<T>>) {
        let (wanted, found) = (self.dimension, list.len());
        let message = format!("{what} needs {wanted} entries in {wanted}D, found {found}");
        self.require(found == wanted, list.place, message);
    }

    fn names(&mut self) {
        let case = self.case;
        if case.bodies.is_empty() {
            self.say(case.bodies.place, "a case needs at least one body");
        }
        let mut all: Vec<(&str, &At<String>)> = Vec::new();
        all.extend(case.bodies.iter().map(|(name, _)| ("bodies", name)));
        all.extend(case.obstacles.iter().map(|(name, _)| ("obstacles", name)));
        all.extend(case.contact.iter().map(|(name, _)| ("contact", name)));
        all.extend(case.boundary.iter().map(|(name, _)| ("boundary", name)));
        all.extend(case.output.probes.iter().map(|(name, _)| ("probes", name)));
        for (block, name) in all {
            let fits = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
            if name.is_empty() || !name.chars().all(fits) {
                self.say(name.place, format!("'{}' can not be a name in `{block}`", name.value));
                self.cure("names consist of letters, digits, '_' and '-'");
            }
        }
        for (name, _) in case.obstacles.iter().filter(|(name, _)| case.bodies.get(name).is_some()) {
            self.say(name.place, format!("'{}' names a body and an obstacle", name.value));
        }
        for (name, _) in case.petsc.iter() {
            let fits = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            if name.is_empty() || name.starts_with('-') || !name.chars().all(fits) {
                self.say(name.place, format!("'{}' can not be a PETSc option", name.value));
                self.cure("write the name without the leading dash, as in ksp_monitor");
            }
        }
    }

    fn body(&mut self, name: &At<String>, body: &Body) {
        match &body.mesh {
            Mesh::Box(cuboid) => self.cuboid(cuboid, body.locking),
            Mesh::File(mesh) => {
                self.require(!mesh.file.is_empty(), mesh.file.place, "the mesh file has no name")
            }
        }
        let elastic = body.material.elastic();
        self.positive("Young's modulus", elastic.young_modulus);
        let ratio = elastic.poisson_ratio;
        if !(ratio.si > -1.0 && ratio.si < 0.5) {
            self.say(ratio.place, format!("Poisson's ratio must be > -1 and < 0.5, found {}", ratio.si));
            self.cure("an almost incompressible solid is written as 0.49 or 0.499, with `locking: selective_reduced`");
        }
        match body.density {
            Some(density) => self.positive("the density", density),
            None => self.missing_density(name),
        }
        if let Some(velocity) = &body.initial_velocity {
            self.size("an initial velocity", velocity);
            for component in velocity.iter() {
                let constant = component.is_constant_in_time();
                self.require(constant, component.place, "an initial velocity can not depend on t");
                self.finite(component);
            }
            let moves = !self.case.is_static();
            self.require(moves, velocity.place, "an initial velocity has no meaning with the static scheme");
        }
        if self.case.is_static() && !self.is_held(name) {
            self.say(
                name.place,
                format!("nothing holds the body '{}', and the static scheme has no inertia", name.value),
            );
            self.cure("add a displacement boundary or a contact, or use a dynamic scheme");
        }
    }

    fn missing_density(&mut self, name: &At<String>) {
        let weighs =
            |(_, boundary): (_, &Boundary)| boundary.gravity.is_some() && boundary.on.value == name.value;
        if !self.case.is_static() || self.case.boundary.iter().any(weighs) {
            self.say(name.place, format!("the body '{}' needs a density", name.value));
            self.cure("add `density:` in kg/m3; only statics without gravity does without");
        }
    }

    fn is_held(&self, body: &str) -> bool {
        let of_body = |set: &str| set.split('.').next() == Some(body);
        let supported = |boundary: &Boundary| boundary.displacement.is_some() && of_body(&boundary.on);
        let touches = |contact: &Contact| of_body(&contact.contactor) || of_body(&contact.target);
        self.case.boundary.values().any(supported) || self.case.contact.values().any(touches)
    }

    fn cuboid(&mut self, cuboid: &BoxMesh, locking: Locking) {
        self.size("the corner 'min'", &cuboid.min);
        self.size("the corner 'max'", &cuboid.max);
        self.size("'cells'", &cuboid.cells);
        for (axis, (min, max)) in ["x", "y", "z"].iter().zip(cuboid.min.iter().zip(cuboid.max.iter())) {
            let message = format!("the box has no extent along {axis}: max {} <= min {}", max.si, min.si);
            self.require(max.si > min.si, max.place, message);
        }
        let cells = cuboid.cells.iter().map(|count| u64::from(*count)).fold(1u64, u64::saturating_mul);
        self.require(cells > 0, cuboid.cells.place, "a box needs at least one cell in each direction");
        self.require(
            cells < 1 << 27,
            cuboid.cells.place,
            format!("{cells} cells are more than a box can have"),
        );
        let default = if self.dimension == 2 { Element::Quad4 } else { Element::Hex8 };
        let (element, place) =
            cuboid.element.as_ref().map_or((default, cuboid.cells.place), |e| (e.value, e.place));
        let (name, its) = (element.name(), element.dimension());
        self.require(
            its == self.dimension,
            place,
            format!("{name} is an element of {its}D, the case has {}D", self.dimension),
        );
        if locking != Locking::None && !element.offers_locking_cure() {
            self.say(place, format!("{name} offers no cure for locking"));
            self.cure("selective_reduced and f_bar are for quad4 and hex8; write `locking: none`, or change the element");
        }
    }

    fn obstacle(&mut self, obstacle: &Obstacle) {
        match obstacle {
            Obstacle::Plane { point, normal } => {
                self.size("the point of a plane", point);
                self.direction("the normal of a plane", normal);
            }
            Obstacle::Sphere { center, radius, .. } => {
                self.size("the centre of a sphere", center);
                self.positive("the radius", *radius);
            }
            Obstacle::Cylinder { point, axis, radius, .. } if self.dimension == 3 => {
                self.size("the point of a cylinder", point);
                self.direction("the axis of a cylinder", axis);
                self.positive("the radius", *radius);
            }
            Obstacle::Cylinder { point, .. } => {
                self.say(point.place, "a cylinder is an obstacle of 3D");
                self.cure("in 2D a `sphere` is a disc");
            }
        }
    }

    fn direction(&mut self, what: &str, direction: &At<Vec<super::quantity::Number>>) {
        self.size(what, direction);
        let length = direction.iter().map(|component| component.si.powi(2)).sum::<f64>();
        self.require(length > 0.0, direction.place, format!("{what} is zero"));
    }

    fn contact(&mut self, contact: &Contact) {
        if self.case.obstacles.get(&contact.contactor).is_some() {
            self.say(
                contact.contactor.place,
                format!("'{}' is an obstacle; the contactor is a body's surface", contact.contactor.value),
            );
            self.cure("exchange contactor and target");
        } else {
            self.surface("a contactor", &contact.contactor);
        }
        if self.case.obstacles.get(&contact.target).is_none() {
            self.target(contact);
        }
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

    fn target(&mut self, contact: &Contact) {
        let target = &contact.target;
        if target.value == contact.contactor.value {
            self.say(target.place, format!("'{}' can not be its own target", target.value));
        } else if target.contains('.') || self.case.bodies.get(target).is_some() {
            self.surface("a target", target);
        } else {
            let known = self.case.obstacles.names().chain(self.case.bodies.names());
            let complaint = Complaint::unknown("target", target, known);
            self.found.push(complaint.at(target.place));
        }
    }

    fn power_law(&mut self, stiffness: &PowerStiffness, exponent: super::quantity::Number) {
        self.require(
            stiffness.si > 0.0,
            stiffness.place,
            format!("the stiffness must be > 0, found {}", stiffness.si),
        );
        self.positive("the exponent", exponent);
        let expected = PowerStiffness::dimension_for(exponent.si);
        if let Some(found) = stiffness.dimension.filter(|found| *found != expected) {
            let message =
                format!("the stiffness is {found}; expected {expected}, which is Pa/m^{}", exponent.si);
            self.say(stiffness.place, message);
            self.cure(&format!("write a number in Pa/m^{0}, or as in \"1 MPa/m^{0}\"", exponent.si));
        }
    }

    fn coefficient(&mut self, coefficient: &At<Coefficient>) {
        match &coefficient.value {
            Coefficient::Constant(value) => {
                self.not_negative("the coefficient of friction", *value, coefficient.place);
            }
            Coefficient::GroschSchallamach { reference, modulus, exponent } => {
                self.not_negative("the reference coefficient", reference.si, reference.place);
                self.positive("the modulus", *modulus);
                let fits = exponent.si > -1.0 && exponent.si <= 1.0;
                let message = format!("the exponent must be > -1 and <= 1, found {}", exponent.si);
                self.require(fits, exponent.place, message);
            }
            Coefficient::Stribeck { rest, kinetic, decay_velocity } => {
                self.not_negative("the static coefficient", rest.si, rest.place);
                self.not_negative("the kinetic coefficient", kinetic.si, kinetic.place);
                self.positive("the decay velocity", *decay_velocity);
            }
        }
    }

    fn regularization(&mut self, regularization: &Regularization) {
        match regularization {
            Regularization::StickStiffness(stiffness) => self.positive("the stick stiffness", *stiffness),
            Regularization::StickVelocity(velocity) => {
                self.positive("the stick velocity", *velocity);
                let sought = self.case.start.as_ref().map(|start| &start.value);
                let in_start = matches!(sought, Some(Start::Equilibrium { friction: true, .. }));
                if self.case.is_static() || in_start {
                    self.say(
                        velocity.place,
                        "statics knows no slip velocity, so `stick_velocity` would be no friction",
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

    /// Whether `body` or `body.set` names a body that exists, and a set that can exist; says so where not.
    fn body_of(&mut self, on: &At<String>) -> bool {
        let (name, set) = on.split_once('.').map_or((on.as_str(), None), |(name, set)| (name, Some(set)));
        let Some(body) = self.case.bodies.get(name) else {
            let complaint = if self.case.obstacles.get(name).is_some() {
                Complaint::new(format!("'{name}' is an obstacle, a body is needed here"))
            } else {
                Complaint::unknown("body", name, self.case.bodies.names())
            };
            self.found.push(complaint.at(on.place));
            return false;
        };
        let Some(set) = set else { return true };
        let sets = ["left", "right", "bottom", "top", "front", "back"];
        let sets = &sets[..2 * self.dimension];
        if matches!(body.mesh, Mesh::Box(_)) && !sets.contains(&set) {
            let mut complaint = Complaint::unknown("set", set, sets.iter().copied()).at(on.place);
            complaint.message = format!("the box '{name}' has no set '{set}'");
            self.found.push(complaint);
        }
        true
    }

    fn boundary(&mut self, name: &At<String>, boundary: &Boundary) {
        let on = &boundary.on;
        let known = self.body_of(on);
        let actions: Vec<Action> = boundary.actions().collect();
        if actions.len() != 1 {
            let does = if actions.is_empty() { "does nothing" } else { "does more than one thing" };
            self.say(name.place, format!("the boundary '{}' {does}", name.value));
            self.cure("give it one of displacement, gravity, traction, pressure");
        }
        let whole = !on.contains('.');
        for action in &actions {
            match action {
                Action::Displacement(components) => self.components(name, components),
                Action::Gravity(components) => {
                    components.iter().for_each(|component| self.finite(component));
                    boundary.gravity.iter().for_each(|gravity| self.size("gravity", gravity));
                    self.require(
                        whole || !known,
                        on.place,
                        "gravity acts on a whole body, not on a set of it",
                    );
                }
                Action::Traction(components) => {
                    self.components(name, components);
                    self.require(!whole || !known, on.place, "a traction acts on a surface, as body.set");
                }
                Action::Pressure(pressure) => {
                    self.finite(pressure);
                    self.require(!whole || !known, on.place, "a pressure acts on a surface, as body.set");
                }
            }
        }
    }

    fn components<const KG: i8, const M: i8, const S: i8>(
        &mut self,
        name: &At<String>,
        components: &[Option<&Varying<KG, M, S>>; 3],
    ) {
        if components.iter().all(Option::is_none) {
            self.say(name.place, format!("the boundary '{}' names no direction", name.value));
            self.cure("as in { x: 0, y: \"1.0 * t\" }");
        }
        if let (2, Some(z)) = (self.dimension, components[2]) {
            self.say(z.place, "a case in 2D has no z");
        }
        components.iter().flatten().for_each(|component| self.finite(component));
    }

    /// A function of time alone can be tried: it must be finite at the start and at the end.
    fn finite<const KG: i8, const M: i8, const S: i8>(&mut self, varying: &Varying<KG, M, S>) {
        let function: &Function = varying;
        if !function.is_constant_in_space() {
            return;
        }
        for t in [0.0, self.case.time.end.si] {
            let motion = function.motion([0.0; 3], t);
            if ![motion.value, motion.rate, motion.second].iter().all(|value| value.is_finite()) {
                let what = if motion.value.is_finite() { "derivative" } else { "value" };
                self.say(varying.place, format!("the {what} is not finite at t = {t}"));
                return;
            }
        }
    }

    fn doubly_prescribed(&mut self) {
        let mut seen: Vec<(&str, usize)> = Vec::new();
        for boundary in self.case.boundary.values() {
            let Some(displacement) = &boundary.displacement else { continue };
            for (direction, component) in displacement.as_array().into_iter().enumerate() {
                let Some(component) = component else { continue };
                let entry = (boundary.on.value.as_str(), direction);
                if seen.contains(&entry) {
                    let axis = ["x", "y", "z"][direction];
                    self.say(
                        component.place,
                        format!("the displacement {axis} of '{}' is prescribed twice", entry.0),
                    );
                }
                seen.push(entry);
            }
        }
    }

    fn time(&mut self) {
        let time = &self.case.time;
        self.positive("the end", time.end);
        if let Some(step) = time.step {
            self.positive("the step", step);
            let message = format!("the step {} is longer than the whole time {}", step.si, time.end.si);
            self.require(step.si <= time.end.si || time.end.si <= 0.0, step.place, message);
        }
        self.require(
            time.cuts.value <= 30,
            time.cuts.place,
            format!("a step can be halved 30 times at most, not {}", time.cuts.value),
        );
        self.require(
            time.growth.si >= 1.0,
            time.growth.place,
            format!("the growth must be >= 1, found {}", time.growth.si),
        );
        match &time.scheme.value {
            Scheme::Newmark { beta, gamma } => {
                self.within("beta", beta, [0.0, 0.5]);
                self.require(
                    beta.si != 0.0,
                    beta.place,
                    "beta = 0 is an explicit scheme, which this program has not",
                );
                self.within("gamma", gamma, [0.5, 1.0]);
            }
            Scheme::Hht { spectral_radius } => {
                self.within("the spectral radius of hht", spectral_radius, [0.5, 1.0])
            }
            Scheme::GeneralizedAlpha { spectral_radius } => {
                self.within("the spectral radius", spectral_radius, [0.0, 1.0]);
            }
            Scheme::BackwardEuler => {}
            Scheme::Static { increments } => self.increments(increments.as_ref()),
        }
        if time.step.is_none() && !self.case.is_static() {
            self.say(time.end.place, "the key 'step' is missing beside 'end'");
        }
    }

    fn increments(&mut self, increments: Option<&At<u32>>) {
        let time = &self.case.time;
        match (time.step, increments) {
            (Some(_), Some(increments)) => {
                self.say(increments.place, "statics takes 'step' or 'increments', not both")
            }
            (None, None) => {
                self.say(time.scheme.place, "the static scheme needs 'increments', or a 'step' beside 'end'");
                self.cure("as in scheme: { static: { increments: 4 } }");
            }
            (None, Some(increments)) => self.at_least_one("'increments'", increments),
            (Some(_), None) => {}
        }
    }

    fn within(&mut self, what: &str, value: &super::quantity::Number, [low, high]: [f64; 2]) {
        let message = format!("{what} must be between {low} and {high}, found {}", value.si);
        self.require((low..=high).contains(&value.si), value.place, message);
    }

    fn start(&mut self) {
        let Some(start) = &self.case.start else { return };
        if self.case.is_static() {
            self.say(start.place, "a static case has no start: it begins undeformed and seeks equilibrium");
            self.cure("leave out `start`");
        }
        if let Start::Equilibrium { increments: 0, .. } = start.value {
            self.say(start.place, "the equilibrium needs at least one increment");
        }
    }

    fn solver(&mut self) {
        let (newton, krylov) = (&self.case.solver.newton, &self.case.solver.krylov);
        for (what, tolerance) in [("Newton", newton.tolerance), ("Krylov", krylov.tolerance)] {
            let fits = tolerance.si > 0.0 && tolerance.si < 1.0;
            let message = format!("the {what} tolerance must be > 0 and < 1, found {}", tolerance.si);
            self.require(fits, tolerance.place, message);
        }
        self.at_least_one("'max_iterations'", &newton.max_iterations);
        self.at_least_one("'max_iterations'", &krylov.max_iterations);
        self.at_least_one("'restart'", &krylov.restart);
        let linear = &self.case.solver.linear;
        let rubs = |contact: &Contact| contact.friction != Friction::None;
        if linear.needs_symmetry() && self.case.contact.values().any(rubs) {
            self.say(
                linear.place,
                "this linear solver needs a symmetric matrix, and friction makes it non-symmetric",
            );
            self.cure("write `linear: auto`, or a GMRES preset, or direct");
        }
    }

    fn output(&mut self) {
        let output = &self.case.output;
        self.at_least_one("'every'", &output.fields.every);
        output.checkpoint.iter().for_each(|checkpoint| self.at_least_one("'every'", &checkpoint.every));
        for probe in output.probes.values() {
            self.size("the position of a probe", &probe.at);
            let Some(on) = &probe.on else { continue };
            if self.body_of(on) {
                self.require(!on.contains('.'), on.place, "a probe lies on a body, not on a set of it");
            }
        }
    }
}
