//! Thin parts of bodies between two surfaces in contact, such as meshing teeth.

use std::collections::HashSet;

use super::{ContactModel, Model};
use crate::mesh::{Bounds, BoundsTree, Facet, FacetIndex, Mesh};
use crate::space::facet_normal;
use crate::tensor::Vector;

/// Barycentric coordinates down to which a ray hits a triangle. Facets of regular meshes lie
/// exactly opposite each other, and the ray from the centre of one passes through the common edge
/// of two triangles of the other. Half and twice the value find the same walls in the tests.
const ROUNDING: f64 = 1e-9;

impl<const D: usize> Model<D> {
    /// Returns the thickness of the thinnest wall between the two surfaces of each contact \[m\]. It is
    /// infinite for contacts without a wall, with an obstacle, or of a body with itself.
    ///
    /// A wall is a part of a body, such as the tooth of a gear. The inward normal at the centre of a
    /// facet first leaves its own body, and then the other body through a facet of the other
    /// surface. Without the wall these two facets would count as a deep penetration. Rays are as
    /// long as half the shortest side of the boxes around the bodies, because deeper points have no
    /// weight (theory, section 1.3).
    pub fn walls(&self, mesh: &Mesh<D>) -> Vec<f64> {
        let mut boundary = None;
        let thinnest = |contact: &ContactModel<D>| {
            let Some(set) = contact.target.set() else { return f64::INFINITY };
            if contact.target.bodies() == contact.bodies {
                return f64::INFINITY;
            }
            let boundary = boundary.get_or_insert_with(|| Boundary::of(mesh));
            let depth = 0.5 * boundary.shortest_side(&contact.all_bodies());
            let [one, other] = [contact.contactor.as_str(), set].map(|name| boundary.surface(name));
            [(&one, &other), (&other, &one)]
                .into_iter()
                .flat_map(|(own, opposite)| own.facets.iter().map(move |&facet| (facet, opposite)))
                .filter_map(|(facet, opposite)| boundary.wall(facet, opposite, depth))
                .fold(f64::INFINITY, f64::min)
        };
        self.contacts.iter().map(thinnest).collect()
    }
}

/// The boundary facets of all bodies, with a tree of their boxes.
struct Boundary<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    facets: Vec<Facet>,
    tree: BoundsTree<D>,
}

/// One surface of a contact.
struct Surface<const D: usize> {
    facets: HashSet<Facet>,
    around: Bounds<D>,
}

/// A ray from the centre of a facet into its body.
struct Ray<const D: usize> {
    start: Vector<D>,
    along: Vector<D>,
}

impl<'a, const D: usize> Boundary<'a, D> {
    fn of(mesh: &'a Mesh<D>) -> Self {
        let facets = FacetIndex::new(mesh).boundary();
        let boxes: Vec<Bounds<D>> = facets.iter().map(|&facet| around(mesh, facet)).collect();
        Self { mesh, facets, tree: BoundsTree::new(&boxes) }
    }

    /// The facets of a set, with the box around them.
    fn surface(&self, name: &str) -> Surface<D> {
        let facets: HashSet<Facet> = self.mesh.facet_sets.get(name).into_iter().flatten().copied().collect();
        let boxes = facets.iter().map(|&facet| around(self.mesh, facet));
        Surface { around: boxes.fold(Bounds::EMPTY, |all, one| all.join(&one)), facets }
    }

    /// Shortest side of the boxes around these bodies \[m\].
    fn shortest_side(&self, bodies: &[usize]) -> f64 {
        let mut boxes = vec![Bounds::EMPTY; bodies.iter().max().map_or(0, |last| last + 1)];
        for &facet in &self.facets {
            if let Some(all) = boxes.get_mut(usize::from(self.mesh.body[facet.element as usize])) {
                *all = all.join(&around(self.mesh, facet));
            }
        }
        let shortest =
            |own: &Bounds<D>| (0..D).map(|k| own.high[k] - own.low[k]).fold(f64::INFINITY, f64::min);
        bodies.iter().map(|&body| shortest(&boxes[body])).fold(f64::INFINITY, f64::min)
    }

    /// Returns the thickness of the body under a facet \[m\] if a facet of the `opposite` surface lies
    /// behind that part of the body, at most `depth` away.
    fn wall(&self, facet: Facet, opposite: &Surface<D>, depth: f64) -> Option<f64> {
        let corners: Vec<Vector<D>> = corners(self.mesh, facet).collect();
        let start = corners.iter().sum::<Vector<D>>() / corners.len() as f64;
        let ray = Ray { start, along: -outward(&corners) };
        let ends = ray.ends(depth);
        if !opposite.around.meets_segment(ends) {
            return None;
        }
        let body = self.mesh.body[facet.element as usize];
        let mut wall = f64::INFINITY;
        let mut other = f64::INFINITY;
        for index in self.tree.admitted(|bounds| bounds.meets_segment(ends)) {
            let hit = self.facets[index as usize];
            let is_own = self.mesh.body[hit.element as usize] == body;
            if hit == facet || !is_own && !opposite.facets.contains(&hit) {
                continue;
            }
            let nearest = if is_own { &mut wall } else { &mut other };
            if let Some(exit) = ray.exit(self.mesh, hit).filter(|exit| (0.0..=depth).contains(exit)) {
                *nearest = nearest.min(exit);
            }
        }
        (other.is_finite() && wall < other).then_some(wall)
    }
}

