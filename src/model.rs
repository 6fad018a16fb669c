//! The case as checked: laws built, names resolved, SI numbers.

use crate::case::{self, Action, Case, Function};
use crate::contact::friction::coefficient::{Coefficient, Constant, GroschSchallamach, Stribeck};
use crate::contact::friction::{Coulomb, Friction, FrictionLaw, PowerLaw as PowerFriction, Regularization};
use crate::contact::normal::{NormalLaw, Penalty, PowerLaw as PowerNormal};
use crate::contact::obstacle::{Cylinder, Obstacle, Plane, Side, Sphere};
use crate::element::{Formulation, Kinematics, Locking};
use crate::error::{Error, Result};
use crate::material::Material;
use crate::mesh::{BoxShape, ElementKind, Mesh, merge, require_room, validate};
use crate::tensor::Vector;

/// A case in `D` dimensions, ready to be discretised.
#[derive(Debug, Clone)]
pub struct Model<const D: usize> {
    /// The deformable bodies.
    pub bodies: Vec<Body>,
    /// The contacts.
    pub contacts: Vec<Contact<D>>,
    /// The displacement boundaries.
    pub supports: Vec<Support<D>>,
    /// The loads.
    pub loads: Vec<Load<D>>,
    /// The probes.
    pub probes: Vec<Probe<D>>,
}

/// A deformable body.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name in the case file.
    pub name: String,
    /// Law, kinematics, locking, density.
    pub formulation: Formulation,
    /// Diagonal mass.
    pub lumped_mass: bool,
    /// The mass matrix leaves out the nodes of contact surfaces.
    pub redistributed_mass: bool,
    /// Young's modulus \[Pa\], to which penalties are compared.
    pub young_modulus: f64,
    /// Velocity at the start [m/s], one function a component; empty where it rests.
    pub initial_velocity: Vec<Function>,
}

/// Where the normal law comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalChoice {
    /// Given.
    Law(NormalLaw),
    /// Penalty from the modulus and the facet size: `1 / eps = STIFFNESS_RATIO E / h`.
    FromStiffness,
}

impl NormalChoice {
    /// Stiffness of the derived penalty over that of a layer of elements: 5 % of h at a pressure of E.
    const STIFFNESS_RATIO: f64 = 20.0;

    /// The law, for facets of size `facet_size` \[m\] on a body of modulus `young_modulus` \[Pa\].
    ///
    /// # Errors
    /// When modulus and size give no positive compliance.
    pub fn law(self, young_modulus: f64, facet_size: f64) -> Result<NormalLaw> {
        match self {
            Self::Law(law) => Ok(law),
            Self::FromStiffness => {
                Ok(NormalLaw::Penalty(Penalty::new(facet_size / (Self::STIFFNESS_RATIO * young_modulus))?))
            }
        }
    }
}

/// What happens to points that penetrate before the start.
pub use case::InitialOverclosure;
/// Where on a facet contact is evaluated.
pub use case::Quadrature;

/// What a contactor may touch.
#[derive(Debug, Clone)]
pub enum Target<const D: usize> {
    /// A rigid obstacle.
    Obstacle(Obstacle<D>),
    /// The facets of a set `body.set`, of the body with this index.
    Surface {
        /// Name of the set.
        set: String,
        /// Index of its body.
        body: usize,
    },
}

impl<const D: usize> Target<D> {
    /// The obstacle, where it is one.
    pub fn obstacle(&self) -> Option<&Obstacle<D>> {
        match self {
            Self::Obstacle(obstacle) => Some(obstacle),
            Self::Surface { .. } => None,
        }
    }
}

/// A contact between a surface and its target.
#[derive(Debug, Clone)]
pub struct Contact<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Set of facets that carry the points, `body.set`.
    pub contactor: String,
    /// Index of the contactor's body.
    pub body: usize,
    /// What it may touch.
    pub target: Target<D>,
    /// Name of the target.
    pub target_name: String,
    /// Young's modulus of the softer side \[Pa\], to which penalties are compared.
    pub softer: f64,
    /// Normal law.
    pub normal: NormalChoice,
    /// Penetration that the user asked for \[m\].
    pub penetration: Option<f64>,
    /// Friction; none leaves the matrix symmetric.
    pub friction: Option<Friction>,
    /// Nodes or Gauss points.
    pub quadrature: Quadrature,
    /// Tractions act on the deformed area.
    pub current_area: bool,
    /// Points that penetrate before the start.
    pub initial_overclosure: InitialOverclosure,
}

/// A displacement boundary.
#[derive(Debug, Clone)]
pub struct Support<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// `body` or `body.set`.
    pub set: String,
    /// The prescribed components \[m\].
    pub components: [Option<Function>; D],
}

