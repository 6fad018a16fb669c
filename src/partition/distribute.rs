//! Distribution of the mesh from rank 0 to the ranks that own it.

use mpi::traits::{AsRaw, CommunicatorCollectives, Root};
use petsc_sys::MPI_Comm;

use super::extract::{Cut, require_numbers};
use super::graph::Graph;
use super::message::Message;
use super::{LocalMesh, Plan, Quality, Report, metis, ptscotch};
use crate::case::Partitioner;
use crate::error::{Error, Result, agree};
use crate::mesh::Mesh;

/// Partitions `mesh`, which only rank 0 provides, and gives every rank its part. Collective.
///
/// It works on any number of ranks, including ranks without elements. The same mesh, plan and
/// number of ranks give the same parts. Rank 0 frees the whole mesh.
///
/// # Errors
/// A mesh cannot be numbered or partitioned, or PETSc lacks the partitioner of the plan. The error is
/// identical on every rank.
pub fn distribute<const D: usize>(
    world: &(impl CommunicatorCollectives + AsRaw<Raw = MPI_Comm>),
    mesh: Option<Mesh<D>>,
    plan: &Plan,
) -> Result<(LocalMesh<D>, Report)> {
    let graph = agree(world, graph(world, mesh.as_ref(), plan))?;
    let part = partition(world, graph.as_ref(), plan.partitioner)?;
    let cut = agree(world, cut(world.size() as usize, mesh, graph, part, plan))?;
    let quality = cut.as_ref().map(|cut| cut.quality.clone()).unwrap_or_default();
    let local = agree(world, exchange(world, cut))?;
    let report = Report::gather(world, &local, &quality);
    Ok((local, report))
}

/// The graph of the mesh on rank 0; nothing on other ranks.
fn graph<const D: usize>(
    world: &impl CommunicatorCollectives,
    mesh: Option<&Mesh<D>>,
    plan: &Plan,
) -> Result<Option<Graph>> {
    match (world.rank(), mesh) {
        (0, Some(mesh)) => {
            require_numbers(mesh)?;
            Graph::dual(mesh, &plan.weights).map(Some)
        }
        (0, None) => Err(Error::internal("partition: rank 0 has no mesh")),
        _ => Ok(None),
    }
}

/// The part of each element on rank 0, which has the graph. Collective.
fn partition(
    world: &(impl CommunicatorCollectives + AsRaw<Raw = MPI_Comm>),
    graph: Option<&Graph>,
    partitioner: Partitioner,
) -> Result<Option<Vec<u32>>> {
    let parts = world.size() as usize;
    if partitioner == Partitioner::Metis {
        return agree(world, graph.map(|graph| metis::partition(graph, parts)).transpose());
    }
    let known = graph.and_then(|graph| graph.parts_without_library(parts));
    let mut decided = known.is_some();
    world.process_at_rank(0).broadcast_into(&mut decided);
    if decided { Ok(known) } else { ptscotch::partition(world, graph) }
}

/// The mesh with its parts on rank 0, which has them; nothing on other ranks.
fn cut<const D: usize>(
    parts: usize,
    mesh: Option<Mesh<D>>,
    graph: Option<Graph>,
    part: Option<Vec<u32>>,
    plan: &Plan,
) -> Result<Option<Cut<D>>> {
    let (Some(mesh), Some(graph), Some(part)) = (mesh, graph, part) else { return Ok(None) };
    let quality = Quality::new(&graph, &plan.weights, &part, parts);
    drop(graph);
    Cut::new(mesh, plan, part, quality).map(Some)
}

/// Rank 0 extracts one part at a time and sends it. Besides the whole mesh there is never more than
/// one part in memory.
fn exchange<const D: usize>(
    world: &impl CommunicatorCollectives,
    cut: Option<Cut<D>>,
) -> Result<LocalMesh<D>> {
    let Some(mut cut) = cut else {
        return Message::receive(world, 0).unpack();
    };
    for rank in 1..world.size() {
        Message::pack(&cut.local(rank as u32)).send(world, rank);
    }
    Ok(cut.local(0))
}
