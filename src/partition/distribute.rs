//! Distribution of the mesh from rank 0 to the ranks that own it.

use mpi::traits::CommunicatorCollectives;

use super::extract::Cut;
use super::message::Message;
use super::{LocalMesh, Plan, Report};
use crate::error::{Error, Result, agree};
use crate::mesh::Mesh;

/// Partitions `mesh`, which only rank 0 provides, and gives every rank its part. Collective.
///
/// It works on any number of ranks, including ranks without elements. The same mesh, plan and
/// number of ranks give the same parts. Rank 0 frees the whole mesh.
///
/// # Errors
/// A mesh cannot be numbered or partitioned, see [`partition`](super::partition). The error is
/// identical on every rank.
pub fn distribute<const D: usize>(
    world: &impl CommunicatorCollectives,
    mesh: Option<Mesh<D>>,
    plan: &Plan,
) -> Result<(LocalMesh<D>, Report)> {
    let cut = agree(world, cut(world, mesh, plan))?;
    let quality = cut.as_ref().map(|cut| cut.quality.clone()).unwrap_or_default();
    let local = agree(world, exchange(world, cut))?;
    let report = Report::gather(world, &local, &quality);
    Ok((local, report))
}

/// Partitions the mesh on rank 0; does nothing on other ranks.
fn cut<const D: usize>(
    world: &impl CommunicatorCollectives,
    mesh: Option<Mesh<D>>,
    plan: &Plan,
) -> Result<Option<Cut<D>>> {
    match (world.rank(), mesh) {
        (0, Some(mesh)) => Cut::new(mesh, plan, world.size() as usize).map(Some),
        (0, None) => Err(Error::internal("partition: rank 0 has no mesh")),
        _ => Ok(None),
    }
}

/// Rank 0 extracts one part at a time and sends it. Besides the whole mesh there is never more than
/// one part in memory.
fn exchange<const D: usize>(
    world: &impl CommunicatorCollectives,
    cut: Option<Cut<D>>,
) -> Result<LocalMesh<D>> {
    let Some(mut cut) = cut else {
        return Message::receive(world).unpack();
    };
    for rank in 1..world.size() {
        Message::pack(&cut.local(rank as u32)).send(world, rank);
    }
    Ok(cut.local(0))
}
