//! The checked case: laws are built, names are resolved, and numbers are in the units of the case.

mod body_sets;
mod build;
mod conformity;
mod intrusion;
mod meshes;
mod overlap;
mod patches;
mod places;
pub mod regions;
mod sets;
mod ties;
mod walls;

use std::rc::Rc;

use crate::case::{self, PlacedFunction, Units};
use crate::contact::damping::ContactDamping;
use crate::contact::friction::Friction;
use crate::contact::normal::NormalLaw;
use crate::contact::obstacle::Shape;
use crate::contact::rigid::{BodyMotion, MassProperties};
use crate::contact::target::{ContactTarget, RigidTarget};
use crate::element::Kinematics;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::tensor::{Tensor, Vector};

pub use meshes::{read_mesh, read_meshes};
pub use ties::TieModel;

/// A case in `D` dimensions, ready to be discretised.
#[derive(Debug, Clone)]
pub struct Model<const D: usize> {
    /// The units of all numbers.
    pub units: Units,
    /// The deformable bodies.
    pub bodies: Vec<Body>,
    /// The bodies of `rigid`. Those of `obstacles` are not among them.
    pub rigid: Vec<RigidModel<D>>,
    /// The contacts.
    pub contacts: Vec<ContactModel<D>>,
    /// The tied surfaces.
    pub ties: Vec<TieModel>,
    /// The displacement boundaries.
    pub supports: Vec<Support<D>>,
    /// The supports along one direction.
    pub rollers: Vec<RollerModel<D>>,
    /// The foundations, and the springs and dashpots at nodes.
    pub elastic_supports: Vec<ElasticSupport<D>>,
    /// The loads.
    pub loads: Vec<Load<D>>,
    /// The probes.
    pub probes: Vec<ProbeModel<D>>,
    /// The segments along which fields are written.
    pub lines: Vec<LineModel<D>>,
}

/// A deformable body.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name in the case file.
    pub name: String,
    /// Its materials: that of the elements in no region, and those of the regions.
    pub materials: Vec<BodyMaterial>,
    /// Distribution of its mass.
    pub mass: MassChoice,
    /// Initial velocity \[m/s\], one function per component; empty for a body at rest.
    pub initial_velocity: Vec<PlacedFunction>,
}

impl Body {
    /// Strain measure of all its elements.
    pub fn kinematics(&self) -> Kinematics {
        self.materials.first().map_or(Kinematics::Finite, |material| material.formulation.kinematics)
    }

    /// Whether all its elements have mass.
    pub fn has_mass(&self) -> bool {
        self.materials.iter().all(|material| material.formulation.density > 0.0)
    }

    /// Whether some of its elements are damped.
    pub fn is_damped(&self) -> bool {
        self.materials.iter().any(|material| material.damping.is_some())
    }

    /// Smallest Young's modulus \[Pa\].
    pub fn softest_modulus(&self) -> f64 {
        self.materials.iter().map(|material| material.young_modulus).fold(f64::INFINITY, f64::min)
    }

    /// Name of a material in messages and tables: that of the body, and the region.
    pub fn material_name<'a>(&'a self, material: &'a BodyMaterial) -> &'a str {
        material.set.as_deref().unwrap_or(&self.name)
    }
}

/// Rayleigh damping of a body, `C = mass M + stiffness K_0` (3.18).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayleighFactors {
    /// Factor of the mass matrix [1/s].
    pub mass: f64,
    /// Factor of the stiffness matrix of the undeformed body \[s\].
    pub stiffness: f64,
}

/// A rigid body.
#[derive(Debug, Clone)]
pub struct RigidModel<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// What determines its motion.
    pub drive: RigidDrive<D>,
}

/// What determines the motion of a rigid body.
#[derive(Debug, Clone)]
pub enum RigidDrive<const D: usize> {
    /// Functions of time.
    Prescribed(Rc<BodyMotion<D>>),
    /// Forces, for the body with this index among the free ones.
    Free(usize, Rc<FreeBodyModel<D>>),
}