/// A load.
#[derive(Debug, Clone)]
pub struct Load<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// `body` or `body.set`.
    pub set: String,
    /// Index of the body.
    pub body: usize,
    /// What acts.
    pub kind: LoadKind<D>,
}

/// Kinds of loads.
#[derive(Debug, Clone)]
pub enum LoadKind<const D: usize> {
    /// Force per mass [m/s2].
    BodyForce([Function; D]),
    /// Force per reference area \[Pa\].
    Traction([Function; D]),
    /// Against the outward normal of the deformed surface \[Pa\].
    Pressure(Function),
}

impl<const D: usize> LoadKind<D> {
    /// Whether the load never changes by itself.
    pub fn is_constant_in_time(&self) -> bool {
        match self {
            Self::BodyForce(functions) | Self::Traction(functions) => {
                functions.iter().all(Function::is_constant_in_time)
            }
            Self::Pressure(function) => function.is_constant_in_time(),
        }
    }
}

/// A point whose motion is written every step.
#[derive(Debug, Clone)]
pub struct Probe<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Reference position asked for \[m\].
    pub at: [f64; D],
    /// Body to look on.
    pub body: Option<usize>,
}

/// Pressure at which the penetration that a user accepts is reached, over the modulus of the contactor: beyond
/// it bodies of this kind have lost a tenth of their height.
const REFERENCE_PRESSURE: f64 = 0.1;

impl<const D: usize> Model<D> {
    /// Builds the laws and resolves the names of a checked case.
    ///
    /// # Errors
    /// When a law refuses its constants, with the place in the case.
    pub fn new(case: &Case) -> Result<Self> {
        let bodies: Vec<Body> = case.bodies.iter().map(|(name, b)| body(name, b)).collect::<Result<_>>()?;
        let contacts = case.contact.iter().map(|(name, contact)| Self::contact(case, &bodies, name, contact));
        let contacts = contacts.collect::<Result<_>>()?;
        let mut model =
            Self { bodies, contacts, supports: Vec::new(), loads: Vec::new(), probes: Vec::new() };
        for (name, boundary) in case.boundary.iter() {
            let set = boundary.on.value.clone();
            for action in boundary.actions() {
                model.add(name, &set, action)?;
            }
        }
        for (name, probe) in case.output.probes.iter() {
            let body = probe.on.as_ref().map(|on| body_index(&model.bodies, on)).transpose()?;
            model.probes.push(Probe { name: name.value.clone(), at: lengths(&probe.at), body });
        }
        Ok(model)
    }

    /// Whether forces that conserve over a step have a symmetric matrix: all kinematics linear, all targets flat.
    pub fn has_symmetric_steps(&self) -> bool {
        let linear = |body: &Body| body.formulation.kinematics == Kinematics::Linear;
        let flat = |contact: &Contact<D>| matches!(contact.target, Target::Obstacle(Obstacle::Plane(_)));
        self.bodies.iter().all(linear) && self.contacts.iter().all(flat)
    }

    fn add(&mut self, name: &str, set: &str, action: Action) -> Result<()> {
        let name = name.to_owned();
        let set = set.to_owned();
        let zero = || Function::constant(0.0);
        let kind = match action {
            Action::Displacement(components) => {
                let components = std::array::from_fn(|i| components[i].map(|f| f.function.clone()));
                self.supports.push(Support { name, set, components });
                return Ok(());
            }
            Action::Gravity(g) => LoadKind::BodyForce(std::array::from_fn(|i| {
                g.get(i).map_or_else(zero, |f| f.function.clone())
            })),
            Action::Traction(t) => {
                LoadKind::Traction(std::array::from_fn(|i| t[i].map_or_else(zero, |f| f.function.clone())))
            }
            Action::Pressure(p) => LoadKind::Pressure(p.function.clone()),
        };
        let body = body_index(&self.bodies, set.split('.').next().unwrap_or(&set))?;
        self.loads.push(Load { name, set, body, kind });
        Ok(())
    }

