//! Sparsity pattern of the system: coupled nodes, by row of the rank's own nodes.

use crate::mesh::Mesh;
use crate::partition::LocalMesh;
use crate::petsc::BlockPattern;

/// All pairs of nodes that share an assembled element, a patch or a tie, for the rows that this rank owns.
pub fn pattern_of_elements<const D: usize>(local: &LocalMesh<D>) -> BlockPattern {
    let LocalMesh { mesh, index, assembled, .. } = local;
    let touching = elements_at_nodes(mesh, *assembled, index.owned);
    let tied = at_nodes(mesh.ties.iter().map(|tie| tie.nodes.as_slice()), index.owned);
    let mut of_node = tied.as_slice();
    let shared = at_nodes(mesh.patches.iter().map(|patch| patch.nodes.as_slice()), index.owned);
    let mut patches_of_node = shared.as_slice();
    let mut row_offsets = Vec::with_capacity(index.owned + 1);
    let mut columns = Vec::new();
    let mut row: Vec<i32> = Vec::new();
    row_offsets.push(0);
    for node in 0..index.owned {
        row.clear();
        row.push(index.global(node as u32));
        for &element in
            &touching.elements[touching.offsets[node] as usize..touching.offsets[node + 1] as usize]
        {
            row.extend(mesh.element_nodes(element as usize).iter().map(|&other| index.global(other)));
        }
        let ties = of_node.partition_point(|(at, _)| *at as usize <= node);
        for &(_, tie) in &of_node[..ties] {
            row.extend(mesh.ties[tie as usize].nodes.iter().map(|&other| index.global(other)));
        }
        of_node = &of_node[ties..];
        let patches = patches_of_node.partition_point(|(at, _)| *at as usize <= node);
        for &(_, patch) in &patches_of_node[..patches] {
            row.extend(mesh.patches[patch as usize].nodes.iter().map(|&other| index.global(other)));
        }
        patches_of_node = &patches_of_node[patches..];
        row.sort_unstable();
        row.dedup();
        columns.extend_from_slice(&row);
        row_offsets.push(columns.len() as u32);
    }
    let places = local.input_node[..index.owned].to_vec();
    BlockPattern { block_size: D, first_row: index.first, row_offsets, columns, places }
}

/// Owned nodes with the numbers of the lists that have them, ascending, each pair once.
fn at_nodes<'a>(lists: impl Iterator<Item = &'a [u32]>, owned: usize) -> Vec<(u32, u32)> {
    let owned = |node: &u32| (*node as usize) < owned;
    let pairs = (0..).zip(lists).flat_map(|(number, nodes)| nodes.iter().map(move |&node| (node, number)));
    let mut pairs: Vec<(u32, u32)> = pairs.filter(|(node, _)| owned(node)).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// The elements that use each owned node, in compressed form.
struct Touching {
    offsets: Vec<u32>,
    elements: Vec<u32>,
}

/// Finds the elements at nodes by counting sort.
fn elements_at_nodes<const D: usize>(mesh: &Mesh<D>, assembled: usize, owned: usize) -> Touching {
    let nodes_of = |element: u32| {
        mesh.element_nodes(element as usize).iter().map(|&n| n as usize).filter(move |&n| n < owned)
    };
    let mut offsets = vec![0u32; owned + 1];
    for element in 0..assembled as u32 {
        nodes_of(element).for_each(|node| offsets[node + 1] += 1);
    }
    for node in 0..owned {
        offsets[node + 1] += offsets[node];
    }
    let mut next = offsets.clone();
    let mut elements = vec![0u32; offsets[owned] as usize];
    for element in 0..assembled as u32 {
        for node in nodes_of(element) {
            elements[next[node] as usize] = element;
            next[node] += 1;
        }
    }
    Touching { offsets, elements }
}
