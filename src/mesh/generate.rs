//! Rectangles and boxes of every kind of element.
//!
//! All kinds use one lattice: cells in a linear mesh, half cells in a quadratic one and in one of
//! pyramids, which meet in the centre of their cell. The corners of a cell are divided into elements.
//! Each further node is the mean of its parents, which is also a lattice point.

use super::{ElementKind, Facet, Mesh};
use crate::error::{Error, Result};

/// A rectangle or box with edges along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxShape<const D: usize> {
    /// Corner with the lowest coordinates \[m\].
    pub min: [f64; D],
    /// Corner with the highest coordinates \[m\].
    pub max: [f64; D],
    /// Cells along each axis. A cell is one quadrilateral or hexahedron, two triangles or
    /// wedges, or six tetrahedra or pyramids.
    pub cells: [u32; D],
    /// Kind of all elements.
    pub element: ElementKind,
}

/// Integer position of a node, in lattice steps.
type Place<const D: usize> = [u32; D];

/// Corners of a cell in the node order of a hexahedron, and its centre, in half cells. A plane cell has
/// the first four.
const CORNERS: [[u32; 3]; 9] =
    [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2], [1, 1, 1]];

const QUAD: &[&[u8]] = &[&[0, 1, 2, 3]];
const HEX: &[&[u8]] = &[&[0, 1, 2, 3, 4, 5, 6, 7]];
/// The two ways to halve a quadrilateral. Cells alternate between them, so that the mesh has no
/// preferred direction.
const HALVES: [&[&[u8]]; 2] = [&[&[0, 1, 2], &[0, 2, 3]], &[&[0, 1, 3], &[1, 2, 3]]];
/// The halves of a hexahedron above those of a quadrilateral.
const WEDGES: [&[&[u8]]; 2] =
    [&[&[0, 1, 2, 4, 5, 6], &[0, 2, 3, 4, 6, 7]], &[&[0, 1, 3, 4, 5, 7], &[1, 2, 3, 5, 6, 7]]];
/// Six tetrahedra around the diagonal from corner 0 to corner 6 (Kuhn). The faces of neighbouring
/// cells match.
const SIXTHS: &[&[u8]] =
    &[&[0, 1, 2, 6], &[0, 2, 3, 6], &[0, 3, 7, 6], &[0, 7, 4, 6], &[0, 4, 5, 6], &[0, 5, 1, 6]];

/// Six pyramids on the sides, with the centre as their apex.
const PYRAMIDS: &[&[u8]] = &[
    &[0, 1, 2, 3, 8],
    &[4, 7, 6, 5, 8],
    &[0, 4, 5, 1, 8],
    &[1, 5, 6, 2, 8],
    &[2, 6, 7, 3, 8],
    &[0, 3, 7, 4, 8],
];

/// A division of a cell: the corners of each element.
type Pieces = &'static [&'static [u8]];

impl<const D: usize> BoxShape<D> {
    /// The mesh, with facet sets `left` and `right` (x), `bottom` and `top` (the last coordinate),
    /// and in 3D `front` and `back` (y). Nodes and elements are numbered row by row from the
    /// bottom, x fastest.
    ///
    /// # Errors
    /// There are no cells, the box is empty or unbounded, the element has another dimension, or the
    /// number of unknowns exceeds 32 bits.
    pub fn mesh(&self) -> Result<Mesh<D>> {
        self.check()?;
        let mut mesh = Mesh::with_points(self.lattice());
        let mut cell: Place<D> = [0; D];
        for _ in 0..self.cells.iter().map(|&n| n as usize).product() {
            for corners in self.pieces(cell) {
                self.add_element(cell, corners, &mut mesh);
            }
            advance(&mut cell, |axis| self.cells[axis]);
        }
        mesh.drop_unused_points();
        Ok(mesh)
    }

    fn check(&self) -> Result<()> {
        if self.element.dimension() != D {
            let known: Vec<_> = ElementKind::SOLIDS.iter().filter(|kind| kind.dimension() == D).collect();
            let known = known.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ");
            let message = format!("a box in {D} dimensions can not be made of {} elements", self.element);
            return Err(Error::case(message).hint(&format!("known: {known}")));
        }
        for axis in 0..D {
            let low = self.min[axis];
            let high = self.max[axis];
            let name = ["x", "y", "z"][axis];
            let step = (high - low) / f64::from(self.cells[axis]);
            if self.cells[axis] == 0 {
                let message = format!("the box has no cells in {name}");
                return Err(Error::case(message).hint("`cells` needs at least 1 along each axis"));
            }
            if !(low < high && step.is_finite() && low + 0.5 * step > low && high - 0.5 * step < high) {
                let message = format!("the box is empty in {name}: min = {low}, max = {high}");
                return Err(Error::case(message).hint("`max` must be greater than `min`, both finite"));
            }
        }
        self.check_size()
    }

