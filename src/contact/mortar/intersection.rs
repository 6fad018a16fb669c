//! The overlap of two pieces, in 2D and in 3D.

use super::segment::{PlacedPiece, PointVariation, SegmentPoint, Want};
use super::{line, polygon};
use crate::mesh::ElementKind;

/// Polynomial degree that is integrated exactly over a segment of flat facets of these kinds:
/// weight times displacement.
pub fn degree(contactor: ElementKind, target: ElementKind) -> usize {
    let of = |kind| match kind {
        ElementKind::Line2 | ElementKind::Tri3 => 1,
        ElementKind::Line3 | ElementKind::Tri6 => 2,
        ElementKind::Quad4 => 2,
        ElementKind::Quad8 => 3,
        _ => 4,
    };
    let weight = of(super::split::linear(contactor));
    let bent = usize::from(contactor == ElementKind::Line3);
    weight + of(contactor).max(of(target)) + bent
}

/// Calls `visit` with every point of the overlap of two pieces. It also computes the variation of
/// the point if `want` requests it; otherwise the variation is zero.
///
/// The quadrature rule is exact to `degree` on flat facets. Pieces that do not face each other have
/// no overlap.
pub fn overlap<const D: usize>(
    contactor: &PlacedPiece<'_, D>,
    target: &PlacedPiece<'_, D>,
    degree: usize,
    want: Want,
    visit: &mut impl FnMut(&SegmentPoint<D>, &PointVariation<D>),
) {
    match D {
        2 => line::overlap(contactor, target, degree, want, visit),
        _ => polygon::overlap(contactor, target, degree, want, visit),
    }
}

#[cfg(test)]
mod tests {
    use super::super::segment::{ByCorners, TARGET};
    use super::super::split::pieces;
    use super::*;
    use crate::space::facet_normal;
    use crate::taylor::{scatter, taylor_rate};
    use crate::tensor::Vector;

    /// A facet of `kind` with about unit size, bent by `bend`, seen from below if it is a target.
    pub(in super::super) fn facet<const D: usize>(kind: ElementKind, seed: u32, bend: f64) -> Vec<Vector<D>> {
        let places = crate::space::reference(kind).node_coordinates();
        let noise = scatter(kind.nodes() * D, seed);
        let node = |(a, at): (usize, &[f64; 3])| {
            Vector::<D>::from_fn(|i, _| if i + 1 < D { at[i] } else { 0.0 } + bend * noise[a * D + i])
        };
        places.iter().take(kind.nodes()).enumerate().map(node).collect()
    }

    /// A target over a contactor whose body is below it, rotated about the first axis and shifted.
    fn opposite<const D: usize>(kind: ElementKind, seed: u32, bend: f64) -> Vec<Vector<D>> {
        let shift = Vector::<D>::from_fn(|i, _| [0.37, 0.21, 0.0][if D == 2 && i == 1 { 2 } else { i }]);
        let mut nodes = facet::<D>(kind, seed, bend);
        for node in &mut nodes {
            // The normal is reversed; in the plane the line has the opposite direction.
            let flip = if D == 2 { 0 } else { 1 };
            node[flip] = -node[flip];
            *node += shift;
            node[D - 1] += 0.05;
        }
        nodes
    }

    fn points<const D: usize>(
        kinds: [ElementKind; 2],
        z: &[f64],
        want: Want,
    ) -> Vec<(SegmentPoint<D>, PointVariation<D>)> {
        let piece = |kind| &pieces(kind)[0];
        let all: Vec<Vector<D>> = z.chunks_exact(D).map(Vector::from_column_slice).collect();
        let (x, y) = all.split_at(kinds[0].nodes());
        let corners = [piece(kinds[0]).positions(kinds[0], x), piece(kinds[1]).positions(kinds[1], y)];
        let place = |i: usize| PlacedPiece { piece: piece(kinds[i]), corners: &corners[i] };
        let mut found = Vec::new();
        overlap(&place(0), &place(1), degree(kinds[0], kinds[1]), want, &mut |point, variation| {
            found.push((*point, *variation));
        });
        found
    }

    const PLANE: [[ElementKind; 2]; 1] = [[ElementKind::Line2, ElementKind::Line2]];
    const SPACE: [[ElementKind; 2]; 4] = [
        [ElementKind::Quad4, ElementKind::Quad4],
        [ElementKind::Tri3, ElementKind::Quad4],
        [ElementKind::Quad4, ElementKind::Tri3],
        [ElementKind::Tri3, ElementKind::Tri3],
    ];

    fn coordinates<const D: usize>(kinds: [ElementKind; 2], seed: u32, bend: f64) -> Vec<f64> {
        let both =
            facet::<D>(kinds[0], seed, bend).into_iter().chain(opposite::<D>(kinds[1], seed + 100, bend));
        both.flat_map(|x| x.as_slice().to_vec()).collect()
    }

    fn varies<const D: usize>(kinds: [ElementKind; 2]) {
        for seed in 0..20 {
            let z = coordinates::<D>(kinds, seed, 0.15);
            let flat = |found: &[(SegmentPoint<D>, PointVariation<D>)]| {
                found
                    .iter()
                    .flat_map(|(p, _)| [p.xi[0], p.xi[1], p.eta[0], p.eta[1], p.weight])
                    .collect::<Vec<f64>>()
            };
            let value = |z: &[f64]| flat(&points::<D>(kinds, z, Want::Points));
            let slope = |z: &[f64], d: &[f64]| {
                let along = |by: &ByCorners<D>| {
                    let (first, second) = (kinds[0].corners(), kinds[1].corners());
                    let corners = (0..first).chain(TARGET..TARGET + second);
                    corners
                        .zip(d.chunks_exact(D))
                        .map(|(c, d)| by[c].dot(&Vector::<D>::from_column_slice(d)))
                        .sum()
                };
                let of = |(_, v): &(SegmentPoint<D>, PointVariation<D>)| -> [f64; 5] {
                    [&v.xi[0], &v.xi[1], &v.eta[0], &v.eta[1], &v.weight].map(along)
                };
                points::<D>(kinds, z, Want::Variations).iter().flat_map(of).collect::<Vec<f64>>()
            };
            let direction: Vec<f64> = scatter(z.len(), seed + 7).iter().map(|d| 1e-3 * d).collect();
            assert!(!value(&z).is_empty(), "{kinds:?} {seed}");
            let rate = taylor_rate(value, slope, &z, &direction);
            assert!(rate > 1.9, "{kinds:?}, seed {seed}: rate {rate}");
        }
    }

