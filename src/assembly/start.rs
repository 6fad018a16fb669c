//! Points that penetrate before the start: they are counted, rejected, or moved out.

use std::collections::BTreeSet;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::build::{facet_normals, height, size_of};
use super::contact::facets_of;
use crate::case::Units;
use crate::collective::Collective;
use crate::contact::mortar::contact::CLOSABLE;
use crate::contact::obstacle::Shape;
use crate::error::{Error, Result, agree};
use crate::mesh::{Facet, spelled};
use crate::model::{ContactModel, InitialOverclosure};
use crate::partition::LocalMesh;
use crate::tensor::Vector;

/// Largest overclosure of a contact in the undeformed state, with the same values on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Overclosure<const D: usize> {
    /// Name of the contact.
    pub contact: String,
    /// Smallest gap of all contactor nodes, or of all points of a deformable contact \[m\]. It is
    /// negative if they penetrate, and infinite if no target is near.
    pub smallest_gap: f64,
    /// Position of the smallest gap \[m\].
    pub place: [f64; D],
    /// Largest gap of the nodes or points with a target nearby \[m\].
    pub largest_gap: f64,
    /// Position of the largest gap \[m\].
    pub far_place: [f64; D],
    /// Number of nodes or points that penetrate.
    pub nodes: u64,
    /// Number of nodes or points with a target nearby.
    pub paired: u64,
    /// Number of nodes or points that may touch.
    pub candidates: u64,
    /// Whether all facets of the contactor face away from an obstacle.
    pub looks_away: bool,
}

/// Finds contactor nodes behind an obstacle and treats them as the case requires. Collective.
///
/// `known` is the accuracy of positions \[m\].
///
/// # Errors
/// If the case defines an overclosure as an error, or the whole body is behind the obstacle.
pub fn resolve_overclosure<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &mut LocalMesh<D>,
    contact: &ContactModel<D>,
    units: Units,
    known: f64,
) -> Result<Option<Overclosure<D>>> {
    let Some(obstacle) = contact.target.obstacle() else { return Ok(None) };
    let facets = agree(world, facets_of(local, &contact.contactor).map(<[Facet]>::to_vec))?;
    let mut nodes = Vec::new();
    let mut of_facet = Vec::new();
    for &facet in &facets {
        local.mesh.facet_nodes(facet, &mut of_facet);
        nodes.extend_from_slice(&of_facet);
    }
    nodes.sort_unstable();
    nodes.dedup();
    require_free_side(world, local, contact, obstacle)?;
    let owned = nodes.iter().filter(|&&node| local.index.owns(node));
    let gaps = owned.map(|&node| {
        let point = local.mesh.points[node as usize];
        (obstacle.gap(&Vector::from(point)), point)
    });
    let mut found = worst(world, &contact.name, known, gaps);
    found.looks_away = look_away(world, local, &facets, obstacle);
    let facet = mean_facet(world, local, &facets);
    if let Some(apart) = adjusted(contact, units, &found, "nodes", facet)? {
        let facing = facing_nodes(local, &facets, obstacle);
        let apart = apart.min(CLOSABLE * height(world, local, &facets));
        for &node in &nodes {
            let apart = if facing.contains(&node) { apart } else { 0.0 };
            let is_revolved = local.mesh.plane.is_revolved();
            move_onto(&mut local.mesh.points[node as usize], obstacle, apart, is_revolved);
        }
    }
    Ok(Some(found))
}

/// Finds contact points below a target, evaluated on the undeformed bodies, and treats them as the
/// case requires. Over a round obstacle this comes after its nodes have been moved: a straight facet
/// between nodes on the obstacle overlaps it by up to `h^2 / (8 R)`. Collective.
///
/// `known` is the accuracy of positions \[m\].
///
/// # Errors
/// If the case defines an overclosure as an error.
pub fn resolve_overclosure_of_points<const D: usize>(
    world: &impl CommunicatorCollectives,
    given: &ContactModel<D>,
    units: Units,
    contact: &mut super::contact::LocalContact<D>,
    known: f64,
) -> Result<Overclosure<D>> {
    let found = worst(world, &given.name, known, contact.gaps().into_iter());
    if let Some(apart) = adjusted(given, units, &found, "points", contact.facet_size)? {
        contact.state.adjust(apart);
    }
    Ok(found)
}

