//! A closed point as springs for multigrid, no stiffer than the surrounding elements.

use crate::tensor::{Tensor, Vector};

/// Stiffness of a closed point against relative motion of its two sides, `K_CN` and `K_T` only.
#[derive(Debug, Clone, Copy)]
pub struct Joint<const D: usize> {
    /// Along the normal, `-dt_n/dg` \[Pa/m\].
    pub normal: f64,
    /// Along the surface, `-dt_T/du_T`, symmetric and not negative \[Pa/m\].
    pub tangential: Tensor<D>,
}

impl<const D: usize> Joint<D> {
    /// Adds `A c_a c_b (k_n n n^T + K_T)` to `stiffness[((a * m + b) * D + i) * D + j]` of the `m`
    /// nodes with these coefficients \[N/m\]. Springs stiffer than `stiffest` \[Pa/m\] are reduced
    /// to it. The matrix is symmetric and positive semidefinite, and it does not resist common
    /// motions of the two sides.
    pub fn add_springs(
        &self,
        normal: &Vector<D>,
        area: f64,
        coefficients: impl Iterator<Item = f64> + Clone,
        stiffest: f64,
        stiffness: &mut [f64],
    ) {
        let along = self.tangential.amax();
        let softer = if along > stiffest { stiffest / along } else { 1.0 };
        let spring =
            normal * normal.transpose() * self.normal.max(0.0).min(stiffest) + self.tangential * softer;
        let count = coefficients.clone().count();
        for (a, test) in coefficients.clone().enumerate() {
            for (b, node) in coefficients.clone().enumerate() {
                let block = spring * (area * test * node);
                let start = (a * count + b) * D * D;
                for (i, row) in stiffness[start..start + D * D].chunks_exact_mut(D).enumerate() {
                    row.iter_mut().enumerate().for_each(|(j, entry)| *entry += block[(i, j)]);
                }
            }
        }
    }
}