    fn contact(case: &Case, bodies: &[Body], name: &str, contact: &case::Contact) -> Result<Contact<D>> {
        let owner = contact.contactor.split('.').next().unwrap_or_default();
        let body = body_index(bodies, owner)?;
        let within = |error: Error| error.within(&format!("contact.{name}"));
        let target = match case.obstacles.get(&contact.target) {
            Some(shape) => Target::Obstacle(obstacle(shape).map_err(within)?),
            None => surface(bodies, &contact.target).map_err(within)?,
        };
        let softer = match &target {
            Target::Surface { body: other, .. } => {
                bodies[*other].young_modulus.min(bodies[body].young_modulus)
            }
            Target::Obstacle(_) => bodies[body].young_modulus,
        };
        let (normal, penetration) = normal(&contact.normal, softer).map_err(within)?;
        Ok(Contact {
            name: name.to_owned(),
            contactor: contact.contactor.value.clone(),
            body,
            target,
            target_name: contact.target.value.clone(),
            softer,
            normal,
            penetration,
            friction: friction(&contact.friction).map_err(within)?,
            quadrature: contact.quadrature.value,
            // The potential of a contact lies on the reference area: forces that conserve act on it as well.
            current_area: contact.area == case::Area::Current
                && case.time.scheme.value != case::Scheme::Conserving,
            initial_overclosure: contact.initial_overclosure,
        })
    }
}

fn body(name: &str, body: &case::Body) -> Result<Body> {
    let elastic = body.material.elastic();
    let law = match body.material {
        case::Material::NeoHookean(_) => "neo_hookean",
        case::Material::SaintVenantKirchhoff(_) => "saint_venant_kirchhoff",
    };
    let (young_modulus, poisson_ratio) = (elastic.young_modulus.si, elastic.poisson_ratio.si);
    let formulation = Formulation {
        material: Material::named(law, young_modulus, poisson_ratio).map_err(|e| e.within(name))?,
        kinematics: match body.kinematics {
            case::Kinematics::Finite => Kinematics::Finite,
            case::Kinematics::Linear => Kinematics::Linear,
        },
        locking: match body.locking {
            case::Locking::None => Locking::None,
            case::Locking::SelectiveReduced => Locking::SelectiveReduced,
        },
        density: body.density.map_or(0.0, |density| density.si),
    };
    let velocity = body.initial_velocity.as_ref();
    Ok(Body {
        name: name.to_owned(),
        formulation,
        lumped_mass: body.mass == case::Mass::Lumped,
        redistributed_mass: body.mass == case::Mass::Redistributed,
        young_modulus,
        initial_velocity: velocity.map_or_else(Vec::new, |v| v.iter().map(|f| f.function.clone()).collect()),
    })
}

fn body_index(bodies: &[Body], name: &str) -> Result<usize> {
    let found = bodies.iter().position(|body| body.name == name);
    found.ok_or_else(|| Error::case(format!("there is no body '{name}'")))
}

fn lengths<const D: usize>(values: &[case::quantity::Length]) -> [f64; D] {
    std::array::from_fn(|i| values.get(i).map_or(0.0, |value| value.si))
}

fn vector<const D: usize, const KG: i8, const M: i8, const S: i8>(
    values: &[case::quantity::Quantity<KG, M, S>],
) -> Vector<D> {
    Vector::from_fn(|i, _| values.get(i).map_or(0.0, |value| value.si))
}

fn surface<const D: usize>(bodies: &[Body], set: &str) -> Result<Target<D>> {
    let body = body_index(bodies, set.split('.').next().unwrap_or(set))?;
    Ok(Target::Surface { set: set.to_owned(), body })
}

fn obstacle<const D: usize>(obstacle: &case::Obstacle) -> Result<Obstacle<D>> {
    let side = |side: &case::Side| match side {
        case::Side::Outside => Side::Outside,
        case::Side::Inside => Side::Inside,
    };
    Ok(match obstacle {
        case::Obstacle::Plane { point, normal } => {
            Obstacle::Plane(Plane::new(vector(point), vector(normal))?)
        }
        case::Obstacle::Sphere { center, radius, side: on } => {
            Obstacle::Sphere(Sphere::new(vector(center), radius.si, side(on))?)
        }
        case::Obstacle::Cylinder { point, axis, radius, side: on } => {
            Obstacle::Cylinder(Cylinder::new(vector(point), vector(axis), radius.si, side(on))?)
        }
    })
}

fn normal(normal: &case::Normal, young_modulus: f64) -> Result<(NormalChoice, Option<f64>)> {
    Ok(match normal {
        case::Normal::Penalty(penalty) => match (penalty.compliance, penalty.penetration) {
            (Some(compliance), _) => {
                (NormalChoice::Law(NormalLaw::Penalty(Penalty::new(compliance.si)?)), None)
            }
            (None, Some(penetration)) => {
                let compliance = penetration.si / (REFERENCE_PRESSURE * young_modulus);
                (NormalChoice::Law(NormalLaw::Penalty(Penalty::new(compliance)?)), Some(penetration.si))
            }
            (None, None) => (NormalChoice::FromStiffness, None),
        },
        case::Normal::PowerLaw { stiffness, exponent } => {
            (NormalChoice::Law(NormalLaw::PowerLaw(PowerNormal::new(stiffness.si, exponent.si)?)), None)
        }
    })
}

