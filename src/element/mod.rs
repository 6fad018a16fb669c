//! Element kernels: internal force and stiffness, mass, loads, stress and energy of groups of equal
//! elements.
//!
//! All results are passed element by element to an [`ElementSink`]. The kernels are independent of
//! matrix formats, global numbers and processes. They are a crate of their own above `serial`, so that they are
//! compiled once. Their tests are in `element/tests`.

mod axisymmetric;
mod batch;
mod compiled;
mod dilatation;
mod energy;
mod evaluate;
mod general;
mod group;
mod kinematics;
mod linearised_pressure;
mod loads;
mod mass;
mod patches;
mod projection;
mod solid;
mod step;
mod stress;
mod tangent;
mod viscous;
mod workspace;

pub use group::{ElementGroup, Formulation};
pub use kinematics::{DilatationSpace, Kinematics, LOCKS, Locking, locks, reference_gradients};
pub use loads::{Configuration, LoadedLine, LoadedSurface};
pub use patches::PatchGroup;
pub use stress::{Cauchy, CauchyState, ElementStress};
pub use viscous::{ViscousEnergies, ViscousHistory, components};

// In all files of the program, paths to modules begin with `crate`. So they do here.
use serial::{composed, error, lanes, material, mesh, space, square, tensor, terms};

use crate::terms::Terms;

/// Results that [`ElementGroup::evaluate`] computes in addition to the force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Request<'a> {
    /// Requested stiffness terms: [`Terms::MATERIAL`] for `K_0 + K_NL`, [`Terms::GEOMETRIC`] for
    /// `K_S`; others are ignored.
    pub stiffness: Option<Terms>,
    /// Displacements of the local nodes at which the stiffness of nearly incompressible elements has its
    /// pressure linearised \[m\]; `None` for the derivative of the force. Results over a step ignore them.
    pub linearised_at: Option<&'a [f64]>,
}

impl Request<'_> {
    /// Only the force.
    pub const FORCE: Self = Self { stiffness: None, linearised_at: None };
    /// Force and consistent tangent.
    pub const TANGENT: Self = Self::of(Terms::ALL);

    /// The force and these terms of the consistent tangent.
    pub const fn of(terms: Terms) -> Self {
        Self { stiffness: Some(terms), linearised_at: None }
    }
}

/// Receives elements (or facets) one by one, in the order of their group.
pub trait ElementSink {
    /// `force` is `[a * D + i]` \[N\]. `stiffness`, if requested, is `[((a * N + b) * D + i) * D +
    /// j]` \[N/m\], the left-hand side for rows `(a, i)` and columns `(b, j)`.
    fn element(&mut self, index: usize, force: &[f64], stiffness: Option<&[f64]>);
}

/// An element that is inverted (or has a NaN) in a trial state, or is stretched beyond the limit of its
/// law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inverted {
    /// Local number in the mesh.
    pub element: u32,
    /// Reference coordinates of the quadrature point in the element, unused ones zero.
    pub point: [f64; 3],
    /// `det F` there.
    pub det: f64,
    /// [`Law::reserve`](crate::material::Law::reserve) there, not positive beyond the limit; 1 for a
    /// law without limit.
    pub reserve: f64,
}
