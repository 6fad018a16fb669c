//! Construction of the parts of a system from the model, on the rank's part of the mesh.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::{LocalContact, Measures, facets_of};
use super::elastic::ElasticSupports;
use super::external::{self, External};
use super::pair::SearchRadii;
use super::pieces::Pieces;
use super::rollers::Rollers;
use super::solid::{BodyPhysics, MassKind};
use super::supports::Supports;
use crate::collective::Collective;
use crate::contact::mortar::surface::edge_nodes;
use crate::element::Kinematics;
use crate::error::{Error, Result, agree};
use crate::mesh::{Bounds, Facet};
use crate::model::regions::softest_beneath;
use crate::model::{self, MassChoice, Model};
use crate::partition::LocalMesh;
use crate::partition::exchange::NodeExchange;
use crate::petsc::BlockPattern;
use crate::space::{DisplacementBoundary, DofMap, Held};
use crate::tensor::Vector;

/// A body, or a piece of one, that no support holds in some direction.
pub(super) struct UnsupportedBody {
    /// Indices of the bodies that are joined in it; empty for a rigid body.
    pub bodies: Vec<usize>,
    /// Index of the group of pieces.
    pub group: usize,
    /// Name and directions, for messages.
    pub words: String,
}

/// Laws and masses of the materials of each body.
pub(super) fn physics<const D: usize>(model: &Model<D>) -> Vec<Vec<BodyPhysics>> {
    let physics = |body: &model::Body, material: &model::BodyMaterial| BodyPhysics {
        formulation: material.formulation,
        mass: match body.mass {
            MassChoice::Consistent => MassKind::Consistent,
            MassChoice::Lumped => MassKind::Lumped,
            MassChoice::Redistributed | MassChoice::RedistributedIfPossible => MassKind::Redistributed,
        },
        damping: material.damping,
        series: material.series.clone(),
    };
    let of_body =
        |body: &model::Body| body.materials.iter().map(|material| physics(body, material)).collect();
    model.bodies.iter().map(of_body).collect()
}

/// Creates the displacement boundaries and rollers. Collective.
///
/// # Errors
/// If a set does not exist, or two boundaries contradict each other; the same on all ranks.
pub(super) fn supports<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    model: &Model<D>,
) -> Result<Supports<D>> {
    let boundary = |support: &crate::model::Support<D>| DisplacementBoundary {
        name: support.name.clone(),
        set: support.set.clone(),
        components: std::array::from_fn(|i| support.components[i].is_some()),
    };
    let boundaries: Vec<DisplacementBoundary<D>> = model.supports.iter().map(boundary).collect();
    let motion = |k: usize, component: usize| &model.supports[k].components[component];
    let same = |[a, b]: [usize; 2], component| motion(a, component) == motion(b, component);
    let mut dofs = agree(world, DofMap::new(&local.mesh, &boundaries, same))?;
    let rollers = Rollers::new(world, local, &model.rollers, &mut dofs.held)?;
    Ok(Supports::new(dofs, rollers, &model.supports))
}

/// Creates the contacts. Collective.
///
/// # Errors
/// All ranks return the same error.
pub(super) fn contacts<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    bodies: &[model::Body],
    wanted: &[model::ContactModel<D>],
) -> Result<Vec<LocalContact<D>>> {
    let mut contacts = Vec::with_capacity(wanted.len());
    for contact in wanted {
        let measures = measures(world, local, bodies, contact)?;
        let mut own = agree(world, LocalContact::new(contact, &measures, local))?;
        if let (Some(set), false) = (contact.target.set(), contact.keeps_momentum) {
            let contactor = edge_marks(world, local, &contact.contactor)?;
            let target = edge_marks(world, local, set)?;
            let [contactor, target] = [contactor, target].map(|marks| move |node| marks[node as usize]);
            own.pair.mark_edges(&local.mesh, contactor, target);
        }
        contacts.push(own);
    }
    Ok(contacts)
}

/// For each local node whether it is on a sharp edge of a surface or on its boundary. Collective.
fn edge_marks<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    set: &str,
) -> Result<Vec<bool>> {
    let facets = agree(world, facets_of(local, set))?;
    let mut marks = vec![false; local.index.local_count()];
    for node in edge_nodes(&local.mesh, facets, local.index.owned) {
        marks[node as usize] = true;
    }
    let mut exchange = NodeExchange::new(world, &local.index, &local.index.ghosts)?;
    let mut of_ghosts = vec![0.0; local.index.ghosts.len()];
    let give = |node: u32, mark: &mut [f64]| mark[0] = f64::from(u8::from(marks[node as usize]));
    exchange.forward_from(world, 1, give, &mut of_ghosts);
    for (mark, of_ghost) in marks[local.index.owned..].iter_mut().zip(&of_ghosts) {
        *mark = *of_ghost > 0.0;
    }
    Ok(marks)
}

