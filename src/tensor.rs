//! Tensors of the deformation, evaluated without cancellation.
//!
//! Everything here takes the displacement gradient `grad_u` (row = component, column = reference
//! direction) rather than `F = 1 + grad_u`: at strains of 1e-6 the difference `F^T F - 1` has lost
//! ten digits, the forms below have lost none.

use nalgebra::{SMatrix, SVector};

/// A second-order tensor in `D` dimensions; row = component, column = direction.
pub type Tensor<const D: usize> = SMatrix<f64, D, D>;

/// A vector in `D` dimensions.
pub type Vector<const D: usize> = SVector<f64, D>;

/// Green strain `E = (H + H^T + H^T H) / 2` of the displacement gradient `H` (2.12). Dimensionless, symmetric.
pub fn green_strain<const D: usize>(grad_u: &Tensor<D>) -> Tensor<D> {
    (grad_u + grad_u.transpose() + grad_u.transpose() * grad_u) * 0.5
}

/// `det(1 + H) - 1` from the invariants of `H`, exact to rounding for small `H`. Dimensionless.
///
/// In the plane `tr H + det H`; in space the second invariant joins.
pub fn det_minus_one<const D: usize>(grad_u: &Tensor<D>) -> f64 {
    let h = |i: usize, j: usize| grad_u[(i, j)];
    let minor = |i: usize, j: usize| h(i, i) * h(j, j) - h(i, j) * h(j, i);
    let trace: f64 = (0..D).map(|i| h(i, i)).sum();
    match D {
        2 => trace + minor(0, 1),
        3 => {
            let det = h(0, 0) * (h(1, 1) * h(2, 2) - h(1, 2) * h(2, 1))
                - h(0, 1) * (h(1, 0) * h(2, 2) - h(1, 2) * h(2, 0))
                + h(0, 2) * (h(1, 0) * h(2, 1) - h(1, 1) * h(2, 0));
            trace + minor(0, 1) + minor(0, 2) + minor(1, 2) + det
        }
        _ => unreachable!("the program works in two or three dimensions"),
    }
}

/// `P = 1 - n n`, the projector onto the plane normal to the unit vector `normal` (2.6). Symmetric, idempotent.
pub fn tangential_projector<const D: usize>(normal: &Vector<D>) -> Tensor<D> {
    Tensor::identity() - normal * normal.transpose()
}

/// `a x b` in space.
pub fn cross<const D: usize>(a: &Vector<D>, b: &Vector<D>) -> Vector<D> {
    Vector::from_fn(|i, _| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

/// Velocities at `arm` from a centre of the rotations about it by one radian a second: one in the plane, three in space; the others zero.
pub fn rotations<const D: usize>(arm: &Vector<D>) -> [Vector<D>; 3] {
    let planes: &[[usize; 2]] = if D == 2 { &[[0, 1]] } else { &[[0, 1], [1, 2], [2, 0]] };
    let mut motions = [Vector::zeros(); 3];
    for (motion, &[i, j]) in motions.iter_mut().zip(planes) {
        motion[i] = -arm[j];
        motion[j] = arm[i];
    }
    motions
}

/// A point in 2D or 3D with all three coordinates.
pub fn in_space<const D: usize>(point: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|i| point.get(i).copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rotations are cross products with the axes z, x and y.
    #[test]
    fn rotations_are_cross_products() {
        let arm = Vector::<3>::new(1.0, 2.0, 3.0);
        let axes = [Vector::<3>::z(), Vector::<3>::x(), Vector::<3>::y()];
        assert_eq!(rotations(&arm), axes.map(|axis| cross(&axis, &arm)));
        assert_eq!(rotations(&Vector::<2>::new(1.0, 2.0))[0], Vector::<2>::new(-2.0, 1.0));
    }

    /// The cancellation-free strain and determinant agree with their definitions where those are exact enough.
    #[test]
    fn agrees_with_the_definitions() {
        let h = Tensor::<3>::new(0.3, -0.2, 0.1, 0.05, 0.4, -0.1, 0.2, 0.15, -0.25);
        let f = Tensor::<3>::identity() + h;
        let strain = (f.transpose() * f - Tensor::identity()) * 0.5;
        assert!((green_strain(&h) - strain).norm() < 1e-15);
        assert!((det_minus_one(&h) - (f.determinant() - 1.0)).abs() < 1e-15);
        let plane = Tensor::<2>::new(0.3, -0.2, 0.05, 0.4);
        let det = (Tensor::<2>::identity() + plane).determinant();
        assert!((det_minus_one(&plane) - (det - 1.0)).abs() < 1e-15);
    }

    /// At strains of 1e-12 the determinant keeps all its digits.
    #[test]
    fn keeps_digits_at_tiny_strain() {
        let h = Tensor::<2>::new(1e-12, 0.0, 0.0, 2e-12);
        let exact = 3e-12 + 2e-24;
        assert!((det_minus_one(&h) - exact).abs() < 1e-27);
    }

    /// The projector removes the normal component and nothing else.
    #[test]
    fn projects_onto_the_tangent_plane() {
        let n = Vector::<3>::new(1.0, 2.0, -2.0) / 3.0;
        let p = tangential_projector(&n);
        assert!((p * n).norm() < 1e-15);
        assert!((p * p - p).norm() < 1e-15);
    }
}
