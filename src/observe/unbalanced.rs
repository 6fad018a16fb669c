//! The place where forces are farthest from balance, for the message of a step that did not converge.

use mpi::collective::SystemOperation;
use mpi::traits::{Communicator, Root};

use crate::assembly::ContactSystem;
use crate::collective::Collective;
use crate::dynamics::{Equations, Stage};
use crate::error::Result;
use crate::mesh::spelled;

/// Describes the node with the largest unbalanced force at the trial state of `stage`: the force, the
/// position before the deformation, the body, and the contacts on whose surfaces it lies. `None` if forces
/// are not finite, or if the node is that of a rigid body. The same on all ranks. Collective.
///
/// # Errors
/// PETSc reports an error.
pub fn unbalanced_place<const D: usize>(
    system: &mut ContactSystem<D>,
    stage: &mut Stage,
) -> Result<Option<String>> {
    let mut residual = system.pattern_vector().like()?;
    stage.update_rates()?;
    system.prescribe(stage)?;
    if !system.residual(stage, &mut residual)?.norm.is_finite() {
        return Ok(None);
    }
    let session = system.session().clone();
    let world = session.world();
    let local = system.bodies().local();
    let force = |block: &[f64]| block.iter().map(|part| part * part).sum::<f64>().sqrt();
    let forces: Vec<f64> = residual.owned().chunks_exact(D).map(force).collect();
    let own = (0_u32..).zip(&forces).max_by(|a, b| a.1.total_cmp(b.1));
    let (own_node, own_force) = own.map_or((0, -1.0), |(node, force)| (node, *force));
    let mut all = vec![0.0; session.size() as usize];
    world.gather_all(&[own_force], &mut all);
    let most = all.iter().copied().fold(0.0, f64::max);
    let Some(owner) = all.iter().position(|force| *force == most) else { return Ok(None) };
    let mut node = local.index.global(own_node);
    let mut place = local.mesh.points.get(own_node as usize).copied().unwrap_or([0.0; D]);
    let owner = world.process_at_rank(owner as i32);
    owner.broadcast_into(&mut node);
    owner.broadcast_into(&mut place[..]);

    // Elements and facets at a node may lie in the parts of other ranks.
    let known = local.index.local(node);
    let has = |element: &usize| known.is_some_and(|node| local.mesh.element_nodes(*element).contains(&node));
    let body = (0..local.mesh.element_count()).find(has).map(|element| i32::from(local.mesh.body[element]));
    let on =
        |contact: &crate::assembly::LocalContact<D>| known.is_some_and(|node| contact.pair.has_node(node));
    let found: Vec<i32> = std::iter::once(body.unwrap_or(-1))
        .chain(system.contacts().iter().map(|contact| i32::from(on(contact))))
        .collect();
    let mut everywhere = found.clone();
    world.reduce_all(&found[..], &mut everywhere[..], SystemOperation::max());
    let Ok(body) = usize::try_from(everywhere[0]) else { return Ok(None) };
    let Some(body) = system.bodies().body_names().nth(body) else { return Ok(None) };
    let contacts = system.contacts().iter().zip(&everywhere[1..]).filter(|(_, on)| **on > 0);
    let contacts: Vec<String> = contacts.map(|(contact, _)| format!("'{}'", contact.name)).collect();
    let units = system.bodies().units();
    let within =
        if contacts.is_empty() { String::new() } else { format!(", in contact {}", contacts.join(", ")) };
    Ok(Some(format!(
        "the largest unbalanced force, {most:.1e} {}, is at {} {} of '{body}'{within}",
        units.of("N"),
        spelled(&place),
        units.of("m")
    )))
}