/// Sizes of a contact over all ranks. Collective.
fn measures<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    bodies: &[model::Body],
    contact: &crate::model::ContactModel<D>,
) -> Result<Measures> {
    let contactor = agree(world, facets_of(local, &contact.contactor))?;
    let mut own = size_of(local, contactor).to_vec();
    let mut most = vec![extent_of(local, contactor)];
    let mut depth = f64::MAX;
    let mut softer = softest_beneath(bodies, &local.mesh, contactor);
    if let Some(set) = contact.target.set() {
        let target = agree(world, facets_of(local, set))?;
        softer = softer.min(softest_beneath(bodies, &local.mesh, target));
        own.extend(size_of(local, target));
        most.push(extent_of(local, target));
        // A body in contact with itself may be folded, and is then thinner than the box around it.
        let thinner = match contact.target.bodies() == contact.bodies {
            true => height(world, local, contactor).min(height(world, local, target)),
            false => {
                let all = contact.all_bodies().into_iter();
                all.map(|body| shortest_side(world, local, body)).fold(contact.wall, f64::min)
            }
        };
        depth = 0.5 * thinner;
    }
    let mut total = vec![0.0_f64; own.len()];
    world.reduce_all(&own[..], &mut total[..], SystemOperation::sum());
    let mut largest = vec![0.0; most.len()];
    world.reduce_all(&most[..], &mut largest[..], SystemOperation::max());
    let names = [&contact.contactor, &contact.target_name];
    for (name, sums) in names.into_iter().zip(total.chunks(2)) {
        if sums[1] == 0.0 {
            let message = format!("contact '{}': the surface '{name}' has no facet", contact.name);
            return Err(Error::case(message));
        }
    }
    let facet = largest.iter().copied().fold(0.0, f64::max);
    let radii = SearchRadii { facet, depth };
    let length = |area: f64, count: f64| (area / count).powf(1.0 / (D as f64 - 1.0));
    let facet_size = length(total[0], total[1]);
    let mut softest = 0.0;
    world.reduce_all(&softer, &mut softest, SystemOperation::min());
    Ok(Measures { facet_size, softer: softest, radii })
}

/// Shortest side of the box around a body \[m\]. Collective.
fn shortest_side<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    body: usize,
) -> f64 {
    sides_of(world, local, body).into_iter().fold(f64::INFINITY, f64::min)
}

/// Height of the lowest element on one of these facets \[m\], over all ranks. Collective.
pub(super) fn height<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    facets: &[Facet],
) -> f64 {
    let height = |&facet: &Facet| {
        let outward: Vector<D> = facet_normals(local, facet).iter().sum();
        let mut nodes = Vec::new();
        local.mesh.facet_nodes(facet, &mut nodes);
        let place = |node: u32| Vector::<D>::from(local.mesh.points[node as usize]);
        let below = |&node: &u32| (place(nodes[0]) - place(node)).dot(&outward);
        let inner = local.mesh.element_nodes(facet.element as usize).iter();
        inner.map(below).fold(0.0, f64::max) / outward.norm()
    };
    let own = facets.iter().map(height).fold(f64::INFINITY, f64::min);
    let mut all = own;
    world.reduce_all(&own, &mut all, SystemOperation::min());
    all
}

/// Side lengths of the box around a body \[m\]. Collective.
pub fn sides_of<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    body: usize,
) -> [f64; D] {
    let mesh = &local.mesh;
    let elements = (0..mesh.element_count()).filter(|&element| usize::from(mesh.body[element]) == body);
    let nodes = elements.flat_map(|element| mesh.element_nodes(element));
    box_around(world, nodes.map(|&node| mesh.points[node as usize]))
}

/// Side lengths of the box around points of all ranks \[m\]. Collective.
fn box_around<const D: usize>(
    world: &impl CommunicatorCollectives,
    points: impl Iterator<Item = [f64; D]>,
) -> [f64; D] {
    let all = bounds_of(world, points);
    std::array::from_fn(|i| all[i] + all[i + 3])
}

/// Largest coordinates of points of all ranks \[m\], followed from the fourth entry on by the
/// largest of their negatives. Collective.
fn bounds_of<const D: usize>(
    world: &impl CommunicatorCollectives,
    points: impl Iterator<Item = [f64; D]>,
) -> [f64; 6] {
    let mut bounds = [f64::NEG_INFINITY; 6];
    for point in points {
        for i in 0..D {
            bounds[i] = bounds[i].max(point[i]);
            bounds[i + 3] = bounds[i + 3].max(-point[i]);
        }
    }
    let mut all = [0.0; 6];
    world.reduce_all(&bounds[..], &mut all[..], SystemOperation::max());
    all
}

/// Centre of the box around all bodies \[m\]. Collective.
pub(super) fn middle_of<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
) -> Vector<D> {
    let all = bounds_of(world, points_of_elements(local));
    Vector::from_fn(|i, _| 0.5 * (all[i] - all[i + 3]))
}

/// Largest coordinate of all ranks \[m\]. Its rounding is that of every position. Collective.
pub(super) fn farthest<const D: usize>(world: &impl CommunicatorCollectives, local: &LocalMesh<D>) -> f64 {
    let own = points_of_elements(local).flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut most = 0.0;
    world.reduce_all(&own, &mut most, SystemOperation::max());
    most
}

