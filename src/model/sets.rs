//! Sets that a case names, looked for in the meshes: those of a mesh file are known only when it is read.

use crate::case::{Action, At, Case};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, SetKind};

/// The sets that contacts and boundaries name and the meshes lack, or have without surfaces where surfaces are needed: an error
/// each, at its place in the case file, with the sets that there are.
pub fn missing_sets<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let mut faults = Vec::new();
    let mut look = |on, surface| faults.extend(require(case, mesh, on, surface).err());
    for (_, contact) in case.contact.iter() {
        look(&contact.contactor, true);
        if case.obstacles.get(&contact.target).is_none() {
            look(&contact.target, true);
        }
    }
    for (_, boundary) in case.boundary.iter() {
        let acts_on_facets = |action| matches!(action, Action::Traction(_) | Action::Pressure(_));
        look(&boundary.on, boundary.actions().any(acts_on_facets));
    }
    faults
}

fn require<const D: usize>(case: &Case, mesh: &Mesh<D>, on: &At<String>, surface: bool) -> Result<()> {
    let Some((body, set)) = on.split_once('.') else { return Ok(()) };
    let of_body = |name: &'_ str| name.split_once('.').is_some_and(|(owner, _)| owner == body);
    let sets = mesh.sets();
    let sets = sets.iter().filter(|(name, _)| of_body(name));
    let fits = |kind: SetKind| !surface || kind == SetKind::Facets;
    let found = sets.clone().find(|(name, _)| *name == on.as_str());
    let message = match found {
        Some((_, kind)) if fits(*kind) => return Ok(()),
        Some((_, kind)) => {
            let kind = if *kind == SetKind::Points { "points" } else { "elements" };
            format!("the set '{}' has {kind}, a surface is needed here", on.value)
        }
        None if surface => format!("the mesh of '{body}' has no surface '{set}', there is no '{}'", on.value),
        None => format!("the mesh of '{body}' has no set '{set}', there is no '{}'", on.value),
    };
    Err(case.unknown(on, message, sets.filter(|(_, kind)| fits(*kind)).map(|(name, _)| *name)))
}
