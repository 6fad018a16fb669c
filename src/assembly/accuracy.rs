//! What an accuracy asks of contact.

use std::collections::BTreeSet;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::LocalContact;
use super::redistribution::Redistribution;
use super::system::ContactSystem;
use crate::contact::friction::Regularization;
use crate::contact::multipliers::Augmentation;
use crate::contact::point::Status;
use crate::dynamics::{Dynamics, Shortfall};
use crate::error::Result;

/// Penetration that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Asked {
    /// As a length \[m\].
    Length(f64),
    /// Over the mean size of the contactor's facets.
    Relative(f64),
}

impl Asked {
    /// What is asked of this contact \[m\]. The penetration of a power law is that of its surface.
    fn of<const D: usize>(self, contact: &LocalContact<D>) -> Option<f64> {
        let length = match self {
            Self::Length(length) => length,
            Self::Relative(part) => part * contact.facet_size,
        };
        contact.law().normal.is_penalty().then_some(length)
    }
}

/// How points that stick move all the same.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stuck {
    /// Largest slip velocity of a sticking point under a law with a stick velocity \[m/s\].
    pub creep: f64,
    /// Largest elastic slip of a sticking point under a law with a stick stiffness \[m\].
    pub give: f64,
}

impl<const D: usize> LocalContact<D> {
    /// Multipliers of the last accepted step.
    pub fn recall_multipliers(&mut self) {
        let law = self.law().normal;
        self.state.recall_multipliers(|pressure| law.penetration(pressure));
    }

    /// The current pressures as multipliers.
    pub fn take_multipliers(&mut self) {
        let law = self.law().normal;
        self.state.take_multipliers(|pressure| law.penetration(pressure));
    }

    /// Those that the next step begins with.
    pub fn remember_multipliers(&mut self) {
        if let Some(compliance) = self.law().normal.law().linear_compliance() {
            self.state.remember_multipliers(1.0 / compliance);
        }
    }

    /// Makes the penalty stiffer by `factor`, up to a most; returns the factor that it took.
    pub fn stiffen(&mut self, factor: f64) -> f64 {
        /// Beyond it rounding takes over.
        const MOST: f64 = 65536.0;
        let factor = factor.min(MOST / self.stiffening);
        let Some(stiffer) = self.law().normal.law().stiffened(factor) else { return 1.0 };
        self.law_mut().normal = stiffer;
        self.stiffening *= factor;
        factor
    }
}

/// How far the closed points of each contact are from touching exactly, over all ranks \[m\]. Collective.
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

/// The contact that is farthest from what was asked of it; `None` where nothing was asked. Collective.
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

