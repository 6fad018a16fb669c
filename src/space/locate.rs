//! Search for the node nearest to a point of the reference configuration, and for the element that
//! contains it.

use nalgebra::{SMatrix, SVector};

use super::reference::{ReferenceElement, reference};
use crate::mesh::{Bounds, BoundsTree, Mesh};

/// A node near a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Local node.
    pub node: u32,
    /// Its distance from the point \[m\].
    pub distance: f64,
}

/// A point in an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// Local element.
    pub element: u32,
    /// Reference coordinates of the point in it, unused ones zero.
    pub coordinates: [f64; 3],
}

/// Maximum number of Newton steps of [`pull_back`]; elements of any quality need fewer than ten.
const STEPS: usize = 30;

/// Distance outside its reference domain up to which a point still counts as in the element.
/// Dimensionless.
const TOLERANCE: f64 = 1e-10;

/// The nearest of `candidates` (local nodes) to `point` \[m\]. Of equally near nodes it is the
/// first; `None` without candidates.
///
/// On several ranks: take the smallest distance, and for equal distances the lowest number in the
/// input mesh.
pub fn nearest_node<const D: usize>(
    mesh: &Mesh<D>,
    candidates: impl IntoIterator<Item = u32>,
    point: &[f64; D],
) -> Option<Nearest> {
    let distance = |node: u32| {
        let to = &mesh.points[node as usize];
        (0..D).map(|k| (to[k] - point[k]).powi(2)).sum::<f64>().sqrt()
    };
    let all = candidates.into_iter().map(|node| Nearest { node, distance: distance(node) });
    all.reduce(|best, next| if next.distance < best.distance { next } else { best })
}

/// The first of `elements` that contains `point` \[m\]; `None` if no element contains it.
pub fn locate<const D: usize>(
    mesh: &Mesh<D>,
    elements: impl IntoIterator<Item = u32>,
    point: &[f64; D],
) -> Option<Located> {
    elements.into_iter().filter(|&element| near(mesh, element, point)).find_map(|element| {
        let coordinates = pull_back(mesh, element, point)?;
        let inside = reference(mesh.kinds[element as usize]).contains(&coordinates, TOLERANCE);
        inside.then_some(Located { element, coordinates })
    })
}

/// Elements in a tree of boxes, to locate many points among them.
#[derive(Debug)]
pub struct ElementTree<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    elements: Vec<u32>,
    tree: BoundsTree<D>,
}

impl<'a, const D: usize> ElementTree<'a, D> {
    /// A tree of these elements.
    pub fn new(mesh: &'a Mesh<D>, elements: Vec<u32>) -> Self {
        let boxes: Vec<Bounds<D>> = elements.iter().map(|&element| reach(mesh, element)).collect();
        Self { mesh, elements, tree: BoundsTree::new(&boxes) }
    }

    /// The first of those elements that are `allowed` and contain `point` \[m\]; `None` if none of them
    /// contains it.
    pub fn locate(&self, allowed: impl Fn(u32) -> bool, point: &[f64; D]) -> Option<Located> {
        let mut found: Vec<u32> = self.tree.meeting(&Bounds { low: *point, high: *point }).collect();
        found.sort_unstable();
        let elements = found.into_iter().map(|number| self.elements[number as usize]);
        locate(self.mesh, elements.filter(|&element| allowed(element)), point)
    }
}

/// Reference coordinates of `point` \[m\] in an element, also for a point outside; `None` if
/// Newton's method fails.
pub fn pull_back<const D: usize>(mesh: &Mesh<D>, element: u32, point: &[f64; D]) -> Option<[f64; 3]> {
    let nodes = mesh.element_nodes(element as usize);
    let kind = reference(mesh.kinds[element as usize]);
    let mut n = vec![0.0; nodes.len()];
    let mut dn = vec![0.0; nodes.len() * D];
    let mut xi = kind.reduced_rule().points[0];
    for _ in 0..STEPS {
        kind.shape(&xi, &mut n);
        kind.gradient(&xi, &mut dn);
        let mut missing = SVector::<f64, D>::from(*point);
        let mut slope = SMatrix::<f64, D, D>::zeros();
        for (a, &node) in nodes.iter().enumerate() {
            let x = SVector::from(mesh.points[node as usize]);
            missing -= x * n[a];
            slope += x * SVector::<f64, D>::from_column_slice(&dn[a * D..(a + 1) * D]).transpose();
        }
        let step = slope.try_inverse()? * missing;
        (0..D).for_each(|k| xi[k] += step[k]);
        if step.norm() < 1e-13 {
            return Some(xi);
        }
    }
    None
}

/// Whether the point may lie in the element.
fn near<const D: usize>(mesh: &Mesh<D>, element: u32, point: &[f64; D]) -> bool {
    reach(mesh, element).meets(&Bounds { low: *point, high: *point })
}

/// The box around the nodes of an element, extended by half its size because curved sides may bulge.
fn reach<const D: usize>(mesh: &Mesh<D>, element: u32) -> Bounds<D> {
    let nodes = mesh.element_nodes(element as usize);
    let nodal = Bounds::of(nodes.iter().map(|&node| mesh.points[node as usize]));
    let margin = |k: usize| 0.5 * (nodal.high[k] - nodal.low[k]);
    Bounds {
        low: std::array::from_fn(|k| nodal.low[k] - margin(k)),
        high: std::array::from_fn(|k| nodal.high[k] + margin(k)),
    }
}

