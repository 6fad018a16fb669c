//! Conversion of the case to the model: resolves names and builds bodies, boundaries, probes and
//! contacts in the order of the file.

use std::rc::Rc;

use super::body_sets::bodies_of;
use super::{
    Body, BodyMaterial, ContactModel, ElasticSupport, FreeBodyModel, Grounded, LineModel, Load, LoadKind,
    MassChoice, Model, ProbeModel, RayleighFactors, RigidDrive, RigidModel, RollerModel, Support,
    SupportCoefficients, Target, TieModel, lengths,
};
use crate::case::{
    self, Action, At, Case, Components, Directional, Function, PlacedFunction, SetNames, Varying,
};
use crate::contact::obstacle::SolidMoments;
use crate::contact::rigid::{BodyMotion, MassProperties};
use crate::contact::target::{RigidTarget, TargetMotion};
use crate::element::{Formulation, Kinematics, Locking};
use crate::error::{Error, Result};
use crate::mesh::PlaneState;
use crate::tensor::{Tensor, Vector};

impl<const D: usize> Model<D> {
    /// Builds the laws and resolves the names of a checked case.
    ///
    /// # Errors
    /// A law rejects its parameters. The error gives the location in the case.
    pub fn new(case: &Case) -> Result<Self> {
        let bodies: Vec<Body> =
            case.bodies.iter().map(|(name, b)| body(case, name, b)).collect::<Result<_>>()?;
        let rigid: Vec<RigidModel<D>> = rigid(case);
        let contacts =
            case.contact.iter().map(|(name, contact)| Self::contact(case, &bodies, &rigid, name, contact));
        let contacts = contacts.collect();
        let ties = case.tied.iter().map(|(name, tied)| tie(case, name, tied)).collect();
        let mut model = Self {
            units: case.units,
            bodies,
            rigid,
            contacts,
            ties,
            supports: Vec::new(),
            rollers: Vec::new(),
            elastic_supports: Vec::new(),
            loads: Vec::new(),
            probes: Vec::new(),
            lines: Vec::new(),
        };
        model.elastic_supports.extend(springs_of_free_bodies(case).chain(torsion_springs(case)));
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
        for (name, line) in case.output.lines.iter() {
            let body = line.on.as_ref().map(|on| body_index(&model.bodies, on)).transpose()?;
            let ends = [lengths(&line.from), lengths(line.end())];
            model.lines.push(LineModel {
                name: name.value.clone(),
                ends,
                count: line.count(),
                body,
                stresses: line.stresses,
            });
        }
        Ok(model)
    }

