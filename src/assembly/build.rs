//! The parts of a system, built from the model on the rank's share of the mesh.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::{Contact, Place, facets_of, have_nodal_rule, size_of};
use super::external::{self, External};
use super::forces::BodyPhysics;
use super::mass::MassKind;
use super::supports::Supports;
use crate::element::Kinematics;
use crate::error::{Error, Result, agree};
use crate::model::Model;
use crate::partition::LocalMesh;
use crate::petsc::BlockPattern;
use crate::space::{Boundary, DofMap};

/// A body that no support holds in some direction.
pub(super) struct FreeBody {
    /// Index of the body.
    pub body: usize,
    /// For people: name and directions.
    pub words: String,
}

/// Laws and masses of the bodies.
pub(super) fn physics<const D: usize>(model: &Model<D>) -> Vec<BodyPhysics> {
    let mass = |lumped| if lumped { MassKind::Lumped } else { MassKind::Consistent };
    let body = |body: &crate::model::Body| BodyPhysics {
        formulation: body.formulation,
        mass: mass(body.lumped_mass),
    };
    model.bodies.iter().map(body).collect()
}

/// The displacement boundaries.
///
/// # Errors
/// When a set is not there, or two boundaries contradict each other.
pub(super) fn supports<const D: usize>(local: &LocalMesh<D>, model: &Model<D>) -> Result<Supports<D>> {
    let boundary = |support: &crate::model::Support<D>| Boundary {
        name: support.name.clone(),
        set: support.set.clone(),
        components: std::array::from_fn(|i| support.components[i].is_some()),
    };
    let boundaries: Vec<Boundary<D>> = model.supports.iter().map(boundary).collect();
    let motion = |k: usize, component: usize| &model.supports[k].components[component];
    let same = |[a, b]: [usize; 2], component| motion(a, component) == motion(b, component);
    Ok(Supports::new(DofMap::new(&local.mesh, &boundaries, same)?, &model.supports))
}

/// The contacts. Collective.
///
/// # Errors
/// The same on all ranks.
pub(super) fn contacts<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    model: &Model<D>,
    pattern: &BlockPattern,
    constrained: &[bool],
) -> Result<Vec<Contact<D>>> {
    let mut contacts = Vec::with_capacity(model.contacts.len());
    for contact in &model.contacts {
        let facets = agree(world, facets_of(local, &contact.contactor))?;
        let own = size_of(local, facets);
        let missing = u8::from(!have_nodal_rule(local, facets));
        let mut without = 0;
        world.all_reduce_into(&missing, &mut without, SystemOperation::max());
        let mut total = [0.0f64; 2];
        world.all_reduce_into(&own[..], &mut total[..], SystemOperation::sum());
        let facet_size = (total[0] / total[1]).powf(1.0 / (D as f64 - 1.0));
        if total[1] == 0.0 {
            return Err(Error::case(format!(
                "contact '{}': the surface '{}' has no facet",
                contact.name, contact.contactor
            )));
        }
        let place = Place { local, pattern, constrained, nodal: without == 0 };
        contacts.push(agree(world, Contact::new(contact, facet_size, &place))?);
    }
    Ok(contacts)
}

/// The loads.
///
/// # Errors
/// When a set is not there.
pub(super) fn loads<const D: usize>(
    local: &LocalMesh<D>,
    model: &Model<D>,
    pattern: &BlockPattern,
    constrained: &[bool],
) -> Result<External<D>> {
    let kinematics: Vec<Kinematics> = model.bodies.iter().map(|body| body.formulation.kinematics).collect();
    External::new(&model.loads, &external::Place { local, pattern, constrained, kinematics: &kinematics })
}

/// Bodies that lack a support in some direction; the same on all ranks. Collective.
pub(super) fn free_bodies<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    model: &Model<D>,
    supports: &Supports<D>,
) -> Vec<FreeBody> {
    let mut own = vec![0u8; model.bodies.len() * D];
    for element in 0..local.mesh.element_count() {
        let body = usize::from(local.mesh.body[element]);
        for (node, i) in local.mesh.element_nodes(element).iter().flat_map(|&n| (0..D).map(move |i| (n, i))) {
            own[body * D + i] |= u8::from(supports.dofs.constrained[node as usize * D + i]);
        }
    }
    let mut held = vec![0u8; own.len()];
    world.all_reduce_into(&own[..], &mut held[..], SystemOperation::max());
    let free = |body: usize| {
        (0..D).filter(|i| held[body * D + i] == 0).map(|i| ["x", "y", "z"][i]).collect::<Vec<_>>()
    };
    let words = |k: usize| format!("'{}' along {}", model.bodies[k].name, free(k).join(", "));
    let loose = (0..model.bodies.len()).filter(|&k| !free(k).is_empty());
    loose.map(|body| FreeBody { body, words: words(body) }).collect()
}

/// A typical diagonal entry of the stiffness, `E h^(D - 2)` [N/m].
pub(super) fn unit<const D: usize>(model: &Model<D>, extent: f64, local: &LocalMesh<D>) -> f64 {
    let stiffest = model.bodies.iter().map(|body| body.young_modulus).fold(0.0, f64::max);
    let size = extent / f64::from(local.index.total.max(1)).powf(1.0 / D as f64);
    stiffest * size.powi(D as i32 - 2)
}

/// Longest side of the box around all bodies [m].
pub(super) fn extent<const D: usize>(world: &impl CommunicatorCollectives, local: &LocalMesh<D>) -> f64 {
    let mut bounds = [f64::NEG_INFINITY; 6];
    for point in &local.mesh.points {
        for i in 0..D {
            bounds[i] = bounds[i].max(point[i]);
            bounds[i + 3] = bounds[i + 3].max(-point[i]);
        }
    }
    let mut all = [0.0; 6];
    world.all_reduce_into(&bounds[..], &mut all[..], SystemOperation::max());
    (0..D).map(|i| all[i] + all[i + 3]).fold(0.0, f64::max)
}