/// A rigid body that forces move.
#[derive(Debug, Clone)]
pub struct FreeBodyModel<const D: usize> {
    /// Centre of mass in the reference configuration \[m\].
    pub centre: Vector<D>,
    /// Mass and inertia. It is `None` in statics without mass. A moment of inertia is 0 if it was
    /// not given.
    pub mass: Option<MassProperties>,
    /// Prescribed displacements \[m\].
    pub translation: [Option<PlacedFunction>; D],
    /// Rotations that are zero, about the axes x, y, z.
    pub fixed_rotations: [bool; 3],
    /// Prescribed rotation: unit axis, and angle \[rad\].
    pub rotation: Option<([f64; 3], PlacedFunction)>,
    /// Force at the centre of mass \[N\].
    pub force: [Option<PlacedFunction>; D],
    /// Stiffness of the springs at the centre of mass \[N/m\].
    pub stiffness: SupportCoefficients<D>,
    /// Whether a spring resists its rotation.
    pub has_torsion_spring: bool,
    /// Torque in space \[N m\].
    pub torque: [Option<PlacedFunction>; 3],
    /// Acceleration of gravity \[m/s2\], one function per direction, or none.
    pub gravity: Vec<PlacedFunction>,
    /// Initial velocity of the centre of mass \[m/s\].
    pub initial_velocity: Vector<D>,
    /// Initial angular velocity \[rad/s\].
    pub initial_spin: [f64; 3],
}

impl<const D: usize> FreeBodyModel<D> {
    /// All functions of time.
    pub fn functions(&self) -> impl Iterator<Item = &PlacedFunction> {
        let loads = self.force.iter().chain(&self.torque).chain(&self.translation).flatten();
        loads.chain(&self.gravity).chain(self.rotation.iter().map(|(_, angle)| angle))
    }
}

impl<const D: usize> RigidModel<D> {
    /// The prescribed motion; `None` for a free body.
    pub fn prescribed(&self) -> Option<&Rc<BodyMotion<D>>> {
        match &self.drive {
            RigidDrive::Prescribed(motion) => Some(motion),
            RigidDrive::Free(..) => None,
        }
    }

    /// The free body; `None` if the motion is prescribed.
    pub fn free(&self) -> Option<&Rc<FreeBodyModel<D>>> {
        match &self.drive {
            RigidDrive::Prescribed(_) => None,
            RigidDrive::Free(_, body) => Some(body),
        }
    }

    /// Whether the body may rotate.
    pub fn rotates(&self) -> bool {
        self.prescribed().is_none_or(|motion| motion.rotates())
    }

    /// All functions of time.
    pub fn functions(&self) -> Box<dyn Iterator<Item = &PlacedFunction> + '_> {
        match &self.drive {
            RigidDrive::Prescribed(motion) => Box::new(motion.functions()),
            RigidDrive::Free(_, body) => Box::new(body.functions()),
        }
    }
}

/// Distribution of the mass of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassChoice {
    /// Consistent mass matrix: `int rho N_a N_b`.
    Consistent,
    /// Lumped at the nodes.
    Lumped,
    /// Redistributed so that the nodes of contact surfaces are massless.
    Redistributed,
    /// Redistributed if the body permits it, otherwise consistent.
    RedistributedIfPossible,
}

impl MassChoice {
    /// Whether the nodes of contact surfaces should be massless.
    pub fn spares_contact(self) -> bool {
        matches!(self, Self::Redistributed | Self::RedistributedIfPossible)
    }
}

/// Treatment of points that penetrate before the start.
pub use case::InitialOverclosure;
pub use regions::BodyMaterial;

/// Target of a contact.
#[derive(Debug, Clone)]
pub enum Target<const D: usize> {
    /// A rigid body.
    Obstacle(RigidTarget<D>),
    /// The facets of a set.
    Surface {
        /// Name of the set: `body.set`, the joined name of a list of sets, or `all`.
        set: String,
        /// Indices of its bodies.
        bodies: Vec<usize>,
    },
}

impl<const D: usize> Target<D> {
    /// The shape of a rigid body in the reference configuration; `None` for a surface.
    pub fn obstacle(&self) -> Option<&dyn Shape<D>> {
        match self {
            Self::Obstacle(target) => Some(&*target.shape),
            Self::Surface { .. } => None,
        }
    }

    /// Name of the set of facets; `None` for a rigid body.
    pub fn set(&self) -> Option<&str> {
        match self {
            Self::Obstacle(_) => None,
            Self::Surface { set, .. } => Some(set),
        }
    }

    /// Indices of the bodies that have the facets.
    pub fn bodies(&self) -> &[usize] {
        match self {
            Self::Obstacle(_) => &[],
            Self::Surface { bodies, .. } => bodies,
        }
    }

