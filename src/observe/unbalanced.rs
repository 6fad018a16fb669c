//! The place where forces are farthest from balance, for the message of a step or a static start that
//! did not converge.

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact};
use crate::collective::Collective;
use crate::dynamics::{Equations, Stage};
use crate::error::Result;
use crate::mesh::spelled;

/// Forces within this fraction of the largest one count as equal. It is well above rounding, which
/// depends on the partition. Half and twice the value choose the same node in the test.
const EQUAL: f64 = 1e-6;

/// Describes the node with the largest unbalanced force at the trial state of `stage`: the force,
/// the position before the deformation, the body, and the contacts on whose surfaces it lies. If
/// several forces are equal, it is the node with the smallest coordinates. Returns `None` if forces
/// are not finite. Nodes of rigid bodies are left out. The result is the same on all ranks.
/// Collective.
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
    let force = |block: &[f64]| block.iter().map(|part| part * part).sum::<f64>().sqrt();
    let forces: Vec<f64> = residual.owned().chunks_exact(D).map(force).collect();
    let units = system.bodies().units();
    Ok(worst(system, &forces).map(|Worst { force, place, body, contacts }| {
        let contacts = match contacts.is_empty() {
            true => String::new(),
            false => format!(", on a surface of contact {}", contacts.join(", ")),
        };
        let (newton, m) = (units.of("N"), units.of("m"));
        format!(
            "the largest unbalanced force, {force:.1e} {newton}, is at {} {m} of '{body}'{contacts}",
            spelled(&place)
        )
    }))
}

/// A node of a deformable body.
struct Worst<const D: usize> {
    force: f64,
    place: [f64; D],
    body: String,
    contacts: Vec<String>,
}

/// The node with the largest of the `forces` at the owned nodes \[N\]. Collective.
fn worst<const D: usize>(system: &ContactSystem<D>, forces: &[f64]) -> Option<Worst<D>> {
    let session = system.session().clone();
    let world = session.world();
    let local = system.bodies().local();
    let mut body_of = vec![-1; local.mesh.points.len()];
    for element in 0..local.mesh.element_count() {
        for &node in local.mesh.element_nodes(element) {
            body_of[node as usize] = i32::from(local.mesh.body[element]);
        }
    }
    let of_bodies = || forces.iter().enumerate().filter(|(node, _)| body_of[*node] >= 0);
    let own = of_bodies().map(|(_, force)| *force).fold(-1.0, f64::max);
    let mut most = -1.0;
    world.reduce_all(&own, &mut most, SystemOperation::max());
    if most < 0.0 {
        return None;
    }

    // Each rank offers its first node with that force: global number and position.
    let equal = of_bodies().filter(|(_, force)| **force >= (1.0 - EQUAL) * most);
    let first = equal.map(|(node, _)| node).min_by(|a, b| {
        let [a, b] = [*a, *b].map(|node| local.mesh.points[node]);
        a.partial_cmp(&b).unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut offer = [-1.0; 4];
    if let Some(node) = first {
        offer[0] = f64::from(local.index.global(node as u32));
        offer[1..=D].copy_from_slice(&local.mesh.points[node]);
    }
    let mut offers = vec![0.0; 4 * session.size() as usize];
    world.gather_all(&offer, &mut offers);
    let offers = offers.chunks_exact(4).filter(|offer| offer[0] >= 0.0);
    let chosen = offers.min_by(|a, b| a[1..].partial_cmp(&b[1..]).unwrap_or(std::cmp::Ordering::Equal))?;

    // Elements and facets at the node may lie in the parts of other ranks.
    let known = local.index.local(chosen[0] as i32);
    let touches = |contact: &LocalContact<D>| known.is_some_and(|node| contact.pair.has_node(node));
    let mut own = vec![known.map_or(-1, |node| body_of[node as usize])];
    own.extend(system.contacts().iter().map(|contact| i32::from(touches(contact))));
    let mut all = own.clone();
    world.reduce_all(&own[..], &mut all[..], SystemOperation::max());
    let body = system.bodies().body_names().nth(usize::try_from(all[0]).ok()?)?.to_owned();
    let contacts = system.contacts().iter().zip(&all[1..]).filter(|(_, touches)| **touches > 0);
    let contacts = contacts.map(|(contact, _)| format!("'{}'", contact.name)).collect();
    Some(Worst { force: most, place: std::array::from_fn(|k| chosen[1 + k]), body, contacts })
}
