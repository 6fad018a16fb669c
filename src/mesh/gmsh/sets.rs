//! Physical groups as sets: the selected region, facets, points.

use std::collections::BTreeMap;

use super::input::GmshInput;
use super::raw::{Raw, RawElement};
use crate::error::{Error, Result};
use crate::mesh::{Facet, FacetIndex, Mesh};

/// The name of a group, or its number if it has no name.
pub(super) fn label(raw: &Raw, dimension: usize, tag: u32) -> String {
    let name = raw.names.get(&(dimension, tag)).filter(|name| !name.is_empty());
    name.cloned().unwrap_or_else(|| tag.to_string())
}

/// Which elements belong to the region; `None` without a region.
pub(super) fn keep<const D: usize>(
    mesh: &Mesh<D>,
    raw: &Raw,
    region: Option<&str>,
) -> Result<Option<Vec<bool>>> {
    let Some(region) = region else { return Ok(None) };
    if let Some(members) = mesh.element_sets.get(region) {
        let mut kept = vec![false; mesh.element_count()];
        members.iter().for_each(|&element| kept[element as usize] = true);
        return Ok(Some(kept));
    }
    let known: Vec<&str> = mesh.element_sets.keys().map(String::as_str).collect();
    let hint = if known.is_empty() {
        format!("the mesh has no physical groups of dimension {D}")
    } else {
        format!("known regions: {}", known.join(", "))
    };
    let namesake = raw.names.iter().find(|(_, name)| name.as_str() == region).map(|((d, _), _)| *d);
    let message = match namesake {
        Some(d) if d == D => format!("region '{region}' has no elements"),
        Some(d) => format!("'{region}' is a physical group of dimension {d}, but a region has dimension {D}"),
        None => format!("the mesh has no region '{region}'"),
    };
    Err(Error::file(message).hint(&hint))
}

/// Groups of dimension `D - 1` as sides of the retained elements.
pub(super) fn facets<const D: usize>(
    input: &GmshInput,
    raw: &Raw,
    mesh: &Mesh<D>,
    index: &FacetIndex,
    kept: Option<&[bool]>,
) -> Result<BTreeMap<String, Vec<Facet>>> {
    let mut sets: BTreeMap<String, Vec<Facet>> = BTreeMap::new();
    for element in raw.elements.iter().filter(|element| element.dimension() + 1 == D) {
        let groups = raw.groups_of(element);
        let Some(&first) = groups.first() else { continue };
        let set = label(raw, D - 1, first);
        let nodes = raw.resolve(input, element)?;
        let sides = matching_sides(mesh, index, element, &nodes)
            .map_err(|reason| raw.error(input, element, format!("of set '{set}' {reason}")).hint(MATCH))?;
        let ours: Vec<Facet> =
            sides.into_iter().filter(|f| kept.is_none_or(|k| k[f.element as usize])).collect();
        if ours.len() > 1 {
            let message = format!("of set '{set}' lies inside the mesh, between two elements");
            let cure = "a facet set must lie on the surface of its body; choose a `region`, or remove the \
                        group";
            return Err(raw.error(input, element, message).hint(cure));
        }
        for &tag in groups {
            sets.entry(label(raw, D - 1, tag)).or_default().extend(&ours);
        }
    }
    for facets in sets.values_mut() {
        facets.sort_unstable();
        facets.dedup();
    }
    Ok(sets)
}

const MATCH: &str = "mesh all dimensions together, and save them in one file with elements of one order";

/// The element sides that match a facet of the file, or the reason why no side matches.
fn matching_sides<const D: usize>(
    mesh: &Mesh<D>,
    index: &FacetIndex,
    element: &RawElement,
    nodes: &[u32],
) -> std::result::Result<Vec<Facet>, String> {
    let corners = element.kind.map_or(1, |kind| kind.corners());
    let sides: Vec<Facet> = index.find(nodes[..corners].iter().copied()).collect();
    let Some(&first) = sides.first() else { return Err("is not a side of any element".to_owned()) };
    let mut expected = Vec::new();
    mesh.facet_nodes(first, &mut expected);
    expected.sort_unstable();
    let mut found = nodes.to_vec();
    found.sort_unstable();
    if expected != found {
        let side = mesh.facet_kind(first);
        let kind = mesh.kinds[first.element as usize];
        return Err(format!("has other nodes than the {side} side of the {kind} element that it bounds"));
    }
    Ok(sides)
}

/// Groups of lower dimensions as nodes. If a region is selected, nodes without elements are
/// omitted.
pub(super) fn points<const D: usize>(
    input: &GmshInput,
    raw: &Raw,
    mesh: &Mesh<D>,
    region_chosen: bool,
) -> Result<BTreeMap<String, Vec<u32>>> {
    let mut used = vec![false; raw.points.len()];
    mesh.nodes.iter().for_each(|&node| used[node as usize] = true);
    let mut sets: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for element in raw.elements.iter().filter(|element| element.dimension() + 1 < D) {
        let groups = raw.groups_of(element);
        let Some(&first) = groups.first() else { continue };
        let nodes = raw.resolve(input, element)?;
        if let Some(&alone) = nodes.iter().find(|&&node| !used[node as usize] && !region_chosen) {
            let set = label(raw, element.dimension(), first);
            let id = raw.node_ids()[alone as usize];
            let message =
                format!("of set '{set}' uses node {id}, which belongs to no element of dimension {D}");
            return Err(raw
                .error(input, element, message)
                .hint("a point of a set must be a node of the body"));
        }
        for &tag in groups {
            sets.entry(label(raw, element.dimension(), tag)).or_default().extend(&nodes);
        }
    }
    for nodes in sets.values_mut() {
        nodes.sort_unstable();
        nodes.dedup();
    }
    Ok(sets)
}

/// Removes sets without members in the region, which belong to other bodies.
pub(super) fn drop_empty<const D: usize>(mesh: &mut Mesh<D>) {
    mesh.facet_sets.retain(|_, facets| !facets.is_empty());
    mesh.point_sets.retain(|_, points| !points.is_empty());
    mesh.element_sets.retain(|_, elements| !elements.is_empty());
}

/// Checks that names of sets are unambiguous.
pub(super) fn check_names<const D: usize>(mesh: &Mesh<D>) -> Result<()> {
    let sets = mesh.sets();
    let Some(twice) = sets.windows(2).find(|pair| pair[0].0 == pair[1].0) else { return Ok(()) };
    let message = format!("physical groups of different dimensions are both called '{}'", twice[0].0);
    Err(Error::file(message).hint("give each physical group a unique name"))
}