impl ReferenceElement {
    /// Whether `xi` lies in the reference domain, or outside by at most `tolerance`.
    pub fn contains(&self, xi: &[f64; 3], tolerance: f64) -> bool {
        let xi = &xi[..self.dimension()];
        if self.is_wedge() {
            let in_triangle = xi[..2].iter().all(|&x| x >= -tolerance) && xi[0] + xi[1] <= 1.0 + tolerance;
            return in_triangle && xi[2].abs() <= 1.0 + tolerance;
        }
        if self.is_pyramid() {
            let width = 1.0 - xi[2] + tolerance;
            return xi[2] >= -tolerance && xi[..2].iter().all(|x| x.abs() <= width);
        }
        if self.is_simplex() {
            return xi.iter().all(|&x| x >= -tolerance) && xi.iter().sum::<f64>() <= 1.0 + tolerance;
        }
        xi.iter().all(|x| x.abs() <= 1.0 + tolerance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{BoxShape, ElementKind};

    /// One element on its reference domain, sheared and bent.
    fn single<const D: usize>(kind: ElementKind) -> Mesh<D> {
        let place = |p: &[f64; 3]| {
            std::array::from_fn(|i| {
                2.0 + p[i] + 0.2 * p[(i + 1) % D] + 0.05 * (p[0] * 1.3 + p[1] - p[2]).sin()
            })
        };
        let mut mesh = Mesh::with_points(reference(kind).node_coordinates().iter().map(place).collect());
        mesh.push(kind, 0..kind.nodes() as u32);
        mesh
    }

    fn round_trip<const D: usize>() {
        for kind in ElementKind::ALL.into_iter().filter(|kind| kind.dimension() == D) {
            let mesh = single::<D>(kind);
            let xi = [0.21, 0.34, 0.27];
            let mut n = vec![0.0; kind.nodes()];
            let image = |xi: &[f64; 3], n: &mut [f64]| -> [f64; D] {
                reference(kind).shape(xi, n);
                std::array::from_fn(|k| n.iter().zip(&mesh.points).map(|(n, x)| n * x[k]).sum())
            };
            let found = locate(&mesh, [0], &image(&xi, &mut n)).expect("inside");
            for k in 0..D {
                assert!((found.coordinates[k] - xi[k]).abs() < 1e-12, "{kind:?}");
            }
            let outside = [1.1, 0.5, 0.5];
            assert_eq!(locate(&mesh, [0], &image(&outside, &mut n)), None, "{kind:?}");
        }
    }

    /// For every element, mapping a point to the element and back reproduces the point. A point
    /// outside is in no element.
    #[test]
    fn points_are_found_where_they_are() {
        round_trip::<2>();
        round_trip::<3>();
    }

    /// The apex of a pyramid, where its functions have no gradient, and points near it are found.
    #[test]
    fn the_apex_of_a_pyramid_is_found() {
        let mesh = single::<3>(ElementKind::Pyramid5);
        let apex = mesh.points[4];
        let found = locate(&mesh, [0], &apex).expect("inside");
        assert!((found.coordinates[2] - 1.0).abs() < 1e-12, "{found:?}");
        for part in [1e-3, 1e-8, 1e-14] {
            let near: [f64; 3] = std::array::from_fn(|k| apex[k] + part * (mesh.points[0][k] - apex[k]));
            let found = locate(&mesh, [0], &near).expect("inside");
            assert!((1.0 - found.coordinates[2] - part).abs() < 1e-12, "{part}: {found:?}");
        }
        let beyond: [f64; 3] = std::array::from_fn(|k| apex[k] + 1e-3 * (apex[k] - mesh.points[0][k]));
        assert_eq!(locate(&mesh, [0], &beyond), None);
    }

    /// A tree finds the element that a search of all elements finds, of neighbours the first in the
    /// given order, and only allowed ones.
    #[test]
    fn a_tree_finds_what_a_search_of_all_finds() {
        let shape =
            BoxShape { min: [0.0; 3], max: [1.0, 2.0, 1.5], cells: [3, 4, 2], element: ElementKind::Tet10 };
        let mesh = shape.mesh().expect("a box");
        let elements: Vec<u32> = (0..mesh.element_count() as u32).rev().collect();
        let tree = ElementTree::new(&mesh, elements.clone());
        let even = |element: u32| element.is_multiple_of(2);
        for k in 0..=24 {
            let part = f64::from(k) / 20.0;
            let point = [part, 2.0 * part, 1.5 * part];
            let known = locate(&mesh, elements.iter().copied(), &point);
            assert_eq!(known.is_some(), k <= 20);
            assert_eq!(tree.locate(|_| true, &point), known);
            let known = locate(&mesh, elements.iter().copied().filter(|&element| even(element)), &point);
            assert_eq!(tree.locate(even, &point), known);
        }
    }

    /// The nearest node is found: the first of equally near ones, `None` without candidates.
    #[test]
    fn nearest_node_is_the_nearest() {
        let mesh = Mesh::<2>::with_points(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        assert_eq!(nearest_node(&mesh, 0..3, &[0.9, 0.2]).map(|n| n.node), Some(1));
        assert_eq!(nearest_node(&mesh, 0..3, &[0.5, 0.0]), Some(Nearest { node: 0, distance: 0.5 }));
        assert_eq!(nearest_node(&mesh, 0..0, &[0.5, 0.0]), None);
    }
}
