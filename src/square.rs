//! Small square matrices over any [`Real`]: what laws and kernels need of tensor algebra, in `f64` and in lanes.
//!
//! [`crate::tensor`] is the same for plain numbers on nalgebra's types.

use crate::lanes::Real;

/// `a[row][column]`; row = component, column = direction.
pub type Square<T, const D: usize> = [[T; D]; D];

/// A vector over `T`.
pub type Row<T, const D: usize> = [T; D];

/// `value` times the identity.
#[inline(always)]
pub fn diagonal<T: Real, const D: usize>(value: T) -> Square<T, D> {
    let mut out = [[value.constant(0.0); D]; D];
    for i in 0..D {
        out[i][i] = value;
    }
    out
}

/// `a . b`.
#[inline(always)]
pub fn dot<T: Real, const D: usize>(a: &Row<T, D>, b: &Row<T, D>) -> T {
    let mut sum = a[0] * b[0];
    for i in 1..D {
        sum = a[i].mul_add(b[i], sum);
    }
    sum
}

/// `a b` for a matrix and a vector.
#[inline(always)]
pub fn apply<T: Real, const D: usize>(a: &Square<T, D>, b: &Row<T, D>) -> Row<T, D> {
    let mut out = *b;
    for i in 0..D {
        out[i] = dot(&a[i], b);
    }
    out
}

/// `a b + c` for a matrix and vectors.
#[inline(always)]
pub fn apply_add<T: Real, const D: usize>(a: &Square<T, D>, b: &Row<T, D>, c: &Row<T, D>) -> Row<T, D> {
    let mut out = *c;
    for i in 0..D {
        for j in 0..D {
            out[i] = a[i][j].mul_add(b[j], out[i]);
        }
    }
    out
}

/// `a x + c`, each component.
#[inline(always)]
pub fn scale_add<T: Real, const D: usize>(a: &Row<T, D>, x: T, c: &Row<T, D>) -> Row<T, D> {
    let mut out = *c;
    for i in 0..D {
        out[i] = x.mul_add(a[i], out[i]);
    }
    out
}

/// `a x`, each entry.
#[inline(always)]
pub fn scale_all<T: Real, const D: usize>(a: &Square<T, D>, x: T) -> Square<T, D> {
    let mut out = *a;
    for i in 0..D {
        out[i] = scale(&out[i], x);
    }
    out
}

/// `a x`, each component.
#[inline(always)]
pub fn scale<T: Real, const D: usize>(a: &Row<T, D>, x: T) -> Row<T, D> {
    let mut out = *a;
    for i in 0..D {
        out[i] = out[i] * x;
    }
    out
}

/// The transpose.
#[inline(always)]
pub fn transpose<T: Real, const D: usize>(a: &Square<T, D>) -> Square<T, D> {
    let mut out = *a;
    for i in 0..D {
        for j in 0..D {
            out[i][j] = a[j][i];
        }
    }
    out
}

/// `a b`.
#[inline(always)]
pub fn product<T: Real, const D: usize>(a: &Square<T, D>, b: &Square<T, D>) -> Square<T, D> {
    product_transposed(a, &transpose(b))
}

/// `a b^T`.
#[inline(always)]
pub fn product_transposed<T: Real, const D: usize>(a: &Square<T, D>, b: &Square<T, D>) -> Square<T, D> {
    let mut out = *a;
    for i in 0..D {
        out[i] = apply(b, &a[i]);
    }
    out
}

/// `b^T a b` for a symmetric `a`; symmetric in every bit.
#[inline(always)]
pub fn congruent<T: Real, const D: usize>(a: &Square<T, D>, b: &Square<T, D>) -> Square<T, D> {
    let columns = transpose(b);
    let half = product_transposed(a, &columns);
    let halves = transpose(&half);
    let mut out = *a;
    for i in 0..D {
        for j in i..D {
            out[i][j] = dot(&columns[i], &halves[j]);
            out[j][i] = out[i][j];
        }
    }
    out
}