    /// The target of the contact on a rank, before its facets are gathered.
    pub fn before_gathering(&self) -> ContactTarget<D> {
        match self {
            Self::Obstacle(target) => ContactTarget::Obstacle(target.clone()),
            Self::Surface { .. } => ContactTarget::unknown_body(),
        }
    }

    /// Whether the target is flat and stays so.
    pub fn is_plane(&self) -> bool {
        self.obstacle().is_some_and(Shape::is_plane)
    }
}

/// A contact between a surface and its target.
#[derive(Debug, Clone)]
pub struct ContactModel<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Set of facets that carry the contact points: `body.set`, the joined name of a list of sets, or `all`.
    pub contactor: String,
    /// Indices of the contactor's bodies.
    pub bodies: Vec<usize>,
    /// The target.
    pub target: Target<D>,
    /// Name of the target.
    pub target_name: String,
    /// Young's modulus of the softer side \[Pa\], the reference for penalties.
    pub softer: f64,
    /// Normal law, which may be completed with the size of the facets.
    pub normal: NormalLaw,
    /// Penetration requested by the user \[m\].
    pub penetration: Option<f64>,
    /// Friction; without friction the matrix is symmetric.
    pub friction: Option<Friction>,
    /// Damping along the normal and along the surface.
    pub damping: ContactDamping,
    /// Whether tractions act on the deformed area.
    pub current_area: bool,
    /// Treatment of points that penetrate before the start.
    pub initial_overclosure: InitialOverclosure,
    /// Whether the forces conserve over steps.
    pub conserves: bool,
    /// Whether the scheme conserves momentum, so that forces may have no moment.
    pub keeps_momentum: bool,
    /// Thickness of the thinnest wall between the two surfaces \[m\]. Infinite without a wall, and
    /// until [`Model::walls`] has measured it.
    pub wall: f64,
}

impl<const D: usize> ContactModel<D> {
    /// Whether contactor and target are one surface.
    pub fn is_with_itself(&self) -> bool {
        self.contactor == self.target_name
    }

    /// Names of the sets of facets of both sides, the contactor's first.
    pub fn sets(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.contactor.as_str()).chain(self.target.set())
    }

    /// The contact, with its obstacle described relative to the point nearest to `near` \[m\].
    #[must_use]
    pub fn anchored(&self, near: &Vector<D>) -> Self {
        let mut contact = self.clone();
        if let Target::Obstacle(target) = &mut contact.target {
            target.shape = target.shape.anchored(near).into();
        }
        contact
    }

    /// Indices of all participating bodies, each once, in ascending order.
    pub fn all_bodies(&self) -> Vec<usize> {
        let mut all = [&self.bodies, self.target.bodies()].concat();
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// A displacement boundary.
#[derive(Debug, Clone)]
pub struct Support<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// `body` or `body.set`, or the joined name of a list of these.
    pub set: String,
    /// Indices of its bodies.
    pub bodies: Vec<usize>,
    /// The prescribed components \[m\].
    pub components: [Option<PlacedFunction>; D],
}

/// A support along one direction (3.31).
#[derive(Debug, Clone)]
pub struct RollerModel<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// `body` or `body.set`, or the joined name of a list of these.
    pub set: String,
    /// Unit vector of the held direction; that of the surface normals if `None`.
    pub direction: Option<[f64; D]>,
    /// Displacement along it \[m\]. Its place in the case is that of errors of the roller.
    pub displacement: PlacedFunction,
}

/// Springs and dashpots between a surface, or nodes, and the ground (3.19).
#[derive(Debug, Clone)]
pub struct ElasticSupport<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// `body.set`, or the joined name of a list of these.
    pub set: String,
    /// What it acts on.
    pub on: Grounded,
    /// Stiffness per reference area [Pa/m], or of each node \[N/m\].
    pub stiffness: SupportCoefficients<D>,
    /// Viscosity per reference area [Pa s/m], or of each node [N s/m].
    pub damping: SupportCoefficients<D>,
}

/// What springs and dashpots connect to the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grounded {
    /// Facets, per reference area.
    Surface,
    /// Each node of a set.
    Nodes,
    /// The centre of mass of the free rigid body with this index.
    FreeBody(usize),
    /// The only free rotation of the free rigid body with this index, with the torque per angle [N m] and
    /// per angular velocity [N m s].
    FreeRotation(usize, [f64; 2]),
}

