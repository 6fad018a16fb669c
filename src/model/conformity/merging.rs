//! `merge: { tolerance: ... }`: merges coincident nodes of a body, except between the sets of a
//! contact.

use std::collections::{HashMap, HashSet};

use crate::error::Result;
use crate::mesh::{Bounds, BoundsTree, DisjointSets, FacetIndex, Mesh};

use super::seams::{Seams, nodes_of};
use super::{MeshOrigin, distance};

/// Result of a merge.
pub(super) struct Merged {
    /// Number of nodes that were replaced by another one.
    pub(super) joined: usize,
    /// Number of node pairs within the tolerance that a contact keeps separate.
    pub(super) apart: usize,
}

/// Merges nodes that are closer than `tolerance`, which is in `m`. Replaced nodes belong to no
/// element afterwards.
pub(super) fn merge_nodes<const D: usize>(
    mesh: &mut Mesh<D>,
    tolerance: f64,
    m: &str,
    source: &MeshOrigin,
    seams: &Seams,
) -> Result<Merged> {
    let pairs = close_pairs(mesh, tolerance);
    let mut sets = DisjointSets::new(mesh.points.len());
    let merged = if seams.is_empty() {
        let joined = pairs.iter().filter(|[one, other]| sets.join(*one, *other)).count();
        Merged { joined, apart: 0 }
    } else {
        join_except_in_contact(mesh, &pairs, seams, &mut sets)
    };
    if merged.joined == 0 {
        return Ok(merged);
    }
    for element in 0..mesh.element_count() {
        let mut own: Vec<u32> = mesh.element_nodes(element).iter().map(|&node| sets.find(node)).collect();
        let count = own.len();
        own.sort_unstable();
        own.dedup();
        if own.len() < count {
            let message = format!("has two nodes within merge.tolerance, {tolerance:.1e} {m}");
            let cure = "use a tolerance well below the shortest side of an element";
            return Err(source.at_element(mesh, element, &message).hint(cure));
        }
    }
    mesh.nodes.iter_mut().for_each(|node| *node = sets.find(*node));
    for members in mesh.point_sets.values_mut() {
        members.iter_mut().for_each(|node| *node = sets.find(*node));
        members.sort_unstable();
        members.dedup();
    }
    Ok(merged)
}

/// Pairs of nodes of the surface within `tolerance` of each other, each pair once.
fn close_pairs<const D: usize>(mesh: &Mesh<D>, tolerance: f64) -> Vec<[u32; 2]> {
    let mut surface: Vec<u32> =
        FacetIndex::new(mesh).boundary().into_iter().flat_map(|facet| nodes_of(mesh, facet)).collect();
    surface.sort_unstable();
    surface.dedup();
    let at = |node: u32| mesh.points[node as usize];
    let boxes: Vec<Bounds<D>> = surface.iter().map(|&node| Bounds::of([at(node)])).collect();
    let tree = BoundsTree::new(&boxes);
    let mut pairs = Vec::new();
    for (&node, around) in surface.iter().zip(&boxes) {
        for other in tree.meeting(&around.inflate(tolerance)) {
            let other = surface[other as usize];
            if node < other && distance(&at(node), &at(other)) <= tolerance {
                pairs.push([node, other]);
            }
        }
    }
    pairs.sort_unstable();
    pairs
}

/// Joins the pairs, but never a node of one set of a contact with a node of the other, neither
/// directly nor through a third node.
fn join_except_in_contact<const D: usize>(
    mesh: &Mesh<D>,
    pairs: &[[u32; 2]],
    seams: &Seams,
    sets: &mut DisjointSets,
) -> Merged {
    let glued = glued_nodes(mesh, pairs, seams);
    // Nodes of contacts in each set of joined nodes, by the lowest member of the set.
    let mut in_contact: HashMap<u32, Vec<u32>> = HashMap::new();
    for &node in pairs.as_flattened() {
        if !glued.contains(&node) && seams.contain(node) {
            in_contact.insert(node, vec![node]);
        }
    }
    let mut merged = Merged { joined: 0, apart: 0 };
    for &[one, other] in pairs {
        let roots = [sets.find(one), sets.find(other)];
        if roots[0] == roots[1] {
            continue;
        }
        let [these, those] = roots.map(|root| in_contact.get(&root).map_or(&[][..], Vec::as_slice));
        if these.iter().any(|&a| those.iter().any(|&b| seams.part(a, b))) {
            merged.apart += 1;
            continue;
        }
        let both = [these, those].concat();
        sets.join(one, other);
        in_contact.insert(sets.find(one), both);
        merged.joined += 1;
    }
    merged
}

/// Nodes of coincident sides between which no contact acts.
///
/// If a contact ends inside a body, at the tip of a crack, its last nodes are also of this kind:
/// the sides beyond must be joined.
fn glued_nodes<const D: usize>(mesh: &Mesh<D>, pairs: &[[u32; 2]], seams: &Seams) -> HashSet<u32> {
    let mut all = DisjointSets::new(mesh.points.len());
    for &[one, other] in pairs {
        all.join(one, other);
    }
    let mut merged = mesh.clone();
    merged.nodes.iter_mut().for_each(|node| *node = all.find(*node));
    let sides = FacetIndex::new(&merged);
    let own = FacetIndex::new(mesh);
    let were_apart = sides.inner().filter(|[one, _]| own.find(mesh.facet_corners(*one)).count() == 1);
    let nodes = were_apart.map(|pair| pair.map(|facet| nodes_of(mesh, facet)));
    nodes.filter(|[one, other]| !seams.separate(one, other)).flatten().flatten().collect()
}

/// Requires that no side has three elements after the merge.
pub(super) fn require_two_sides<const D: usize>(
    mesh: &Mesh<D>,
    index: &FacetIndex,
    source: &MeshOrigin,
) -> Result<()> {
    let Some(crowd) = index.overcrowded().next() else { return Ok(()) };
    let others: Vec<String> = crowd[1..].iter().map(|side| source.element(mesh, side.element)).collect();
    let message =
        format!("shares one side with two or more others once nodes are merged: {}", others.join(", "));
    Err(source
        .at_element(mesh, crowd[0].element as usize, &message)
        .hint("elements overlap there: remove one of them, or use a smaller merge.tolerance"))
}

/// Removes sides from their sets that are in the interior of the body after the merge.
pub(super) fn drop_inner_facets<const D: usize>(
    mesh: &mut Mesh<D>,
    index: &FacetIndex,
    name: &str,
) -> Vec<String> {
    let mut remarks = Vec::new();
    let mut sets = std::mem::take(&mut mesh.facet_sets);
    for (set, facets) in &mut sets {
        let before = facets.len();
        facets.retain(|&facet| index.find(mesh.facet_corners(facet)).count() == 1);
        let inner = before - facets.len();
        if inner > 0 {
            remarks.push(format!(
                "merge: {inner} of the {before} sides in the set '{name}.{set}' are inside the merged body and were removed \
                 from the set"
            ));
        }
    }
    sets.retain(|_, facets| !facets.is_empty());
    mesh.facet_sets = sets;
    remarks
}
