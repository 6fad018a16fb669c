//! Conversion of the case to the model: resolves names and builds bodies, boundaries, probes and
//! contacts in the order of the file.

use std::rc::Rc;

use super::body_sets::bodies_of;
use super::{
    Body, ContactModel, Load, LoadKind, MassChoice, Model, ProbeModel, RayleighFactors, RigidModel, Support,
    Target, lengths,
};
use crate::case::{self, Action, Case, Function, PlacedFunction, SetNames};
use crate::contact::rigid::BodyMotion;
use crate::contact::target::RigidTarget;
use crate::element::{Formulation, Kinematics, Locking};
use crate::error::{Error, Result};
use crate::tensor::Vector;

impl<const D: usize> Model<D> {
    /// Builds the laws and resolves the names of a checked case.
    ///
    /// # Errors
    /// A law rejects its parameters. The error gives the location in the case.
    pub fn new(case: &Case) -> Result<Self> {
        let bodies: Vec<Body> =
            case.bodies.iter().map(|(name, b)| body(case, name, b)).collect::<Result<_>>()?;
        let rigid: Vec<RigidModel<D>> =
            case.rigid.iter().map(|(name, body)| rigid(case, name, body)).collect();
        let contacts =
            case.contact.iter().map(|(name, contact)| Self::contact(case, &bodies, &rigid, name, contact));
        let contacts = contacts.collect();
        let mut model = Self {
            units: case.units,
            bodies,
            rigid,
            contacts,
            supports: Vec::new(),
            loads: Vec::new(),
            probes: Vec::new(),
        };
        for (name, boundary) in case.boundary.iter() {
            for action in boundary.actions() {
                model.add(case, name, &boundary.on, action);
            }
        }
        for (name, probe) in case.output.probes.iter() {
            let body = probe.on.as_ref().map(|on| body_index(&model.bodies, on)).transpose()?;
            let line = probe.at.place.line;
            model.probes.push(ProbeModel { name: name.value.clone(), at: lengths(&probe.at), body, line });
        }
        Ok(model)
    }

    fn add(&mut self, case: &Case, name: &str, on: &SetNames, action: Action) {
        let name = name.to_owned();
        let set = on.value.clone();
        let bodies = bodies_of(case, on);
        let zero = || PlacedFunction::from(Function::constant(0.0));
        let kind = match action {
            Action::Displacement(components) => {
                let components = std::array::from_fn(|i| components[i].map(|f| case.function(f)));
                self.supports.push(Support { name, set, bodies, components });
                return;
            }
            Action::Gravity(g) => {
                LoadKind::BodyForce(std::array::from_fn(|i| g.get(i).map_or_else(zero, |f| case.function(f))))
            }
            Action::Traction(t) => {
                LoadKind::Traction(std::array::from_fn(|i| t[i].map_or_else(zero, |f| case.function(f))))
            }
            Action::Pressure(p) => LoadKind::Pressure(case.function(p)),
        };
        let of_body = |body| Load { name: name.clone(), set: set.clone(), body, kind: kind.clone() };
        self.loads.extend(bodies.into_iter().map(of_body));
    }

    fn contact(
        case: &Case,
        bodies: &[Body],
        rigid: &[RigidModel<D>],
        name: &str,
        contact: &case::Contact,
    ) -> ContactModel<D> {
        let owners = bodies_of(case, &contact.contactor);
        let target = match case.shape(&contact.target) {
            Some(shape) => {
                let body = rigid.iter().find(|body| body.name == contact.target.value);
                Target::Obstacle(RigidTarget::moving(shape.shape(), body.map(|body| body.motion.clone())))
            }
            None => Target::Surface {
                set: contact.target.value.clone(),
                bodies: bodies_of(case, &contact.target),
            },
        };
        let opposite = match &target {
            Target::Surface { bodies, .. } => &bodies[..],
            Target::Obstacle(_) => &[],
        };
        let both = owners.iter().chain(opposite);
        let softer = both.map(|&body| bodies[body].young_modulus).fold(f64::INFINITY, f64::min);
        ContactModel {
            name: name.to_owned(),
            contactor: contact.contactor.value.clone(),
            bodies: owners,
            target,
            target_name: contact.target.value.clone(),
            softer,
            normal: contact.normal,
            penetration: contact.normal.law().accepted_penetration(),
            friction: contact.friction.friction(),
            // The potential of a contact is defined on the reference area, so conserving forces act
            // on it as well.
            current_area: contact.area == case::Area::Current && !case.time.scheme.value.conserves(),
            initial_overclosure: contact.initial_overclosure,
        }
    }
}

