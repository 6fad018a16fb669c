//! Element data: node counts, sides, and the codes and node orders of VTK and Gmsh.
//!
//! Node order is VTK's for every kind: corners, then midside nodes, then face centres, then the
//! centre. Output therefore needs no permutation; the Gmsh reader permutes once.

use std::fmt;

/// Shape and order of an element or of a facet. Lines occur as facets of plane elements only.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
#[allow(missing_docs)] // The names say it: shape and number of nodes.
pub enum ElementKind {
    Line2,
    Line3,
    Tri3,
    Tri6,
    Quad4,
    Quad8,
    Quad9,
    Tet4,
    Tet10,
    Hex8,
    Hex20,
    Hex27,
    Wedge6,
    Pyramid5,
}

use ElementKind::*;

/// All data of a kind, one row of the table.
struct Row {
    name: &'static str,
    dimension: usize,
    corners: usize,
    /// For each node, the corners whose mean it is in a straight-sided element.
    parents: &'static [&'static [u8]],
    sides: &'static [&'static [u8]],
    vtk: u8,
    gmsh: i32,
    gmsh_order: &'static [u8],
}

impl ElementKind {
    /// Every kind, facets included, in the order of the enumeration.
    pub const ALL: [Self; 14] =
        [Line2, Line3, Tri3, Tri6, Quad4, Quad8, Quad9, Tet4, Tet10, Hex8, Hex20, Hex27, Wedge6, Pyramid5];

    /// The kinds of solid elements in two or three dimensions.
    pub const SOLIDS: [Self; 12] =
        [Tri3, Tri6, Quad4, Quad8, Quad9, Tet4, Tet10, Hex8, Hex20, Hex27, Wedge6, Pyramid5];

    /// The name in case files and messages, for example `quad4`.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Dimension of the reference element: 1, 2 or 3.
    pub fn dimension(self) -> usize {
        self.row().dimension
    }

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        self.row().parents.len()
    }

    /// Number of corner nodes; they come first in the node order.
    pub fn corners(self) -> usize {
        self.row().corners
    }

    /// Polynomial order along an edge, 1 or 2.
    pub fn order(self) -> usize {
        if self.nodes() == self.corners() { 1 } else { 2 }
    }

    /// For each node, the corners whose mean it is in an element with straight sides.
    ///
    /// Shape `nodes()`: one entry for a corner, two for a midside node, more for the centre of a
    /// face or of the element.
    pub fn parents(self) -> &'static [&'static [u8]] {
        self.row().parents
    }

    /// Local nodes of each side, in the node order of [`side_kind`](Self::side_kind), oriented
    /// outward.
    ///
    /// Outward means that the normal vector points out of the element. In 2D it is `(t_y, -t_x)` of
    /// the edge's tangent `t`, in 3D the cross product of the two tangents. A line has no sides.
    pub fn sides(self) -> &'static [&'static [u8]] {
        self.row().sides
    }

    /// The kind of a side, an index into [`sides`](Self::sides). The sides of wedges and
    /// pyramids are triangles and quadrilaterals. For a side that does not
    /// exist it is the kind of the element.
    pub fn side_kind(self, side: usize) -> Self {
        match (self.dimension(), self.sides().get(side).map_or(0, |nodes| nodes.len())) {
            (2, 2) => Line2,
            (2, 3) => Line3,
            (3, 3) => Tri3,
            (3, 4) => Quad4,
            (3, 6) => Tri6,
            (3, 8) => Quad8,
            (3, 9) => Quad9,
            _ => self,
        }
    }

    /// Cell type of the VTK file formats.
    pub fn vtk_type(self) -> u8 {
        self.row().vtk
    }

    /// Element type of the MSH file format.
    pub fn gmsh_type(self) -> i32 {
        self.row().gmsh
    }

    /// Node `i` here is node `gmsh_order()[i]` in an MSH file. Shape `nodes()`.
    pub fn gmsh_order(self) -> &'static [u8] {
        self.row().gmsh_order
    }

    /// The kind of an MSH element type, if this program supports it.
    pub fn from_gmsh(code: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.gmsh_type() == code)
    }

    /// The kind with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }
}

impl fmt::Display for ElementKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

const NATURAL: [u8; 27] = {
    let mut order = [0; 27];
    let mut i = 0;
    while i < 27 {
        order[i] = i as u8;
        i += 1;
    }
    order
};

const fn natural(nodes: usize) -> &'static [u8] {
    const ORDER: &[u8] = &NATURAL;
    ORDER.split_at(nodes).0
}

