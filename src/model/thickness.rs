//! Thickness of bodies under the surfaces of their contacts.

use super::{ContactModel, Model, Target};
use crate::mesh::{Bounds, BoundsTree, Facet, FacetIndex, Mesh};
use crate::space::facet_normal;
use crate::tensor::Vector;

/// Maximum number of facets of one contact that are measured. 1e5 facets take less than a second.
const MOST: usize = 100_000;

/// Barycentric coordinates down to which a ray hits a triangle. Facets of regular meshes lie exactly
/// opposite each other, and the ray from the centre of one passes through the common edge of two
/// triangles of the other. Other values were not tried.
const ROUNDING: f64 = 1e-9;

impl<const D: usize> Model<D> {
    /// For each contact the smallest thickness of the bodies under its two surfaces \[m\]. Infinite over
    /// an obstacle, and for bodies in contact with themselves.
    ///
    /// The thickness under a facet is the distance from its centre along the inward normal to the other
    /// side of its body, and at least the height of its element: at the tip of a wedge it would be zero.
    pub fn thicknesses(&self, mesh: &Mesh<D>) -> Vec<f64> {
        let mut boundary = None;
        let of = |contact: &ContactModel<D>| {
            let Target::Surface { set, bodies } = &contact.target else { return f64::INFINITY };
            if *bodies == contact.bodies {
                return f64::INFINITY;
            }
            let boundary = boundary.get_or_insert_with(|| Boundary::of(mesh));
            let sides = [&contact.contactor, set].map(|name| mesh.facet_sets.get(name));
            let facets: Vec<Facet> = sides.into_iter().flatten().flatten().copied().collect();
            let stride = facets.len().div_ceil(MOST).max(1);
            let measured = facets.iter().step_by(stride).map(|&facet| boundary.thickness(facet));
            measured.fold(f64::INFINITY, f64::min)
        };
        self.contacts.iter().map(of).collect()
    }
}

/// The boundary facets of all bodies, with a tree of their boxes.
struct Boundary<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    facets: Vec<Facet>,
    tree: BoundsTree<D>,
    /// Diagonal of the box around the mesh \[m\].
    diagonal: f64,
}

impl<'a, const D: usize> Boundary<'a, D> {
    fn of(mesh: &'a Mesh<D>) -> Self {
        let facets = FacetIndex::new(mesh).boundary();
        let corners = |&facet: &Facet| mesh.facet_corners(facet).map(|node| mesh.points[node as usize]);
        let boxes: Vec<Bounds<D>> = facets.iter().map(|facet| Bounds::of(corners(facet))).collect();
        let all = boxes.iter().fold(Bounds::EMPTY, |all, one| all.join(one));
        let diagonal = (Vector::from(all.high) - Vector::from(all.low)).norm();
        Self { mesh, facets, tree: BoundsTree::new(&boxes), diagonal }
    }

    fn corners(&self, facet: Facet) -> impl Iterator<Item = Vector<D>> + '_ {
        self.mesh.facet_corners(facet).map(|node| self.mesh.points[node as usize].into())
    }

    /// Thickness of the body under a facet \[m\].
    fn thickness(&self, facet: Facet) -> f64 {
        let corners: Vec<Vector<D>> = self.corners(facet).collect();
        let centre = corners.iter().sum::<Vector<D>>() / corners.len() as f64;
        let normal = outward(&corners);
        let inner = self.mesh.element_nodes(facet.element as usize).iter();
        let below = inner.map(|&node| (centre - Vector::from(self.mesh.points[node as usize])).dot(&normal));
        let height = below.fold(0.0, f64::max);
        // Sections of doubling length keep the boxes around them small.
        let (mut from, mut to) = (0.0, height);
        while height > 0.0 && from < self.diagonal {
            let ends = [from, to].map(|depth| <[f64; D]>::from(centre - normal * depth));
            let hits = self.tree.meeting(&Bounds::of(ends)).filter_map(|number| {
                let other = self.facets[number as usize];
                let own = self.mesh.body[other.element as usize] == self.mesh.body[facet.element as usize];
                let depth =
                    (own && other != facet).then(|| self.depth_of(other, &centre, &-normal)).flatten()?;
                (depth > 0.0 && depth <= to).then_some(depth)
            });
            let nearest = hits.fold(f64::INFINITY, f64::min);
            if nearest.is_finite() {
                return nearest.max(height);
            }
            (from, to) = (to, 2.0 * to);
        }
        f64::INFINITY
    }

    /// Distance along the ray from `start` in the direction `along`, of length one, at which it leaves
    /// the body through this facet \[m\].
    fn depth_of(&self, facet: Facet, start: &Vector<D>, along: &Vector<D>) -> Option<f64> {
        let corners: Vec<Vector<D>> = self.corners(facet).collect();
        (1..corners.len()).take(corners.len() + 1 - D).find_map(|second| {
            let triangle: Vec<Vector<D>> =
                std::iter::once(corners[0]).chain((0..D - 1).map(|k| corners[second + k])).collect();
            let normal = outward(&triangle);
            let speed = along.dot(&normal);
            if speed.is_nan() || speed <= 0.0 {
                return None;
            }
            let depth = (triangle[0] - start).dot(&normal) / speed;
            let place = start + along * depth;
            let inside = (0..D).all(|k| {
                let moved = |j: usize| if j == k { place } else { triangle[j] };
                let part: Vec<Vector<D>> = (0..D).map(moved).collect();
                area(&part).dot(&area(&triangle)) >= -ROUNDING * area(&triangle).norm_squared()
            });
            inside.then_some(depth)
        })
    }
}

