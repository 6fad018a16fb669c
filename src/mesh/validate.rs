//! Quality of element shapes, determined at their corners.
//!
//! A corner's Jacobian is the product of its edges. For a straight-sided linear element it
//! determines whether the map from the reference element can be inverted. The curved map is checked
//! at the quadrature points by the code that integrates.

use super::{ElementKind, Mesh};

/// Sine of a corner below which an element has no usable volume there.
pub(crate) const FLAT: f64 = 1e-12;

/// An element that is inverted or degenerate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BadElement<const D: usize> {
    /// Its number in the mesh.
    pub element: usize,
    /// Number of the invalid node in the mesh.
    pub node: u32,
    /// Product of the edges at that corner divided by the product of their lengths: 1 at a
    /// right-angled corner, 0 at a flat one.
    pub sine: f64,
    /// Whether all corners are negative, because the nodes are listed in the opposite order.
    pub reversed: bool,
}

/// The corners adjacent to each corner, ordered so that a valid element has positive products.
fn neighbours(kind: ElementKind) -> &'static [&'static [u8]] {
    match (kind.dimension(), kind.corners()) {
        (2, 3) => &[&[1, 2], &[2, 0], &[0, 1]],
        (2, _) => &[&[1, 3], &[2, 0], &[3, 1], &[0, 2]],
        (3, 4) => &[&[1, 2, 3]],
        // The apex has the products of the base.
        (3, 5) => &[&[1, 3, 4], &[2, 0, 4], &[3, 1, 4], &[0, 2, 4]],
        (3, 6) => &[&[1, 2, 3], &[2, 0, 4], &[0, 1, 5], &[5, 4, 0], &[3, 5, 1], &[4, 3, 2]],
        (3, _) => {
            &[&[1, 3, 4], &[2, 0, 5], &[3, 1, 6], &[0, 2, 7], &[7, 5, 0], &[4, 6, 1], &[5, 7, 2], &[6, 4, 3]]
        }
        _ => &[],
    }
}

/// The first element with a corner that is inverted or flat.
pub fn first_bad_element<const D: usize>(mesh: &Mesh<D>) -> Option<BadElement<D>> {
    (0..mesh.element_count()).find_map(|element| judge(mesh, element))
}

fn judge<const D: usize>(mesh: &Mesh<D>, element: usize) -> Option<BadElement<D>> {
    let nodes = mesh.element_nodes(element);
    let point = |local: usize| mesh.points[nodes[local] as usize];
    let mut worst = f64::INFINITY;
    let mut best = f64::NEG_INFINITY;
    let mut at = 0;
    for (corner, next) in neighbours(mesh.kinds[element]).iter().enumerate() {
        let from = point(corner);
        let mut edges = [[0.0; D]; D];
        for (edge, &to) in edges.iter_mut().zip(*next) {
            let to = point(to as usize);
            *edge = std::array::from_fn(|k| to[k] - from[k]);
        }
        let sine = sine(edges);
        best = best.max(sine);
        if sine < worst {
            (worst, at) = (sine, corner);
        }
    }
    let bad = worst <= FLAT;
    bad.then(|| BadElement { element, node: nodes[at], sine: worst, reversed: best < -FLAT })
}

/// Determinant of edges normalized to length 1; zero if an edge has zero length.
fn sine<const D: usize>(mut edges: [[f64; D]; D]) -> f64 {
    for edge in &mut edges {
        let largest = edge.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let length = largest * edge.iter().map(|x| (x / largest).powi(2)).sum::<f64>().sqrt();
        if length.is_nan() || length <= 0.0 {
            return 0.0;
        }
        edge.iter_mut().for_each(|x| *x /= length);
    }
    let e = &edges;
    if D == 2 {
        return e[0][0] * e[1][1] - e[0][1] * e[1][0];
    }
    (0..3)
        .map(|i| e[0][i] * (e[1][(i + 1) % 3] * e[2][(i + 2) % 3] - e[1][(i + 2) % 3] * e[2][(i + 1) % 3]))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::BoxShape;

    fn one<const D: usize>(kind: ElementKind) -> Mesh<D> {
        BoxShape { min: [0.0; D], max: [1e-6; D], cells: [1; D], element: kind }.mesh().unwrap()
    }

    fn check_kind<const D: usize>(kind: ElementKind) {
        let good = one::<D>(kind);
        assert_eq!(first_bad_element(&good), None, "{kind}");

        let mut mirrored = good.clone();
        mirrored.points.iter_mut().for_each(|x| x[0] = -x[0]);
        let bad = first_bad_element(&mirrored).unwrap();
        assert!(bad.reversed && bad.element == 0, "{kind}: {bad:?}");

        let mut flat = good.clone();
        flat.points.iter_mut().for_each(|x| x[D - 1] = 0.0);
        let bad = first_bad_element(&flat).unwrap();
        assert!(!bad.reversed && bad.sine.abs() <= FLAT, "{kind}: {bad:?}");

        let mut long = good;
        long.points.iter_mut().for_each(|x| x[0] *= 1e5);
        assert_eq!(first_bad_element(&long), None, "{kind}: long elements are allowed");
    }

    /// Valid elongated elements pass; mirrored and flat ones are detected, for every kind.
    #[test]
    fn mirrored_and_flat_elements_are_found() {
        for kind in ElementKind::SOLIDS {
            if kind.dimension() == 2 { check_kind::<2>(kind) } else { check_kind::<3>(kind) }
        }
    }

    /// A single corner that is moved through the element is reported, although the other corners
    /// are valid.
    #[test]
    fn one_bad_corner_is_enough() {
        let mut quad = one::<2>(ElementKind::Quad4);
        quad.points[3] = [0.2e-6, 0.2e-6];
        let bad = first_bad_element(&quad).unwrap();
        assert_eq!((bad.node, bad.reversed), (3, false));
        for node in 0..8 {
            let mut hex = one::<3>(ElementKind::Hex8);
            let through: [f64; 3] = std::array::from_fn(|k| 0.5e-6 - 0.3 * (hex.points[node][k] - 0.5e-6));
            hex.points[node] = through;
            assert_eq!(first_bad_element(&hex).unwrap().node, node as u32);
        }
    }
}