/// Coefficients by direction, constant in time; without a function they are zero.
#[derive(Debug, Clone, PartialEq)]
pub struct SupportCoefficients<const D: usize> {
    /// Along the axes.
    pub axes: [Option<PlacedFunction>; D],
    /// Along the reference normal of a surface.
    pub normal: Option<PlacedFunction>,
    /// In the tangential plane of a surface.
    pub tangential: Option<PlacedFunction>,
}

impl<const D: usize> SupportCoefficients<D> {
    /// No coefficient in any direction.
    pub const NONE: Self = Self { axes: [const { None }; D], normal: None, tangential: None };

    /// Whether there is a coefficient in some direction.
    pub fn is_given(&self) -> bool {
        self.axes.iter().any(Option::is_some) || self.normal.is_some() || self.tangential.is_some()
    }

    /// The symmetric matrix `k_i e_i e_i + k_n n n + k_t (1 - n n)` at a point of the reference configuration
    /// \[m\], with the unit normal `n` of a surface.
    ///
    /// # Errors
    /// A coefficient is not finite or negative there.
    pub fn matrix(&self, point: &[f64; D], normal: &Vector<D>) -> Result<Tensor<D>> {
        self.weighted(point, normal, |coefficient| coefficient)
    }

    /// The [`matrix`](Self::matrix) with coefficients of 1 in place of those above zero.
    ///
    /// # Errors
    /// A coefficient is not finite or negative there.
    pub fn directions(&self, point: &[f64; D], normal: &Vector<D>) -> Result<Tensor<D>> {
        self.weighted(point, normal, |coefficient| if coefficient > 0.0 { 1.0 } else { 0.0 })
    }

    fn weighted(
        &self,
        point: &[f64; D],
        normal: &Vector<D>,
        weight: impl Fn(f64) -> f64,
    ) -> Result<Tensor<D>> {
        let at = |function: &Option<PlacedFunction>| match function {
            Some(function) => function.coefficient(point).map(&weight),
            None => Ok(0.0),
        };
        let across = normal * normal.transpose();
        let mut matrix = across * at(&self.normal)? + (Tensor::identity() - across) * at(&self.tangential)?;
        for (i, function) in self.axes.iter().enumerate() {
            matrix[(i, i)] += at(function)?;
        }
        Ok(matrix)
    }
}

/// A load.
#[derive(Debug, Clone)]
pub struct Load<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// `body` or `body.set`, or the joined name of a list of these.
    pub set: String,
    /// Index of the body on whose part of the set the load acts; `None` for a total over the whole set.
    pub body: Option<usize>,
    /// The kind of load.
    pub kind: LoadKind<D>,
}

/// Kinds of loads.
#[derive(Debug, Clone)]
pub enum LoadKind<const D: usize> {
    /// Force per mass \[m/s2\].
    BodyForce([PlacedFunction; D]),
    /// Force per reference area \[Pa\].
    Traction([PlacedFunction; D]),
    /// Against the outward normal of the deformed surface \[Pa\].
    Pressure(PlacedFunction),
    /// Force per reference length of edges \[N/m\].
    Line([PlacedFunction; D]),
    /// Total force on a surface or on nodes.
    Force {
        /// Its components \[N\], functions of time.
        components: [PlacedFunction; D],
        /// Point of its line of action on a surface \[m\]; `None` for the centroid.
        at: Option<[f64; D]>,
    },
    /// Total torque on a surface \[N m\], functions of time; about z only in 2D.
    Torque(Box<[PlacedFunction; 3]>),
}

impl<const D: usize> LoadKind<D> {
    /// Whether the load is constant in time.
    pub fn is_constant_in_time(&self) -> bool {
        self.functions().iter().all(|function| function.is_constant_in_time())
    }

    /// Whether the values between the kinks, the start and the end are bounded by the values at
    /// these times.
    pub fn is_linear_between_kinks(&self) -> bool {
        self.functions().iter().all(|function| function.is_linear_between_kinks())
    }

    /// One function per direction or axis, or a single one for a pressure.
    pub fn functions(&self) -> &[PlacedFunction] {
        match self {
            Self::BodyForce(functions)
            | Self::Traction(functions)
            | Self::Line(functions)
            | Self::Force { components: functions, .. } => functions,
            Self::Torque(functions) => &functions[..],
            Self::Pressure(function) => std::slice::from_ref(function),
        }
    }
}

