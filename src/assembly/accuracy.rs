//! Requirements of a requested accuracy on contact.

use std::collections::BTreeSet;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::LocalContact;
use super::redistribution::Redistribution;
use super::system::ContactSystem;
use crate::contact::friction::Regularization;
use crate::contact::multipliers::Augmentation;
use crate::contact::point::Status;
use crate::dynamics::{MultigridHints, Shortfall};
use crate::error::Result;

/// Requested penetration tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Asked {
    /// As a length \[m\].
    Length(f64),
    /// Relative to the mean size of the contactor's facets.
    Relative(f64),
}

impl Asked {
    /// Tolerance for this contact \[m\]. The penetration of a power law is that of its surface and
    /// has no tolerance.
    fn of<const D: usize>(self, contact: &LocalContact<D>) -> Option<f64> {
        let length = match self {
            Self::Length(length) => length,
            Self::Relative(part) => part * contact.facet_size,
        };
        contact.law().normal.is_penalty().then_some(length)
    }
}

/// Residual motion of points that stick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stuck {
    /// Largest slip velocity of a sticking point under a law with a stick velocity \[m/s\].
    pub creep: f64,
    /// Largest elastic slip of a sticking point under a law with a stick stiffness \[m\].
    pub give: f64,
}

impl<const D: usize> LocalContact<D> {
    /// Restores the multipliers of the last accepted step.
    pub fn recall_multipliers(&mut self) {
        let law = self.law().normal;
        self.state.recall_multipliers(|pressure| law.penetration(pressure));
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
fn depths<const D: usize>(world: &impl CommunicatorCollectives, contacts: &[LocalContact<D>]) -> Vec<f64> {
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
    /// Limits the penetration of every penalty law.
    ///
    /// Without inertia, the limit is met by multipliers. In dynamics, a multiplier that changes
    /// pushes nodes by the whole tolerance within one step and feeds energy into the contact. The
    /// penalty is therefore increased instead, see [`keep_penetration`](Self::keep_penetration). A
    /// power law is not changed, because its penetration is that of the surface.
    pub fn limit_penetration(&mut self, asked: Asked) {
        let multipliers = !self.is_dynamic();
        for contact in &mut self.contacts {
            if let Some(tolerance) = asked.of(contact) {
                contact.tolerance = Some(tolerance);
                contact.state.augment(if multipliers { Augmentation::Sought } else { Augmentation::Carried });
            }
        }
    }

    /// Smallest tolerance that this request gives for a contact \[m\]; `None` if no contact has a
    /// penalty.
    pub fn tolerance(&self, asked: Asked) -> Option<f64> {
        self.contacts.iter().filter_map(|contact| asked.of(contact)).reduce(f64::min)
    }

    /// Largest deviation of the closed points of penalty contacts from touching exactly \[m\].
    /// Collective.
    pub fn depth(&self) -> f64 {
        let depths = depths(self.session.world(), &self.contacts).into_iter().zip(&self.contacts);
        let penalties = depths.filter(|(_, contact)| contact.law().normal.is_penalty());
        penalties.map(|(depth, _)| depth).fold(0.0, f64::max)
    }

    /// Stiffens a contact in motion if half as much pressure again would exceed its penetration
    /// tolerance. The tractions at the end of the present step, which is accepted, do not change.
    /// Collective.
    pub fn keep_penetration(&mut self) {
        /// Ratio of the elastic part of the penetration to the remaining tolerance, above which the
        /// contact becomes stiffer.
        const GROWTH: f64 = 2.0;
        /// Smallest part of the tolerance that is assumed to remain.
        const LEAST: f64 = 0.25;
        if self.is_dynamic() {
            self.note_gaps();
            self.stiffen_where(|[depth, elastic]| elastic > GROWTH * (1.0 - depth).max(LEAST));
        }
    }

    /// Stiffens a contact in motion that exceeds its tolerance in the present step. The tractions
    /// at the start of the step do not change. Collective.
    ///
    /// Returns whether a contact benefits, with the same result on all ranks.
    pub fn mend_penetration(&mut self) -> bool {
        /// Ratio of elastic part to tolerance below which stiffening hardly changes a contact.
        const HARDLY: f64 = 1.0 / 32.0;
        /// Part of the tolerance to be kept, because a stiffened contact still yields a little.
        const INSIDE: f64 = 0.97;
        self.is_dynamic() && self.stiffen_where(|[depth, elastic]| depth > INSIDE && elastic > HARDLY)
    }

    /// Stiffens contacts according to their depth and its elastic part, both relative to the
    /// tolerance. Collective.
    fn stiffen_where(&mut self, stiffens: impl Fn([f64; 2]) -> bool) -> bool {
        /// Factor of one stiffening.
        const FACTOR: f64 = 4.0;
        if self.contacts.iter().all(|contact| contact.tolerance.is_none()) {
            return false;
        }
        let depths = depths(self.session.world(), &self.contacts);
        let elastic = |contact: &LocalContact<D>| {
            let pressures = contact.state.current.iter().map(|point| point.normal_traction);
            contact.law().normal.penetration(pressures.fold(0.0, f64::max))
        };
        let own: Vec<f64> = self.contacts.iter().map(elastic).collect();
        let mut all = vec![0.0; own.len()];
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::max());
        let mut stiffer = false;
        for ((contact, depth), elastic) in self.contacts.iter_mut().zip(depths).zip(all) {
            let Some(tolerance) = contact.tolerance else { continue };
            if stiffens([depth / tolerance, elastic / tolerance]) {
                let factor = contact.stiffen(FACTOR);
                contact.state.stiffen(factor);
                stiffer |= factor > 1.0;
            }
        }
        stiffer
    }

    /// Whether the mass of a node can chatter on a penalty that was stiffened.
    ///
    /// If the nodes of either side have no mass, the elements behind them participate in every
    /// motion, and these are softer.
    pub fn rattles(&self) -> bool {
        let stiffer = self.contacts.iter().filter(|contact| contact.stiffening > 1.0);
        stiffer.into_iter().any(|contact| !self.is_calm(contact))
    }

    /// Whether a side of the contact has nodes without mass.
    pub(super) fn is_calm(&self, contact: &LocalContact<D>) -> bool {
        self.redistribution.as_ref().is_some_and(|mass| contact.bodies.iter().any(|&body| mass.has(body)))
    }

    /// Names of the bodies whose mass is redistributed, and of those whose mass cannot be
    /// redistributed as required.
    pub fn redistributed(&self) -> [Vec<String>; 2] {
        let names = |bodies: &BTreeSet<usize>| {
            bodies.iter().map(|&body| self.bodies[body].name().to_owned()).collect()
        };
        self.redistribution.as_ref().map_or_else(Default::default, |mass| mass.bodies().each_ref().map(names))
    }

    /// Memory on this rank for the multipliers of contact points, and for the redistribution of
    /// mass \[bytes\].
    pub fn bytes(&self) -> [usize; 2] {
        let multipliers = self.contacts.iter().map(|contact| contact.state.multiplier_bytes()).sum();
        [multipliers, self.redistribution.as_ref().map_or(0, Redistribution::bytes)]
    }

    /// Factors by which the contacts are stiffer than their laws.
    pub fn stiffenings(&self) -> Vec<f64> {
        self.contacts.iter().map(|contact| contact.stiffening).collect()
    }

    /// Records the gaps at the last residual as those of the last accepted step.
    pub fn note_gaps(&mut self) {
        self.contacts.iter_mut().for_each(|contact| contact.state.note_gaps());
    }

    /// Smallest requested penetration tolerance \[m\].
    pub fn smallest_tolerance(&self) -> Option<f64> {
        self.contacts.iter().filter_map(|contact| contact.tolerance).reduce(f64::min)
    }

    /// Increases the stick stiffness so that no sticking point yields by more than `slip` \[m\]
    /// under the bound on its friction. Collective.
    ///
    /// A law with a stick velocity would creep forever, so it gets a return map. The stiffness is a
    /// power of two times the larger of the `given` stiffness and that of the normal law. Returns
    /// whether a law changed.
    pub fn stiffen_stick(&mut self, given: &[Option<Regularization>], slip: f64) -> bool {
        /// Largest factor by which a law is stiffened.
        const MOST: f64 = 1024.0;
        let mut changed = false;
        for (contact, given) in self.contacts.iter_mut().zip(given) {
            let Some(given) = *given else { continue };
            let bounds = contact.state.history.iter().map(|history| history.bound);
            let trial = contact.state.current.iter().map(|point| point.bound);
            let own = bounds.chain(trial).filter(|bound| bound.is_finite()).fold(0.0, f64::max);
            let mut bound = 0.0;
            self.session.world().all_reduce_into(&own, &mut bound, SystemOperation::max());
            let wanted = bound / slip;
            // The power law is softest without pressure, so the first required stiffness sets the
            // scale.
            let normal = contact.law().normal.law().linear_compliance().map_or(0.0, f64::recip);
            let base = match given.stiffness() {
                Some(stiffness) => stiffness.value.max(normal),
                _ if normal > 0.0 => normal,
                // Without an initial stiffness, the law is kept until a point is under pressure.
                _ if wanted == 0.0 => continue,
                _ => wanted.log2().ceil().exp2(),
            };
            let factor = (wanted / base).clamp(1.0, MOST).log2().ceil().exp2();
            let stiff = Regularization::stick_stiffness(base * factor);
            if let Some(friction) = &mut contact.law_mut().friction {
                changed |= friction.regularization != stiff;
                friction.regularization = stiff;
            }
        }
        changed
    }

    /// For each contact, the root mean square speed of all bodies that an impulse on it gives to
    /// those of its bodies that are free to move \[1/kg\]. Collective.
    pub fn recoils(&self) -> Vec<f64> {
        let masses = self.body_masses();
        let all: f64 = masses.iter().sum();
        let flies = |body: &usize| masses[*body] > 0.0 && self.holding().leaves_free(*body);
        let recoil = |contact: &LocalContact<D>| {
            let flying = contact.bodies.iter().filter(|body| flies(body));
            flying.map(|&body| 1.0 / (masses[body] * all)).sum::<f64>().sqrt()
        };
        self.contacts.iter().map(recoil).collect()
    }

    /// Whether a side of each contact has nodes without mass. Forces of other contacts belong to
    /// chattering nodes and are no measure of an impulse.
    pub fn calm(&self) -> Vec<bool> {
        self.contacts.iter().map(|contact| self.is_calm(contact)).collect()
    }

    /// Period in which the nodes in contact oscillate on their penalty, `2 pi sqrt(m / k)` \[s\].
    /// Collective.
    ///
    /// It uses the mass that moves along the normals, and force over depth. It is 0 if nothing is
    /// closed.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn swing(&mut self) -> Result<f64> {
        let mut normals = self.pattern_vector().like()?;
        self.contact_normals(&mut normals)?;
        let mass = self.weighted_square(&normals)?.max(0.0);
        let world = self.session.world();
        let stiffness = |contact: &LocalContact<D>| {
            let closed = || contact.state.current.iter().filter(|point| point.is_closed());
            let own: f64 = closed().map(|point| point.normal_traction * point.area).sum();
            let deepest = closed().map(|point| -point.gap).fold(0.0, f64::max);
            let mut force = 0.0;
            let mut depth = 0.0;
            world.all_reduce_into(&own, &mut force, SystemOperation::sum());
            world.all_reduce_into(&deepest, &mut depth, SystemOperation::max());
            if depth > 0.0 { force / depth } else { 0.0 }
        };
        let stiffness: f64 = self.contacts.iter().map(stiffness).sum();
        Ok(if stiffness > 0.0 { std::f64::consts::TAU * (mass / stiffness).sqrt() } else { 0.0 })
    }