    fn check_size(&self) -> Result<()> {
        let product = |of: &dyn Fn(usize) -> f64| (0..D).map(of).product::<f64>();
        let unknowns =
            D as f64 * product(&|k| f64::from(self.cells[k]) * f64::from(self.steps_per_cell()) + 1.0);
        let per_cell = self.pieces([0; D]).len() * self.element.nodes();
        let entries = per_cell as f64 * product(&|k| f64::from(self.cells[k]));
        if unknowns > f64::from(i32::MAX) || entries > f64::from(u32::MAX) {
            let message = format!("the box would have {unknowns:.1e} unknowns, more than {}", i32::MAX);
            return Err(Error::case(message).hint("use fewer cells"));
        }
        Ok(())
    }

    /// Lattice steps of a cell along an axis.
    fn steps_per_cell(&self) -> u32 {
        match (D, self.element.corners()) {
            (3, 5) => 2,
            _ => self.element.order() as u32,
        }
    }

    /// Lattice steps along an axis.
    fn steps(&self, axis: usize) -> u32 {
        self.cells[axis] * self.steps_per_cell()
    }

    /// Position of every lattice point, x fastest. The end coordinates are exact.
    fn lattice(&self) -> Vec<[f64; D]> {
        let count = (0..D).map(|axis| self.steps(axis) as usize + 1).product();
        let mut place: Place<D> = [0; D];
        let mut points = Vec::with_capacity(count);
        for _ in 0..count {
            points.push(std::array::from_fn(|axis| {
                let t = f64::from(place[axis]) / f64::from(self.steps(axis));
                self.min[axis] * (1.0 - t) + self.max[axis] * t
            }));
            advance(&mut place, |axis| self.steps(axis) + 1);
        }
        points
    }

    fn pieces(&self, cell: Place<D>) -> Pieces {
        match (D, self.element.corners()) {
            (2, 3) => HALVES[cell.iter().sum::<u32>() as usize % 2],
            (2, _) => QUAD,
            (_, 4) => SIXTHS,
            (_, 5) => PYRAMIDS,
            (_, 6) => WEDGES[cell.iter().take(2).sum::<u32>() as usize % 2],
            _ => HEX,
        }
    }

    fn add_element(&self, cell: Place<D>, corners: &[u8], mesh: &mut Mesh<D>) {
        let kind = self.element;
        let places: Vec<Place<D>> = kind.parents().iter().map(|of| self.place(cell, corners, of)).collect();
        let element = mesh.push(kind, places.iter().map(|&place| self.number(place)));
        for (side, nodes) in kind.sides().iter().enumerate() {
            let on_side = |axis: usize, at: u32| nodes.iter().all(|&n| places[n as usize][axis] == at);
            for axis in 0..D {
                for (end, name) in [0, self.steps(axis)].into_iter().zip(side_names::<D>(axis)) {
                    if on_side(axis, end) {
                        let facet = Facet { element, side: side as u8 };
                        mesh.facet_sets.entry(name.to_owned()).or_default().push(facet);
                    }
                }
            }
        }
    }

    /// Mean of the parents, which is a lattice point.
    fn place(&self, cell: Place<D>, corners: &[u8], parents: &[u8]) -> Place<D> {
        let steps = self.steps_per_cell();
        std::array::from_fn(|axis| {
            let offset = |&parent: &u8| CORNERS[corners[parent as usize] as usize][axis];
            let halves = parents.iter().map(offset).sum::<u32>();
            cell[axis] * steps + steps * halves / (2 * parents.len() as u32)
        })
    }

    fn number(&self, place: Place<D>) -> u32 {
        (0..D).rev().fold(0, |number, axis| number * (self.steps(axis) + 1) + place[axis])
    }
}

/// Names of the facet sets at the low and the high end of an axis.
fn side_names<const D: usize>(axis: usize) -> [&'static str; 2] {
    match axis {
        0 => ["left", "right"],
        _ if axis + 1 == D => ["bottom", "top"],
        _ => ["front", "back"],
    }
}