const LINE: &[&[u8]] = &[&[0], &[1], &[0, 1]];
const TRI: &[&[u8]] = &[&[0], &[1], &[2], &[0, 1], &[1, 2], &[2, 0]];
const QUAD: &[&[u8]] = &[&[0], &[1], &[2], &[3], &[0, 1], &[1, 2], &[2, 3], &[3, 0], &[0, 1, 2, 3]];
const TET: &[&[u8]] = &[&[0], &[1], &[2], &[3], &[0, 1], &[1, 2], &[2, 0], &[0, 3], &[1, 3], &[2, 3]];
#[rustfmt::skip]
const HEX: &[&[u8]] = &[
    &[0], &[1], &[2], &[3], &[4], &[5], &[6], &[7],
    &[0, 1], &[1, 2], &[2, 3], &[3, 0], &[4, 5], &[5, 6], &[6, 7], &[7, 4], &[0, 4], &[1, 5], &[2, 6], &[3, 7],
    &[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 3, 2, 1], &[4, 5, 6, 7],
    &[0, 1, 2, 3, 4, 5, 6, 7],
];

const WEDGE: &[&[u8]] = &[&[0], &[1], &[2], &[3], &[4], &[5]];

const PYRAMID: &[&[u8]] = &[&[0], &[1], &[2], &[3], &[4]];

const GMSH_TET10: &[u8] = &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
#[rustfmt::skip]
const GMSH_HEX: &[u8] = &[
    0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26,
];