/// A point whose motion is written every step.
#[derive(Debug, Clone)]
pub struct ProbeModel<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Requested reference position \[m\].
    pub at: [f64; D],
    /// Body to which the search is limited.
    pub body: Option<usize>,
    /// Line of the case file that requests it; 0 if unknown.
    pub line: usize,
}

/// A segment along which fields are written every step.
#[derive(Debug, Clone)]
pub struct LineModel<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Reference positions of both ends \[m\].
    pub ends: [[f64; D]; 2],
    /// Number of points, at least 1.
    pub count: u32,
    /// Body to which the search is limited.
    pub body: Option<usize>,
    /// Whether stresses are reported.
    pub stresses: bool,
}

impl<const D: usize> LineModel<D> {
    /// The points at equal distances, both ends included \[m\].
    pub fn points(&self) -> impl Iterator<Item = [f64; D]> + '_ {
        let last = self.count.saturating_sub(1).max(1);
        let [from, to] = &self.ends;
        (0..self.count).map(move |k| {
            let part = f64::from(k) / f64::from(last);
            std::array::from_fn(|i| (1.0 - part) * from[i] + part * to[i])
        })
    }

    /// Distance of a point from the first one \[m\]; the first has the number 1.
    pub fn distance(&self, number: u64) -> f64 {
        let length = (Vector::from(self.ends[1]) - Vector::from(self.ends[0])).norm();
        let last = self.count.saturating_sub(1).max(1);
        length * (number.saturating_sub(1) as f64) / f64::from(last)
    }
}

impl<const D: usize> Model<D> {
    /// Whether forces that conserve over a step have a symmetric matrix: all kinematics are linear,
    /// and all targets are flat and do not rotate.
    pub fn has_symmetric_steps(&self) -> bool {
        let linear = |body: &Body| body.kinematics() == Kinematics::Linear;
        let flat = |contact: &ContactModel<D>| contact.target.is_plane();
        let rotates = self.rigid.iter().any(RigidModel::rotates);
        self.bodies.iter().all(linear) && self.contacts.iter().all(flat) && !rotates
    }

    /// Whether the scheme `conserving` accepts all bodies: none is viscoelastic, a free rigid body or a body
    /// of revolution.
    pub fn may_conserve(&self) -> bool {
        let conserves =
            |material: &BodyMaterial| material.series.is_none() && !material.formulation.plane.is_revolved();
        self.free_bodies().next().is_none()
            && self.bodies.iter().flat_map(|body| &body.materials).all(conserves)
    }

    /// The free rigid bodies with their names, in the order of their indices.
    pub fn free_bodies(&self) -> impl Iterator<Item = (&str, &Rc<FreeBodyModel<D>>)> {
        self.rigid.iter().filter_map(|body| Some((body.name.as_str(), body.free()?)))
    }

    /// Appends the nodes of the free rigid bodies to the mesh of all bodies, two each: displacement
    /// and rotation. They belong to no element. Returns their number.
    pub fn add_pose_nodes(&self, mesh: &mut Mesh<D>) -> usize {
        let before = mesh.points.len();
        for (_, body) in self.free_bodies() {
            let centre: [f64; D] = body.centre.into();
            mesh.points.extend([centre; 2]);
        }
        mesh.points.len() - before
    }

    /// Times at which loads, supports or rigid bodies, or their rates, may jump \[s\].
    pub fn kinks(&self) -> Vec<f64> {
        let supports = self.supports.iter().flat_map(|support| support.components.iter().flatten());
        let loads = self.loads.iter().flat_map(|load| load.kind.functions());
        let rigid = self.rigid.iter().flat_map(RigidModel::functions);
        let rollers = self.rollers.iter().map(|roller| &roller.displacement);
        let jumps = self.ties.iter().flat_map(|tie| tie.jump.iter().flatten());
        let functions = supports.chain(rollers).chain(loads).chain(rigid).chain(jumps);
        functions.flat_map(|function| function.kinks()).collect()
    }
}

/// Lengths as numbers \[m\]; missing ones are 0.
fn lengths<const D: usize>(values: &[crate::reader::quantity::Length]) -> [f64; D] {
    std::array::from_fn(|i| values.get(i).map_or(0.0, |value| value.value))
}