/// Largest gap at which nodes or points are treated as touching, in addition to those that
/// penetrate \[m\]; `None` if all gaps are kept.
fn adjusted<const D: usize>(
    contact: &ContactModel<D>,
    units: Units,
    found: &Overclosure<D>,
    what: &str,
    facet: f64,
) -> Result<Option<f64>> {
    let apart = match contact.initial_overclosure {
        InitialOverclosure::Error if found.smallest_gap < 0.0 => {
            return Err(refusal(contact, units, found, what));
        }
        InitialOverclosure::Error | InitialOverclosure::Accept => return Ok(None),
        InitialOverclosure::Adjust => 0.0,
        InitialOverclosure::Conform => CLOSABLE * facet,
    };
    require_small(contact, units, found, facet)?;
    Ok(Some(apart))
}

fn refusal<const D: usize>(
    contact: &ContactModel<D>,
    units: Units,
    found: &Overclosure<D>,
    what: &str,
) -> Error {
    let m = units.of("m");
    Error::case(format!(
        "contact '{}' starts with {} {what} behind '{}'; the largest overclosure is {:.3e} {m} at {} {m}",
        contact.name,
        found.nodes,
        contact.target_name,
        -found.smallest_gap,
        spelled(&found.place)
    ))
    .hint("move the body, or set initial_overclosure to adjust, conform or accept")
}

/// Largest overclosure that may be adjusted, relative to the size of a facet.
///
/// The error of a mesh on a curved surface is `h^2 / (8 R)`, an eighth of a facet that is as long
/// as the radius. A body that is moved by more loses its shape.
const ADJUSTABLE: f64 = 0.25;

/// Refuses to adjust more than small mesh errors.
fn require_small<const D: usize>(
    contact: &ContactModel<D>,
    units: Units,
    found: &Overclosure<D>,
    facet: f64,
) -> Result<()> {
    if -found.smallest_gap <= ADJUSTABLE * facet {
        return Ok(());
    }
    let m = units.of("m");
    Err(Error::case(format!(
        "contact '{}': initial_overclosure would remove an overclosure of {:.3e} {m} at {} {m}, more than a \
         quarter of the facet size, {facet:.3e} {m}",
        contact.name,
        -found.smallest_gap,
        spelled(&found.place)
    ))
    .hint(
        "adjust and conform correct small mesh errors only; move the body, or set initial_overclosure to \
         accept",
    ))
}

/// Mean size of the facets of a contactor \[m\]. Collective.
fn mean_facet<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    facets: &[Facet],
) -> f64 {
    let [area, count] = size_of(local, facets);
    let mut sums = [0.0_f64; 2];
    world.reduce_all(&[area, count][..], &mut sums[..], SystemOperation::sum());
    (sums[0] / sums[1]).powf(1.0 / (D as f64 - 1.0))
}

/// Reports an obstacle that is inside out, if a body is completely behind its target.
fn require_free_side<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    contact: &ContactModel<D>,
    obstacle: &dyn Shape<D>,
) -> Result<()> {
    let mesh = &local.mesh;
    let own = (0..mesh.element_count()).filter(|&e| contact.bodies.contains(&usize::from(mesh.body[e])));
    let points = own.flat_map(|element| mesh.element_nodes(element)).map(|&node| mesh.points[node as usize]);
    let largest = points.map(|point| obstacle.gap(&Vector::from(point))).fold(f64::NEG_INFINITY, f64::max);
    let mut all = 0.0;
    world.reduce_all(&largest, &mut all, SystemOperation::max());
    if all > 0.0 {
        return Ok(());
    }
    let (name, target) = (&contact.name, &contact.target_name);
    Err(Error::case(format!(
        "contact '{name}': the whole body lies behind '{target}', with no point on the free side"
    ))
    .hint(
        "the normal of a plane must point to the free side; for a sphere or cylinder set side: outside or \
         inside",
    ))
}

/// Whether the outward normals of all facets point the same way as the obstacle's. Collective.
fn look_away<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    facets: &[Facet],
    obstacle: &dyn Shape<D>,
) -> bool {
    let mut nodes = Vec::new();
    let faces = |&facet: &Facet| {
        local.mesh.facet_nodes(facet, &mut nodes);
        let normal: Vector<D> = facet_normals(local, facet).iter().sum();
        let against =
            |&node: &u32| obstacle.proximity(&local.mesh.points[node as usize].into()).normal.dot(&normal);
        nodes.iter().any(|node| against(node) < 0.0)
    };
    let own = u64::from(facets.iter().any(faces));
    let mut any = 0;
    world.reduce_all(&own, &mut any, SystemOperation::max());
    any == 0
}