fn friction(friction: &case::Friction) -> Result<Option<Friction>> {
    let (law, regularization) = match friction {
        case::Friction::None => return Ok(None),
        case::Friction::Coulomb { coefficient: mu, regularization } => {
            (FrictionLaw::Coulomb(Coulomb { coefficient: coefficient(mu)? }), regularization)
        }
        case::Friction::PowerLaw { stiffness, exponent, regularization } => {
            (FrictionLaw::PowerLaw(PowerFriction::new(stiffness.si, exponent.si)?), regularization)
        }
    };
    let regularization = match regularization {
        case::Regularization::StickVelocity(velocity) => Regularization::stick_velocity(velocity.si)?,
        case::Regularization::SmoothStickVelocity(velocity) => {
            Regularization::smooth_stick_velocity(velocity.si)?
        }
        case::Regularization::StickStiffness(stiffness) => Regularization::stick_stiffness(stiffness.si)?,
    };
    Ok(Some(Friction { law, regularization }))
}

fn coefficient(coefficient: &case::Coefficient) -> Result<Coefficient> {
    Ok(match coefficient {
        case::Coefficient::Constant(value) => Coefficient::Constant(Constant::new(*value)?),
        case::Coefficient::GroschSchallamach { reference, modulus, exponent } => {
            Coefficient::GroschSchallamach(GroschSchallamach::new(reference.si, modulus.si, exponent.si)?)
        }
        case::Coefficient::Stribeck { rest, kinetic, decay_velocity } => {
            Coefficient::Stribeck(Stribeck::new(rest.si, kinetic.si, decay_velocity.si)?)
        }
    })
}

/// Reads or generates the meshes of all bodies and merges them; sets are named `body.set`. For one rank.
///
/// # Errors
/// When a mesh can not be read or is no good, with file and place.
pub fn read_mesh<const D: usize>(case: &Case) -> Result<Mesh<D>> {
    require_room(box_nodes(case))?;
    let mut bodies = Vec::with_capacity(case.bodies.len());
    for (name, body) in case.bodies.iter() {
        let mesh = match &body.mesh {
            case::Mesh::Box(shape) => {
                box_mesh(shape).map_err(|e| e.within(&format!("body '{}'", name.value)))?
            }
            case::Mesh::File(file) => {
                let region = file.region.as_ref().map(|region| region.value.as_str());
                crate::mesh::gmsh::read(&case.resolve(&file.file.value), region)?
            }
        };
        bodies.push((name.value.clone(), mesh));
    }
    merge(bodies)
}

/// Nodes that all boxes have at least.
fn box_nodes(case: &Case) -> f64 {
    let nodes = |body: &case::Body| match &body.mesh {
        case::Mesh::Box(shape) => shape.cells.iter().map(|&cells| f64::from(cells) + 1.0).product(),
        case::Mesh::File(_) => 0.0,
    };
    case.bodies.values().map(nodes).sum()
}

fn box_mesh<const D: usize>(shape: &case::BoxMesh) -> Result<Mesh<D>> {
    let default = if D == 2 { ElementKind::Quad4 } else { ElementKind::Hex8 };
    let named = shape.element.as_ref().map(|element| ElementKind::from_name(element.name()));
    let kind = named.unwrap_or(Some(default)).ok_or_else(|| Error::internal("an element without a kind"))?;
    let mut mesh = BoxShape::<D> {
        min: lengths(&shape.min),
        max: lengths(&shape.max),
        cells: std::array::from_fn(|i| shape.cells.get(i).copied().unwrap_or(1)),
        element: kind,
    }
    .mesh()?;
    if let Some(map) = &shape.map {
        bend(&mut mesh, map)?;
    }
    Ok(mesh)
}

/// Moves the points of a box.
fn bend<const D: usize>(mesh: &mut Mesh<D>, map: &case::BoxMap) -> Result<()> {
    for point in &mut mesh.points {
        let place: [f64; 3] = std::array::from_fn(|i| point.get(i).copied().unwrap_or(0.0));
        for (entry, function) in point.iter_mut().zip(map.functions()) {
            *entry = function.map_or(*entry, |function| function.value(place, 0.0));
        }
        if point.iter().any(|entry| !entry.is_finite()) {
            return Err(Error::case(format!("the map of the box sends {:?} to {point:?}", &place[..D])));
        }
    }
    match validate::first_bad_element(mesh) {
        Some(bad) => Err(Error::case(format!(
            "the map of the box leaves an element at {:?} flat or turned inside out",
            mesh.points[bad.node as usize]
        ))
        .hint("neighbours must stay neighbours, and left must stay left of right")),
        None => Ok(()),
    }
}
