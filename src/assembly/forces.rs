//! Internal forces and stiffness of the solids, swept group by group.

use std::collections::BTreeMap;

use super::mass::MassKind;
use super::scatter::{ForceSink, LiftTarget, MatrixSink, ScatterMap};
use crate::dynamics::{OverStep, Stage};
use crate::element::{ElementGroup, ElementSink, Formulation, Inverted, Request};
use crate::error::Result;
use crate::mesh::ElementKind;
use crate::partition::LocalMesh;
use crate::petsc::{BlockPattern, BlockValues};
use crate::terms::Terms;

/// Displacements at which solids are evaluated, local nodes \[m\].
#[derive(Debug, Clone, Copy)]
pub struct At<'a> {
    /// The trial state.
    pub u: &'a [f64],
    /// The start of the step, where forces conserve over a step in whose middle the trial state is.
    pub start: Option<&'a [f64]>,
}

impl<'a> At<'a> {
    /// The trial state `u` of `stage`, whose start is at `start`.
    pub fn of(stage: &Stage, u: &'a [f64], start: &'a [f64]) -> Self {
        Self { u, start: (stage.over_step == OverStep::Middle).then_some(start) }
    }
}

/// Elements of one kind and body, with the places of their entries.
pub struct Solid<const D: usize> {
    /// The kernel.
    pub group: ElementGroup<D>,
    /// Where its entries go.
    pub map: ScatterMap,
    /// How its mass is spread.
    pub mass: MassKind,
    /// Index of the body.
    pub body: usize,
}

/// Physics of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyPhysics {
    /// Law, kinematics, locking, density.
    pub formulation: Formulation,
    /// How the mass is spread.
    pub mass: MassKind,
}

/// The solids of a rank: one group for each body and kind of element, elements in local order.
///
/// # Errors
/// When a formulation does not fit its elements.
pub fn solids<const D: usize>(
    local: &LocalMesh<D>,
    bodies: &[BodyPhysics],
    pattern: &BlockPattern,
    constrained: &[bool],
) -> Result<Vec<Solid<D>>> {
    let mut groups: BTreeMap<(u16, ElementKind), Vec<u32>> = BTreeMap::new();
    for (element, (&body, &kind)) in local.mesh.body.iter().zip(&local.mesh.kinds).enumerate() {
        groups.entry((body, kind)).or_default().push(element as u32);
    }
    let mut solids = Vec::with_capacity(groups.len());
    for ((body, kind), elements) in groups {
        let nodes = elements.iter().flat_map(|&e| local.mesh.element_nodes(e as usize)).copied().collect();
        let map = ScatterMap::new::<D>(kind.nodes(), nodes, pattern, &local.index, constrained);
        let physics = &bodies[usize::from(body)];
        let group = ElementGroup::new(&local.mesh, elements, physics.formulation)?;
        solids.push(Solid { group, map, mass: physics.mass, body: usize::from(body) });
    }
    Ok(solids)
}

impl<const D: usize> Solid<D> {
    /// Adds `Q` to the owned rows of `force` \[N\].
    ///
    /// # Errors
    /// The first element that is turned inside out.
    pub fn add_force(&self, at: &At, force: &mut [f64]) -> std::result::Result<(), Inverted> {
        self.evaluate(at, Request::FORCE, &mut ForceSink::<D> { map: &self.map, force })
    }

    fn evaluate(
        &self,
        at: &At,
        request: Request,
        sink: &mut dyn ElementSink,
    ) -> std::result::Result<(), Inverted> {
        match at.start {
            Some(start) => self.group.evaluate_step(start, at.u, request, sink),
            None => self.group.evaluate(at.u, request, sink),
        }
    }

    /// Adds the wanted stiffness terms to the matrix.
    ///
    /// # Errors
    /// The first element that is turned inside out.
    pub fn add_stiffness(
        &self,
        at: &At,
        terms: Terms,
        constrained: &[bool],
        values: &mut BlockValues,
        lift: Option<LiftTarget>,
    ) -> std::result::Result<(), Inverted> {
        let scratch = Vec::with_capacity((self.map.width * D).pow(2));
        let mut sink = MatrixSink::<D> { map: &self.map, constrained, values, lift, scratch };
        self.evaluate(at, Request { stiffness: Some(terms) }, &mut sink)
    }
}
