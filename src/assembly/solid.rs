//! The solids of a rank: elements by body and kind, with their kernels and the places of their entries.

use std::collections::BTreeMap;

use super::scatter::ScatterMap;
use crate::element::{ElementGroup, Formulation};
use crate::error::Result;
use crate::mesh::ElementKind;
use crate::partition::LocalMesh;
use crate::petsc::BlockPattern;

/// How the mass is spread over the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassKind {
    /// `int rho N_a N_b dV`.
    Consistent,
    /// Diagonal.
    Lumped,
    /// Consistent, without the nodes that may touch, see [`super::redistribution`].
    Redistributed,
}

/// Elements of one kind and body, with the places of their entries.
pub struct SolidElements<const D: usize> {
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
) -> Result<Vec<SolidElements<D>>> {
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
        solids.push(SolidElements { group, map, mass: physics.mass, body: usize::from(body) });
    }
    Ok(solids)
}
