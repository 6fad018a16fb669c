//! Checks of the sets that a case names. The sets of a mesh file are known only after it is read.

use std::collections::HashSet;

use crate::case::{self, At, Case, SetNames};
use crate::error::{Error, Result};
use crate::mesh::{Facet, Mesh, SetKind};

/// Errors for the sets that contacts and boundaries name but that do not exist in the meshes, or
/// that have no surface although one is needed. Each error gives its location in the case file and
/// the available sets.
pub fn missing_sets<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let mut faults = Vec::new();
    let mut look = |on: &SetNames, surface| {
        faults.extend(on.names().iter().filter_map(|name| require(case, mesh, name, surface).err()));
    };
    for (_, contact) in case.contact.iter() {
        look(&contact.contactor, true);
        if case.shape(&contact.target).is_none() {
            look(&contact.target, true);
        }
    }
    for tied in case.tied.values() {
        look(&tied.contactor, true);
        look(&tied.target, true);
    }
    for (_, boundary) in case.boundary.iter() {
        look(&boundary.on, boundary.actions().any(|action| action.needs_facets()));
    }
    faults
}

/// Line forces on sets that have no edges.
pub fn without_edges<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let fault = |on: &At<String>| {
        let nodes = mesh.point_sets.get(&on.value);
        if nodes.is_some_and(|nodes| !mesh.edges_within(nodes).is_empty()) {
            return None;
        }
        let message = match nodes {
            Some(_) => {
                format!("the set '{}' has no edge of an element: a line force acts on edges", on.value)
            }
            None => format!("a line force acts on a set of points, which '{}' is not", on.value),
        };
        let cure = "name a physical curve, or a set `of: nodes` that has all nodes along the line";
        Some(case.error(on.place, message).hint(cure))
    };
    let lines = case.boundary.values().filter(|boundary| boundary.line_force.is_some());
    lines.flat_map(|boundary| boundary.on.names()).filter_map(fault).collect()
}

/// Contacts whose two sides cannot touch: they have facets in common, or there is only one facet.
pub fn shared_facets<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let fault = |contact: &case::Contact| {
        let [contactor, target] =
            [&contact.contactor, &contact.target].map(|set| mesh.facet_sets.get(&set.value));
        let (contactor, target) = (contactor?, target?);
        if contact.contactor.value == contact.target.value {
            let message = format!(
                "'{}' is a single facet, which can not be in contact with itself",
                contact.target.value
            );
            let error =
                || case.error(contact.target.place, message).hint("name a surface with several facets");
            return (contactor.len() == 1).then(error);
        }
        let count = common(contactor, target);
        let names = [&contact.contactor.value, &contact.target.value];
        let message = format!("'{}' and '{}' have {count} facets in common", names[0], names[1]);
        let cure =
            "name sets without common facets; for self-contact name the same set as contactor and target";
        (count > 0).then(|| case.error(contact.target.place, message).hint(cure))
    };
    case.contact.values().filter_map(fault).collect()
}

/// Contacts that share facets with an earlier contact on both sides: their tractions would add up.
/// Two contacts with exchanged sides share none, and the case itself is checked for parts of `all`.
pub fn repeated_facets<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let mut faults = Vec::new();
    let mut before: Vec<(&str, &case::Contact)> = Vec::new();
    for (name, contact) in case.contact.iter().filter(|(_, contact)| !contact.is_general()) {
        let shared = |a: &str, b: &str| match [a, b].map(|set| mesh.facet_sets.get(set)) {
            [Some(a), Some(b)] => common(a, b),
            _ => 0,
        };
        for (first, other) in &before {
            let contactors = shared(&other.contactor, &contact.contactor);
            if contactors == 0 {
                continue;
            }
            let is_obstacle = case.shape(&contact.target).is_some();
            let targets = if is_obstacle {
                (other.target.value == contact.target.value)
                    .then(|| format!("the {} '{}'", case.noun(&contact.target), contact.target.value))
            } else {
                let count = shared(&other.target, &contact.target);
                (count > 0).then(|| format!("{count} facets of the target"))
            };
            let Some(targets) = targets else { continue };
            let message = format!(
                "contacts '{first}' and '{}' have {contactors} facets of the contactor and {targets} in common",
                name.value
            );
            let cure = "their tractions would be added: remove the common facets from a set of one of them";
            faults.push(case.error(contact.contactor.place, message).hint(cure));
        }
        before.push((&name.value, contact));
    }
    faults
}

/// Number of facets of `second` that are in `first`.
fn common(first: &[Facet], second: &[Facet]) -> usize {
    let known: HashSet<_> = first.iter().collect();
    second.iter().filter(|facet| known.contains(facet)).count()
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
            format!("expected a surface, but the set '{}' has {kind}", on.value)
        }
        None if surface => format!("the mesh of '{body}' has no surface '{set}': there is no '{}'", on.value),
        None => format!("the mesh of '{body}' has no set '{set}': there is no '{}'", on.value),
    };
    Err(case.unknown(on, message, sets.filter(|(_, kind)| fits(*kind)).map(|(name, _)| *name)))
}
