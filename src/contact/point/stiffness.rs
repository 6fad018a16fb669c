//! Force and stiffness of an evaluated point, term by term.

use super::joint::Joint;
use super::{Response, Slopes};
use crate::contact::geometry::Geometry;
use crate::tensor::Tensor;
use crate::terms::Terms;

/// Which terms of the matrix to add, and `dv/du` of the time integrator \[1/s\], by which damping becomes stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Selection {
    /// Terms wanted; those that are not contact's are ignored.
    pub terms: Terms,
    /// `c_v`.
    pub velocity_shift: f64,
    /// In the place of the terms springs no stiffer than this \[Pa/m\]: what multigrid can work with.
    pub joint: Option<f64>,
}

impl<const D: usize> Response<D> {
    /// Adds the force `A c_a t` to `force[a * D + i]` \[N, per depth in 2D\].
    pub fn add_force(&self, geometry: &Geometry<D>, force: &mut [f64]) {
        if self.slopes.is_none() {
            return;
        }
        let resultant = self.state.traction() * geometry.area;
        for (node, force) in geometry.nodes.iter().zip(force.chunks_exact_mut(D)) {
            for (f, r) in force.iter_mut().zip(resultant.iter()) {
                *f += node.coefficient * r;
            }
        }
    }

    /// Adds the chosen left-hand-side terms to `stiffness[((a * m + b) * D + i) * D + j]`, `m` nodes \[N/m\].
    pub fn add_stiffness(&self, geometry: &Geometry<D>, selection: &Selection, stiffness: &mut [f64]) {
        let Some(slopes) = &self.slopes else {
            return;
        };
        if let Some(stiffest) = selection.joint {
            let by_increment = slopes.by_velocity * selection.velocity_shift + slopes.by_increment;
            let joint = Joint { normal: -slopes.normal, tangential: -by_increment };
            let coefficients = geometry.nodes.iter().map(|node| node.coefficient);
            return joint.add_springs(&geometry.normal, geometry.area, coefficients, stiffest, stiffness);
        }
        let count = geometry.nodes.len();
        for b in 0..count {
            let column = self.column(geometry, slopes, selection, b);
            for (a, test) in geometry.nodes.iter().enumerate() {
                let block = column * test.coefficient;
                let start = (a * count + b) * D * D;
                for (i, row) in stiffness[start..start + D * D].chunks_exact_mut(D).enumerate() {
                    for (j, entry) in row.iter_mut().enumerate() {
                        *entry += block[(i, j)];
                    }
                }
            }
        }
    }

    /// Minus the derivative of `A t` by the position of node `b`, the chosen terms of it.
    fn column(
        &self,
        geometry: &Geometry<D>,
        slopes: &Slopes<D>,
        selection: &Selection,
        b: usize,
    ) -> Tensor<D> {
        let (node, terms, shift) = (&geometry.nodes[b], selection.terms, selection.velocity_shift);
        let mut by_traction = Tensor::zeros();
        if terms.contains(Terms::NORMAL_CONTACT) {
            by_traction += geometry.normal * (node.gap * slopes.normal).transpose();
        }
        if terms.contains(Terms::NORMAL_GEOMETRY) {
            by_traction += node.normal * self.state.normal_traction;
        }
        if terms.contains(Terms::FRICTION_NORMAL_COUPLING) {
            by_traction += slopes.by_gap * node.gap.transpose();
        }
        if terms.contains(Terms::FRICTION_DAMPING) {
            by_traction += (slopes.by_velocity * shift + slopes.by_increment) * node.coefficient;
        }
        if terms.contains(Terms::COEFFICIENT_CHANGE) {
            by_traction += slopes.through_bound * (shift * node.coefficient);
        }
        if terms.contains(Terms::FRICTION_GEOMETRY) {
            by_traction += slopes.by_normal * node.normal;
        }
        let mut column = by_traction * -geometry.area;
        if terms.contains(Terms::ZONE_CHANGE) {
            column -= self.state.traction() * node.area.transpose();
        }
        column
    }
}
