//! Finds bodies whose own surfaces face each other. Contact is detected only between the sets that
//! a contact names.

use crate::contact::passage::{Path, normal_of};
use crate::mesh::{Bounds, BoundsTree, FacetIndex, spelled};
use crate::model::{ContactModel, Model};
use crate::partition::LocalMesh;
use crate::tensor::Vector as Point;

/// Fraction of the body size below which a distance is zero, because facets that touch each other
/// may intersect by rounding.
const TOUCH: f64 = 1e-9;

/// Remarks on bodies that may touch themselves although no contact detects it, with the distance.
/// `local` is the whole mesh.
pub fn remarks<const D: usize>(local: &LocalMesh<D>, model: &Model<D>) -> Vec<String> {
    let met = |body: usize| {
        let is_on_both_sides = |contact: &ContactModel<D>| {
            contact.bodies.contains(&body) && contact.target.bodies().contains(&body)
        };
        model.contacts.iter().any(is_on_both_sides)
    };
    let m = model.units.of("m");
    let bodies = model.bodies.iter().enumerate().filter(|(body, _)| !met(*body));
    let told = bodies.filter_map(|(number, body)| {
        let (distance, place) = narrowest(local, number)?;
        Some(format!(
            "surfaces of '{}' face each other at a distance of {distance:.3e} {m} at {}: contact between \
             them is detected only if an entry of `contact` names them, as its two sides or for \
             self-contact",
            body.name,
            spelled(place.as_slice())
        ))
    });
    told.collect()
}

/// The shortest path \[m\] along a facet normal that leaves a body and enters it again, and the
/// point where it starts.
fn narrowest<const D: usize>(local: &LocalMesh<D>, body: usize) -> Option<(f64, Point<D>)> {
    let mesh = &local.mesh;
    let mut simplices: Vec<[Path<D>; D]> = Vec::new();
    for facet in FacetIndex::new(mesh).boundary() {
        if usize::from(mesh.body[facet.element as usize]) != body {
            continue;
        }
        let corners: Vec<Path<D>> = mesh
            .facet_corners(facet)
            .map(|node| Point::from(mesh.points[node as usize]))
            .map(|place| Path { start: place, end: place })
            .collect();
        // A line, a triangle, or the triangles of a quadrilateral.
        for last in D - 1..corners.len() {
            simplices.push(std::array::from_fn(|k| corners[if k == 0 { 0 } else { last + 1 + k - D }]));
        }
    }
    let around = |corners: &[Path<D>; D]| Bounds::of(corners.iter().map(|corner| corner.end.into()));
    let boxes: Vec<Bounds<D>> = simplices.iter().map(around).collect();
    let tree = BoundsTree::new(&boxes);
    let all = boxes.iter().fold(*boxes.first()?, |a, b| a.join(b));
    let size = all.extent();
    let mut found: Option<(f64, Point<D>)> = None;
    for corners in &simplices {
        let middle = corners.iter().map(|corner| corner.end).sum::<Point<D>>() / D as f64;
        let Some(out) = normal_of(&corners.map(|corner| corner.end)).try_normalize(0.0) else { continue };
        let most = found.map_or(size, |(distance, _)| distance);
        let way = [middle.into(), (middle + out * most).into()];
        for hit in tree.admitted(|bounds| bounds.meets_segment(way)) {
            let other = &simplices[hit as usize];
            let normal = normal_of(&other.map(|corner| corner.end));
            let against = normal.dot(&out);
            let distance = normal.dot(&(other[0].end - middle)) / against;
            let place = middle + out * distance;
            let nearer = distance > TOUCH * size && found.is_none_or(|(known, _)| distance < known);
            if against < 0.0 && nearer && (Path { start: place, end: place }).is_over(other, size) {
                found = Some((distance, middle));
            }
        }
    }
    found
}
