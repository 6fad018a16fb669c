//! The facets around a node, divided at sharp edges.

use crate::tensor::Vector;

/// Cosine of the angle between facets from which on their common edge is sharp (50 degrees). Edges of
/// a cube and of a hexagonal bar (60 degrees) are sharp; a ring of eight straight facets (45 degrees)
/// is not.
///
/// At twice the angle the edges of a cube are joined: of ten blocks, one of each kind of element, that
/// are pressed into a die with edges of a twenty-fifth of a facet, six end with code 5 instead of
/// none. At half of it the corners of a wheel of ten straight facets are divided, and its force in
/// a hollow disc 6 % larger changes by 5 %.
const SHARP: f64 = 0.64;

/// A facet at one of its corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacetCorner<const D: usize> {
    /// Outward normal at the corner, of any length.
    pub normal: Vector<D>,
    /// The corners before and after this one.
    pub beside: [u32; 2],
}

impl<const D: usize> FacetCorner<D> {
    /// Whether both facets meet at an edge that is not sharp. In 2D the edge is the node itself.
    fn continues(&self, other: &Self) -> bool {
        let meets = D == 2 || self.beside.iter().any(|node| other.beside.contains(node));
        meets && self.normal.dot(&other.normal) > SHARP * self.normal.norm() * other.normal.norm()
    }
}

/// For each of these facets around a node the number of the smooth part that it belongs to. The parts
/// are numbered in the order of their first facets.
pub fn smooth_parts<const D: usize>(corners: &[FacetCorner<D>]) -> Vec<u32> {
    let mut parts = vec![None; corners.len()];
    let mut count = 0;
    for first in 0..corners.len() {
        if parts[first].is_some() {
            continue;
        }
        parts[first] = Some(count);
        let mut open = vec![first];
        while let Some(facet) = open.pop() {
            for other in 0..corners.len() {
                if parts[other].is_none() && corners[facet].continues(&corners[other]) {
                    parts[other] = Some(count);
                    open.push(other);
                }
            }
        }
        count += 1;
    }
    parts.into_iter().flatten().collect()
}

/// Whether the surface has a sharp edge at a node with these facets around it, or ends there.
pub fn is_at_edge<const D: usize>(corners: &[FacetCorner<D>]) -> bool {
    let ends = match D {
        2 => corners.len() == 1,
        _ => {
            let beside = || corners.iter().flat_map(|corner| corner.beside);
            beside().any(|node| beside().filter(|&other| other == node).count() == 1)
        }
    };
    ends || smooth_parts(corners).iter().any(|part| *part > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(normal: [f64; 3], beside: [u32; 2]) -> FacetCorner<3> {
        FacetCorner { normal: normal.into(), beside }
    }

    /// The corner of a cube has three parts, a point of its edge two, a point of a face one.
    #[test]
    fn a_cube_has_parts_at_its_edges() {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(smooth_parts(&[corner(x, [1, 2]), corner(y, [2, 3]), corner(z, [3, 1])]), [0, 1, 2]);
        let edge = [corner(x, [1, 2]), corner(y, [2, 3]), corner(y, [3, 4]), corner(x, [4, 1])];
        assert_eq!(smooth_parts(&edge), [0, 1, 1, 0]);
        let face = [corner(z, [1, 2]), corner(z, [3, 4]), corner(z, [2, 3]), corner(z, [4, 1])];
        assert_eq!(smooth_parts(&face), [0; 4]);
    }

    /// Points of an edge of a cube and on the boundary of a face are at an edge, those within a face are not.
    #[test]
    fn a_face_ends_at_its_boundary() {
        let [y, z] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let face = [corner(z, [1, 2]), corner(z, [2, 3]), corner(z, [3, 4]), corner(z, [4, 1])];
        assert!(!is_at_edge(&face));
        assert!(is_at_edge(&face[..3]) && is_at_edge(&face[..1]));
        let edge = [face[0], face[1], corner(y, [3, 4]), corner(y, [4, 1])];
        assert!(is_at_edge(&edge));
        let line = FacetCorner { normal: Vector::<2>::new(0.0, 1.0), beside: [0; 2] };
        assert!(is_at_edge(&[line]) && !is_at_edge(&[line, line]));
    }

    /// Facets that share no edge are not one part, even if they face the same way.
    #[test]
    fn facets_that_meet_in_a_point_are_apart() {
        let z = [0.0, 0.0, 1.0];
        assert_eq!(smooth_parts(&[corner(z, [1, 2]), corner(z, [3, 4])]), [0, 1]);
    }

    /// In the plane the angle decides: 45 degrees are smooth, 60 degrees are sharp.
    #[test]
    fn the_angle_decides() {
        for (degrees, parts) in [(0.0_f64, [0, 0]), (45.0, [0, 0]), (60.0, [0, 1]), (90.0, [0, 1])] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let beside = [0; 2];
            let line = FacetCorner { normal: Vector::<2>::new(2.0, 0.0), beside };
            let other = FacetCorner { normal: Vector::<2>::new(3.0 * cos, 3.0 * sin), beside };
            assert_eq!(smooth_parts(&[line, other]), parts, "{degrees} degrees");
        }
    }
}