/// `a a^T`, its lower triangle a copy of the upper.
#[inline(always)]
pub fn outer_gram<T: Real, const D: usize>(a: &Square<T, D>) -> Square<T, D> {
    let mut out = *a;
    for i in 0..D {
        for j in i..D {
            out[i][j] = dot(&a[i], &a[j]);
            out[j][i] = out[i][j];
        }
    }
    out
}

/// `a^T a`.
#[inline(always)]
pub fn inner_gram<T: Real, const D: usize>(a: &Square<T, D>) -> Square<T, D> {
    outer_gram(&transpose(a))
}

/// The sum of the diagonal.
#[inline(always)]
pub fn trace<T: Real, const D: usize>(a: &Square<T, D>) -> T {
    let mut sum = a[0][0];
    for i in 1..D {
        sum = sum + a[i][i];
    }
    sum
}

/// `1 + a`.
#[inline(always)]
pub fn plus_one<T: Real, const D: usize>(a: &Square<T, D>) -> Square<T, D> {
    let mut out = *a;
    for i in 0..D {
        out[i][i] = out[i][i] + out[i][i].constant(1.0);
    }
    out
}

/// The cofactor matrix `det(a) a^-T`.
#[inline(always)]
pub fn cofactor<T: Real, const D: usize>(a: &Square<T, D>) -> Square<T, D> {
    let mut out = *a;
    if D == 2 {
        for i in 0..D {
            for j in 0..D {
                let opposite = a[1 - i][1 - j];
                out[i][j] = if i == j { opposite } else { -opposite };
            }
        }
        return out;
    }
    for i in 0..D {
        for j in 0..D {
            let (k, l, m, n) = ((i + 1) % D, (i + 2) % D, (j + 1) % D, (j + 2) % D);
            out[i][j] = a[k][m].mul_add(a[l][n], -(a[k][n] * a[l][m]));
        }
    }
    out
}

/// `E = (H + H^T + H^T H) / 2`, Green's strain of the displacement gradient `H` (2.12). Symmetric, dimensionless.
#[inline(always)]
pub fn green_strain<T: Real, const D: usize>(grad_u: &Square<T, D>) -> Square<T, D> {
    let columns = transpose(grad_u);
    let half = grad_u[0][0].constant(0.5);
    let mut out = *grad_u;
    for i in 0..D {
        for j in i..D {
            out[i][j] = half * (grad_u[i][j] + columns[i][j] + dot(&columns[i], &columns[j]));
            out[j][i] = out[i][j];
        }
    }
    out
}

/// `(H + H^T) / 2`, the strain of linear kinematics. Symmetric, dimensionless.
#[inline(always)]
pub fn small_strain<T: Real, const D: usize>(grad_u: &Square<T, D>) -> Square<T, D> {
    let half = grad_u[0][0].constant(0.5);
    let mut out = *grad_u;
    for i in 0..D {
        for j in i..D {
            out[i][j] = half * (grad_u[i][j] + grad_u[j][i]);
            out[j][i] = out[i][j];
        }
    }
    out
}

/// The part of `det(1 + H) - 1` that is not linear in `H`: `det H` in the plane, second plus third invariant in space.
#[inline(always)]
pub fn det_minus_one_minus_trace<T: Real, const D: usize>(h: &Square<T, D>) -> T {
    let minor = |i: usize, j: usize| h[i][i].mul_add(h[j][j], -(h[i][j] * h[j][i]));
    if D == 2 {
        return minor(0, 1);
    }
    let cofactors = cofactor(h);
    minor(0, 1) + minor(0, 2) + minor(1, 2) + dot(&h[0], &cofactors[0])
}

/// `det(1 + H) - 1`, exact to rounding for small `H`. Dimensionless.
#[inline(always)]
pub fn det_minus_one<T: Real, const D: usize>(h: &Square<T, D>) -> T {
    trace(h) + det_minus_one_minus_trace(h)
}