    /// Points, coordinates and weights match their variations to second order, for every pair of
    /// pieces.
    #[test]
    fn points_move_as_their_variations_say() {
        PLANE.into_iter().for_each(varies::<2>);
        SPACE.into_iter().for_each(varies::<3>);
    }

    /// If facets end at the same position, as on matching meshes, rounding does not choose the
    /// derivatives.
    #[test]
    fn rounding_does_not_choose_derivatives_at_aligned_ends() {
        let variations = |e: f64| {
            let z = [0.0, 0.0, 1.0, 0.0, 1.0 + e, -0.1, -e, -0.1];
            let found = points::<2>(PLANE[0], &z, Want::Variations);
            found.iter().flat_map(|(_, v)| v.weight.map(|by| by.x)).collect::<Vec<f64>>()
        };
        let aligned = variations(0.0);
        assert!(!aligned.is_empty());
        for e in [1e-15, -1e-15, 1e-13, -1e-13] {
            let apart = variations(e).iter().zip(&aligned).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-10, "{e:e}: {apart}");
        }
    }

    /// A contactor on two facets whose common edge coincides with one of its own, is next to it, or
    /// crosses it at a small angle, is covered completely. No motion changes that, and the mean height of
    /// the target does not depend on where the edge lies.
    #[test]
    fn aligned_edges_leave_no_gap_in_derivatives() {
        let quad = ElementKind::Quad4;
        let piece = &pieces(quad)[0];
        let low = |x: f64, y: f64| Vector::<3>::new(x, y, -0.1);
        let own =
            [[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vector::<3>::new(x, y, 0.0));
        let contactor = piece.positions(quad, &own);
        for (e, f) in [0.0, 1e-15, 1e-13, 8e-12, 3e-11, 1e-9, 1e-3]
            .into_iter()
            .flat_map(|e| [(e, e), (-e, -e), (e, -e), (2.0 * e, e), (-e, -2.0 * e), (e, 0.0), (0.0, -e)])
        {
            let near = [low(e, -1.2), low(f, 1.2)];
            let left = [low(-1.5, -1.2), low(-1.5, 1.2), near[1], near[0]];
            let right = [near[0], near[1], low(2.0, 1.2), low(2.0, -1.2)];
            let mut found = 0.0;
            let mut by_own = [Vector::<3>::zeros(); 4];
            let mut by_near = [Vector::<3>::zeros(); 2];
            for (nodes, at) in [(left, [3, 2]), (right, [0, 1])] {
                let target = piece.positions(quad, &nodes);
                let [contactor, target] = [&contactor, &target].map(|corners| PlacedPiece { piece, corners });
                overlap(&contactor, &target, 3, Want::Variations, &mut |point, variation| {
                    // The integrals of 1 + x over the contactor.
                    let value = 1.5 + 0.5 * point.xi[0];
                    found += point.weight * value;
                    let by = |corner: usize| {
                        variation.weight[corner] * value + variation.xi[0][corner] * (0.5 * point.weight)
                    };
                    by_own.iter_mut().enumerate().for_each(|(corner, sum)| *sum += by(corner));
                    by_near.iter_mut().zip(at).for_each(|(sum, corner)| *sum += by(TARGET + corner));
                });
            }
            assert!((found - 6.0).abs() < 1e-10, "{e:e} {f:e}: {found}");
            let largest = by_own.iter().chain(&by_near).map(|by| by.amax()).fold(0.0, f64::max);
            assert!(largest < 1e-4, "{e:e} {f:e}: {by_own:?} {by_near:?}");
        }
    }

    /// The two points of a pair lie on the normal of the contactor's piece.
    #[test]
    fn points_are_paired_along_the_normal() {
        for kinds in SPACE {
            for seed in 0..20 {
                let z = coordinates::<3>(kinds, seed, 0.15);
                let all: Vec<Vector<3>> = z.chunks_exact(3).map(Vector::from_column_slice).collect();
                let (x, y) = all.split_at(kinds[0].nodes());
                let centre = if kinds[0] == ElementKind::Quad4 { [0.0; 2] } else { [1.0 / 3.0; 2] };
                let shape = super::super::shape::FacetShape::at(kinds[0], centre);
                let tangents = [0, 1].map(|k| x.iter().zip(shape.gradient).map(|(x, g)| x * g[k]).sum());
                let normal = facet_normal::<3>(&tangents).normalize();
                for (point, _) in points::<3>(kinds, &z, Want::Points) {
                    let at = |kind, xi, nodes: &[Vector<3>]| -> Vector<3> {
                        let shape = super::super::shape::FacetShape::at(kind, xi);
                        nodes.iter().zip(shape.value).map(|(x, n)| x * n).sum()
                    };
                    let chord = at(kinds[0], point.xi, x) - at(kinds[1], point.eta, y);
                    assert!((chord - normal * normal.dot(&chord)).norm() < 1e-13, "{kinds:?} {seed}");
                    assert!(point.weight > 0.0);
                }
            }
        }
    }
}