/// The motion of a rigid body. A body that nothing moves has one that is zero.
fn rigid<const D: usize>(case: &Case, name: &str, body: &case::Rigid) -> RigidModel<D> {
    let zero = || PlacedFunction::from(Function::constant(0.0));
    let motion = body.motion.as_ref();
    let translation = motion.and_then(|motion| motion.translation.as_ref());
    let translation = translation.map_or([None; 3], |translation| translation.as_array());
    let rotation = motion.and_then(|motion| motion.rotation.as_ref());
    let about = rotation.and_then(|rotation| rotation.about.as_ref());
    let centre = about.map_or_else(|| body.shape.centre(), |about| lengths(about).into());
    let axis: [f64; 3] = match rotation.and_then(|rotation| rotation.axis.as_ref()) {
        Some(axis) => {
            let axis = Vector::<3>::from_fn(|i, _| axis.get(i).map_or(0.0, |entry| entry.value));
            axis.normalize().into()
        }
        None => [0.0, 0.0, 1.0],
    };
    let motion = BodyMotion {
        centre,
        axis,
        translation: std::array::from_fn(|i| translation[i].map_or_else(zero, |f| case.function(f))),
        angle: rotation.map_or_else(zero, |rotation| case.function(&rotation.angle)),
    };
    RigidModel { name: name.to_owned(), motion: Rc::new(motion) }
}

fn body(case: &Case, name: &str, body: &case::Body) -> Result<Body> {
    let formulation = Formulation {
        material: body.material,
        kinematics: match body.kinematics {
            case::Kinematics::Finite => Kinematics::Finite,
            case::Kinematics::Linear => Kinematics::Linear,
        },
        locking: match body.locking {
            case::Locking::Auto => Locking::Auto,
            case::Locking::None => Locking::None,
            case::Locking::SelectiveReduced => Locking::SelectiveReduced,
        },
        density: body.density.map_or(0.0, |density| density.value),
    };
    let velocity = body.initial_velocity.as_ref();
    Ok(Body {
        name: name.to_owned(),
        formulation,
        mass: match body.mass {
            case::Mass::Auto if case.calms_contact_of(name) => MassChoice::RedistributedIfPossible,
            case::Mass::Auto | case::Mass::Consistent => MassChoice::Consistent,
            case::Mass::Lumped => MassChoice::Lumped,
            case::Mass::Redistributed => MassChoice::Redistributed,
        },
        damping: body.damping.as_ref().map(|damping| match damping.value {
            case::Damping::Rayleigh(factors) => {
                RayleighFactors { mass: factors.mass.value, stiffness: factors.stiffness.value }
            }
        }),
        series: body.viscoelasticity.as_ref().map(|viscous| Rc::new(viscous.series())),
        young_modulus: body.material.moduli().young_modulus(),
        initial_velocity: velocity.map_or_else(Vec::new, |v| v.iter().map(|f| case.function(f)).collect()),
    })
}

fn body_index(bodies: &[Body], name: &str) -> Result<usize> {
    let found = bodies.iter().position(|body| body.name == name);
    found.ok_or_else(|| Error::case(format!("there is no body '{name}'")))
}
