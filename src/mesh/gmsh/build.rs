//! Conversion of the file content to a checked mesh: elements, selected region, points.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

use super::input::GmshInput;
use super::raw::Raw;
use super::sets;
use crate::error::{Error, Result};
use crate::mesh::compact::GONE;
use crate::mesh::source::{Label, Labels};
use crate::mesh::spelling::coordinates;
use crate::mesh::{FacetIndex, Mesh, validate};

/// Tolerance of the distance from the plane z = 0 in a plane mesh, relative to the size of the
/// mesh.
const PLANE: f64 = 1e-8;

/// The elements of the mesh's dimension, with their indices in the file.
pub(super) struct Solids<const D: usize> {
    pub mesh: Mesh<D>,
    pub origin: Vec<usize>,
}

/// The checked mesh in `D` dimensions, and the locations of its nodes and elements in the file.
pub(super) fn mesh<const D: usize>(
    input: &GmshInput,
    raw: &Raw,
    region: Option<&str>,
) -> Result<(Mesh<D>, Labels)> {
    check_dimension::<D>(input, raw)?;
    let mut solids = solids::<D>(input, raw)?;
    let kept = sets::keep(&solids.mesh, raw, region)?;
    if region.is_none() {
        check_dangling(input, raw)?;
    }
    let index = FacetIndex::new(&solids.mesh);
    check_sides(input, raw, &solids, &index, kept.as_deref())?;
    solids.mesh.facet_sets = sets::facets(input, raw, &solids.mesh, &index, kept.as_deref())?;
    solids.mesh.point_sets = sets::points(input, raw, &solids.mesh, region.is_some())?;
    if let Some(kept) = kept {
        restrict(&mut solids, &kept);
    }
    check_plane(input, raw, &solids.mesh)?;
    check_shape(input, raw, &solids)?;
    let number = solids.mesh.drop_unused_points();
    sets::drop_empty(&mut solids.mesh);
    sets::check_names(&solids.mesh)?;
    let kept = number.iter().enumerate().filter(|(_, new)| **new != GONE);
    let nodes = kept.map(|(old, _)| Label { id: raw.node_ids()[old], place: raw.node_places[old] });
    let elements = solids.origin.iter().map(|&old| &raw.elements[old]);
    let elements = elements.map(|element| Label { id: element.id, place: element.place });
    let labels = Labels { nodes: nodes.collect(), elements: elements.collect() };
    Ok((solids.mesh, labels))
}

fn check_dimension<const D: usize>(input: &GmshInput, raw: &Raw) -> Result<()> {
    let highest = raw.elements.iter().max_by_key(|element| element.dimension());
    match highest {
        Some(element) if element.dimension() == D => Ok(()),
        Some(element) if element.dimension() > D => {
            let message = format!("has dimension {}, but the case has dimension {D}", element.dimension());
            Err(raw
                .error(input, element, message)
                .hint("set `dimension: 3` in the case, or give a plane mesh"))
        }
        _ => {
            let message = format!("the mesh has no elements of dimension {D}");
            let cure = format!(
                "mesh the geometry with `gmsh -{D}`, and assign all entities to be saved to physical groups"
            );
            Err(Error::file(message).hint(&cure))
        }
    }
}

/// All elements of dimension `D` with their regions. MSH 2.2 repeats an element for each of its
/// groups.
fn solids<const D: usize>(input: &GmshInput, raw: &Raw) -> Result<Solids<D>> {
    let mut mesh = Mesh::with_points(raw.points.iter().map(|x| std::array::from_fn(|k| x[k])).collect());
    let mut origin: Vec<usize> = Vec::new();
    let mut known: HashMap<[u32; 8], u32> = HashMap::with_capacity(raw.elements.len());
    let mut regions: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (index, element) in raw.elements.iter().enumerate() {
        let Some(kind) = element.kind.filter(|kind| kind.dimension() == D) else { continue };
        let nodes = raw.resolve(input, element)?;
        let mut corners = [u32::MAX; 8];
        corners[..kind.corners()].copy_from_slice(&nodes[..kind.corners()]);
        corners.sort_unstable();
        let ordered = kind.gmsh_order().iter().map(|&local| nodes[local as usize]);
        let number = match known.entry(corners) {
            Entry::Vacant(place) => {
                origin.push(index);
                *place.insert(mesh.push(kind, ordered))
            }
            Entry::Occupied(place) => {
                let first = *place.get() as usize;
                let before = &raw.elements[origin[first]];
                let repeats =
                    mesh.kinds[first] == kind && ordered.eq(mesh.element_nodes(first).iter().copied());
                if !repeats || raw.groups_of(before) == raw.groups_of(element) {
                    let message = format!("has the same corners as element {}", before.id);
                    return Err(raw
                        .error(input, element, message)
                        .hint("remove one of the two and mesh again"));
                }
                *place.get()
            }
        };
        for &tag in raw.groups_of(element) {
            regions.entry(tag).or_default().push(number);
        }
    }
    for (tag, members) in regions {
        mesh.element_sets.entry(sets::label(raw, D, tag)).or_default().extend(members);
    }
    for members in mesh.element_sets.values_mut() {
        members.sort_unstable();
        members.dedup();
    }
    Ok(Solids { mesh, origin })
}