    fn add(&mut self, case: &Case, name: &str, on: &SetNames, action: Action) {
        let name = name.to_owned();
        let set = on.value.clone();
        let bodies = bodies_of(case, on);
        let zero = || PlacedFunction::from(Function::constant(0.0));
        let mut whole = false;
        let kind = match action {
            Action::Foundation(case::Foundation { stiffness, damping }) => {
                let stiffness = directional(case, stiffness.as_deref());
                let damping = directional(case, damping.as_deref());
                let on = Grounded::Surface;
                self.elastic_supports.push(ElasticSupport { name, set, on, stiffness, damping });
                return;
            }
            Action::Spring(case::Spring { stiffness, damping }) => {
                let stiffness = of_axes(case, stiffness.as_deref().map(Components::as_array));
                let damping = of_axes(case, damping.as_deref().map(Components::as_array));
                let on = Grounded::Nodes;
                self.elastic_supports.push(ElasticSupport { name, set, on, stiffness, damping });
                return;
            }
            Action::Force(force) => {
                whole = true;
                let given = force.as_array();
                LoadKind::Force {
                    components: std::array::from_fn(|i| given[i].map_or_else(zero, |f| case.function(f))),
                    at: force.at.as_ref().map(|at| lengths(at)),
                }
            }
            Action::Torque(torque) => {
                whole = true;
                let components = torque.map(|component| component.map_or_else(zero, |f| case.function(f)));
                LoadKind::Torque(Box::new(components))
            }
            Action::Displacement(components) => {
                let components = std::array::from_fn(|i| components[i].map(|f| case.function(f)));
                self.supports.push(Support { name, set, bodies, components });
                return;
            }
            Action::Roller(roller) => {
                // Errors of the roller point to its displacement, or else to the roller.
                let at_rest = Varying::<0, 1, 0> { function: Function::constant(0.0), place: roller.place };
                let displacement = case.function(roller.displacement.as_ref().unwrap_or(&at_rest));
                let direction = roller.direction.as_ref().map(|given| {
                    let given = Vector::<D>::from_fn(|i, _| given.get(i).map_or(0.0, |entry| entry.value));
                    given.normalize().into()
                });
                self.rollers.push(RollerModel { name, set, direction, displacement });
                return;
            }
            Action::Motion(motion) => {
                // Errors of values point to the angle, or else to the component.
                let rotation = motion.rotation.as_ref();
                let component = |i: usize| match (rotation, motion.components()[i]) {
                    (Some(rotation), _) => case.function(&rotation.angle).replaced(motion.along(i)),
                    (None, Some(translation)) => case.function(translation),
                    (None, None) => zero(),
                };
                let components = std::array::from_fn(|i| Some(component(i)));
                self.supports.push(Support { name, set, bodies, components });
                return;
            }
            Action::Gravity(g) => {
                LoadKind::BodyForce(std::array::from_fn(|i| g.get(i).map_or_else(zero, |f| case.function(f))))
            }
            Action::Traction(t) => {
                LoadKind::Traction(std::array::from_fn(|i| t[i].map_or_else(zero, |f| case.function(f))))
            }
            Action::LineForce(t) => {
                LoadKind::Line(std::array::from_fn(|i| t[i].map_or_else(zero, |f| case.function(f))))
            }
            Action::Pressure(p) => LoadKind::Pressure(case.function(p)),
        };
        let on = |body| Load { name: name.clone(), set: set.clone(), body, kind: kind.clone() };
        match whole {
            true => self.loads.push(on(None)),
            false => self.loads.extend(bodies.into_iter().map(|body| on(Some(body)))),
        }
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
                let motion = body.map(|body| match &body.drive {
                    RigidDrive::Prescribed(motion) => TargetMotion::Prescribed(motion.clone()),
                    RigidDrive::Free(index, _) => TargetMotion::Free(*index),
                });
                Target::Obstacle(RigidTarget::moving(shape.shape(), motion))
            }
            None => Target::Surface {
                set: contact.target.value.clone(),
                bodies: bodies_of(case, &contact.target),
            },
        };
        let both = owners.iter().chain(target.bodies());
        let softer = both.map(|&body| bodies[body].softest_modulus()).fold(f64::INFINITY, f64::min);
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
            damping: contact.damping.as_ref().map(|damping| damping.value).unwrap_or_default(),
            // The potential of a contact is defined on the reference area, so conserving forces act
            // on it as well.
            current_area: contact.area == case::Area::Current && !case.time.scheme.value.conserves(),
            initial_overclosure: contact.initial_overclosure,
            conserves: case.time.scheme.value.conserves(),
            keeps_momentum: case.time.scheme.value.method().is_midpoint(),
            wall: f64::INFINITY,
        }
    }
}

/// Two tied surfaces.
fn tie(case: &Case, name: &str, tied: &case::Tied) -> TieModel {
    TieModel {
        name: name.to_owned(),
        contactor: tied.contactor.value.clone(),
        target: tied.target.value.clone(),
        stiffness: tied.stiffness.map(|stiffness| stiffness.value),
        within: tied.within.map(|within| within.value),
        offset: tied.offset.as_ref().map(|offset| lengths(offset)),
        jump: tied
            .jump
            .as_ref()
            .map_or([None; 3], |jump| jump.as_array())
            .map(|f| f.map(|f| case.function(f))),
    }
}

/// Coefficients along the axes.
fn of_axes<const D: usize, const KG: i8, const M: i8, const S: i8>(
    case: &Case,
    given: Option<[Option<&Varying<KG, M, S>>; 3]>,
) -> SupportCoefficients<D> {
    let given = given.unwrap_or([None; 3]);
    let axes = std::array::from_fn(|i| given[i].map(|function| case.function(function)));
    SupportCoefficients { axes, ..SupportCoefficients::NONE }
}

/// Coefficients by direction; none if absent.
fn directional<const D: usize, const KG: i8, const M: i8, const S: i8>(
    case: &Case,
    given: Option<&Directional<KG, M, S>>,
) -> SupportCoefficients<D> {
    let [normal, tangential] = given.map_or([None; 2], Directional::of_surface);
    let placed = |function: Option<&Varying<KG, M, S>>| function.map(|function| case.function(function));
    SupportCoefficients {
        normal: placed(normal),
        tangential: placed(tangential),
        ..of_axes(case, given.map(Directional::of_axes))
    }
}

/// The motion of a rigid body. A body that nothing moves has one that is zero.
fn prescribed<const D: usize>(case: &Case, body: &case::Rigid) -> BodyMotion<D> {
    let zero = || PlacedFunction::from(Function::constant(0.0));
    let motion = body.motion.as_ref();
    let translation = motion.and_then(|motion| motion.translation.as_ref());
    let translation = translation.map_or([None; 3], |translation| translation.as_array());
    let rotation = motion.and_then(|motion| motion.rotation.as_ref());
    let about = rotation.and_then(|rotation| rotation.about.as_ref());
    let centre = about.map_or_else(|| body.shape.centre(), |about| lengths(about).into());
    BodyMotion {
        centre,
        axis: axis_of(rotation),
        translation: std::array::from_fn(|i| translation[i].map_or_else(zero, |f| case.function(f))),
        angle: rotation.map_or_else(zero, |rotation| case.function(&rotation.angle)),
    }
}

