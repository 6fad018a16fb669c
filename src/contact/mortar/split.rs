//! Division of facets into linear pieces (lines, triangles and quadrilaterals between corners) for
//! the segment search.
//!
//! A linear facet is one piece. A quadratic facet is divided at its mid-side nodes and, if it is a
//! quadrilateral, at its centre. Pieces only pair the points of the two sides. The integrands use
//! the true shape of the facet.

use super::shape::FacetShape;
use crate::mesh::ElementKind;
use crate::tensor::Vector;

/// Maximum number of corners of a piece.
pub const MOST_CORNERS: usize = 4;

/// A corner of a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Coordinates in the reference domain of the facet.
    pub at: [f64; 2],
    /// The node at this corner; `None` at the centre of a quad8.
    pub node: Option<usize>,
}

/// A linear piece of a facet.
#[derive(Debug, Clone, PartialEq)]
pub struct FacetPiece {
    /// Line2, tri3 or quad4.
    pub kind: ElementKind,
    /// Its corners, in the order of the kind.
    pub corners: Vec<Corner>,
    /// Measure of the piece in the reference domain of the facet, divided by that of its own
    /// reference domain.
    pub scale: f64,
}

/// The pieces of a facet of `kind`.
pub fn pieces(kind: ElementKind) -> &'static [FacetPiece] {
    static PIECES: std::sync::LazyLock<Vec<Vec<FacetPiece>>> = std::sync::LazyLock::new(|| {
        ElementKind::ALL
            .iter()
            .map(|&kind| if kind.dimension() < 3 { cut(kind) } else { Vec::new() })
            .collect()
    });
    &PIECES[kind as usize]
}

/// The linear kind with the corners of `kind`, on which the weight functions of the vertices are
/// defined.
pub fn linear(kind: ElementKind) -> ElementKind {
    match kind {
        ElementKind::Line2 | ElementKind::Line3 => ElementKind::Line2,
        ElementKind::Tri3 | ElementKind::Tri6 => ElementKind::Tri3,
        _ => ElementKind::Quad4,
    }
}

/// Node numbers of the pieces; [`CENTRE`] denotes the centre.
fn layout(kind: ElementKind) -> &'static [&'static [usize]] {
    match kind {
        ElementKind::Line2 => &[&[0, 1]],
        ElementKind::Line3 => &[&[0, 2], &[2, 1]],
        ElementKind::Tri3 => &[&[0, 1, 2]],
        ElementKind::Tri6 => &[&[0, 3, 5], &[3, 1, 4], &[5, 4, 2], &[3, 4, 5]],
        ElementKind::Quad4 => &[&[0, 1, 2, 3]],
        _ => &[&[0, 4, CENTRE, 7], &[4, 1, 5, CENTRE], &[CENTRE, 5, 2, 6], &[7, CENTRE, 6, 3]],
    }
}

/// Index of the centre among the nodes of a quad9; a quad8 has no node there.
const CENTRE: usize = 8;

fn cut(kind: ElementKind) -> Vec<FacetPiece> {
    let places = crate::space::reference(if kind == ElementKind::Quad8 { ElementKind::Quad9 } else { kind });
    let corner = |&number: &usize| {
        let at = places.node_coordinates()[number];
        Corner { at: [at[0], at[1]], node: (number < kind.nodes()).then_some(number) }
    };
    let layout = layout(kind);
    let piece = |numbers: &&[usize]| FacetPiece {
        kind: linear(kind),
        corners: numbers.iter().map(corner).collect(),
        scale: 1.0 / layout.len() as f64,
    };
    layout.iter().map(piece).collect()
}

impl FacetPiece {
    /// Positions of the corners \[m\] of a piece, for a facet of `kind` with nodes at `nodes`.
    pub fn positions<const D: usize>(
        &self,
        kind: ElementKind,
        nodes: &[Vector<D>],
    ) -> [Vector<D>; MOST_CORNERS] {
        let mut positions = [Vector::zeros(); MOST_CORNERS];
        for (position, corner) in positions.iter_mut().zip(&self.corners) {
            *position = match corner.node {
                Some(node) => nodes[node],
                None => {
                    let shape = FacetShape::at(kind, corner.at);
                    nodes.iter().zip(shape.value).map(|(x, n)| x * n).sum()
                }
            };
        }
        positions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces cover the reference domain exactly once and have the orientation of the facet.
    #[test]
    fn pieces_cover_the_facet() {
        for kind in
            [ElementKind::Tri3, ElementKind::Tri6, ElementKind::Quad4, ElementKind::Quad8, ElementKind::Quad9]
        {
            let area = |piece: &FacetPiece| {
                let n = piece.corners.len();
                let cross = |i: usize| {
                    let a = piece.corners[i].at;
                    let b = piece.corners[(i + 1) % n].at;
                    a[0] * b[1] - a[1] * b[0]
                };
                0.5 * (0..n).map(cross).sum::<f64>()
            };
            let whole = if linear(kind) == ElementKind::Tri3 { 0.5 } else { 4.0 };
            for piece in pieces(kind) {
                assert!((area(piece) - whole * piece.scale).abs() < 1e-15, "{kind}");
            }
            assert!((pieces(kind).iter().map(area).sum::<f64>() - whole).abs() < 1e-15, "{kind}");
        }
    }
}
