//! Checks that need the meshes: functions that are not finite at a node, and probes that are far
//! from all bodies.

use super::{LineModel, lengths};
use crate::case::{Action, At, Case, Varying};
use crate::error::Error;
use crate::mesh::{Mesh, spelled};
use crate::space::ElementTree;
use crate::tensor::Vector;

/// Returns an error for each prescribed displacement and initial velocity that is not finite at a
/// node at the start. Returns another error for each probe whose distance from all nodes exceeds
/// the length of the bodies. Errors give the location in the case file.
pub fn unsound_places<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let mut faults = Vec::new();
    for (number, body) in case.bodies.values().enumerate() {
        let Some(velocity) = &body.initial_velocity else { continue };
        let nodes = nodes_of_body(mesh, number);
        faults.extend(velocity.iter().filter_map(|function| unsound(case, mesh, function, &nodes)));
    }
    for boundary in case.boundary.values() {
        for action in boundary.actions() {
            let functions = match action {
                Action::Displacement(functions) => functions,
                Action::Roller(roller) => [roller.displacement.as_ref(), None, None],
                _ => continue,
            };
            let on = boundary.on.names().iter();
            let nodes: Vec<u32> = on.flat_map(|on| nodes_on(case, mesh, on)).collect();
            if let (true, Action::Displacement([Some(radial), ..])) = (mesh.plane.is_revolved(), action) {
                faults.extend(leaves_axis(case, mesh, radial, &nodes));
            }
            let functions = functions.into_iter().flatten();
            faults.extend(functions.filter_map(|function| unsound(case, mesh, function, &nodes)));
        }
    }
    faults.extend(far_probes(case, mesh));
    faults.extend(points_outside(case, mesh));
    faults
}

/// The error of a radial displacement that moves a node of the axis of revolution.
fn leaves_axis<const D: usize, const KG: i8, const M: i8, const S: i8>(
    case: &Case,
    mesh: &Mesh<D>,
    radial: &Varying<KG, M, S>,
    nodes: &[u32],
) -> Option<Error> {
    let placed = case.function(radial);
    let end = case.time.end.value;
    let moves = |node: &&u32| {
        let point = &mesh.points[**node as usize];
        let place = std::array::from_fn(|i| point.get(i).copied().unwrap_or(0.0));
        point[0] == 0.0 && [0.0, 0.37 * end, end].iter().any(|&time| placed.value(place, time) != 0.0)
    };
    let node = nodes.iter().find(moves)?;
    let place = spelled(&mesh.points[*node as usize]);
    let message = format!("the node at {place} is on the axis of revolution and has no radial displacement");
    Some(case.error(radial.place, message).hint("use a set without the nodes at x = 0"))
}

/// The first node at which a function of the case has no finite value at the start.
fn unsound<const D: usize, const KG: i8, const M: i8, const S: i8>(
    case: &Case,
    mesh: &Mesh<D>,
    function: &Varying<KG, M, S>,
    nodes: &[u32],
) -> Option<Error> {
    let placed = case.function(function);
    nodes.iter().find_map(|&node| {
        let point = &mesh.points[node as usize];
        let place = std::array::from_fn(|i| point.get(i).copied().unwrap_or(0.0));
        placed.require_sound(&placed.motion(place, 0.0), point, 0.0).err()
    })
}

fn far_probes<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let (m, size) = (case.units.of("m"), longest_side(mesh));
    let mut faults = Vec::new();
    for (name, probe) in case.output.probes.iter() {
        if probe.at.len() != D {
            continue;
        }
        let at = Vector::<D>::from_fn(|i, _| probe.at[i].value);
        let nodes = match &probe.on {
            Some(on) => nodes_on(case, mesh, on),
            None => (0..mesh.points.len() as u32).collect(),
        };
        let distance = |&node: &u32| (Vector::from(mesh.points[node as usize]) - at).norm();
        let nearest = nodes.iter().map(distance).fold(f64::INFINITY, f64::min);
        if nearest.is_finite() && nearest > size {
            let message = format!("probe '{}' is {nearest:.3e} {m} away from the nearest node", name.value);
            let cure = format!("give a reference position on a body, in {m}");
            faults.push(case.error(probe.at.place, message).hint(&cure));
        }
    }
    faults
}

/// An error for each segment with points that are in no element, with their number and the first of
/// them.
fn points_outside<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let mut faults = Vec::new();
    if case.output.lines.names().next().is_none() {
        return faults;
    }
    let tree = ElementTree::new(mesh, (0..mesh.element_count() as u32).collect());
    for (name, line) in case.output.lines.iter() {
        if line.from.len() != D || line.end().len() != D {
            continue;
        }
        let body =
            line.on.as_ref().and_then(|on| case.bodies.iter().position(|(name, _)| name.value == on.value));
        let ends = [lengths(&line.from), lengths(line.end())];
        let model = LineModel::<D> {
            name: name.value.clone(),
            ends,
            count: line.count(),
            body,
            stresses: line.stresses,
        };
        let of_body = |element: u32| body.is_none_or(|body| usize::from(mesh.body[element as usize]) == body);
        let outside: Vec<String> = (1..)
            .zip(model.points())
            .filter(|(_, point)| tree.locate(of_body, point).is_none())
            .map(|(number, point)| format!("{number} at [{}]", point.map(|x| x.to_string()).join(", ")))
            .collect();
        if outside.is_empty() {
            continue;
        }
        let shown = outside.iter().take(3).cloned().collect::<Vec<_>>().join("; ");
        let more = if outside.len() > 3 { "; ..." } else { "" };
        let message = format!(
            "line '{}': {} of {} points are in no element{}: {shown}{more}",
            name.value,
            outside.len(),
            line.count(),
            line.on.as_ref().map_or_else(String::new, |on| format!(" of '{}'", on.value)),
        );
        let cure = "give ends inside the body, in the reference configuration";
        faults.push(case.error(line.from.place, message).hint(cure));
    }
    faults
}

/// Longest side of the box around all bodies \[m\].
fn longest_side<const D: usize>(mesh: &Mesh<D>) -> f64 {
    let side = |i: usize| {
        let along = mesh.points.iter().map(|point| point[i]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    (0..D).map(side).fold(0.0, f64::max)
}

/// Nodes of a body or of one of its sets; empty if there is no such set, which is reported
/// separately.
fn nodes_on<const D: usize>(case: &Case, mesh: &Mesh<D>, on: &At<String>) -> Vec<u32> {
    let body = case.bodies.iter().position(|(name, _)| name.value == on.value);
    body.map_or_else(|| mesh.set_nodes(on).unwrap_or_default(), |number| nodes_of_body(mesh, number))
}

fn nodes_of_body<const D: usize>(mesh: &Mesh<D>, number: usize) -> Vec<u32> {
    let elements = (0..mesh.element_count()).filter(|&element| usize::from(mesh.body[element]) == number);
    let mut nodes: Vec<u32> = elements.flat_map(|element| mesh.element_nodes(element)).copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