/// Nodes of the facets that face the obstacle.
fn facing_nodes<const D: usize>(
    local: &LocalMesh<D>,
    facets: &[Facet],
    obstacle: &dyn Shape<D>,
) -> BTreeSet<u32> {
    let (mut facing, mut nodes) = (BTreeSet::new(), Vec::new());
    for &facet in facets {
        local.mesh.facet_nodes(facet, &mut nodes);
        let normal: Vector<D> = facet_normals(local, facet).iter().sum();
        let place = Vector::from(local.mesh.points[nodes[0] as usize]);
        if obstacle.proximity(&place).normal.dot(&normal) < -0.5 * normal.norm() {
            facing.extend(&nodes);
        }
    }
    facing
}

/// Moves a point onto the surface of the obstacle if it is behind it, or at most `apart` in front
/// of it \[m\]. In axisymmetry a point on the axis moves along it, and no point moves beyond it.
fn move_onto<const D: usize>(point: &mut [f64; D], obstacle: &dyn Shape<D>, apart: f64, is_revolved: bool) {
    let at = obstacle.proximity(&Vector::from(*point));
    if at.gap >= 0.0 && at.gap > apart {
        return;
    }
    if is_revolved && point[0] == 0.0 {
        // Newton's step along the axis, which is the solution for planes.
        if at.normal[1].abs() > STEEP {
            point[1] -= at.gap / at.normal[1];
        }
        return;
    }
    *point = (Vector::from(*point) - at.normal * at.gap).into();
    if is_revolved {
        point[0] = point[0].max(0.0);
    }
}

/// Component of a normal along the axis of revolution below which a point on the axis cannot move onto the
/// surface. Such a surface is within 6 degrees of the axis, and the step along the axis would be more than
/// ten times the gap. Half and twice the value change the result only within 12 degrees of the axis.
const STEEP: f64 = 0.1;

/// Returns the gaps, with those at the rounding of coordinates set to zero.
fn touching<const D: usize>(
    known: f64,
    gaps: impl Iterator<Item = (f64, [f64; D])>,
) -> impl Iterator<Item = (f64, [f64; D])> {
    gaps.map(move |(gap, point)| (if gap.abs() <= known { 0.0 } else { gap }, point))
}

/// Finds the smallest and the largest gap of all ranks and counts the gaps. Collective.
///
/// `known` is the accuracy of positions \[m\].
fn worst<const D: usize>(
    world: &impl CommunicatorCollectives,
    contact: &str,
    known: f64,
    gaps: impl Iterator<Item = (f64, [f64; D])>,
) -> Overclosure<D> {
    let gaps: Vec<_> = touching(known, gaps).collect();
    let (smallest_gap, place) = least(world, known, &gaps);
    let paired: Vec<_> =
        gaps.iter().filter(|(gap, _)| *gap < f64::MAX).map(|&(gap, at)| (-gap, at)).collect();
    let (largest, far_place) = least(world, known, &paired);
    let below = gaps.iter().filter(|(gap, _)| *gap < 0.0).count();
    let count = [below, paired.len(), gaps.len()].map(|number| number as u64);
    let mut total = [0u64; 3];
    world.reduce_all(&count[..], &mut total[..], SystemOperation::sum());
    let [nodes, paired, candidates] = total;
    let contact = contact.to_owned();
    Overclosure {
        contact,
        smallest_gap,
        place,
        largest_gap: -largest,
        far_place,
        nodes,
        paired,
        candidates,
        looks_away: false,
    }
}

/// Finds the smallest value of all ranks and its position. Collective.
///
/// Values whose difference is below the accuracy `known` \[m\] count as equal. The position with
/// the lowest coordinates is then chosen, so that the result does not depend on the ranks.
fn least<const D: usize>(
    world: &impl CommunicatorCollectives,
    known: f64,
    values: &[(f64, [f64; D])],
) -> (f64, [f64; D]) {
    let least = |own: f64| {
        let mut all = 0.0;
        world.reduce_all(&own, &mut all, SystemOperation::min());
        all
    };
    let smallest = least(values.iter().map(|(value, _)| *value).fold(f64::INFINITY, f64::min));
    let mut ties: Vec<[f64; D]> =
        values.iter().filter(|(value, _)| *value <= smallest + known).map(|(_, place)| *place).collect();
    let mut place = [0.0; D];
    for k in 0..D {
        place[k] = least(ties.iter().map(|tie| tie[k]).fold(f64::INFINITY, f64::min));
        ties.retain(|tie| tie[k] == place[k]);
    }
    (smallest, place)
}