/// One row for each kind, in the order of the enumeration.
#[rustfmt::skip]
static TABLE: [Row; 14] = [
    Row { name: "line2", dimension: 1, corners: 2, parents: LINE.split_at(2).0, sides: &[],
          vtk: 3, gmsh: 1, gmsh_order: natural(2) },
    Row { name: "line3", dimension: 1, corners: 2, parents: LINE, sides: &[],
          vtk: 21, gmsh: 8, gmsh_order: natural(3) },
    Row { name: "tri3", dimension: 2, corners: 3, parents: TRI.split_at(3).0,
          sides: &[&[0, 1], &[1, 2], &[2, 0]],
          vtk: 5, gmsh: 2, gmsh_order: natural(3) },
    Row { name: "tri6", dimension: 2, corners: 3, parents: TRI,
          sides: &[&[0, 1, 3], &[1, 2, 4], &[2, 0, 5]],
          vtk: 22, gmsh: 9, gmsh_order: natural(6) },
    Row { name: "quad4", dimension: 2, corners: 4, parents: QUAD.split_at(4).0,
          sides: &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
          vtk: 9, gmsh: 3, gmsh_order: natural(4) },
    Row { name: "quad8", dimension: 2, corners: 4, parents: QUAD.split_at(8).0,
          sides: &[&[0, 1, 4], &[1, 2, 5], &[2, 3, 6], &[3, 0, 7]],
          vtk: 23, gmsh: 16, gmsh_order: natural(8) },
    Row { name: "quad9", dimension: 2, corners: 4, parents: QUAD,
          sides: &[&[0, 1, 4], &[1, 2, 5], &[2, 3, 6], &[3, 0, 7]],
          vtk: 28, gmsh: 10, gmsh_order: natural(9) },
    Row { name: "tet4", dimension: 3, corners: 4, parents: TET.split_at(4).0,
          sides: &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]],
          vtk: 10, gmsh: 4, gmsh_order: natural(4) },
    Row { name: "tet10", dimension: 3, corners: 4, parents: TET,
          sides: &[&[0, 1, 3, 4, 8, 7], &[1, 2, 3, 5, 9, 8], &[2, 0, 3, 6, 7, 9], &[0, 2, 1, 6, 5, 4]],
          vtk: 24, gmsh: 11, gmsh_order: GMSH_TET10 },
    Row { name: "hex8", dimension: 3, corners: 8, parents: HEX.split_at(8).0,
          sides: &[&[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 3, 2, 1], &[4, 5, 6, 7]],
          vtk: 12, gmsh: 5, gmsh_order: natural(8) },
    Row { name: "hex20", dimension: 3, corners: 8, parents: HEX.split_at(20).0,
          sides: &[&[0, 4, 7, 3, 16, 15, 19, 11], &[1, 2, 6, 5, 9, 18, 13, 17], &[0, 1, 5, 4, 8, 17, 12, 16],
                   &[3, 7, 6, 2, 19, 14, 18, 10], &[0, 3, 2, 1, 11, 10, 9, 8], &[4, 5, 6, 7, 12, 13, 14, 15]],
          vtk: 25, gmsh: 17, gmsh_order: GMSH_HEX.split_at(20).0 },
    Row { name: "hex27", dimension: 3, corners: 8, parents: HEX,
          sides: &[&[0, 4, 7, 3, 16, 15, 19, 11, 20], &[1, 2, 6, 5, 9, 18, 13, 17, 21], &[0, 1, 5, 4, 8, 17, 12, 16, 22],
                   &[3, 7, 6, 2, 19, 14, 18, 10, 23], &[0, 3, 2, 1, 11, 10, 9, 8, 24], &[4, 5, 6, 7, 12, 13, 14, 15, 25]],
          vtk: 29, gmsh: 12, gmsh_order: GMSH_HEX },
    Row { name: "wedge6", dimension: 3, corners: 6, parents: WEDGE,
          sides: &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
          vtk: 13, gmsh: 6, gmsh_order: natural(6) },
    Row { name: "pyramid5", dimension: 3, corners: 5, parents: PYRAMID,
          sides: &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
          vtk: 14, gmsh: 7, gmsh_order: natural(5) },
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of the reference corners on the unit cube or simplex: a position for every node of a
    /// straight element.
    fn node_places(kind: ElementKind) -> Vec<[f64; 3]> {
        let corner = |c: u8| -> [f64; 3] {
            match kind {
                Line2 | Line3 => [[0., 0., 0.], [1., 0., 0.]][c as usize],
                Tri3 | Tri6 | Tet4 | Tet10 => {
                    [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]][c as usize]
                }
                Pyramid5 => {
                    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0.5, 0.5, 1.]][c as usize]
                }
                Wedge6 => {
                    let z = f64::from(c / 3);
                    [[0., 0., z], [1., 0., z], [0., 1., z]][c as usize % 3]
                }
                _ => {
                    let z = f64::from(c / 4);
                    [[0., 0., z], [1., 0., z], [1., 1., z], [0., 1., z]][c as usize % 4]
                }
            }
        };
        let mean = |parents: &&[u8]| -> [f64; 3] {
            std::array::from_fn(|k| parents.iter().map(|&c| corner(c)[k]).sum::<f64>() / parents.len() as f64)
        };
        kind.parents().iter().map(mean).collect()
    }

    fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| a[k] - b[k])
    }

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        a.iter().zip(b).map(|(x, y)| x * y).sum()
    }

    /// Each row has the index of its kind, and names and codes map back to the kind.
    #[test]
    fn table_is_in_the_order_of_the_enumeration() {
        for kind in ElementKind::ALL {
            let spelled = format!("{kind:?}").to_lowercase();
            assert_eq!(kind.name(), spelled);
            assert!(spelled.ends_with(&kind.nodes().to_string()));
            assert_eq!(ElementKind::from_name(kind.name()), Some(kind));
            assert_eq!(ElementKind::from_gmsh(kind.gmsh_type()), Some(kind));
        }
        assert_eq!(ElementKind::from_gmsh(13), None);
    }

    /// The permutation to Gmsh's node order contains each node once.
    #[test]
    fn gmsh_order_is_a_permutation() {
        for kind in ElementKind::ALL {
            let mut order = kind.gmsh_order().to_vec();
            order.sort_unstable();
            assert_eq!(order, natural(kind.nodes()), "{kind}");
        }
    }

    /// The nodes of a side have the order of its facet kind: each midside node lies between the
    /// correct corners.
    #[test]
    fn sides_follow_the_node_order_of_their_facet_kind() {
        for kind in ElementKind::SOLIDS {
            for (number, side) in kind.sides().iter().enumerate() {
                let facet = kind.side_kind(number);
                assert_eq!(facet.dimension() + 1, kind.dimension());
                assert_eq!(facet.order(), kind.order());
                assert_eq!(side.len(), facet.nodes(), "{kind}");
                for (local, parents) in facet.parents().iter().enumerate() {
                    let mut expected: Vec<u8> = parents.iter().map(|&c| side[c as usize]).collect();
                    let mut found = kind.parents()[side[local] as usize].to_vec();
                    expected.sort_unstable();
                    found.sort_unstable();
                    assert_eq!(found, expected, "{kind} side {side:?} node {local}");
                }
            }
        }
    }

    /// The sides of an element are oriented outward and form a closed surface: their area vectors
    /// sum to zero.
    #[test]
    fn sides_point_outward_and_close_the_element() {
        for kind in ElementKind::SOLIDS {
            let x = node_places(kind);
            let corners = kind.corners() as f64;
            let centre: [f64; 3] =
                std::array::from_fn(|k| x[..kind.corners()].iter().map(|p| p[k]).sum::<f64>() / corners);
            let mut total = [0.0; 3];
            for (number, side) in kind.sides().iter().enumerate() {
                let p = |i: usize| x[side[i] as usize];
                let area = match kind.side_kind(number).corners() {
                    2 => [p(1)[1] - p(0)[1], p(0)[0] - p(1)[0], 0.0],
                    3 => cross(minus(p(1), p(0)), minus(p(2), p(0))).map(|v| v / 2.0),
                    _ => cross(minus(p(2), p(0)), minus(p(3), p(1))).map(|v| v / 2.0),
                };
                assert!(dot(area, minus(p(0), centre)) > 0.0, "{kind} side {side:?}");
                total = std::array::from_fn(|k| total[k] + area[k]);
            }
            assert!(dot(total, total) < 1e-24, "{kind}");
        }
    }

    fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }
}
