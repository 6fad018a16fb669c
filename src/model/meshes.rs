//! The meshes of a case: read from files or generated as boxes, deformed, and merged into one.

use std::collections::HashSet;

use super::body_sets::{define, forget, join_lists};
use super::conformity::{MeshOrigin, MeshParts, conform, require_sound_curves};
use super::lengths;
use super::overlap;
use super::places::unsound_places;
use super::regions::unsound_regions;
use super::sets::{missing_sets, repeated_facets, shared_facets, without_edges};
use crate::case::{self, Case, Merge};
use crate::error::{Error, Result};
use crate::mesh::{
    BoxShape, ElementKind, Facet, FacetIndex, Mesh, merge, read_file, require_room, spelled, validate,
};
use crate::rounding;

/// Reads or generates the meshes of all bodies and merges them; sets are named `body.set`. Call it
/// on one rank.
///
/// # Errors
/// A mesh cannot be read or is invalid. The error gives the file and the location.
pub fn read_mesh<const D: usize>(case: &Case) -> Result<Mesh<D>> {
    read_meshes(case).map(|(mesh, _)| mesh)
}

/// The mesh of [`read_mesh`], and remarks for the user. Call it on one rank.
///
/// # Errors
/// The errors of [`read_mesh`].
pub fn read_meshes<const D: usize>(case: &Case) -> Result<(Mesh<D>, Vec<String>)> {
    require_room(box_nodes(case))?;
    let plane = super::build::plane(case);
    let mut bodies = Vec::with_capacity(case.bodies.len());
    let mut faults = Vec::new();
    let mut remarks = Vec::new();
    for (name, body) in case.bodies.iter() {
        let mesh = match &body.mesh {
            case::Mesh::Box(shape) => box_body(case, &name.value, body, shape, &mut remarks),
            case::Mesh::File(file) => file_body(case, &name.value, body, file, &mut remarks),
        };
        let mesh = mesh.and_then(|mut mesh| {
            define(case, &name.value, &body.sets, &mut mesh)?;
            if plane.is_revolved() {
                place_axis(case, body, &mut mesh)?;
            }
            Ok(mesh)
        });
        match mesh {
            Ok(mesh) => bodies.push((name.value.clone(), mesh)),
            Err(fault) => faults.push(fault),
        }
    }
    Error::together(faults)?;
    let mut mesh = merge(bodies)?;
    mesh.plane = plane;
    let places = mesh.points.as_flattened_mut().iter_mut().enumerate();
    places.for_each(|(index, x)| *x = rounding::place(index, *x));
    if case.contact.values().any(case::Contact::is_general) {
        let mut surface = FacetIndex::new(&mesh).boundary();
        let tied = tied_facets(case, &mesh);
        surface.retain(|facet| !tied.contains(facet) && !is_on_axis(&mesh, *facet));
        mesh.facet_sets.insert(case::ALL.to_owned(), surface);
    }
    let mut faults = missing_sets(case, &mesh);
    join_lists(case, &mut mesh);
    faults.extend(without_edges(case, &mesh));
    faults.extend(shared_facets(case, &mesh));
    faults.extend(repeated_facets(case, &mesh));
    faults.extend(unsound_places(case, &mesh));
    faults.extend(unsound_regions(case, &mesh));
    Error::together(faults)?;
    remarks.extend(overlap::remarks(case, &mesh)?);
    Ok((mesh, remarks))
}

/// Whether a facet lies on the axis of revolution, where it has no area.
fn is_on_axis<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> bool {
    mesh.plane.is_revolved() && mesh.facet_corners(facet).all(|node| mesh.points[node as usize][0] == 0.0)
}

/// Distance from the axis of revolution, relative to the largest radius of the body, up to which a
/// node is on the axis. Mesh files have 7 to 16 digits. The next nodes of a mesh without a hole are
/// an element away, so the value matters only for a hole of this size, which is closed. Other
/// values were not tried.
const ON_AXIS: f64 = 1e-7;