/// Unit axis of a rotation; z without one.
fn axis_of(rotation: Option<&case::At<case::Rotation>>) -> [f64; 3] {
    rotation.map_or([0.0, 0.0, 1.0], |rotation| rotation.unit_axis())
}

/// The bodies of `rigid`, with the free ones numbered.
fn rigid<const D: usize>(case: &Case) -> Vec<RigidModel<D>> {
    let mut count = 0;
    let mut all = Vec::with_capacity(case.rigid.len());
    for (name, body) in case.rigid.iter() {
        let drive = match &body.free {
            None => RigidDrive::Prescribed(Rc::new(prescribed(case, body))),
            Some(free) => {
                count += 1;
                RigidDrive::Free(count - 1, Rc::new(free_body(case, body, free)))
            }
        };
        all.push(RigidModel { name: name.value.clone(), drive });
    }
    all
}

/// The springs and dashpots at free rigid bodies.
fn springs_of_free_bodies<const D: usize>(case: &Case) -> impl Iterator<Item = ElasticSupport<D>> {
    let bodies = case.rigid.iter().filter_map(|(name, body)| Some((name, body.free.as_ref()?)));
    bodies.enumerate().filter_map(|(index, (name, free))| {
        let case::Spring { stiffness, damping } = &free.spring.as_ref()?.value;
        Some(ElasticSupport {
            name: format!("{}.spring", name.value),
            set: name.value.clone(),
            on: Grounded::FreeBody(index),
            stiffness: of_axes(case, stiffness.as_deref().map(Components::as_array)),
            damping: of_axes(case, damping.as_deref().map(Components::as_array)),
        })
    })
}

/// The torsion springs of free rigid bodies.
fn torsion_springs<const D: usize>(case: &Case) -> impl Iterator<Item = ElasticSupport<D>> {
    let bodies = case.rigid.iter().filter_map(|(name, body)| Some((name, body.free.as_ref()?)));
    bodies.enumerate().filter(|(_, (_, free))| free.torsion_spring.is_some()).map(|(index, (name, free))| {
        ElasticSupport {
            name: format!("{}.torsion_spring", name.value),
            set: name.value.clone(),
            on: Grounded::FreeRotation(index, torsion_of(free)),
            stiffness: SupportCoefficients::NONE,
            damping: SupportCoefficients::NONE,
        }
    })
}

/// Stiffness [N m] and damping [N m s] of the torsion spring of a free body; zero without one.
fn torsion_of(free: &case::FreeMotion) -> [f64; 2] {
    free.torsion_spring.as_ref().map_or([0.0; 2], |spring| {
        [spring.stiffness.map_or(0.0, |k| k.value), spring.damping.map_or(0.0, |c| c.value)]
    })
}

/// A rigid body that forces move.
fn free_body<const D: usize>(case: &Case, body: &case::Rigid, free: &case::FreeMotion) -> FreeBodyModel<D> {
    let numbers = |list: Option<Vec<f64>>| -> Vec<f64> { list.unwrap_or_default() };
    let zero = || PlacedFunction::from(Function::constant(0.0));
    let fixed = |direction: usize| free.fixes(|degree| degree.direction() == Some(direction));
    let motion = body.motion.as_ref();
    let along = motion.map_or([None; 3], |motion| motion.components());
    let rotation = motion.and_then(|motion| motion.rotation.as_ref());
    let translation = std::array::from_fn(|i| {
        along[i].map(|function| case.function(function)).or_else(|| fixed(i).then(zero))
    });
    let force = free.force.as_ref().map_or([None; 3], |force| force.as_array());
    let torque = free.torque.as_ref().map_or([None; 3], |torque| torque.as_array());
    let velocity = numbers(free.initial_velocity.as_ref().map(|all| all.iter().map(|v| v.value).collect()));
    let spin = numbers(free.initial_spin.as_ref().map(|all| all.iter().map(|rate| rate.value).collect()));
    let mut initial_spin = [0.0; 3];
    // In 2D the only entry is that about z.
    for (k, value) in spin.iter().enumerate() {
        initial_spin[if D == 2 { 2 } else { k }] = *value;
    }
    let solid = free.density.and_then(|_| body.shape.shape::<D>().solid());
    let centre = || solid.map_or_else(|| body.shape.centre(), |solid| solid.centroid);
    FreeBodyModel {
        centre: free.center.as_ref().map_or_else(centre, |center| lengths(center).into()),
        mass: mass_of::<D>(free, solid.as_ref()),
        translation,
        fixed_rotations: std::array::from_fn(|i| {
            free.fixes(|degree| degree.axis() == Some(i)) || (D == 2 && i < 2)
        }),
        rotation: rotation.map(|rotation| (axis_of(Some(rotation)), case.function(&rotation.angle))),
        force: std::array::from_fn(|i| force[i].map(|function| case.function(function))),
        stiffness: of_axes(
            case,
            free.spring.as_ref().and_then(|spring| spring.stiffness.as_deref()).map(Components::as_array),
        ),
        has_torsion_spring: torsion_of(free)[0] > 0.0,
        torque: torque.map(|component| component.map(|function| case.function(function))),
        gravity: free.gravity.iter().flat_map(|gravity| gravity.iter()).map(|g| case.function(g)).collect(),
        initial_velocity: Vector::from_fn(|i, _| velocity.get(i).copied().unwrap_or(0.0)),
        initial_spin,
    }
}