/// Vector area of an edge or of a triangle \[m^(D - 1)\], twice as long for a triangle.
fn area<const D: usize>(corners: &[Vector<D>]) -> Vector<D> {
    let last = corners.len() - 1;
    facet_normal(&[corners[1] - corners[0], corners[last] - corners[0]])
}

/// Outward unit normal of a facet, from its first and last sides.
fn outward<const D: usize>(corners: &[Vector<D>]) -> Vector<D> {
    let area = area(corners);
    area / area.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::model::read_mesh;

    /// Thickness under a contact of `upper.bottom` with `lower.top`, given the boxes of both bodies.
    fn thickness<const D: usize>(lower: &str, upper: &str) -> f64 {
        let body = |shape: &str| {
            let law = "neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 }";
            format!("{{ mesh: {{ box: {{ {shape} }} }}, material: {{ {law} }} }}")
        };
        let text = format!(
            "dimension: {D}\nbodies:\n  lower: {}\n  upper: {}\n\
             contact: {{ joint: {{ contactor: upper.bottom, target: lower.top }} }}\n\
             time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}\n",
            body(lower),
            body(upper)
        );
        let case = Case::parse(&text, "case.yml").unwrap_or_else(|error| panic!("{error}"));
        let mesh = read_mesh(&case).unwrap_or_else(|error| panic!("{error}"));
        Model::<D>::new(&case).expect("a model").thicknesses(&mesh)[0]
    }

    const THICK: &str = "min: [-9, 20], max: [9, 40], cells: [9, 5]";

    /// The thinner body decides, for elements of all shapes.
    #[test]
    fn a_plate_has_its_thickness() {
        for kind in ["quad4", "tri3", "quad9", "tri6"] {
            let plate = format!("min: [0, 0], max: [7, 0.25], cells: [13, 2], element: {kind}");
            assert!((thickness::<2>(&plate, THICK) - 0.25).abs() < 1e-12, "{kind}");
        }
        let thick = "min: [-9, -9, 20], max: [9, 9, 40], cells: [3, 3, 3]";
        for kind in ["hex8", "tet4", "wedge6", "hex27", "tet10"] {
            let plate = format!("min: [0, 0, 0], max: [7, 5, 0.25], cells: [5, 4, 2], element: {kind}");
            assert!((thickness::<3>(&plate, thick) - 0.25).abs() < 1e-12, "{kind}");
        }
    }

    /// The wall of a half ring of radius 5 and thickness 0.5, not its width. Its outer side is the bottom
    /// of the box.
    #[test]
    fn a_ring_has_the_thickness_of_its_wall() {
        let ring = "min: [-0.5, 0], max: [0.5, 0.5], cells: [60, 2], \
                    map: { x: \"(5 - y) * sin(pi * x)\", y: \"50 - (5 - y) * cos(pi * x)\" }";
        let found = thickness::<2>("min: [-9, 0], max: [9, 20], cells: [9, 5]", ring);
        assert!((found - 0.5).abs() < 5e-3, "{found}");
    }

    /// Facets at the tip of a wedge have the height of their element.
    #[test]
    fn the_tip_of_a_wedge_is_not_thin() {
        let wedge = "min: [0, 0], max: [4, 1], cells: [8, 4], map: { y: \"50 + y * (0.25 + x)\" }";
        let found = thickness::<2>("min: [-9, 0], max: [9, 20], cells: [9, 5]", wedge);
        assert!((0.1..1.0).contains(&found), "{found}");
    }
}
