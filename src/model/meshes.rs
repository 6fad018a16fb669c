//! The meshes of a case: read from files or made as boxes, bent, and merged to one.

use super::lengths;
use crate::case::{self, Case};
use crate::error::{Error, Result};
use crate::mesh::{BoxShape, ElementKind, Mesh, gmsh, merge, require_room, validate};

/// Reads or generates the meshes of all bodies and merges them; sets are named `body.set`. For one rank.
///
/// # Errors
/// When a mesh can not be read or is no good, with file and place.
pub fn read_mesh<const D: usize>(case: &Case) -> Result<Mesh<D>> {
    require_room(box_nodes(case))?;
    let mut bodies = Vec::with_capacity(case.bodies.len());
    for (name, body) in case.bodies.iter() {
        let mesh = match &body.mesh {
            case::Mesh::Box(shape) => {
                box_mesh(shape).map_err(|e| e.within(&format!("body '{}'", name.value)))?
            }
            case::Mesh::File(file) => {
                let region = file.region.as_ref().map(|region| region.value.as_str());
                gmsh::read(&case.resolve(&file.file.value), region)?
            }
        };
        bodies.push((name.value.clone(), mesh));
    }
    merge(bodies)
}

/// Nodes that all boxes have at least.
fn box_nodes(case: &Case) -> f64 {
    let nodes = |body: &case::Body| match &body.mesh {
        case::Mesh::Box(shape) => shape.cells.iter().map(|&cells| f64::from(cells) + 1.0).product(),
        case::Mesh::File(_) => 0.0,
    };
    case.bodies.values().map(nodes).sum()
}

fn box_mesh<const D: usize>(shape: &case::BoxMesh) -> Result<Mesh<D>> {
    let default = if D == 2 { ElementKind::Quad4 } else { ElementKind::Hex8 };
    let named = shape.element.as_ref().map(|element| ElementKind::from_name(element.name()));
    let kind = named.unwrap_or(Some(default)).ok_or_else(|| Error::internal("an element without a kind"))?;
    let mut mesh = BoxShape::<D> {
        min: lengths(&shape.min),
        max: lengths(&shape.max),
        cells: std::array::from_fn(|i| shape.cells.get(i).copied().unwrap_or(1)),
        element: kind,
    }
    .mesh()?;
    if let Some(map) = &shape.map {
        bend(&mut mesh, map)?;
    }
    Ok(mesh)
}

/// Moves the points of a box.
fn bend<const D: usize>(mesh: &mut Mesh<D>, map: &case::BoxMap) -> Result<()> {
    for point in &mut mesh.points {
        let place: [f64; 3] = std::array::from_fn(|i| point.get(i).copied().unwrap_or(0.0));
        for (entry, function) in point.iter_mut().zip(map.functions()) {
            *entry = function.map_or(*entry, |function| function.value(place, 0.0));
        }
        if point.iter().any(|entry| !entry.is_finite()) {
            return Err(Error::case(format!("the map of the box sends {:?} to {point:?}", &place[..D])));
        }
    }
    match validate::first_bad_element(mesh) {
        Some(bad) => Err(Error::case(format!(
            "the map of the box leaves an element at {:?} flat or turned inside out",
            mesh.points[bad.node as usize]
        ))
        .hint("neighbours must stay neighbours, and left must stay left of right")),
        None => Ok(()),
    }
}