/// `a + b`, each entry.
#[inline(always)]
pub fn sum<T: Real, const D: usize>(a: &Square<T, D>, b: &Square<T, D>) -> Square<T, D> {
    let mut out = *a;
    for i in 0..D {
        for j in 0..D {
            out[i][j] = a[i][j] + b[i][j];
        }
    }
    out
}

/// `a : b`.
#[inline(always)]
pub fn double_dot<T: Real, const D: usize>(a: &Square<T, D>, b: &Square<T, D>) -> T {
    let mut out = dot(&a[0], &b[0]);
    for i in 1..D {
        out = out + dot(&a[i], &b[i]);
    }
    out
}

/// The cofactors of `1 + a` without the ones, `tr(a) 1 - a^T` plus, in space, the cofactors of `a`; no digits are lost
/// where `a` is small.
#[inline(always)]
pub fn cofactor_minus_one<T: Real, const D: usize>(a: &Square<T, D>) -> Square<T, D> {
    let (trace, columns, second) = (trace(a), transpose(a), cofactor(a));
    let mut out = *a;
    for i in 0..D {
        for j in 0..D {
            let linear = if i == j { trace - columns[i][j] } else { -columns[i][j] };
            out[i][j] = if D == 2 { linear } else { linear + second[i][j] };
        }
    }
    out
}

/// Derivative of the cofactors of a symmetric `a` along a symmetric `b`; in the plane it does not depend on `a`.
#[inline(always)]
pub fn cofactor_change<T: Real, const D: usize>(a: &Square<T, D>, b: &Square<T, D>) -> Square<T, D> {
    let change = trace(b);
    let mut out = *b;
    if D == 2 {
        for i in 0..D {
            for j in 0..D {
                out[i][j] = if i == j { change - b[i][j] } else { -b[i][j] };
            }
        }
        return out;
    }
    let size = trace(a);
    let middle = size * change - double_dot(a, b);
    let (left, right) = (product(a, b), product(b, a));
    for i in 0..D {
        for j in 0..D {
            let rest = left[i][j] + right[i][j] - size * b[i][j] - change * a[i][j];
            out[i][j] = if i == j { rest + middle } else { rest };
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::scatter;
    use crate::tensor::{self, Tensor};

    fn agrees<const D: usize>() {
        let numbers = scatter(D * D, 7);
        let mut h = [[0.0; D]; D];
        for i in 0..D {
            h[i].copy_from_slice(&numbers[i * D..(i + 1) * D]);
        }
        let matrix = Tensor::<D>::from_fn(|i, j| h[i][j]);
        let same = |a: &Square<f64, D>, b: &Tensor<D>| {
            assert!((Tensor::<D>::from_fn(|i, j| a[i][j]) - b).norm() < 1e-14, "{a:?} {b}");
        };
        same(&green_strain(&h), &tensor::green_strain(&matrix));
        same(&product(&h, &transpose(&h)), &(matrix * matrix.transpose()));
        let twice = product(&transpose(&h), &product(&outer_gram(&h), &h));
        same(&congruent(&outer_gram(&h), &h), &Tensor::<D>::from_fn(|i, j| twice[i][j]));
        assert!((apply_add(&h, &h[0], &h[1])[0] - apply(&h, &h[0])[0] - h[1][0]).abs() < 1e-15);
        same(&outer_gram(&h), &(matrix * matrix.transpose()));
        same(&inner_gram(&h), &(matrix.transpose() * matrix));
        same(&small_strain(&h), &((matrix + matrix.transpose()) * 0.5));
        assert!((det_minus_one(&h) - tensor::det_minus_one(&matrix)).abs() < 1e-14);
        // a cof(a)^T = det(a) 1
        let f = plus_one(&h);
        same(&product(&f, &transpose(&cofactor(&f))), &(Tensor::<D>::identity() * (1.0 + det_minus_one(&h))));
    }

    /// The algebra over any real is nalgebra's in both dimensions.
    #[test]
    fn agrees_with_nalgebra() {
        agrees::<2>();
        agrees::<3>();
    }
}