    /// Sets whether slip that reverses in the initial guess of the next step is attributed to an
    /// error of the guess.
    pub fn doubt_first_slip(&mut self, doubtful: bool) {
        self.contacts.iter_mut().for_each(|contact| contact.state.doubt(doubtful));
    }

    /// Number of nodes of all bodies on all ranks.
    pub fn nodes(&self) -> u32 {
        self.local.index.total.unsigned_abs()
    }

    /// Current regularisations of the friction laws.
    pub fn regularizations(&self) -> Vec<Option<Regularization>> {
        self.contact_laws().map(|law| law.friction.map(|friction| friction.regularization)).collect()
    }

    /// Motion of sticking points at the last residual, over all ranks. Collective.
    pub fn stuck(&self) -> Stuck {
        let mut own = [0.0f64; 2];
        for contact in &self.contacts {
            let Some(friction) = contact.law().friction else { continue };
            for point in contact.state.current.iter().filter(|point| point.status == Status::Stick) {
                match friction.regularization.stiffness() {
                    Some(stiffness) => {
                        own[1] = own[1].max(point.friction_traction.norm() / stiffness.value);
                    }
                    None => own[0] = own[0].max(point.slip_velocity.norm()),
                }
            }
        }
        let mut all = [0.0; 2];
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::max());
        Stuck { creep: all[0], give: all[1] }
    }
}