impl<const D: usize> Ray<D> {
    /// The ends of the part of the ray up to this distance \[m\].
    fn ends(&self, distance: f64) -> [[f64; D]; 2] {
        [self.start.into(), (self.start + self.along * distance).into()]
    }

    /// Distance at which the ray leaves a body through a facet, given by its corners \[m\].
    fn exit(&self, mesh: &Mesh<D>, facet: Facet) -> Option<f64> {
        let corners: Vec<Vector<D>> = corners(mesh, facet).collect();
        let triangles = corners.len() + 1 - D;
        (1..=triangles).find_map(|second| {
            let triangle: [Vector<D>; D] =
                std::array::from_fn(|k| if k == 0 { corners[0] } else { corners[second + k - 1] });
            let whole = area(&triangle);
            let speed = self.along.dot(&whole);
            if speed.is_nan() || speed <= 0.0 {
                return None;
            }
            let distance = (triangle[0] - self.start).dot(&whole) / speed;
            let place = self.start + self.along * distance;
            let is_inside = (0..D).all(|k| {
                let mut part = triangle;
                part[k] = place;
                area(&part).dot(&whole) >= -ROUNDING * whole.norm_squared()
            });
            is_inside.then_some(distance)
        })
    }
}

fn corners<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> impl Iterator<Item = Vector<D>> + '_ {
    mesh.facet_corners(facet).map(|node| mesh.points[node as usize].into())
}

fn around<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> Bounds<D> {
    Bounds::of(mesh.facet_corners(facet).map(|node| mesh.points[node as usize]))
}

/// Vector area of an edge, or twice that of the triangle of the first two corners and the last one
/// [m, m^2].
fn area<const D: usize>(corners: &[Vector<D>]) -> Vector<D> {
    let last = corners.len() - 1;
    facet_normal(&[corners[1] - corners[0], corners[last] - corners[0]])
}

/// Outward unit normal of a facet; not a number if it has no area at its first corner.
fn outward<const D: usize>(corners: &[Vector<D>]) -> Vector<D> {
    let area = area(corners);
    area / area.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::model::read_mesh;

    /// A cup, the lower half of a ring with this outer radius and a wall of 0.5, about (0, 50). Its
    /// outer side is the bottom of the box, its inner one the top.
    fn cup(dimension: usize, radius: f64, element: &str) -> String {
        let map = format!("x: \"({radius} - y) * sin(pi * x)\", y: \"50 - ({radius} - y) * cos(pi * x)\"");
        match dimension {
            2 => format!(
                "min: [-0.5, 0], max: [0.5, 0.5], cells: [61, 2], element: {element}, map: {{ {map} }}"
            ),
            _ => format!(
                "min: [-0.5, 0, 0], max: [0.5, 0.5, 12], cells: [61, 2, 2], element: {element}, map: {{ {map} }}"
            ),
        }
    }

    /// The wall between the surfaces `contact` of two cups, of which `b` has this outer radius.
    fn wall<const D: usize>(radius: f64, element: &str, [contactor, target]: [&str; 2]) -> f64 {
        let body = |shape: String| {
            let law = "neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 }";
            format!("{{ mesh: {{ box: {{ {shape} }} }}, material: {{ {law} }} }}")
        };
        let text = format!(
            "dimension: {D}\nbodies:\n  a: {}\n  b: {}\n\
             contact: {{ joint: {{ contactor: {contactor}, target: {target}, initial_overclosure: accept }} }}\n\
             time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}\n",
            body(cup(D, 5.0, element)),
            body(cup(D, radius, element))
        );
        let case = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        let mesh = read_mesh(&case).unwrap_or_else(|error| panic!("{error}"));
        Model::<D>::new(&case).expect("a model").walls(&mesh)[0]
    }

    /// In 3D the box of an element has its second axis along y as in 2D, so that `back` and `front`
    /// are the outer and the inner side.
    const THROUGH: [[&str; 2]; 2] = [["a.bottom", "b.top"], ["a.front", "b.back"]];
    const NESTED: [&str; 2] = ["a.top", "b.bottom"];

    /// The walls of both cups lie between the outer side of one and the inner side of the smaller
    /// one.
    #[test]
    fn a_wall_between_facets_is_found() {
        for kind in ["quad4", "tri3", "quad9", "tri6"] {
            let found = wall::<2>(4.0, kind, THROUGH[0]);
            assert!((found - 0.5).abs() < 5e-3, "{kind}: {found}");
        }
        for kind in ["hex8", "tet4", "wedge6", "hex27"] {
            let found = wall::<3>(4.0, kind, THROUGH[1]);
            assert!((found - 0.5).abs() < 5e-3, "{kind}: {found}");
        }
    }

    /// Surfaces that face each other across a gap, or that overlap, have no wall between them.
    #[test]
    fn facets_that_meet_have_no_wall() {
        for radius in [4.0, 4.49, 4.6] {
            assert_eq!(wall::<2>(radius, "quad4", NESTED), f64::INFINITY, "{radius}");
        }
    }

    /// A facet that is farther away than half the box around a body makes no wall.
    #[test]
    fn far_facets_do_not_count() {
        assert_eq!(wall::<2>(1.2, "quad4", THROUGH[0]), f64::INFINITY);
    }
}
