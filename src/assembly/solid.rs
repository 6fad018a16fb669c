//! The solids of a rank: elements by body and kind, with their kernels and the positions of their
//! entries.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::scatter::ScatterMap;
use super::viscous::ViscousElements;
use crate::element::{ElementGroup, Formulation};
use crate::error::Result;
use crate::material::PronySeries;
use crate::mesh::ElementKind;
use crate::model::RayleighFactors;
use crate::partition::LocalMesh;
use crate::petsc::BlockPattern;
use crate::space::Held;

/// Distribution of the mass over the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassKind {
    /// Consistent mass, `int rho N_a N_b dV`.
    Consistent,
    /// Diagonal mass.
    Lumped,
    /// Consistent mass without the nodes that may touch, see [`super::redistribution`].
    Redistributed,
}

/// Elements of one kind, body and material, with the positions of their entries.
pub struct SolidElements<const D: usize> {
    /// The kernel.
    pub group: ElementGroup<D>,
    /// The kernel in matrices of joined bodies; `None` if the material is not nearly incompressible.
    pub softened: Option<ElementGroup<D>>,
    /// Positions of its entries.
    pub map: ScatterMap,
    /// Distribution of its mass.
    pub mass: MassKind,
    /// Damping of the body.
    pub damping: Option<RayleighFactors>,
    /// Viscous branches; `None` for an elastic body.
    pub viscous: Option<ViscousElements>,
    /// Index of the body.
    pub body: usize,
    /// Index of the material among those of the body.
    pub material: usize,
}

/// Physical model of one material of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyPhysics {
    /// Law, kinematics, locking, density.
    pub formulation: Formulation,
    /// Distribution of the mass.
    pub mass: MassKind,
    /// Damping.
    pub damping: Option<RayleighFactors>,
    /// Prony series; `None` for an elastic body.
    pub series: Option<Rc<PronySeries>>,
}

impl BodyPhysics {
    /// Part of the shear modulus that remains when the viscous branches have relaxed.
    pub fn relaxed(&self) -> f64 {
        self.series.as_ref().map_or(1.0, |series| 1.0 + series.base())
    }
}

/// Creates the solids of a rank: one group for each body, material and kind of element, with elements in
/// local order. `materials` has the index of the material of each element among those of its body.
///
/// # Errors
/// If a formulation does not fit its elements.
pub fn solids<const D: usize>(
    local: &LocalMesh<D>,
    bodies: &[Vec<BodyPhysics>],
    materials: &[u32],
    pattern: &BlockPattern,
    held: &Held<D>,
) -> Result<Vec<SolidElements<D>>> {
    let mut groups: BTreeMap<(u16, u32, ElementKind), Vec<u32>> = BTreeMap::new();
    for (element, (&body, &kind)) in local.mesh.body.iter().zip(&local.mesh.kinds).enumerate() {
        groups.entry((body, materials[element], kind)).or_default().push(element as u32);
    }
    let mut solids = Vec::with_capacity(groups.len());
    for ((body, material, kind), elements) in groups {
        let nodes = elements.iter().flat_map(|&e| local.mesh.element_nodes(e as usize)).copied().collect();
        let map = ScatterMap::new::<D>(kind.nodes(), nodes, pattern, &local.index, held);
        let physics = &bodies[usize::from(body)][material as usize];
        let group = ElementGroup::new(&local.mesh, elements, physics.formulation)?;
        solids.push(SolidElements {
            softened: group.softened(physics.relaxed()),
            group,
            map,
            mass: physics.mass,
            damping: physics.damping,
            viscous: physics.series.clone().map(ViscousElements::new),
            body: usize::from(body),
            material: material as usize,
        });
    }
    Ok(solids)
}
