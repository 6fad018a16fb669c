//! Force and moment of a contact on its contactor, from the forces of its nodes.

use std::collections::HashMap;
use std::iter::Sum;

use super::candidates::Candidates;
use super::contact::{ContactSink, VertexContact};
use crate::contact::evaluation::{ContactFields, ContactRequest};
use crate::contact::nodal::at;
use crate::contact::state::ContactState;
use crate::tensor::{Tensor, Vector};

/// Sums over the nodal forces `f_a` on the contactor at the current positions `x_a`, additive over
/// ranks.
///
/// The nodal forces do the virtual work of the tractions. Hence the first moments are those of the
/// discrete tractions, without an error of quadrature, and balance those of supports and loads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactResultant<const D: usize> {
    /// `sum f_a` [N, per metre of depth in 2D].
    pub force: Vector<D>,
    /// `sum f_a x_a^T` [N m, per metre of depth in 2D].
    pub first_moment: Tensor<D>,
    /// `sum |f_a|` over facets [N, per metre of depth in 2D].
    pub size: f64,
}

impl<const D: usize> Default for ContactResultant<D> {
    fn default() -> Self {
        Self { force: Vector::zeros(), first_moment: Tensor::zeros(), size: 0.0 }
    }
}

impl<const D: usize> ContactResultant<D> {
    /// Resultants below this part of the sum of the nodal forces are rounding, and have no centre.
    /// Forces of a balanced set of 10^6 nodes leave 10^-13 of their sum. With half or twice the value
    /// nothing changes unless forces cancel to nine digits.
    const BALANCED: f64 = 1e-9;

    /// Moment about the origin, `sum x_a x f_a` [N m, per metre of depth in 2D]. In 2D only the last
    /// component is nonzero.
    pub fn moment(&self) -> [f64; 3] {
        let entry = |force: usize, arm: usize| {
            if force < D && arm < D { self.first_moment[(force, arm)] } else { 0.0 }
        };
        std::array::from_fn(|axis| {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            entry(last, next) - entry(next, last)
        })
    }

    /// Mean of the positions, weighted by the components of the nodal forces along their resultant
    /// \[m\]. `None` if the forces balance each other.
    ///
    /// About this point parallel forces have no moment.
    pub fn centre(&self) -> Option<Vector<D>> {
        let square = self.force.norm_squared();
        (square.sqrt() > Self::BALANCED * self.size)
            .then(|| self.first_moment.transpose() * self.force / square)
    }

    /// The sums, for a reduction over ranks.
    pub fn sums(&mut self) -> impl Iterator<Item = &mut f64> {
        self.force.iter_mut().chain(self.first_moment.iter_mut()).chain([&mut self.size])
    }
}

impl<const D: usize> Sum for ContactResultant<D> {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |sum, part| Self {
            force: sum.force + part.force,
            first_moment: sum.first_moment + part.first_moment,
            size: sum.size + part.size,
        })
    }
}

/// Adds up the forces on the nodes of a contactor.
struct ResultantSink<const D: usize> {
    places: HashMap<u32, Vector<D>>,
    sum: ContactResultant<D>,
}

impl<const D: usize> ContactSink for ResultantSink<D> {
    fn force(&mut self, nodes: &[u32], force: &[f64]) {
        for (node, force) in nodes.iter().zip(force.chunks_exact(D)) {
            let Some(place) = self.places.get(node) else { continue };
            let force = Vector::<D>::from_column_slice(force);
            self.sum.force += force;
            self.sum.first_moment += force * place.transpose();
            self.sum.size += force.norm();
        }
    }

    fn stiffness(&mut self, _: usize, _: &[u32], _: &[f64]) {}
}

impl<const D: usize> VertexContact<D> {
    /// The resultant of the vertices of this rank at `fields`, without a change of their `state`.
    pub fn resultant(
        &self,
        candidates: &Candidates<D>,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &ContactState<D>,
    ) -> ContactResultant<D> {
        let facets = self.surface.facets().iter();
        let places = facets.flat_map(|facet| {
            self.surface.facet_nodes(facet).iter().zip(self.surface.reference_points(facet))
        });
        let places = places.map(|(&node, place)| (node, place + at::<D>(fields.u, node))).collect();
        let mut sink = ResultantSink { places, sum: ContactResultant::default() };
        self.evaluate(candidates, fields, request, &mut state.clone(), &mut sink);
        sink.sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The moment of single forces about the origin, and the centre of parallel ones.
    #[test]
    fn moments_and_centres_of_single_forces() {
        let places =
            HashMap::from([(3, Vector::<3>::new(1.0, 2.0, 0.0)), (5, Vector::<3>::new(4.0, 2.0, 0.0))]);
        let mut sink = ResultantSink { places, sum: ContactResultant::default() };
        // The last node does not belong to the contactor.
        sink.force(&[3, 5, 9], &[0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 0.0, 7.0, 7.0]);
        assert_eq!(sink.sum.moment(), [6.0, -6.0, 0.0]);
        assert_eq!(sink.sum.centre(), Some(Vector::<3>::new(2.0, 2.0, 0.0)));
        let part = |x: f64, force: f64| ContactResultant::<2> {
            force: Vector::<2>::new(0.0, force),
            first_moment: Vector::<2>::new(0.0, force) * Vector::<2>::new(x, 0.0).transpose(),
            size: force.abs(),
        };
        let both = [part(1.0, 1.0), part(4.0, 2.0)].into_iter().sum::<ContactResultant<2>>();
        assert_eq!((both.size, both.centre()), (3.0, Some(Vector::<2>::new(3.0, 0.0))));
        sink.force(&[3], &[0.0, 0.0, -3.0]);
        assert_eq!(sink.sum.centre(), None);
        let mut plane = ResultantSink {
            places: HashMap::from([(0, Vector::<2>::new(3.0, 5.0))]),
            sum: ContactResultant::default(),
        };
        plane.force(&[0], &[1.0, 2.0]);
        assert_eq!(plane.sum.moment(), [0.0, 0.0, 1.0]);
    }
}
