//! Geometry of a facet: tangents, the outward area vector, their variations, and the curvature of
//! the facet.
//!
//! This module alone defines the outward direction: in the plane the tangent rotated clockwise, in
//! space the cross product of the two tangents.
//! [`ElementKind::sides`](crate::mesh::ElementKind::sides) orders the nodes of a facet accordingly.

use crate::tensor::{Tensor, Vector, cross};

/// Derivatives `x_,k` of the position with respect to the facet's `D - 1` reference coordinates
/// \[m\]. In the plane the second entry is zero.
pub type Tangents<const D: usize> = [Vector<D>; 2];

/// Tangents of a facet with nodes at `x` (reference or current) \[m\] and gradients `dn[a * (D - 1)
/// + k]`.
pub fn facet_tangents<const D: usize>(x: &[Vector<D>], dn: &[f64]) -> Tangents<D> {
    let mut tangents = [Vector::zeros(); 2];
    for (x, dn) in x.iter().zip(dn.chunks_exact(D - 1)) {
        for (tangent, dn) in tangents.iter_mut().zip(dn) {
            *tangent += x * *dn;
        }
    }
    tangents
}

/// Outward area vector for a unit of reference measure, `A = |A| n`, so that `da = |A| dxi` [m,
/// m2].
///
/// In the plane `(t_y, -t_x)`, in space `x_,1 x x_,2`.
pub fn facet_normal<const D: usize>(tangents: &Tangents<D>) -> Vector<D> {
    let [s, t] = tangents;
    match D {
        2 => Vector::from_fn(|i, _| if i == 0 { s[1] } else { -s[0] }),
        3 => cross(s, t),
        _ => unreachable!("the program works in two or three dimensions"),
    }
}

/// Derivative of [`facet_normal`] with respect to the position of a node with gradient `dn[k]`: `dA
/// = W du_a` [1, m].
///
/// Row = component of `A`, column = component of `u_a`; skew-symmetric.
pub fn area_variation<const D: usize>(tangents: &Tangents<D>, dn: &[f64]) -> Tensor<D> {
    if D == 2 {
        return Tensor::from_fn(|i, j| match (i, j) {
            (0, 1) => dn[0],
            (1, 0) => -dn[0],
            _ => 0.0,
        });
    }
    // u_,1 x x_,2 + x_,1 x u_,2 = (x_,1 N_,2 - x_,2 N_,1) x u_a.
    let axis = tangents[0] * dn[1] - tangents[1] * dn[0];
    Tensor::from_fn(|i, j| match (3 + j - i) % 3 {
        1 => -axis[3 - i - j],
        2 => axis[3 - i - j],
        _ => 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ElementKind;
    use crate::space::reference;

    /// Nodes of an element on its own reference domain, slightly bent so that the map is not
    /// affine.
    fn bent<const D: usize>(kind: ElementKind, size: f64) -> Vec<Vector<D>> {
        let place = |p: &[f64; 3]| {
            Vector::from_fn(|i, _| p[i] + size * ((1.3 * p[0] - 0.4 * p[1] + 0.7 * p[2] + i as f64).sin()))
        };
        reference(kind).node_coordinates().iter().map(place).collect()
    }

    fn solids(dimension: usize) -> impl Iterator<Item = ElementKind> {
        ElementKind::ALL
            .into_iter()
            .filter(move |kind| kind.dimension() == dimension && !kind.sides().is_empty())
    }

    /// By the divergence theorem the sides of every element enclose its volume, with outward area
    /// vectors.
    fn sides_enclose_the_volume<const D: usize>() {
        for kind in solids(D) {
            let x = bent::<D>(kind, 0.05);
            let element = reference(kind);
            let table = element.tabulate(&element.rule(8));
            let gradients = table.dn.chunks_exact(table.nodes * D);
            let volume: f64 = gradients.zip(&table.weights).map(|(dn, w)| w * jacobian(dn, &x)).sum();
            let centre = x.iter().sum::<Vector<D>>() / x.len() as f64;
            let mut enclosed = 0.0;
            for (number, side) in kind.sides().iter().enumerate() {
                let facet = reference(kind.side_kind(number));
                let on_facet = facet.tabulate(&facet.rule(8));
                let nodes: Vec<Vector<D>> = side.iter().map(|&a| x[a as usize]).collect();
                for q in 0..on_facet.points {
                    let dn = &on_facet.dn[q * nodes.len() * (D - 1)..(q + 1) * nodes.len() * (D - 1)];
                    let n = &on_facet.n[q * nodes.len()..(q + 1) * nodes.len()];
                    let point = nodes.iter().zip(n).map(|(x, n)| x * *n).sum::<Vector<D>>();
                    let area = facet_normal(&facet_tangents(&nodes, dn));
                    assert!(area.dot(&(point - centre)) > 0.0, "{kind:?} {side:?}");
                    enclosed += on_facet.weights[q] * area.dot(&point) / D as f64;
                }
            }
            assert!((enclosed - volume).abs() < 1e-12, "{kind:?}: {enclosed} {volume}");
        }
    }

    /// Determinant of `dx / dxi` for gradients `dn[a * D + k]`.
    fn jacobian<const D: usize>(dn: &[f64], x: &[Vector<D>]) -> f64 {
        let component = |i, k| x.iter().zip(dn.chunks_exact(D)).map(|(x, dn)| x[i] * dn[k]).sum();
        nalgebra::DMatrix::<f64>::from_fn(D, D, component).determinant()
    }

    #[test]
    fn sides_enclose_the_area_in_the_plane() {
        sides_enclose_the_volume::<2>();
    }

    #[test]
    fn sides_enclose_the_volume_in_space() {
        sides_enclose_the_volume::<3>();
    }

    fn facet_kinds(dimension: usize) -> impl Iterator<Item = ElementKind> {
        ElementKind::ALL.into_iter().filter(move |kind| kind.dimension() + 1 == dimension)
    }

    /// The area vector is at most quadratic in the positions: a central difference gives its
    /// variation exactly.
    fn area_variation_is_the_derivative<const D: usize>() {
        for kind in facet_kinds(D) {
            let x = bent::<D>(kind, 0.3);
            let mut dn = vec![0.0; x.len() * (D - 1)];
            reference(kind).gradient(&[0.2, 0.3], &mut dn);
            let area = |x: &[Vector<D>]| facet_normal(&facet_tangents(x, &dn));
            for (a, dn_a) in dn.chunks_exact(D - 1).enumerate() {
                let variation = area_variation(&facet_tangents(&x, &dn), dn_a);
                for j in 0..D {
                    let (mut plus, mut minus) = (x.clone(), x.clone());
                    plus[a][j] += 0.5;
                    minus[a][j] -= 0.5;
                    let difference = area(&plus) - area(&minus);
                    assert!((difference - variation.column(j)).norm() < 1e-14, "{kind:?} node {a}");
                }
            }
        }
    }

    #[test]
    fn variations_in_the_plane() {
        area_variation_is_the_derivative::<2>();
    }

    #[test]
    fn variations_in_space() {
        area_variation_is_the_derivative::<3>();
    }
}