fn check_dangling(input: &GmshInput, raw: &Raw) -> Result<()> {
    let mut used = vec![false; raw.points.len()];
    for id in &raw.element_nodes {
        if let Some(node) = raw.node(*id) {
            used[node as usize] = true;
        }
    }
    let Some(node) = used.iter().position(|used| !used) else { return Ok(()) };
    let message =
        format!("node {} at {} belongs to no element", raw.node_ids()[node], coordinates(&raw.points[node]));
    Err(input.error_at(raw.node_places[node], message).hint(
        "assign its elements to a physical group, or remove it from the geometry; with `region` such nodes \
         are ignored",
    ))
}

/// Keeps the elements of one region and their parts of the sets.
fn restrict<const D: usize>(solids: &mut Solids<D>, kept: &[bool]) {
    let old = std::mem::take(&mut solids.mesh);
    let mut mesh = Mesh { points: old.points.clone(), ..Mesh::default() };
    let mut origin = Vec::new();
    let mut number = vec![0; kept.len()];
    for element in (0..kept.len()).filter(|&element| kept[element]) {
        number[element] = mesh.push(old.kinds[element], old.element_nodes(element).iter().copied());
        origin.push(solids.origin[element]);
    }
    mesh.facet_sets = old.facet_sets;
    mesh.point_sets = old.point_sets;
    mesh.element_sets = old.element_sets;
    for facets in mesh.facet_sets.values_mut() {
        facets.iter_mut().for_each(|facet| facet.element = number[facet.element as usize]);
    }
    for members in mesh.element_sets.values_mut() {
        members.retain(|&element| kept[element as usize]);
        members.iter_mut().for_each(|element| *element = number[*element as usize]);
    }
    *solids = Solids { mesh, origin };
}

fn check_plane<const D: usize>(input: &GmshInput, raw: &Raw, mesh: &Mesh<D>) -> Result<()> {
    if D == 3 {
        return Ok(());
    }
    let used = || mesh.nodes.iter().map(|&node| node as usize);
    let size = used().flat_map(|node| raw.points[node]).fold(0.0, |size: f64, x| size.max(x.abs()));
    let Some(node) = used().find(|&node| raw.points[node][2].abs() > PLANE * size) else { return Ok(()) };
    let id = raw.node_ids()[node];
    let place = coordinates(&raw.points[node]);
    let message = format!("node {id} at {place} is out of the plane: |z| > {:e}", PLANE * size);
    Err(input
        .error_at(raw.node_places[node], message)
        .hint("a case of dimension 2 needs a mesh in the plane z = 0"))
}

/// Checks that no element is inverted or flat and that no side has three elements.
fn check_shape<const D: usize>(input: &GmshInput, raw: &Raw, solids: &Solids<D>) -> Result<()> {
    let mesh = &solids.mesh;
    if let Some(bad) = validate::first_bad_element(mesh) {
        let id = raw.node_ids()[bad.node as usize];
        let place = coordinates(&mesh.points[bad.node as usize]);
        let centre = coordinates(&mesh.element_centre(bad.element));
        let (reason, cure) = if bad.reversed {
            let cure = if D == 2 {
                "its nodes are in clockwise order; in Gmsh reverse the surface: `ReverseMesh Surface {1};`"
            } else {
                "its nodes are in reversed order; reverse the volume in the mesh generator"
            };
            (format!("at {centre} is inverted at every corner"), cure)
        } else {
            let kind = if bad.sine < -validate::FLAT { "inverted" } else { "flat" };
            let reason = format!("at {centre} is {kind} at its node {id} at {place} (sine {:.1e})", bad.sine);
            (reason, "mesh again, with smaller or more regular elements there")
        };
        return Err(raw.error(input, &raw.elements[solids.origin[bad.element]], reason).hint(cure));
    }
    Ok(())
}

/// Checks that no side has three of the retained elements.
fn check_sides<const D: usize>(
    input: &GmshInput,
    raw: &Raw,
    solids: &Solids<D>,
    index: &FacetIndex,
    kept: Option<&[bool]>,
) -> Result<()> {
    for mut crowd in index.overcrowded() {
        crowd.retain(|facet| kept.is_none_or(|kept| kept[facet.element as usize]));
        let elements = crowd.iter().map(|facet| &raw.elements[solids.origin[facet.element as usize]]);
        if crowd.len() > 2
            && let Some(last) = elements.clone().next_back()
        {
            let ids: Vec<String> = elements.map(|element| element.id.to_string()).collect();
            let message = format!("shares one side with two or more others: {}", ids.join(", "));
            let cure = "assign bodies that overlap or share a face to different regions";
            return Err(raw.error(input, last, message).hint(cure));
        }
    }
    Ok(())
}
