//! What every evaluation of a contact shares: fields in, request; and the work on one point against an obstacle.

use super::curvature::Curvature;
use super::geometry::{AreaMeasure, Geometry};
use super::obstacle::Proximity;
use super::point::step::{Fields, StepGeometry, StepMotion, StepResponse, respond_over_step};
use super::point::{ContactLaw, Motion, Response, Selection, respond};
use super::state::{Branches, ContactState, Hold};
use super::surface::ContactSurface;
use crate::tensor::Vector;

/// Which configuration gives the area of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AreaKind {
    /// The deformed facets.
    #[default]
    Current,
    /// The undeformed facets; `K_phi` vanishes.
    Reference,
}

impl AreaKind {
    /// Area of a point of `surface`, as the geometry wants it.
    pub(super) fn measure<const D: usize>(self, surface: &ContactSurface<D>, point: usize) -> AreaMeasure {
        match self {
            Self::Current => AreaMeasure::Current,
            Self::Reference => AreaMeasure::Reference(surface.reference_area(point)),
        }
    }
}

/// Nodal fields, `node * D + component`: the rank's nodes, ghosts included; for deformable targets the foreign nodes
/// follow.
#[derive(Debug, Clone, Copy)]
pub struct ContactFields<'a> {
    /// Displacement \[m\].
    pub u: &'a [f64],
    /// Velocity \[m/s\].
    pub v: &'a [f64],
    /// Displacement at the start of the step \[m\].
    pub u_start: &'a [f64],
}

/// What an evaluation is to bring.
#[derive(Debug, Clone, Copy, Default)]
pub struct ContactRequest {
    /// The terms of the matrix, or none.
    pub stiffness: Option<Selection>,
    /// What is held fixed.
    pub hold: Hold,
    /// Branches of the friction law.
    pub branches: Branches,
    /// The displacements are those in the middle of a step: forces conserve over it, see [`super::point::step`].
    pub over_step: bool,
}

/// A closed point, ready to contribute.
pub(super) enum Answer<const D: usize> {
    /// In the configuration given.
    Now(Response<D>),
    /// Over the step in whose middle that is.
    OverStep(StepResponse<D>),
}

/// A node's vector out of a nodal field.
pub(super) fn at<const D: usize>(field: &[f64], node: u32) -> Vector<D> {
    Vector::from_column_slice(&field[node as usize * D..][..D])
}

/// Values of the nodes of a point and what it contributes; refilled for each, so that nothing is allocated anew.
pub(super) struct Workspace<const D: usize> {
    /// Nodes of the facet.
    pub nodes: Vec<u32>,
    /// Their places \[m\].
    pub current: Vec<Vector<D>>,
    velocity: Vec<Vector<D>>,
    increment: Vec<Vector<D>>,
    pub geometry: Geometry<D>,
    /// Places at the start and at the end of a step, and the geometry there; empty where nothing is evaluated over one.
    pub start: Vec<Vector<D>>,
    pub end: Vec<Vector<D>>,
    pub start_gap: f64,
    pub end_geometry: Geometry<D>,
    /// What the point stands on in the middle of a step, where a stiffness over it is wanted.
    pub foot: Option<Proximity<D>>,
    pub force: Vec<f64>,
    pub stiffness: Vec<f64>,
}

impl<const D: usize> Workspace<D> {
    pub fn new() -> Self {
        Self {
            nodes: Vec::new(),
            current: Vec::new(),
            velocity: Vec::new(),
            increment: Vec::new(),
            geometry: Geometry::default(),
            start: Vec::new(),
            end: Vec::new(),
            start_gap: f64::INFINITY,
            end_geometry: Geometry::default(),
            foot: None,
            force: Vec::new(),
            stiffness: Vec::new(),
        }
    }

    /// Forgets all nodes.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.current.clear();
        self.velocity.clear();
        self.increment.clear();
    }

    /// Appends the values of the nodes of a facet.
    pub fn gather(&mut self, reference: &[Vector<D>], nodes: &[u32], fields: &ContactFields<'_>) {
        self.nodes.extend_from_slice(nodes);
        for (reference, &node) in reference.iter().zip(nodes) {
            let u = at(fields.u, node);
            self.current.push(reference + u);
            self.velocity.push(at(fields.v, node));
            self.increment.push(u - at(fields.u_start, node));
        }
    }

    /// Places of the gathered nodes at the start of the step and at its end, as far from the middle.
    pub fn go_to_ends(&mut self) {
        self.start.clear();
        self.start.extend(self.current.iter().zip(&self.increment).map(|(x, u)| x - u));
        self.end.clear();
        self.end.extend(self.current.iter().zip(&self.increment).map(|(x, u)| x + u));
    }

    /// Force and stiffness of the gathered nodes, zero.
    pub fn clear_sums(&mut self, request: &ContactRequest) {
        let unknowns = self.nodes.len() * D;
        self.force.clear();
        self.force.resize(unknowns, 0.0);
        self.stiffness.clear();
        if request.stiffness.is_some() {
            self.stiffness.resize(unknowns * unknowns, 0.0);
        }
    }

    /// Evaluates the laws in the present geometry and keeps the state of `point`; whether it contributes, which it
    /// does once [`add`](Self::add) is called with the answer.
    pub fn respond(
        &self,
        law: &ContactLaw,
        point: usize,
        request: &ContactRequest,
        state: &mut ContactState<D>,
    ) -> Option<Answer<D>> {
        let manner = state.manner(point, request.hold, request.branches);
        if request.over_step {
            let motion = StepMotion {
                middle: &self.geometry,
                end: self.end_geometry.gap,
                start: self.start_gap,
                fields: self.fields(),
                history: &state.history[point],
            };
            let response = respond_over_step(law, &motion, &manner);
            state.current[point] = response.state;
            return response.is_closed().then_some(Answer::OverStep(response));
        }
        let motion =
            Motion { velocity: &self.velocity, increment: &self.increment, history: &state.history[point] };
        let response = respond(law, &self.geometry, &motion, &manner);
        state.current[point] = response.state;
        response.state.is_closed().then_some(Answer::Now(response))
    }

    fn fields(&self) -> Fields<'_, D> {
        Fields { velocity: &self.velocity, increment: &self.increment }
    }

    /// Adds what a closed point contributes.
    pub fn add(&mut self, answer: &Answer<D>, request: &ContactRequest) {
        match answer {
            Answer::Now(response) => {
                response.add_force(&self.geometry, &mut self.force);
                if let Some(selection) = &request.stiffness {
                    response.add_stiffness(&self.geometry, selection, &mut self.stiffness);
                }
            }
            Answer::OverStep(response) => {
                response.add_force(&self.geometry, &mut self.force);
                let (Some(selection), Some(foot)) = (&request.stiffness, &self.foot) else { return };
                let curvature = Curvature::of_obstacle(foot);
                let geometry =
                    StepGeometry { middle: &self.geometry, end: &self.end_geometry, curvature: &curvature };
                let fields = Fields { velocity: &self.velocity, increment: &self.increment };
                response.add_stiffness(&geometry, &fields, selection, &mut self.stiffness);
            }
        }
    }

    /// The stiffness, if it was asked for.
    pub fn stiffness(&self, request: &ContactRequest) -> Option<&[f64]> {
        request.stiffness.map(|_| &self.stiffness[..])
    }
}
