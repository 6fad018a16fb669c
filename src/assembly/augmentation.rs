//! Multipliers and stiffer penalties, which bring contacts to a requested penetration and slip.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::LocalContact;
use super::redistribution::Redistribution;
use super::slip_limit::SlipLimit;
use super::system::ContactSystem;
use crate::collective::Collective;
use crate::dynamics::{Shortfall, Stage};
use crate::error::Result;

impl<const D: usize> LocalContact<D> {
    /// Restores the multipliers of the last accepted step.
    pub fn reset_multipliers(&mut self) {
        let law = self.law().normal;
        self.state.reset_multipliers(|pressure| law.penetration(pressure));
    }

    /// Takes the current tractions as multipliers.
    pub fn take_multipliers(&mut self) {
        let law = self.law().normal;
        self.state.take_multipliers(|pressure| law.penetration(pressure));
    }

    /// Stores the multipliers with which the next step begins.
    pub fn remember_multipliers(&mut self) {
        self.state.resume_friction();
        if let Some(compliance) = self.law().normal.law().linear_compliance() {
            self.state.remember_multipliers(1.0 / compliance);
        }
    }

    /// Increases the penalty by `factor`, up to a maximum. Returns the factor that was applied.
    pub fn stiffen(&mut self, factor: f64) -> f64 {
        /// Maximum total factor. Above it, rounding dominates.
        const MOST: f64 = 65536.0;
        let factor = factor.min(MOST / self.stiffening);
        let Some(stiffer) = self.law().normal.law().stiffened(factor) else { return 1.0 };
        self.law_mut().normal = stiffer;
        self.stiffening *= factor;
        factor
    }
}

/// Largest deviation of the closed points of each contact from touching exactly, over all ranks
/// \[m\]. Collective.
pub fn depths<const D: usize>(
    world: &impl CommunicatorCollectives,
    contacts: &[LocalContact<D>],
) -> Vec<f64> {
    let depth = |contact: &LocalContact<D>| {
        let closed = contact.state.current.iter().filter(|point| point.is_closed());
        closed.map(|point| point.gap.abs()).fold(0.0, f64::max)
    };
    let own: Vec<f64> = contacts.iter().map(depth).collect();
    let mut all = vec![0.0; own.len()];
    world.reduce_all(&own[..], &mut all[..], SystemOperation::max());
    all
}

/// Returns the penetration of the contact that misses its tolerance most; `None` if no tolerance was
/// requested. Collective.
pub fn excess_penetration<const D: usize>(
    world: &impl CommunicatorCollectives,
    contacts: &[LocalContact<D>],
) -> Option<Shortfall> {
    if contacts.iter().all(|contact| contact.tolerance.is_none()) {
        return None;
    }
    let depths = depths(world, contacts);
    let asked =
        contacts.iter().zip(&depths).filter_map(|(contact, depth)| Some((contact.tolerance?, *depth)));
    asked.map(|(tolerance, depth)| Shortfall::penetration(depth, tolerance)).reduce(Shortfall::larger)
}

/// Largest elastic slip of the closed points of contacts whose friction is augmented, over all ranks
/// \[m\]. Collective.
fn elastic_slip<const D: usize>(world: &impl CommunicatorCollectives, contacts: &[LocalContact<D>]) -> f64 {
    let points = contacts.iter().filter(|contact| contact.state.seeks_stick()).flat_map(|contact| {
        contact.state.current.iter().filter(|point| point.is_closed()).map(|point| point.elastic_slip.norm())
    });
    let own = points.fold(0.0, f64::max);
    let mut all = 0.0;
    world.reduce_all(&own, &mut all, SystemOperation::max());
    all
}

/// Brings contacts that are not in motion closer to their tolerances, by multipliers if they are
/// sought, otherwise by a stiffer penalty. Collective.
pub fn improve<const D: usize>(world: &impl CommunicatorCollectives, contacts: &mut [LocalContact<D>]) {
    let depths = depths(world, contacts);
    for (contact, depth) in contacts.iter_mut().zip(depths) {
        if contact.state.seeks_multipliers() || contact.state.seeks_stick() {
            contact.take_multipliers();
            continue;
        }
        let Some(tolerance) = contact.tolerance else { continue };
        if depth > 0.25 * tolerance {
            contact.stiffen((4.0 * depth / tolerance).log2().ceil().exp2());
        }
    }
}

impl<const D: usize> ContactSystem<D> {
    /// The contacts of this rank, to change their laws or state.
    pub fn contacts_mut(&mut self) -> &mut [LocalContact<D>] {
        &mut self.contacts
    }

    /// Limits the elastic slip to this part of the largest displacement. `size` is the largest one so
    /// far \[m\].
    pub fn limit_slip(&mut self, part: f64, size: f64) {
        self.slip_limit = Some(SlipLimit { part, size });
    }

    /// Whether multipliers limit the elastic slip.
    pub fn limits_elastic_slip(&self) -> bool {
        self.slip_limit.is_some()
    }

    /// By how much the trial state misses the requested penetration and slip. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub(super) fn missed(&self, stage: &Stage) -> Result<Option<Shortfall>> {
        let world = self.bodies.session.world();
        let penetration = excess_penetration(world, &self.contacts);
        let Some(limit) = self.slip_limit else { return Ok(penetration) };
        let slip = elastic_slip(world, &self.contacts);
        if slip == 0.0 {
            return Ok(penetration);
        }
        // The size of the motion is measured as in the report of the accuracy.
        let nodes = f64::from(self.bodies.local.index.total);
        let moved = (self.bodies.weighted_square(&stage.trial.u)? / nodes).sqrt();
        let size = limit.size.max(moved).max(self.travel_of_tools(&stage.trial.u));
        let slip = Shortfall::slip(slip, limit.part * size);
        Ok(Some(penetration.map_or(slip, |penetration| penetration.larger(slip))))
    }

    /// Memory on this rank for the multipliers of contact points, for the redistribution of mass, and
    /// for viscous branches \[bytes\].
    pub fn bytes(&self) -> [usize; 3] {
        let multipliers = self.contacts.iter().map(|contact| contact.state.multiplier_bytes()).sum();
        let masses = self.bodies.redistribution.as_ref().map_or(0, Redistribution::bytes);
        [multipliers, masses, self.bodies.viscous_bytes()]
    }
}
