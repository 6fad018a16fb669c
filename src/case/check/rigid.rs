//! Checks of `rigid`.

use super::super::{
    Degree, FreeMotion, PrescribedMotion, Rigid, Rotation, Strategy, TorsionSpring, inertia_tensor,
};
use super::Check;
use crate::contact::obstacle::NoSolid;
use crate::reader::at::At;
use crate::reader::function::Varying;
use crate::reader::quantity::Quantity;

/// Cure of shapes that have no mass from a density.
const GIVE_MASS: &str = "give `mass` and `inertia`, or choose a shape that is a solid";

impl Check<'_> {
    pub(super) fn rigid(&mut self, name: &At<String>, body: &Rigid) {
        self.obstacle(&body.shape);
        body.free.iter().for_each(|free| self.free(name, body, free));
        body.motion.iter().for_each(|motion| self.motion(name, motion));
    }

    /// A prescribed motion has components and depends on time only.
    pub(super) fn motion(&mut self, name: &At<String>, motion: &At<PrescribedMotion>) {
        if motion.translation.is_none() && motion.rotation.is_none() {
            self.found.say(motion.place, format!("the motion of '{}' is empty", name.value));
            self.found.cure("give it `translation` or `rotation`, or remove `motion`");
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

    /// A free rigid body has mass where it needs it, and something that is free.
    fn free(&mut self, name: &At<String>, body: &Rigid, free: &At<FreeMotion>) {
        free.spring.iter().for_each(|spring| self.spring(name, spring));
        free.torsion_spring.iter().for_each(|spring| self.torsion_spring(name, body, free, spring));
        let name = &name.value;
        self.mass_of(name, body, free);
        self.degrees_of(name, body, free);
        free.center.iter().for_each(|center| self.size("the centre of mass", center));
        if let Some(about) = rotation_of(body).and_then(|rotation| rotation.about.as_ref()) {
            self.found
                .say(about.place, format!("the free rigid body '{name}' rotates about its centre of mass"));
            self.found
                .cure("remove `about`, and give `center` in `free` if it is not the centre of the shape");
        }
        free.gravity.iter().for_each(|gravity| self.size("gravity", gravity));
        free.initial_velocity.iter().for_each(|velocity| self.size("the initial velocity", velocity));
        if let (Some(dimension), Some(spin)) = (self.dimension, &free.initial_spin) {
            self.found.entries("the initial spin", spin, if dimension == 2 { 1 } else { 3 });
        }
        let forces = free.force.as_ref().map_or([None; 3], |force| force.as_array());
        let torques = free.torque.as_ref().map_or([None; 3], |torque| torque.as_array());
        forces.into_iter().flatten().for_each(|force| self.of_time(force));
        torques.into_iter().flatten().for_each(|torque| self.of_time(torque));
        free.gravity.iter().flat_map(|gravity| gravity.iter()).for_each(|entry| self.of_time(entry));
        if self.dimension == Some(2) {
            if let Some(z) = forces[2] {
                self.found.say(z.place, "a 2D case has no z");
            }
            if let Some(torque) = torques[0].or(torques[1]) {
                self.found.say(torque.place, "a torque in 2D is about z");
                self.found.cure("write torque: { z: ... }");
            }
        }
        if self.case.time.scheme.value.is_static() {
            let initial = free.initial_velocity.as_ref().map(|velocity| velocity.place);
            if let Some(place) = initial.or(free.initial_spin.as_ref().map(|spin| spin.place)) {
                self.found.say(place, "an initial velocity is not allowed with the static scheme");
            }
            if let Some(gravity) =
                free.gravity.as_ref().filter(|_| free.mass.is_none() && free.density.is_none())
            {
                self.found.say(gravity.place, format!("gravity acts on '{name}', which has no mass"));
                self.found.cure("add `mass`, or give a `force`");
            }
            let strategy = &self.case.solver.strategy;
            if matches!(strategy.value, Strategy::Staggered { .. }) {
                self.found.say(
                    strategy.place,
                    format!(
                        "in statics no stage of the staggered strategy holds the free rigid body '{name}'"
                    ),
                );
                self.found.cure("use `strategy: monolithic`");
            }
        }
        if self.case.time.scheme.value.conserves() {
            self.found.say(
                free.place,
                format!(
                    "the conserving scheme has no free rigid bodies, whose rotations over a step would not keep \
                     the energy, but '{name}' is free"
                ),
            );
            self.found.cure("use the scheme midpoint or generalized_alpha, or prescribe the motion");
        }
    }

    /// A torsion spring has coefficients, and one axis about which the body turns.
    fn torsion_spring(
        &mut self,
        name: &At<String>,
        body: &Rigid,
        free: &FreeMotion,
        spring: &At<TorsionSpring>,
    ) {
        if spring.stiffness.is_none() && spring.damping.is_none() {
            self.found.say(spring.place, "the torsion spring has neither stiffness nor damping");
            self.found.cure("write for example { stiffness: 20 }");
        }
        if let Some(k) = spring.stiffness {
            self.found.not_negative("the stiffness of a torsion spring", k.value, k.place);
        }
        if let Some(c) = spring.damping {
            self.found.not_negative("the damping of a torsion spring", c.value, c.place);
            self.dashpots_move(c.place);
        }
        let Some(dimension) = self.dimension else { return };
        let axes = free.free_axes(dimension).count();
        if rotation_of(body).is_some() || axes == 0 {
            let message = format!("the torsion spring of '{}' has no rotation that is free", name.value);
            self.found.say(spring.place, message);
            self.found.cure("remove it, or the prescribed or fixed rotation");
        } else if axes > 1 {
            let message =
                format!("the torsion spring of '{}' acts about one axis, but {axes} are free", name.value);
            self.found.say(spring.place, message);
            self.found.cure("fix the other rotations, for example fixed: [rx, ry]");
        }
    }

    fn mass_of(&mut self, name: &str, body: &Rigid, free: &At<FreeMotion>) {
        let is_static = self.case.time.scheme.value.is_static();
        if let Some(density) = &free.density {
            self.found.positive("the density", *density);
            if let Some(place) = free
                .mass
                .as_ref()
                .map(|mass| mass.place)
                .or(free.inertia.as_ref().map(|inertia| inertia.place))
            {
                self.found.say(place, format!("'{name}' has both a density and a mass or inertia"));
                self.found.cure("give either `density`, or `mass` and `inertia`");
            }
            if let Some(center) = &free.center {
                self.found.say(center.place, format!("'{name}' has both a density and a centre of mass"));
                self.found.cure("remove `center`, or give `mass` and `inertia` in place of `density`");
            }
            let reason = self.dimension.and_then(|dimension| body.shape.no_solid(dimension));
            if let Some(reason) = reason.filter(|_| self.found.is_empty()) {
                let (message, cure) = match reason {
                    NoSolid::Unbounded => ("has no volume: it is infinite, hollow or open", GIVE_MASS),
                    NoSolid::Offset => (
                        "has a `radius` around its triangles: its volume is not known",
                        "remove `radius` from the surface, or give `mass`, `inertia` and `center`",
                    ),
                    NoSolid::Overlap => ("has a radius that fills a notch of its points", GIVE_MASS),
                };
                self.found.say(density.place, format!("the shape of '{name}' {message}"));
                self.found.cure(cure);
            }
        }
        free.mass.iter().for_each(|&mass| self.found.positive("the mass", mass));
        free.inertia.iter().for_each(|inertia| self.inertia(inertia));
        if is_static || free.density.is_some() {
            return;
        }
        if free.mass.is_none() {
            self.found.say(free.place, format!("the free rigid body '{name}' has no mass"));
            self.found.cure("add `mass`, or `density` if the shape is a solid");
        }
        let turns = rotation_of(body).is_some()
            || (0..3).any(|axis| {
                (self.dimension == Some(3) || axis == 2) && !free.fixes(|degree| degree.axis() == Some(axis))
            });
        if free.inertia.is_none() && turns {
            self.found.say(free.place, format!("the free rigid body '{name}' has no moment of inertia"));
            self.found.cure("add `inertia`, or fix its rotations with `fixed`");
        }
    }

    /// The entries are those of a tensor of inertia of a body.
    fn inertia(&mut self, inertia: &At<Vec<Quantity<1, 2, 0>>>) {
        /// Part of the largest moment by which given numbers may miss the bounds, as they are rounded.
        const ROUNDED: f64 = 1e-12;
        match self.dimension {
            Some(2) => self.found.entries("the inertia", inertia, 1),
            Some(3) if inertia.len() != 6 => {
                self.found.entries("the inertia", inertia, 3);
                if inertia.len() != 3 {
                    self.found.cure("or give the six entries xx, yy, zz, xy, yz, xz of the tensor");
                }
            }
            _ => {}
        }
        if inertia.len() != 3 && inertia.len() != 6 || self.dimension != Some(3) {
            inertia.iter().for_each(|&moment| self.found.positive("a moment of inertia", moment));
            return;
        }
        inertia[..3].iter().for_each(|&moment| self.found.positive("a moment of inertia", moment));
        let tensor = inertia_tensor(inertia);
        if tensor.iter().any(|entry| !entry.is_finite()) {
            self.found.say(inertia.place, "an entry of the inertia is not finite");
            return;
        }
        let mut moments: [f64; 3] = tensor.symmetric_eigenvalues().into();
        moments.sort_by(f64::total_cmp);
        let [least, middle, most] = moments;
        if least <= ROUNDED * most {
            let message = format!("a tensor of inertia has positive principal moments, found {least:.3e}");
            self.found.say(inertia.place, message);
            self.found.cure("the entries are xx, yy, zz, xy, yz, xz; products are smaller than moments");
        } else if most > (least + middle) * (1.0 + ROUNDED) {
            let message = format!(
                "no body has a principal moment of inertia above the sum of the other two, found {least:.3e}, \
                 {middle:.3e} and {most:.3e}"
            );
            self.found.say(inertia.place, message);
            self.found
                .cure("check the entries, which are xx, yy, zz, xy, yz, xz, and the signs of the products");
        }
    }

    /// A direction that is fixed or prescribed has no initial velocity of its own.
    fn initial_of_held(&mut self, name: &str, body: &Rigid, free: &At<FreeMotion>) {
        let prescribed = body.motion.as_ref().map_or([None; 3], |motion| motion.components());
        let velocity = free.initial_velocity.iter().flat_map(|velocity| velocity.iter().enumerate());
        for (i, entry) in velocity {
            let is_held = free.fixes(|degree| degree.direction() == Some(i))
                || prescribed.get(i).is_some_and(|function| function.is_some());
            if is_held && entry.value != 0.0 {
                let message = format!(
                    "'{name}' has an initial velocity along {}, which is held",
                    ["x", "y", "z"][i.min(2)]
                );
                self.found.say(entry.place, message);
                self.found.cure("write 0 there, or let the direction be free");
            }
        }
        for (k, entry) in free.initial_spin.iter().flat_map(|spin| spin.iter().enumerate()) {
            // In 2D the only entry is that about z.
            let axis = if self.dimension == Some(2) { 2 } else { k };
            let is_held = free.fixes(|degree| degree.axis() == Some(axis)) || rotation_of(body).is_some();
            if is_held && entry.value != 0.0 {
                let message = format!(
                    "'{name}' has an initial spin about {}, which is held",
                    ["x", "y", "z"][axis.min(2)]
                );
                self.found.say(entry.place, message);
                self.found.cure("write 0 there, or let the rotation be free");
            }
        }
    }

    fn degrees_of(&mut self, name: &str, body: &Rigid, free: &At<FreeMotion>) {
        let Some(dimension) = self.dimension else { return };
        let prescribed = body.motion.as_ref().map_or([None; 3], |motion| motion.components());
        let rotation = rotation_of(body);
        for degree in &free.fixed {
            let (Degree::Uz | Degree::Rx | Degree::Ry) = degree.value else { continue };
            if dimension == 2 {
                self.found.say(degree.place, "a rigid body in 2D has the directions ux, uy and rz");
            }
        }
        for degree in &free.fixed {
            let twice = match (degree.direction(), degree.axis()) {
                (Some(direction), _) => prescribed[direction].is_some(),
                (_, Some(_)) => rotation.is_some(),
                _ => false,
            };
            if twice {
                self.found.say(degree.place, format!("a direction of '{name}' is both fixed and prescribed"));
                self.found.cure("remove it from `fixed` or from `motion`");
            }
        }
        self.initial_of_held(name, body, free);
        let moves = (0..dimension)
            .any(|i| prescribed[i].is_none() && !free.fixes(|degree| degree.direction() == Some(i)));
        let axes = if dimension == 2 { 2..3 } else { 0..3 };
        let turns =
            rotation.is_none() && axes.into_iter().any(|i| !free.fixes(|degree| degree.axis() == Some(i)));
        if !moves && !turns {
            self.found.say(free.place, format!("nothing is free in '{name}'"));
            self.found.cure("remove `free`, or free a direction");
        }
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

    /// A rigid motion is a function of time, which does not vary in space.
    pub(super) fn of_time<const KG: i8, const M: i8, const S: i8>(&mut self, varying: &Varying<KG, M, S>) {
        if !varying.is_constant_in_space() {
            self.found.say(varying.place, "this motion or load depends on t only, not on x, y, z");
            self.found.cure("write an expression in t, or a table");
        }
        self.finite(varying);
    }
}

/// The prescribed rotation of a body.
fn rotation_of(body: &Rigid) -> Option<&At<Rotation>> {
    body.motion.as_ref().and_then(|motion| motion.rotation.as_ref())
}
