//! Checks of `bodies`.

use super::super::{
    Body, BodySet, Boundary, BoxMesh, Damping, Locking, Merge, Mesh, Selection, Viscoelasticity,
};
use super::Check;
use crate::reader::at::At;

impl Check<'_> {
    pub(super) fn body(&mut self, name: &At<String>, body: &Body) {
        match &body.mesh {
            Mesh::Box(cuboid) => self.cuboid(cuboid, body.locking.value),
            Mesh::File(mesh) => {
                self.found.require(!mesh.file.is_empty(), mesh.file.place, "the mesh file has no name")
            }
        }
        let merge = match &body.mesh {
            Mesh::Box(cuboid) => cuboid.merge.as_ref(),
            Mesh::File(mesh) => mesh.merge.as_ref(),
        };
        if let Some(&Merge::Tolerance(tolerance)) = merge.map(|merge| &merge.value) {
            self.found.positive("merge.tolerance", tolerance);
        }
        self.locking(body.locking);
        body.sets.iter().for_each(|(name, set)| self.body_set(name, set));
        body.material.check(&mut self.found);
        match body.density {
            Some(density) => self.found.not_negative("the density", density.value, density.place),
            None => self.missing_density(name),
        }
        body.viscoelasticity.iter().for_each(|viscous| self.viscoelasticity(viscous));
        for region in body.regions.values() {
            region.material.check(&mut self.found);
            region.viscoelasticity.iter().for_each(|viscous| self.viscoelasticity(viscous));
            if let Some(density) = region.density {
                self.found.not_negative("the density", density.value, density.place);
            }
        }
        let of_regions = body.regions.values().filter_map(|region| region.damping.as_ref());
        body.damping.iter().chain(of_regions).for_each(|damping| self.damping(damping));
        if let Some(velocity) = &body.initial_velocity {
            self.size("an initial velocity", velocity);
            for component in velocity.iter() {
                let constant = component.is_constant_in_time();
                self.found.require(constant, component.place, "an initial velocity can not depend on t");
                self.finite(component);
            }
            let moves = !self.case.is_static();
            self.found.require(
                moves,
                velocity.place,
                "an initial velocity is not allowed with the static scheme",
            );
        }
        let massless = body.is_massless();
        if (self.case.is_static() || massless) && !self.is_held(name) {
            let why = if massless { "it has no mass" } else { "the static scheme has no inertia" };
            self.found
                .say(name.place, format!("no support or contact holds the body '{}', and {why}", name.value));
            self.found.cure(match massless {
                true => "add a displacement boundary, a foundation or a contact, or give it a density",
                false => "add a displacement boundary, a foundation or a contact, or use a dynamic scheme",
            });
        }
    }

    fn damping(&mut self, damping: &At<Damping>) {
        damping.check(damping.place, &mut self.found);
        let moves = !self.case.is_static();
        self.found.require(moves, damping.place, "damping is not allowed with the static scheme");
        if !moves {
            self.found.cure("remove it, or use a dynamic scheme");
        }
    }

    fn locking(&mut self, locking: At<Locking>) {
        let treats = matches!(
            locking.value,
            Locking::SelectiveReduced | Locking::MeanDilatation | Locking::PatchDilatation
        );
        if treats && self.case.is_plane_stress() {
            let message =
                format!("`{}` has no meaning under plane stress, which does not lock", locking.name());
            self.found.say(locking.place, message);
            self.found.cure("remove `locking`: the thickness is free, so that volume terms restrain nothing");
        }
    }

    fn viscoelasticity(&mut self, viscous: &At<Viscoelasticity>) {
        viscous.check(&mut self.found);
        if self.case.is_plane_stress() {
            self.found.say(
                viscous.place,
                "viscoelasticity is not allowed under plane stress, where the thickness would depend on the \
                 history",
            );
            self.found.cure("use one layer of 3D elements with free faces, or remove the viscoelasticity");
        }
        if self.case.time.scheme.conserves() {
            self.found.say(
                viscous.place,
                "viscoelasticity is not allowed with the scheme `conserving`, which needs stresses whose work \
                 is the change of an energy",
            );
            self.found.cure("use `generalized_alpha` or `midpoint`, or remove the viscoelasticity");
        }
    }

    fn body_set(&mut self, name: &At<String>, set: &BodySet) {
        match &set.selection {
            Selection::Where(condition) => {
                let plane = self.dimension == Some(2);
                self.found.require(!(plane && condition.uses_z()), name.place, "a 2D case has no z");
            }
            Selection::Box(region) => {
                self.size("the corner 'min'", &region.min);
                self.size("the corner 'max'", &region.max);
                for (min, max) in region.min.iter().zip(region.max.iter()) {
                    let message = format!("the box is empty: max {} < min {}", max.value, min.value);
                    self.found.require(max.value >= min.value, max.place, message);
                }
            }
            Selection::Sphere(sphere) => {
                self.size("the center", &sphere.center);
                self.found.positive("the radius", sphere.radius);
            }
            Selection::Of(_, names) => {
                let message = format!("two or more sets can be combined, found {}", names.len());
                self.found.require(names.len() >= 2, names.place, message);
            }
        }
    }

    fn missing_density(&mut self, name: &At<String>) {
        let weighs = |(_, boundary): (_, &Boundary)| {
            boundary.gravity.is_some() && boundary.on.names().iter().any(|on| on.value == name.value)
        };
        if !self.case.is_static() || self.case.boundary.iter().any(weighs) {
            self.found.say(name.place, format!("the body '{}' needs a density", name.value));
            let unit = self.case.units.of("kg/m3");
            self.found
                .cure(&format!("add `density:` in {unit}; it is optional only in statics without gravity"));
        }
    }

    fn is_held(&self, body: &str) -> bool {
        let supported = |boundary: &Boundary| {
            boundary.actions().any(|action| action.holds()) && boundary.on.bodies().any(|name| name == body)
        };
        self.case.boundary.values().any(supported)
            || self.case.contact.values().any(|contact| contact.is_on(body))
            || self.case.tied.values().any(|tied| tied.is_on(body))
    }

    fn cuboid(&mut self, cuboid: &BoxMesh, locking: Locking) {
        self.size("the corner 'min'", &cuboid.min);
        self.size("the corner 'max'", &cuboid.max);
        self.size("'cells'", &cuboid.cells);
        for (axis, (min, max)) in ["x", "y", "z"].iter().zip(cuboid.min.iter().zip(cuboid.max.iter())) {
            let message =
                format!("the box has no extent along {axis}: max {} <= min {}", max.value, min.value);
            self.found.require(max.value > min.value, max.place, message);
        }
        let cells = cuboid.cells.iter().map(|count| u64::from(*count)).fold(1u64, u64::saturating_mul);
        self.found.require(cells > 0, cuboid.cells.place, "a box needs at least one cell in each direction");
        self.found.require(
            cells < 1 << 27,
            cuboid.cells.place,
            format!("{cells} cells are more than a box can have"),
        );
        for (axis, component) in cuboid.map.iter().flat_map(|map| map.functions().into_iter().enumerate()) {
            let Some(function) = component else { continue };
            let message = "a mesh can not depend on t".to_owned();
            self.found.require(function.is_constant_in_time(), function.place, message);
            self.found.require(
                axis < self.dimension.unwrap_or(3),
                function.place,
                "z does not exist in 2D".to_owned(),
            );
        }
        let Some(element) = &cuboid.element else { return };
        let (name, its) = (element.value.name(), element.value.dimension());
        if let Some(dimension) = self.dimension.filter(|dimension| *dimension != its) {
            self.found
                .say(element.place, format!("{name} is an element of {its}D, the case has {dimension}D"));
        }
        if !element.value.offers(locking) {
            self.found.say(element.place, format!("{name} does not support {}", locking.name()));
            self.found.cure(Locking::CURE);
        }
    }
}
