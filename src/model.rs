//! The case as checked: laws built, names resolved, numbers in the units of the case.

mod build;
mod conformity;
mod intrusion;
mod meshes;
mod overlap;
mod places;
mod sets;

use std::rc::Rc;

use crate::case::{self, PlacedFunction, Units};
use crate::contact::friction::Friction;
use crate::contact::normal::NormalLaw;
use crate::contact::obstacle::Shape;
use crate::element::{Formulation, Kinematics};

pub use meshes::{read_mesh, read_meshes};

/// A case in `D` dimensions, ready to be discretised.
#[derive(Debug, Clone)]
pub struct Model<const D: usize> {
    /// The units of all its numbers.
    pub units: Units,
    /// The deformable bodies.
    pub bodies: Vec<Body>,
    /// The contacts.
    pub contacts: Vec<ContactModel<D>>,
    /// The displacement boundaries.
    pub supports: Vec<Support<D>>,
    /// The loads.
    pub loads: Vec<Load<D>>,
    /// The probes.
    pub probes: Vec<ProbeModel<D>>,
}

/// A deformable body.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name in the case file.
    pub name: String,
    /// Law, kinematics, locking, density.
    pub formulation: Formulation,
    /// Where its mass is.
    pub mass: MassChoice,
    /// Young's modulus \[Pa\], to which penalties are compared.
    pub young_modulus: f64,
    /// Velocity at the start \[m/s\], one function a component; empty where it rests.
    pub initial_velocity: Vec<PlacedFunction>,
}

/// Where the mass of a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassChoice {
    /// Where it is: `int rho N_a N_b`.
    Consistent,
    /// At its nodes.
    Lumped,
    /// Not at the nodes of contact surfaces.
    Redistributed,
    /// The same where the body can spare it, else consistent.
    RedistributedIfPossible,
}

impl MassChoice {
    /// Whether the nodes of contact surfaces shall be without mass.
    pub fn spares_contact(self) -> bool {
        matches!(self, Self::Redistributed | Self::RedistributedIfPossible)
    }
}

/// What happens to points that penetrate before the start.
pub use case::InitialOverclosure;

/// What a contactor may touch.
#[derive(Debug, Clone)]
pub enum Target<const D: usize> {
    /// A rigid obstacle.
    Obstacle(Rc<dyn Shape<D>>),
    /// The facets of a set.
    Surface {
        /// Name of the set, `body.set` or `all`.
        set: String,
        /// Indices of its bodies.
        bodies: Vec<usize>,
    },
}

impl<const D: usize> Target<D> {
    /// The obstacle, where it is one.
    pub fn obstacle(&self) -> Option<&dyn Shape<D>> {
        match self {
            Self::Obstacle(shape) => Some(&**shape),
            Self::Surface { .. } => None,
        }
    }
}

/// A contact between a surface and its target.
#[derive(Debug, Clone)]
pub struct ContactModel<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Set of facets that carry the points, `body.set` or `all`.
    pub contactor: String,
    /// Indices of the contactor's bodies.
    pub bodies: Vec<usize>,
    /// What it may touch.
    pub target: Target<D>,
    /// Name of the target.
    pub target_name: String,
    /// Young's modulus of the softer side \[Pa\], to which penalties are compared.
    pub softer: f64,
    /// Normal law, which the size of the facets may complete.
    pub normal: NormalLaw,
    /// Penetration that the user asked for \[m\].
    pub penetration: Option<f64>,
    /// Friction; none leaves the matrix symmetric.
    pub friction: Option<Friction>,
    /// Tractions act on the deformed area.
    pub current_area: bool,
    /// Points that penetrate before the start.
    pub initial_overclosure: InitialOverclosure,
}

impl<const D: usize> ContactModel<D> {
    /// Whether contactor and target are one surface.
    pub fn is_with_itself(&self) -> bool {
        self.contactor == self.target_name
    }

    /// The contact with an obstacle that is described from where it is nearest to `near` \[m\].
    #[must_use]
    pub fn anchored(&self, near: &crate::tensor::Vector<D>) -> Self {
        let mut contact = self.clone();
        if let Target::Obstacle(shape) = &mut contact.target {
            *shape = shape.anchored(near).into();
        }
        contact
    }

    /// Indices of all bodies that take part, each once, in ascending order.
    pub fn all_bodies(&self) -> Vec<usize> {
        let mut all = self.bodies.clone();
        if let Target::Surface { bodies, .. } = &self.target {
            all.extend(bodies);
        }
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
    /// `body` or `body.set`.
    pub set: String,
    /// The prescribed components \[m\].
    pub components: [Option<PlacedFunction>; D],
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
    /// Force per mass \[m/s2\].
    BodyForce([PlacedFunction; D]),
    /// Force per reference area \[Pa\].
    Traction([PlacedFunction; D]),
    /// Against the outward normal of the deformed surface \[Pa\].
    Pressure(PlacedFunction),
}

impl<const D: usize> LoadKind<D> {
    /// Whether the load never changes by itself.
    pub fn is_constant_in_time(&self) -> bool {
        self.functions().iter().all(|function| function.is_constant_in_time())
    }

    /// Whether its values at the kinks, at the start and at the end bound those between.
    pub fn is_linear_between_kinks(&self) -> bool {
        self.functions().iter().all(|function| function.is_linear_between_kinks())
    }

    /// One a direction, or the one of a pressure.
    pub fn functions(&self) -> &[PlacedFunction] {
        match self {
            Self::BodyForce(functions) | Self::Traction(functions) => functions,
            Self::Pressure(function) => std::slice::from_ref(function),
        }
    }
}

/// A point whose motion is written every step.
#[derive(Debug, Clone)]
pub struct ProbeModel<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Reference position asked for \[m\].
    pub at: [f64; D],
    /// Body to look on.
    pub body: Option<usize>,
    /// Line of the case file that asks for it; 0 where unknown.
    pub line: usize,
}

impl<const D: usize> Model<D> {
    /// Whether forces that conserve over a step have a symmetric matrix: all kinematics linear, all targets flat.
    pub fn has_symmetric_steps(&self) -> bool {
        let linear = |body: &Body| body.formulation.kinematics == Kinematics::Linear;
        let flat = |contact: &ContactModel<D>| contact.target.obstacle().is_some_and(Shape::is_plane);
        self.bodies.iter().all(linear) && self.contacts.iter().all(flat)
    }

    /// Instants at which loads or supports may jump, or their rates \[s\].
    pub fn kinks(&self) -> Vec<f64> {
        let supports = self.supports.iter().flat_map(|support| support.components.iter().flatten());
        let loads = self.loads.iter().flat_map(|load| load.kind.functions());
        supports.chain(loads).flat_map(|function| function.kinks()).collect()
    }
}

/// Lengths as numbers \[m\]; those that are missing are 0.
fn lengths<const D: usize>(values: &[crate::reader::quantity::Length]) -> [f64; D] {
    std::array::from_fn(|i| values.get(i).map_or(0.0, |value| value.value))
}
