//! PT-Scotch: all ranks assign the elements to parts together.

use std::ffi::CStr;

use mpi::traits::{AsRaw, CommunicatorCollectives};
use petsc_sys::MPI_Comm;

use super::graph::Graph;
use super::message::Message;
use crate::error::{Error, Result, agree};
use crate::petsc::{GraphRows, partition_graph};

/// PETSc's name of PT-Scotch.
const PTSCOTCH: &CStr = c"ptscotch";

/// The part of each vertex of `graph`, with as many parts as ranks. Only rank 0 provides the graph
/// and receives the parts. Each rank holds an equal number of rows of it. Collective.
///
/// One load is balanced, the first of the graph: elements, but not facets in contact.
///
/// # Errors
/// PETSc lacks PT-Scotch, or a library fails. The error is identical on every rank.
pub(super) fn partition(
    world: &(impl CommunicatorCollectives + AsRaw<Raw = MPI_Comm>),
    graph: Option<&Graph>,
) -> Result<Option<Vec<u32>>> {
    let rows = agree(world, deal(world, graph))?;
    let own = agree(world, partition_graph(world, &rows, world.size(), PTSCOTCH))?;
    agree(world, collect(world, own))
}

/// Sends every rank its rows of the graph that rank 0 has.
fn deal(world: &impl CommunicatorCollectives, graph: Option<&Graph>) -> Result<GraphRows> {
    let Some(graph) = graph else {
        let [total, offsets, neighbours, edge_weights, loads] =
            Message::receive(world, 0).into_lists().ok_or_else(damaged)?;
        let total = *total.first().ok_or_else(damaged)?;
        return Ok(GraphRows { total, offsets, neighbours, edge_weights, loads });
    };
    for rank in 1..world.size() {
        let rows = rows_of(graph, rank as usize, world.size() as usize);
        let lists = [&[rows.total][..], &rows.offsets, &rows.neighbours, &rows.edge_weights, &rows.loads];
        Message::of_lists(&lists).send(world, rank);
    }
    Ok(rows_of(graph, 0, world.size() as usize))
}

/// The rows of one of `ranks` ranks.
fn rows_of(graph: &Graph, rank: usize, ranks: usize) -> GraphRows {
    let first = |rank: usize| graph.vertices() * rank / ranks;
    let rows = first(rank)..first(rank + 1);
    let begin = graph.offsets[rows.start];
    let entries = begin as usize..graph.offsets[rows.end] as usize;
    let loads = match &graph.vertex_weights {
        Some(weights) => rows.clone().map(|row| weights.loads[row * weights.constraints]).collect(),
        None => vec![1; rows.len()],
    };
    GraphRows {
        total: graph.vertices() as i32,
        offsets: graph.offsets[rows.start..=rows.end].iter().map(|offset| offset - begin).collect(),
        neighbours: graph.neighbours[entries.clone()].to_vec(),
        edge_weights: graph.edge_weights[entries].to_vec(),
        loads,
    }
}

/// The parts of all rows on rank 0, from the parts of each rank's rows.
fn collect(world: &impl CommunicatorCollectives, own: Vec<i32>) -> Result<Option<Vec<u32>>> {
    if world.rank() > 0 {
        Message::of_lists(&[&own]).send(world, 0);
        return Ok(None);
    }
    let mut all = own;
    for rank in 1..world.size() {
        let [parts] = Message::receive(world, rank).into_lists().ok_or_else(damaged)?;
        all.extend(parts);
    }
    Ok(Some(all.into_iter().map(|part| part as u32).collect()))
}

fn damaged() -> Error {
    Error::internal("partition: a message with a part of the graph is damaged")
}
