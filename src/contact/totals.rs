//! Sums over the points of a surface, whatever its target: zone, energies, nodal means.

use super::point::PointState;
use super::state::ContactState;
use super::surface::ContactSurface;
use super::zone::ZoneSummary;

/// Energies of a contact on this rank \[J\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactEnergy {
    /// Stored by the normal law and by elastic stick.
    pub stored: f64,
    /// Turned into heat by friction in the step that ends in the current state.
    pub heat_of_step: f64,
}

impl<const D: usize> ContactSurface<D> {
    /// What this rank reports of the zone; merge it over ranks.
    pub fn summary(&self, state: &ContactState<D>) -> ZoneSummary<D> {
        let mut summary = ZoneSummary::default();
        for facet in self.facets().iter().filter(|facet| facet.mine) {
            state.current[facet.points.clone()].iter().for_each(|point| summary.add_forces(point));
        }
        let counted = state.current.iter().zip(self.representative()).filter(|(_, counts)| **counts);
        counted.for_each(|(point, _)| summary.count(point));
        summary
    }

    /// Energies of this rank's facets; call it before [`ContactState::accept`] of a step of length `dt` \[s\].
    pub fn energy(&self, state: &ContactState<D>, dt: f64) -> ContactEnergy {
        let mut energy = ContactEnergy::default();
        for facet in self.facets().iter().filter(|facet| facet.mine) {
            for p in facet.points.clone() {
                let (point, history) = (&state.current[p], &state.history[p]);
                energy.stored += self.reference_area(p) * point.potential + point.area * point.recoverable;
                energy.heat_of_step += point.area * history.work_of_step(point, dt);
            }
        }
        energy
    }

    /// Adds to each local node the area-weighted sum of a value of its points and the weights; their quotient is
    /// the nodal value, complete at owned nodes. `sum[node * K + k]`, `weight[node]`.
    pub fn gather_nodal<const K: usize>(
        &self,
        state: &ContactState<D>,
        value: impl Fn(usize, &PointState<D>) -> [f64; K],
        (sum, weight): (&mut [f64], &mut [f64]),
    ) {
        for facet in self.facets() {
            for (q, p) in facet.points.clone().enumerate() {
                let values = value(p, &state.current[p]);
                let shape = self.facet_point(facet, q).shape;
                for (&node, n) in self.facet_nodes(facet).iter().zip(shape) {
                    let share = n.max(0.0) * self.reference_area(p);
                    weight[node as usize] += share;
                    let sums = &mut sum[node as usize * K..][..K];
                    sums.iter_mut().zip(&values).for_each(|(s, v)| *s += share * v);
                }
            }
        }
    }
}