/// Brings contacts that are not in motion closer to what was asked: by multipliers where they are sought, by a stiffer
/// penalty elsewhere. Collective.
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
    /// Asks every penalty law to leave no more penetration: by multipliers where there is no inertia; in dynamics, where a
    /// multiplier that changes pushes nodes by the whole tolerance within one step and feeds energy into the contact, by
    /// a stiffer penalty, see [`keep_penetration`](Self::keep_penetration). A power law is left alone: its
    /// penetration is that of the surface.
    pub fn limit_penetration(&mut self, asked: Asked) {
        let multipliers = !self.is_dynamic();
        for contact in &mut self.contacts {
            if let Some(tolerance) = asked.of(contact) {
                contact.tolerance = Some(tolerance);
                contact.state.augment(if multipliers { Augmentation::Sought } else { Augmentation::Carried });
            }
        }
    }

    /// The smallest penetration that this asks of a contact \[m\]; `None` where no contact has a penalty.
    pub fn tolerance(&self, asked: Asked) -> Option<f64> {
        self.contacts.iter().filter_map(|contact| asked.of(contact)).reduce(f64::min)
    }

    /// How far the closed points of contacts with a penalty are from touching exactly \[m\]. Collective.
    pub fn depth(&self) -> f64 {
        let depths = depths(self.session.world(), &self.contacts).into_iter().zip(&self.contacts);
        let penalties = depths.filter(|(_, contact)| contact.law().normal.is_penalty());
        penalties.map(|(depth, _)| depth).fold(0.0, f64::max)
    }

    /// Makes a contact in motion stiffer whose penetration would pass its tolerance if its pressure grew by half, and leaves
    /// the tractions at the end of the present step, which is accepted, as they are. Collective.
    pub fn keep_penetration(&mut self) {
        /// Elastic part of the penetration over what is left of the tolerance, beyond which the contact becomes stiffer.
        const GROWTH: f64 = 2.0;
        /// As much of the tolerance is taken to be left at least.
        const LEAST: f64 = 0.25;
        if self.is_dynamic() {
            self.note_gaps();
            self.stiffen_where(|[depth, elastic]| elastic > GROWTH * (1.0 - depth).max(LEAST));
        }
    }

    /// Makes a contact in motion stiffer that passes its tolerance in the present step, and leaves the tractions at the
    /// start of the step as they are. Whether there is one that gains by it, the same on all ranks. Collective.
    pub fn mend_penetration(&mut self) -> bool {
        /// Elastic part over the tolerance that can not take a contact much further.
        const HARDLY: f64 = 1.0 / 32.0;
        /// Part of the tolerance to be kept: what becomes stiffer gives way a little all the same.
        const INSIDE: f64 = 0.97;
        self.is_dynamic() && self.stiffen_where(|[depth, elastic]| depth > INSIDE && elastic > HARDLY)
    }

    /// Makes contacts stiffer by their depth and its elastic part, both over the tolerance. Collective.
    fn stiffen_where(&mut self, stiffens: impl Fn([f64; 2]) -> bool) -> bool {
        /// By this factor.
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

    /// Whether the mass of a node can rattle on a penalty that became stiffer: where the nodes of either side have no mass, the
    /// elements behind them take part in every motion, and are softer.
    pub fn rattles(&self) -> bool {
        let stiffer = self.contacts.iter().filter(|contact| contact.stiffening > 1.0);
        stiffer.into_iter().any(|contact| !self.is_calm(contact))
    }

    /// Whether a side of the contact has nodes without mass.
    pub(super) fn is_calm(&self, contact: &LocalContact<D>) -> bool {
        self.redistribution.as_ref().is_some_and(|mass| contact.bodies.iter().any(|&body| mass.has(body)))
    }

    /// Names of the bodies whose mass is redistributed, and of those that can not spare what they should.
    pub fn redistributed(&self) -> [Vec<String>; 2] {
        let names = |bodies: &BTreeSet<usize>| {
            bodies.iter().map(|&body| self.bodies[body].name().to_owned()).collect()
        };
        self.redistribution.as_ref().map_or_else(Default::default, |mass| mass.bodies().each_ref().map(names))
    }

    /// Memory on this rank of the multipliers of contact points, and of what takes the mass off them \[bytes\].
    pub fn bytes(&self) -> [usize; 2] {
        let multipliers = self.contacts.iter().map(|contact| contact.state.multiplier_bytes()).sum();
        [multipliers, self.redistribution.as_ref().map_or(0, Redistribution::bytes)]
    }

    /// How much stiffer than their laws say the contacts are.
    pub fn stiffenings(&self) -> Vec<f64> {
        self.contacts.iter().map(|contact| contact.stiffening).collect()
    }

    /// Makes the contacts as much stiffer than their laws say.
    pub fn recall_stiffenings(&mut self, stiffenings: &[f64]) {
        let contacts = self.contacts.iter_mut().zip(stiffenings);
        for (contact, factor) in contacts {
            contact.stiffen(factor / contact.stiffening);
            if let Some(compliance) = contact.law().normal.law().linear_compliance() {
                contact.state.resume_multipliers(1.0 / compliance);
            }
        }
    }

    /// Takes note of the gaps at the last residual as those of the last accepted step.
    pub fn note_gaps(&mut self) {
        self.contacts.iter_mut().for_each(|contact| contact.state.note_gaps());
    }

    /// The smallest penetration that is asked for \[m\].
    pub fn smallest_tolerance(&self) -> Option<f64> {
        self.contacts.iter().filter_map(|contact| contact.tolerance).reduce(f64::min)
    }

    /// Makes stick so stiff that no sticking point gives way by more than `slip` \[m\] under the bound on its friction: a law
    /// with a stick velocity, under which it would creep for ever, by the return map, stiffer by powers of two than the
    /// `given` stiffness and than that of the normal law. Whether a law is not what it was. Collective.
    pub fn stiffen_stick(&mut self, given: &[Option<Regularization>], slip: f64) -> bool {
        /// A law is made stiffer by this factor at most.
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
            // The power law is softest where nothing presses: what is wanted first sets the scale.
            let normal = contact.law().normal.law().linear_compliance().map_or(0.0, f64::recip);
            let base = match given.stiffness() {
                Some(stiffness) => stiffness.value.max(normal),
                _ if normal > 0.0 => normal,
                // Without a stiffness to begin with the law stays until something presses.
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

    /// For each contact, the root mean square speed of all bodies that an impulse on it gives to those of its bodies that are free
    /// to move \[1/kg\]. Collective.
    pub fn recoils(&self) -> Vec<f64> {
        let mut own = vec![0.0; self.bodies.len()];
        for solid in &self.solids {
            solid.group.mass(|index, mass| {
                if self.local.mine[solid.group.elements()[index] as usize] {
                    own[solid.body] += mass.iter().sum::<f64>();
                }
            });
        }
        let mut masses = vec![0.0; own.len()];
        self.session.world().all_reduce_into(&own[..], &mut masses[..], SystemOperation::sum());
        let all: f64 = masses.iter().sum();
        let flies =
            |body: &usize| masses[*body] > 0.0 && self.free_bodies.iter().any(|free| free.body == *body);
        let recoil = |contact: &LocalContact<D>| {
            let flying = contact.bodies.iter().filter(|body| flies(body));
            flying.map(|&body| 1.0 / (masses[body] * all)).sum::<f64>().sqrt()
        };
        self.contacts.iter().map(recoil).collect()
    }

    /// Whether a side of each contact has nodes without mass: the forces of others are those of nodes that rattle, and no impulse.
    pub fn calm(&self) -> Vec<bool> {
        self.contacts.iter().map(|contact| self.is_calm(contact)).collect()
    }

    /// Time in which the nodes in contact swing on their penalty, `2 pi sqrt(m / k)` \[s\], by the mass that moves along the
    /// normals and force over depth; 0 where nothing is closed. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn swing(&mut self) -> Result<f64> {
        let mut normals = self.pattern_vector().like()?;
        self.contact_normals(&mut normals)?;
        let mass = self.weighted_square(&normals)?.max(0.0);
        let stiffness = |contact: super::ContactSummary<D>| match contact.zone.max_penetration {
            depth if depth > 0.0 => contact.zone.normal_force / depth,
            _ => 0.0,
        };
        let stiffness: f64 = self.contact_summaries().into_iter().map(stiffness).sum();
        Ok(if stiffness > 0.0 { std::f64::consts::TAU * (mass / stiffness).sqrt() } else { 0.0 })
    }

    /// Whether slip that turns in the first guess of the next step is taken for an error of the guess.
    pub fn doubt_first_slip(&mut self, doubtful: bool) {
        self.contacts.iter_mut().for_each(|contact| contact.state.doubt(doubtful));
    }

    /// Nodes of all bodies on all ranks.
    pub fn nodes(&self) -> u32 {
        self.local.index.total.unsigned_abs()
    }

    /// The regularisations of the friction laws as they are.
    pub fn regularizations(&self) -> Vec<Option<Regularization>> {
        self.contact_laws().map(|law| law.friction.map(|friction| friction.regularization)).collect()
    }

    /// How points that stick move at the last residual, over all ranks. Collective.
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
