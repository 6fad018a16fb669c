//! Points that penetrate before the start: counted, refused, or moved out.

use mpi::collective::SystemOperation;
use mpi::traits::{CommunicatorCollectives, Root};

use super::contact::facets_of;
use crate::contact::obstacle::Obstacle;
use crate::error::{Error, Result, agree};
use crate::mesh::Facet;
use crate::model::{Contact, InitialOverclosure};
use crate::partition::LocalMesh;
use crate::tensor::Vector;

/// Largest overclosure of a contact in the undeformed state; the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Overclosure<const D: usize> {
    /// Name of the contact.
    pub contact: String,
    /// Smallest gap of all contactor nodes, negative where they penetrate [m].
    pub smallest_gap: f64,
    /// Where that is [m].
    pub place: [f64; D],
    /// Number of nodes that penetrate.
    pub nodes: u64,
    /// Number of nodes that may touch.
    pub candidates: u64,
}

/// Looks for contactor nodes behind the target and treats them as the case says. Collective.
///
/// # Errors
/// When the case wants an overclosure to be an error, the whole body lies behind the target, or a contactor has no
/// facet at all.
pub fn resolve_overclosure<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &mut LocalMesh<D>,
    contact: &Contact<D>,
) -> Result<Overclosure<D>> {
    let facets = agree(world, facets_of(local, &contact.contactor).map(<[Facet]>::to_vec))?;
    let mut nodes = Vec::new();
    let mut of_facet = Vec::new();
    for &facet in &facets {
        local.mesh.facet_nodes(facet, &mut of_facet);
        nodes.extend_from_slice(&of_facet);
    }
    nodes.sort_unstable();
    nodes.dedup();
    let Some(obstacle) = contact.target.obstacle() else {
        return Err(Error::case("contact between two bodies is not offered yet"));
    };
    require_free_side(world, local, contact, obstacle)?;
    let found = worst(world, local, (contact, obstacle), &nodes);
    let behind = found.smallest_gap < 0.0;
    match contact.initial_overclosure {
        InitialOverclosure::Error if behind => Err(Error::case(format!(
            "contact '{}' starts with {} nodes behind '{}', the worst by {:.3e} m at {:?}",
            contact.name, found.nodes, contact.target_name, -found.smallest_gap, found.place
        ))
        .hint("move the body, or set initial_overclosure to adjust or accept")),
        InitialOverclosure::Adjust if behind => {
            nodes.iter().for_each(|&node| move_out(&mut local.mesh.points[node as usize], obstacle));
            Ok(found)
        }
        _ => Ok(found),
    }
}

/// A body that lies behind its target as a whole tells of an obstacle that is inside out.
fn require_free_side<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    contact: &Contact<D>,
    obstacle: &Obstacle<D>,
) -> Result<()> {
    let mesh = &local.mesh;
    let own = (0..mesh.element_count()).filter(|&element| usize::from(mesh.body[element]) == contact.body);
    let points = own.flat_map(|element| mesh.element_nodes(element)).map(|&node| mesh.points[node as usize]);
    let largest = points.map(|point| obstacle.gap(&Vector::from(point))).fold(f64::NEG_INFINITY, f64::max);
    let mut all = 0.0;
    world.all_reduce_into(&largest, &mut all, SystemOperation::max());
    if all > 0.0 {
        return Ok(());
    }
    let (name, target) = (&contact.name, &contact.target_name);
    Err(Error::case(format!(
        "contact '{name}': the whole body lies behind '{target}', no point of it is on the free side"
    ))
    .hint("a plane's normal points to the free side; a sphere or cylinder has side: outside or inside"))
}

/// Moves a point onto the surface of the obstacle where it lies behind it.
fn move_out<const D: usize>(point: &mut [f64; D], obstacle: &Obstacle<D>) {
    let at = obstacle.proximity(&Vector::from(*point));
    if at.gap < 0.0 {
        *point = (Vector::from(*point) - at.normal * at.gap).into();
    }
}

fn worst<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    (contact, obstacle): (&Contact<D>, &Obstacle<D>),
    nodes: &[u32],
) -> Overclosure<D> {
    let owned = nodes.iter().filter(|&&node| local.index.owns(node));
    let gaps = owned.map(|&node| {
        let point = local.mesh.points[node as usize];
        (obstacle.gap(&Vector::from(point)), point)
    });
    let (mut smallest, mut place, mut count) = (f64::INFINITY, [0.0; D], [0u64; 2]);
    for (gap, point) in gaps {
        count[0] += u64::from(gap < 0.0);
        count[1] += 1;
        if gap < smallest {
            (smallest, place) = (gap, point);
        }
    }
    let (mut least, mut total) = (0.0, [0u64; 2]);
    world.all_reduce_into(&smallest, &mut least, SystemOperation::min());
    world.all_reduce_into(&count[..], &mut total[..], SystemOperation::sum());
    let holder = if smallest == least { world.rank() } else { i32::MAX };
    let mut first = 0;
    world.all_reduce_into(&holder, &mut first, SystemOperation::min());
    world.process_at_rank(first).broadcast_into(&mut place[..]);
    Overclosure {
        contact: contact.name.clone(),
        smallest_gap: least,
        place,
        nodes: total[0],
        candidates: total[1],
    }
}
