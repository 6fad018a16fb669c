//! Multipliers and stiffer penalties, which bring contacts to a requested penetration.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::LocalContact;
use super::redistribution::Redistribution;
use super::system::ContactSystem;
use crate::dynamics::Shortfall;

impl<const D: usize> LocalContact<D> {
    /// Restores the multipliers of the last accepted step.
    pub fn reset_multipliers(&mut self) {
        let law = self.law().normal;
        self.state.reset_multipliers(|pressure| law.penetration(pressure));
    }

    /// Takes the current pressures as multipliers.
    pub fn take_multipliers(&mut self) {
        let law = self.law().normal;
        self.state.take_multipliers(|pressure| law.penetration(pressure));
    }

    /// Stores the multipliers with which the next step begins.
    pub fn remember_multipliers(&mut self) {
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
    world.all_reduce_into(&own[..], &mut all[..], SystemOperation::max());
    all
}

/// Returns the contact that misses its tolerance most; `None` if no tolerance was requested.
/// Collective.
pub fn shortfall<const D: usize>(
    world: &impl CommunicatorCollectives,
    contacts: &[LocalContact<D>],
) -> Option<Shortfall> {
    if contacts.iter().all(|contact| contact.tolerance.is_none()) {
        return None;
    }
    let depths = depths(world, contacts);
    let asked =
        contacts.iter().zip(&depths).filter_map(|(contact, depth)| Some((contact.tolerance?, *depth)));
    let shortfall = |(tolerance, depth)| Shortfall { ratio: depth / tolerance, depth };
    asked.map(shortfall).max_by(|a, b| a.ratio.total_cmp(&b.ratio))
}

/// Brings contacts that are not in motion closer to their tolerance, by multipliers if they are
/// sought, otherwise by a stiffer penalty. Collective.
pub fn improve<const D: usize>(world: &impl CommunicatorCollectives, contacts: &mut [LocalContact<D>]) {
    let depths = depths(world, contacts);
    for (contact, depth) in contacts.iter_mut().zip(depths) {
        let Some(tolerance) = contact.tolerance else { continue };
        if contact.state.seeks_multipliers() {
            contact.take_multipliers();
        } else if depth > 0.25 * tolerance {
            contact.stiffen((4.0 * depth / tolerance).log2().ceil().exp2());
        }
    }
}

impl<const D: usize> ContactSystem<D> {
    /// The contacts of this rank, to change their laws or state.
    pub fn contacts_mut(&mut self) -> &mut [LocalContact<D>] {
        &mut self.contacts
    }

    /// Memory on this rank for the multipliers of contact points, for the redistribution of mass, and
    /// for viscous branches \[bytes\].
    pub fn bytes(&self) -> [usize; 3] {
        let multipliers = self.contacts.iter().map(|contact| contact.state.multiplier_bytes()).sum();
        let masses = self.bodies.redistribution.as_ref().map_or(0, Redistribution::bytes);
        [multipliers, masses, self.bodies.viscous_bytes()]
    }
}