/// Undeformed area and number of the facets that this rank reports.
pub(super) fn size_of<const D: usize>(local: &LocalMesh<D>, facets: &[Facet]) -> [f64; 2] {
    let mine = facets.iter().filter(|facet| local.mine[facet.element as usize]);
    mine.fold([0.0; 2], |[area, count], &facet| [area + facet_area(local, facet), count + 1.0])
}

fn facet_area<const D: usize>(local: &LocalMesh<D>, facet: Facet) -> f64 {
    facet_normals(local, facet).iter().map(|normal| normal.norm()).sum()
}

/// Undeformed outward normals at the quadrature points of a facet, scaled by their parts of the
/// area \[m^(D - 1)\].
pub(super) fn facet_normals<const D: usize>(local: &LocalMesh<D>, facet: Facet) -> Vec<Vector<D>> {
    let kind = local.mesh.facet_kind(facet);
    let mut nodes = Vec::new();
    local.mesh.facet_nodes(facet, &mut nodes);
    let points: Vec<_> = nodes.iter().map(|&n| local.mesh.points[n as usize].into()).collect();
    let element = crate::space::reference(kind);
    let table = element.tabulate(element.full_rule());
    let width = table.nodes * (D - 1);
    let at = |q: usize| {
        let tangents = crate::space::facet_tangents::<D>(&points, &table.dn[q * width..(q + 1) * width]);
        crate::space::facet_normal(&tangents) * table.weights[q]
    };
    (0..table.points).map(at).collect()
}

/// Largest extent of a facet along an axis \[m\].
fn extent_of<const D: usize>(local: &LocalMesh<D>, facets: &[Facet]) -> f64 {
    let mut nodes = Vec::new();
    let mut extent = |&facet: &Facet| {
        local.mesh.facet_nodes(facet, &mut nodes);
        Bounds::of(nodes.iter().map(|&node| local.mesh.points[node as usize])).extent()
    };
    facets.iter().map(&mut extent).fold(0.0, f64::max)
}

/// Creates the loads. Collective.
///
/// # Errors
/// A set does not exist, or it cannot carry the load; the same on all ranks.
pub(super) fn loads<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    model: &Model<D>,
    pattern: &BlockPattern,
    held: &Held<D>,
) -> Result<External<D>> {
    let kinematics: Vec<Kinematics> = model.bodies.iter().map(model::Body::kinematics).collect();
    External::new(
        world,
        &model.loads,
        &external::LoadContext { local, pattern, held, kinematics: &kinematics },
    )
}

/// Finds pieces of bodies that lack a support in some direction, with the same result on all ranks.
/// Collective.
pub(super) fn free_bodies<const D: usize>(
    world: &impl CommunicatorCollectives,
    local: &LocalMesh<D>,
    pieces: &Pieces<D>,
    supports: &Supports<D>,
    elastic: &ElasticSupports<D>,
) -> Vec<UnsupportedBody> {
    let held = pieces.held(world, &local.mesh, supports, elastic);
    let free =
        |group: usize| (0..D).filter(|&i| !held[group][i]).map(|i| ["x", "y", "z"][i]).collect::<Vec<_>>();
    let loose = (0..held.len()).filter(|&group| !free(group).is_empty());
    let describe = |group: usize| UnsupportedBody {
        bodies: pieces.groups[group].iter().flat_map(|&piece| pieces.all[piece].bodies.clone()).collect(),
        group,
        words: format!("{} along {}", pieces.group_name(group), free(group).join(", ")),
    };
    loose.map(describe).collect()
}

/// Largest ratio of a typical stiffness to that of the softest side of a contact.
const SOFTER: f64 = 1e3;
/// Smallest ratio of a typical stiffness to the largest one. Smaller values are near rounding.
const ABOVE_ROUNDING: f64 = 1e-4;

/// A typical diagonal entry of the stiffness, `E h^(D - 2)` times the extent across the plane \[N/m\].
pub(super) fn unit<const D: usize>(model: &Model<D>, extent: f64, local: &LocalMesh<D>) -> f64 {
    let materials = model.bodies.iter().flat_map(|body| &body.materials);
    let stiffest = materials.map(|material| material.young_modulus).fold(0.0, f64::max);
    let softest = model.contacts.iter().map(|contact| contact.softer).fold(stiffest, f64::min);
    let size = extent / f64::from(local.index.total.max(1)).powf(1.0 / D as f64);
    let modulus = stiffest.min(SOFTER * softest).max(ABOVE_ROUNDING * stiffest);
    modulus * size.powi(D as i32 - 2) * local.mesh.plane.depth(0.5 * extent)
}

/// Longest side of the box around all bodies \[m\].
pub(super) fn extent<const D: usize>(world: &impl CommunicatorCollectives, local: &LocalMesh<D>) -> f64 {
    box_around(world, points_of_elements(local)).into_iter().fold(0.0, f64::max)
}

/// Positions of the nodes of all elements \[m\], once per element. Nodes of free rigid bodies are not
/// among them.
fn points_of_elements<const D: usize>(local: &LocalMesh<D>) -> impl Iterator<Item = [f64; D]> + '_ {
    local.mesh.nodes.iter().map(|&node| local.mesh.points[node as usize])
}