/// Puts nodes of a body that are on the axis of revolution within rounding exactly on it.
///
/// # Errors
/// A node has a negative radius.
fn place_axis<const D: usize>(case: &Case, body: &case::Body, mesh: &mut Mesh<D>) -> Result<()> {
    let largest = mesh.points.iter().fold(0.0, |largest: f64, point| largest.max(point[0].abs()));
    for point in &mut mesh.points {
        if point[0].abs() <= ON_AXIS * largest {
            point[0] = 0.0;
        } else if point[0] < 0.0 {
            let place = match &body.mesh {
                case::Mesh::Box(shape) => shape.min.place,
                case::Mesh::File(file) => file.file.place,
            };
            let message = format!("the node at {} has a negative radius", spelled(point));
            let cure =
                "with `dimension: axisymmetric`, x is the radius and y the axis: move the mesh to x >= 0";
            return Err(case.error(place, message).hint(cure));
        }
    }
    Ok(())
}

/// The facets of all tied surfaces. They are not part of the surface of all bodies.
fn tied_facets<const D: usize>(case: &Case, mesh: &Mesh<D>) -> HashSet<Facet> {
    let sides = case.tied.values().flat_map(|tied| [&tied.contactor, &tied.target]);
    let sets = sides.flat_map(|side| side.names()).filter_map(|name| mesh.facet_sets.get(&name.value));
    sets.flatten().copied().collect()
}

/// The mesh of a box. Its cells conform, except if a map moves different positions onto each other.
fn box_body<const D: usize>(
    case: &Case,
    name: &str,
    body: &case::Body,
    shape: &case::BoxMesh,
    remarks: &mut Vec<String>,
) -> Result<Mesh<D>> {
    let m = &case.units.of("m");
    let mut mesh = box_mesh(case, name, shape)?;
    if shape.map.is_some() {
        let source = MeshOrigin::Box(name, m);
        require_sound_curves(&mesh, &source)?;
        let meets = meets(case, name);
        let parts = parts(shape.merge.as_ref());
        remarks.extend(with_sets(case, name, body, &meets, &mut mesh, |mesh| {
            conform(mesh, name, m, &source, parts, &meets)
        })?);
        mesh.drop_unused_points();
    }
    Ok(mesh)
}

/// The mesh of a file, or of a region of it.
fn file_body<const D: usize>(
    case: &Case,
    name: &str,
    body: &case::Body,
    file: &case::FileMesh,
    remarks: &mut Vec<String>,
) -> Result<Mesh<D>> {
    let m = &case.units.of("m");
    let region = file.region.as_ref().map(|region| region.value.as_str());
    let (mut mesh, source) = read_file(&case.resolve(&file.file.value), region, super::build::plane(case))?;
    remarks.extend_from_slice(source.remarks());
    let locking = body.locking.value;
    if let Some(kind) = mesh.kinds.iter().find(|kind| !super::build::locking(locking).offered(**kind)) {
        let message = format!("'{name}' has {kind} elements, which do not support {}", locking.name());
        return Err(case.error(file.file.place, message).hint(case::Locking::CURE));
    }
    let source = MeshOrigin::File(&source);
    require_sound_curves(&mesh, &source)?;
    let meets = meets(case, name);
    let parts = parts(file.merge.as_ref());
    remarks.extend(with_sets(case, name, body, &meets, &mut mesh, |mesh| {
        conform(mesh, name, m, &source, parts, &meets)
    })?);
    mesh.drop_unused_points();
    Ok(mesh)
}

/// Joins the parts of a body. A contact of the body with itself between sets of the case explains why parts touch that are
/// not joined, so these sets are defined for the time being; joining parts changes which facets are on the surface.
fn with_sets<const D: usize, R>(
    case: &Case,
    name: &str,
    body: &case::Body,
    meets: &[(String, String)],
    mesh: &mut Mesh<D>,
    join: impl FnOnce(&mut Mesh<D>) -> Result<R>,
) -> Result<R> {
    let of_case = |set: &String| body.sets.get(set).is_some();
    if !meets.iter().any(|(one, other)| of_case(one) || of_case(other)) {
        return join(mesh);
    }
    define(case, name, &body.sets, mesh)?;
    let joined = join(mesh);
    forget(&body.sets, mesh);
    joined
}