/// The next position, x fastest.
fn advance<const D: usize>(place: &mut Place<D>, count: impl Fn(usize) -> u32) {
    for (axis, at) in place.iter_mut().enumerate() {
        *at += 1;
        if *at < count(axis) {
            return;
        }
        *at = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{FacetIndex, measure};
    use ElementKind::{Hex8, Hex20, Hex27, Quad4, Quad8, Quad9, Tet4, Tet10, Tri3, Tri6};

    fn plane(element: ElementKind) -> Mesh<2> {
        BoxShape { min: [-1.0, 0.5], max: [2.0, 2.5], cells: [3, 4], element }.mesh().unwrap()
    }

    fn solid(element: ElementKind) -> Mesh<3> {
        BoxShape { min: [0.0, -1.0, 2.0], max: [2.0, 2.0, 3.0], cells: [2, 3, 4], element }.mesh().unwrap()
    }

    fn of_dimension(d: usize) -> impl Iterator<Item = ElementKind> {
        ElementKind::SOLIDS.into_iter().filter(move |kind| kind.dimension() == d)
    }

    /// For every kind, elements fill the box exactly and the facet sets are its whole surface.
    #[test]
    fn elements_fill_the_box_and_sets_are_its_surface() {
        for kind in of_dimension(2) {
            let mesh = plane(kind);
            assert!((measure::volume(&mesh) - 6.0).abs() < 1e-13, "{kind}");
            check_sets(
                &mesh,
                &[("bottom", [0.0, -3.0]), ("left", [-2.0, 0.0]), ("right", [2.0, 0.0]), ("top", [0.0, 3.0])],
            );
        }
        for kind in of_dimension(3) {
            let mesh = solid(kind);
            assert!((measure::volume(&mesh) - 6.0).abs() < 1e-13, "{kind}");
            let areas = [
                ("back", [0.0, 2.0, 0.0]),
                ("bottom", [0.0, 0.0, -6.0]),
                ("front", [0.0, -2.0, 0.0]),
                ("left", [-3.0, 0.0, 0.0]),
                ("right", [3.0, 0.0, 0.0]),
                ("top", [0.0, 0.0, 6.0]),
            ];
            check_sets(&mesh, &areas);
        }
    }

    fn check_sets<const D: usize>(mesh: &Mesh<D>, areas: &[(&str, [f64; D])]) {
        assert_eq!(mesh.facet_sets.keys().collect::<Vec<_>>(), areas.iter().map(|a| a.0).collect::<Vec<_>>());
        for (name, area) in areas {
            let found = measure::area(mesh, &mesh.facet_sets[*name]);
            for k in 0..D {
                assert!((found[k] - area[k]).abs() < 1e-13, "{name}: {found:?}");
            }
        }
        let mut all: Vec<Facet> = mesh.facet_sets.values().flatten().copied().collect();
        all.sort_unstable();
        assert_eq!(all, FacetIndex::new(mesh).boundary());
        assert_eq!(FacetIndex::new(mesh).overcrowded().count(), 0);
    }

    /// For every kind, each further node is the mean of its parents and every point is used.
    #[test]
    fn midside_nodes_lie_between_their_corners() {
        for kind in of_dimension(2) {
            measure::assert_straight(&plane(kind));
        }
        for kind in of_dimension(3) {
            measure::assert_straight(&solid(kind));
        }
    }

    /// Node counts: all lattice points except the centres, which serendipity elements do not have.
    #[test]
    fn node_counts() {
        assert_eq!(plane(Quad4).points.len(), 4 * 5);
        assert_eq!(plane(Quad9).points.len(), 7 * 9);
        assert_eq!(plane(Quad8).points.len(), 7 * 9 - 12);
        assert_eq!(plane(Tri3).element_count(), 24);
        assert_eq!(plane(Tri6).points.len(), 7 * 9);
        assert_eq!(solid(Hex27).points.len(), 5 * 7 * 9);
        assert_eq!(solid(Hex20).points.len(), 3 * 4 * 5 + (2 * 4 * 5 + 3 * 3 * 5 + 3 * 4 * 4));
        assert_eq!(solid(Tet4).element_count(), 6 * 24);
        assert_eq!(solid(Tet10).points.len(), 5 * 7 * 9);
    }

    /// Nodes are numbered row by row from the bottom left, x fastest. The end coordinates of the
    /// box are exact.
    #[test]
    fn nodes_run_row_by_row() {
        let block = BoxShape { min: [0.0, 0.0], max: [0.48, 0.5], cells: [48, 50], element: Quad4 };
        let mesh = block.mesh().unwrap();
        assert_eq!(mesh.points[0], [0.0, 0.0]);
        assert_eq!(mesh.points[48], [0.48, 0.0]);
        assert_eq!(mesh.points[49], [0.0, 0.01]);
        assert_eq!(mesh.points[49 * 51 - 1], [0.48, 0.5]);
        assert_eq!(mesh.element_nodes(49), [50, 51, 100, 99]);
        assert_eq!(mesh.set_nodes("bottom").unwrap(), (0..49).collect::<Vec<u32>>());
        assert_eq!(mesh.bounding_box(), Some(([0.0, 0.0], [0.48, 0.5])));
    }

    /// Invalid boxes are rejected with the reason.
    #[test]
    fn impossible_boxes_are_refused() {
        let good = BoxShape { min: [0.0, 0.0], max: [1.0, 1.0], cells: [2, 2], element: Quad4 };
        let reason = |shape: BoxShape<2>| shape.mesh().unwrap_err().message;
        assert!(reason(BoxShape { cells: [2, 0], ..good }).contains("no cells in y"));
        assert!(reason(BoxShape { max: [0.0, 1.0], ..good }).contains("empty in x"));
        assert!(reason(BoxShape { max: [1.0, f64::NAN], ..good }).contains("empty in y"));
        assert!(reason(BoxShape { min: [f64::NEG_INFINITY, 0.0], ..good }).contains("empty in x"));
        assert!(reason(BoxShape { min: [1e20, 0.0], max: [1e20 + 2e4, 1.0], ..good }).contains("empty in x"));
        assert!(reason(BoxShape { element: Hex8, ..good }).contains("known: tri3, tri6, quad4"));
        assert!(reason(BoxShape { element: ElementKind::Line2, ..good }).contains("line2"));
        assert!(reason(BoxShape { cells: [u32::MAX, u32::MAX], ..good }).contains("fewer cells"));
    }
}
