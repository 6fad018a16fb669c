//! The spin of a facet about its normal, and the arm on which it turns a point beyond an edge in space.
//!
//! Gap and normal do not see a common rotation about the normal, the place of a point beyond an edge does: its offset
//! `o = x - x_p` leaves the normal there, so that a tangential traction `t` on point and foot has the moment `n (n . o x t)`.
//! With the arm `p = n x o` and the spin `w` of the facet, a motion without `p w` is free of that rotation, and forces that belong to
//! it have no such moment. The spin is the mean one of all directions of the facet,
//! `w = (da_1 . a_2 - da_2 . a_1) / 2 J`, `J = |a_1 x a_2|`, at fixed reference coordinates; for a rotation it is the part about `n`,
//! whatever the shape of the facet.

use super::Projection;
use super::second::Position;
use crate::contact::curvature::Spins;
use crate::space::facet_normal;
use crate::tensor::{Tensor, Vector};

impl<const D: usize> Projection<D> {
    /// Whether a common rotation about the normal moves the point out of what gap and normal tell.
    pub(super) fn is_turned_by_spin(&self) -> bool {
        D == 3 && !self.is_interior()
    }

    /// `p = n x (x - x_p)` \[m\]; zero over the facet and in the plane.
    pub fn arm(&self) -> Vector<D> {
        if self.is_turned_by_spin() {
            return facet_normal(&[self.normal, self.facet.offset]);
        }
        Vector::zeros()
    }

    /// `J` \[m^2\].
    fn measure(&self) -> f64 {
        facet_normal(&self.facet.tangents).norm()
    }

    /// `dw/dx_b` \[1/m\] of a node whose shape function has this gradient; zero where there is no [`arm`](Self::arm).
    pub(super) fn spin(&self, gradient: [f64; 2]) -> Vector<D> {
        let ([first, second], measure) = (self.facet.tangents, self.measure());
        if !self.is_turned_by_spin() || measure <= 0.0 {
            return Vector::zeros();
        }
        (second * gradient[0] - first * gradient[1]) / (2.0 * measure)
    }

    /// Variations of arm and spin; none where there is no arm.
    pub(super) fn spins(&self, positions: &[Position<D>]) -> Option<Spins<D>> {
        let ([first, second], measure) = (self.facet.tangents, self.measure());
        if !self.is_turned_by_spin() || measure <= 0.0 {
            return None;
        }
        let arm = |position: &Position<D>| {
            let column = |j: usize| {
                let [normal, offset] =
                    [&position.normal, &position.offset].map(|by| by.column(j).into_owned());
                facet_normal(&[normal, self.facet.offset]) + facet_normal(&[self.normal, offset])
            };
            Tensor::from_columns(&std::array::from_fn::<_, D, _>(column))
        };
        // `dJ` comes from the tangents along these.
        let [by_first, by_second] =
            [facet_normal(&[second, self.normal]), facet_normal(&[self.normal, first])];
        let turn = |a: &Position<D>, b: &Position<D>| {
            let along = |k: usize| b.coordinates[0] * a.second[k][0] + b.coordinates[1] * a.second[k][1];
            let stretch = b.tangents[0].transpose() * by_first + b.tangents[1].transpose() * by_second;
            let change = second * along(0).transpose() + b.tangents[1] * a.gradient[0]
                - first * along(1).transpose()
                - b.tangents[0] * a.gradient[1];
            change / (2.0 * measure) - self.spin(a.gradient) * stretch.transpose() / measure
        };
        let pairs = positions.iter().flat_map(|a| positions.iter().map(move |b| (a, b)));
        Some(Spins {
            arms: positions.iter().map(arm).collect(),
            turns: pairs.map(|(a, b)| turn(a, b)).collect(),
        })
    }
}
