//! Test helpers: volume and surface by corners, and straightness of elements.

use super::{Facet, Mesh};

/// Area vector of a set of straight-sided facets: length times outward normal in 2D, area times
/// outward normal in 3D.
pub(crate) fn area<const D: usize>(mesh: &Mesh<D>, facets: &[Facet]) -> [f64; D] {
    let mut sum = [0.0; D];
    for &facet in facets {
        let vector = facet_area(mesh, facet);
        for k in 0..D {
            sum[k] += vector[k];
        }
    }
    sum
}

/// Volume enclosed by the sides of all elements, by the divergence theorem. Facets are
/// straight-sided and flat.
pub(crate) fn volume<const D: usize>(mesh: &Mesh<D>) -> f64 {
    let mut sum = 0.0;
    for (element, kind) in mesh.kinds.iter().enumerate() {
        for side in 0..kind.sides().len() {
            let facet = Facet { element: element as u32, side: side as u8 };
            let area = facet_area(mesh, facet);
            let corners: Vec<u32> = mesh.facet_corners(facet).collect();
            for &n in &corners {
                let x = mesh.points[n as usize];
                let flux: f64 = (0..D).map(|k| x[k] * area[k]).sum();
                sum += flux / (corners.len() * D) as f64;
            }
        }
    }
    sum
}

fn facet_area<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> [f64; D] {
    let x: Vec<[f64; D]> = mesh.facet_corners(facet).map(|n| mesh.points[n as usize]).collect();
    let edge = |a: usize, b: usize, k: usize| x[b][k] - x[a][k];
    if D == 2 {
        return std::array::from_fn(|k| [edge(0, 1, 1), -edge(0, 1, 0)][k]);
    }
    let diagonals = if x.len() == 3 { [(0, 1), (0, 2)] } else { [(0, 2), (1, 3)] };
    let [(a, b), (c, d)] = diagonals;
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        0.5 * (edge(a, b, i) * edge(c, d, j) - edge(a, b, j) * edge(c, d, i))
    })
}

/// Fails unless each node of each element is the mean of its parents and each point has an element.
pub(crate) fn assert_straight<const D: usize>(mesh: &Mesh<D>) {
    let mut used = vec![false; mesh.points.len()];
    for (element, kind) in mesh.kinds.iter().enumerate() {
        let nodes = mesh.element_nodes(element);
        assert_eq!(nodes.len(), kind.nodes());
        for (local, parents) in kind.parents().iter().enumerate() {
            let found = mesh.points[nodes[local] as usize];
            used[nodes[local] as usize] = true;
            for k in 0..D {
                let sum: f64 = parents.iter().map(|&c| mesh.points[nodes[c as usize] as usize][k]).sum();
                let mean = sum / parents.len() as f64;
                assert!((found[k] - mean).abs() < 1e-10, "{kind} element {element}, node {local}: {found:?}");
            }
        }
    }
    assert!(used.into_iter().all(|u| u), "a point has no element");
}