fn parts(merge: Option<&case::At<Merge>>) -> MeshParts {
    match merge.map(|merge| merge.value) {
        None => MeshParts::Joined,
        Some(Merge::Tolerance(tolerance)) => MeshParts::Merged(tolerance.value),
        Some(Merge::Never) => MeshParts::Apart,
    }
}

/// Pairs of sets of a body between which a contact or a tie acts. Contacts of a set with itself are omitted,
/// because a seam within one set cannot be distinguished from a contact.
fn meets(case: &Case, name: &str) -> Vec<(String, String)> {
    let own = |side: &case::SetNames| -> Vec<String> {
        let sets = side.names().iter().filter_map(|set| set.split_once('.'));
        sets.filter(|(body, _)| *body == name).map(|(_, set)| set.to_owned()).collect()
    };
    let mut pairs = Vec::new();
    for contact in case.contact.values().filter(|contact| contact.contactor.value != contact.target.value) {
        let targets = own(&contact.target);
        for contactor in own(&contact.contactor) {
            pairs.extend(targets.iter().map(|target| (contactor.clone(), target.clone())));
        }
    }
    for tied in case.tied.values() {
        let targets = own(&tied.target);
        for contactor in own(&tied.contactor) {
            pairs.extend(targets.iter().map(|target| (contactor.clone(), target.clone())));
        }
    }
    pairs
}

/// Minimum number of nodes of all boxes together.
fn box_nodes(case: &Case) -> f64 {
    let nodes = |body: &case::Body| match &body.mesh {
        case::Mesh::Box(shape) => shape.cells.iter().map(|&cells| f64::from(cells) + 1.0).product(),
        case::Mesh::File(_) => 0.0,
    };
    case.bodies.values().map(nodes).sum()
}

fn box_mesh<const D: usize>(case: &Case, name: &str, shape: &case::BoxMesh) -> Result<Mesh<D>> {
    let default = if D == 2 { ElementKind::Quad4 } else { ElementKind::Hex8 };
    let named = shape.element.as_ref().map(|element| ElementKind::from_name(element.name()));
    let kind = named.unwrap_or(Some(default)).ok_or_else(|| Error::internal("an element without a kind"))?;
    let mut mesh = BoxShape::<D> {
        min: lengths(&shape.min),
        max: lengths(&shape.max),
        cells: std::array::from_fn(|i| shape.cells.get(i).copied().unwrap_or(1)),
        element: kind,
    }
    .mesh()
    .map_err(|error| error.within(&format!("body '{name}'")))?;
    if let Some(map) = &shape.map {
        bend(&mut mesh, map, case)?;
    }
    Ok(mesh)
}

/// Moves the points of a box.
fn bend<const D: usize>(mesh: &mut Mesh<D>, map: &case::BoxMap, case: &Case) -> Result<()> {
    let m = case.units.of("m");
    for point in &mut mesh.points {
        let place: [f64; 3] = std::array::from_fn(|i| point.get(i).copied().unwrap_or(0.0));
        for (entry, function) in point.iter_mut().zip(map.functions()) {
            let Some(function) = function else { continue };
            let motion = function.motion(place, 0.0);
            case.function(function).require_sound(&motion, &place[..D], 0.0)?;
            *entry = motion.value;
        }
    }
    match validate::first_bad_element(mesh) {
        Some(bad) => {
            let at = map.functions().into_iter().flatten().next().map(|function| function.place);
            let place = spelled(&mesh.points[bad.node as usize]);
            let text = format!("the map of the box makes the element at {place} {m} flat or inverted");
            let error = case.error(at.unwrap_or_default(), text);
            Err(error.hint(
                "the map must keep neighbouring points neighbours, and the left side left of the right side",
            ))
        }
        None => Ok(()),
    }
}
