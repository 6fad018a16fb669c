//! Several bodies in one mesh.

use super::Mesh;
use crate::error::{Error, Result};

/// PETSc numbers unknowns with 32-bit integers.
const MAX_UNKNOWNS: usize = i32::MAX as usize;

/// Puts bodies side by side, in the given order; they share no nodes.
///
/// Set `top` of body `block` becomes `block.top`; the element set `block` holds the whole body.
///
/// # Errors
/// When the bodies together are more than 32-bit numbers can count.
pub fn merge<const D: usize>(bodies: Vec<(String, Mesh<D>)>) -> Result<Mesh<D>> {
    let unknowns = D * bodies.iter().map(|(_, mesh)| mesh.points.len()).sum::<usize>();
    let entries: usize = bodies.iter().map(|(_, mesh)| mesh.nodes.len()).sum();
    if unknowns > MAX_UNKNOWNS || entries > u32::MAX as usize || bodies.len() > usize::from(u16::MAX) {
        let size = format!("the bodies together have {unknowns} unknowns, more than {MAX_UNKNOWNS}");
        return Err(Error::case(size).hint("use coarser meshes"));
    }
    let mut all = Mesh::with_points(Vec::new());
    for (number, (name, mesh)) in bodies.into_iter().enumerate() {
        append(&mut all, number as u16, &name, mesh);
    }
    Ok(all)
}

fn append<const D: usize>(all: &mut Mesh<D>, number: u16, name: &str, mesh: Mesh<D>) {
    let (node, element, entry) =
        (all.points.len() as u32, all.element_count() as u32, all.nodes.len() as u32);
    let elements = mesh.element_count() as u32;
    all.points.extend(mesh.points);
    all.kinds.extend(mesh.kinds);
    all.offsets.extend(mesh.offsets.iter().skip(1).map(|offset| offset + entry));
    all.nodes.extend(mesh.nodes.iter().map(|n| n + node));
    all.body.extend(std::iter::repeat_n(number, elements as usize));
    for (set, mut facets) in mesh.facet_sets {
        facets.iter_mut().for_each(|facet| facet.element += element);
        all.facet_sets.insert(format!("{name}.{set}"), facets);
    }
    for (set, points) in mesh.point_sets {
        all.point_sets.insert(format!("{name}.{set}"), points.iter().map(|n| n + node).collect());
    }
    for (set, members) in mesh.element_sets {
        all.element_sets.insert(format!("{name}.{set}"), members.iter().map(|e| e + element).collect());
    }
    all.element_sets.insert(name.to_owned(), (element..element + elements).collect());
}