/// Mass and inertia of a free body: given, or those of the solid `solid` of the given density.
fn mass_of<const D: usize>(
    free: &case::FreeMotion,
    solid: Option<&SolidMoments<D>>,
) -> Option<MassProperties> {
    if let Some(density) = free.density {
        let density = density.value;
        return solid.map(|solid| MassProperties {
            mass: density * solid.volume,
            inertia: solid.inertia() * density,
        });
    }
    let mass = free.mass?.value;
    let inertia = free.inertia.as_ref().map_or_else(Tensor::<3>::zeros, |list| case::inertia_tensor(list));
    Some(MassProperties { mass, inertia })
}

/// The state across the plane of a case.
pub(super) fn plane(case: &Case) -> PlaneState {
    if case.is_axisymmetric() {
        PlaneState::Axisymmetric
    } else if case.is_plane_stress() {
        PlaneState::Stress
    } else {
        PlaneState::Strain
    }
}

/// The treatment of locking of a case in the elements.
pub(super) fn locking(of: case::Locking) -> Locking {
    match of {
        case::Locking::Auto => Locking::Auto,
        case::Locking::None => Locking::None,
        case::Locking::SelectiveReduced => Locking::SelectiveReduced,
        case::Locking::MeanDilatation => Locking::MeanDilatation,
        case::Locking::PatchDilatation => Locking::PatchDilatation,
    }
}

fn body(case: &Case, name: &str, body: &case::Body) -> Result<Body> {
    let density = body.density.map_or(0.0, |density| density.value);
    let material = |set: Option<String>,
                    law,
                    viscous: Option<&case::Viscoelasticity>,
                    density,
                    damping: Option<&At<case::Damping>>| {
        let damping = damping.map(|damping| match damping.value {
            case::Damping::Rayleigh(factors) => {
                RayleighFactors { mass: factors.mass.value, stiffness: factors.stiffness.value }
            }
        });
        let formulation = Formulation {
            material: law,
            kinematics: match body.kinematics {
                case::Kinematics::Finite => Kinematics::Finite,
                case::Kinematics::Linear => Kinematics::Linear,
            },
            plane: plane(case),
            locking: locking(body.locking.value),
            density,
        };
        let series = viscous.map(|viscous| Rc::new(viscous.series()));
        BodyMaterial { set, formulation, damping, series, young_modulus: law.moduli().young_modulus() }
    };
    let own = material(None, body.material, body.viscoelasticity.as_deref(), density, body.damping.as_ref());
    let of_region = |(region, its): (&At<String>, &case::Region)| {
        let set = format!("{name}.{}", region.value);
        let density = its.density.map_or(density, |density| density.value);
        material(
            Some(set),
            its.material,
            its.viscoelasticity.as_deref(),
            density,
            its.damping.as_ref().or(body.damping.as_ref()),
        )
    };
    let materials = std::iter::once(own).chain(body.regions.iter().map(of_region)).collect();
    let velocity = body.initial_velocity.as_ref();
    Ok(Body {
        name: name.to_owned(),
        materials,
        mass: match body.mass {
            case::Mass::Auto if case.calms_contact_of(name) => MassChoice::RedistributedIfPossible,
            case::Mass::Auto | case::Mass::Consistent => MassChoice::Consistent,
            case::Mass::Lumped => MassChoice::Lumped,
            case::Mass::Redistributed => MassChoice::Redistributed,
        },
        initial_velocity: velocity.map_or_else(Vec::new, |v| v.iter().map(|f| case.function(f)).collect()),
    })
}

fn body_index(bodies: &[Body], name: &str) -> Result<usize> {
    let found = bodies.iter().position(|body| body.name == name);
    found.ok_or_else(|| Error::case(format!("there is no body '{name}'")))
}
