//! What an accuracy asks of contact, and the sizes that errors are compared with.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::Contact;
use super::system::ContactSystem;
use crate::contact::friction::Regularization;
use crate::contact::normal::NormalLaw;
use crate::contact::point::Status;
use crate::dynamics::Shortfall;
use crate::error::Result;
use crate::petsc::Vector;

/// Penetration that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Asked {
    /// As a length [m].
    Length(f64),
    /// Over the mean size of the contactor's facets.
    Relative(f64),
}

/// How points that stick move all the same.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stuck {
    /// Largest slip velocity of a sticking point under a law with a stick velocity [m/s].
    pub creep: f64,
    /// Largest elastic slip of a sticking point under a law with a stick stiffness [m].
    pub give: f64,
}

impl<const D: usize> Contact<D> {
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
}

/// How far the closed points are from touching exactly, over all ranks. Collective.
pub fn shortfall<const D: usize>(
    world: &impl CommunicatorCollectives,
    contacts: &[Contact<D>],
) -> Option<Shortfall> {
    if contacts.iter().all(|contact| contact.tolerance.is_none()) {
        return None;
    }
    let mut own = [0.0f64; 2];
    for contact in contacts {
        let Some(tolerance) = contact.tolerance else { continue };
        let closed = contact.state.current.iter().filter(|point| point.is_closed());
        let depth = closed.map(|point| point.gap.abs()).fold(0.0, f64::max);
        own = [own[0].max(depth / tolerance), own[1].max(depth)];
    }
    let mut all = [0.0; 2];
    world.all_reduce_into(&own[..], &mut all[..], SystemOperation::max());
    Some(Shortfall { ratio: all[0], depth: all[1] })
}

impl<const D: usize> ContactSystem<D> {
    /// Augments every penalty law by multipliers that leave no more penetration than is asked; a power law is left
    /// alone, since its penetration is that of the surface.
    pub fn augment_contacts(&mut self, asked: Asked) {
        for contact in &mut self.contacts {
            if let NormalLaw::Penalty(_) = contact.law().normal {
                contact.tolerance = Some(match asked {
                    Asked::Length(length) => length,
                    Asked::Relative(part) => part * contact.facet_size,
                });
                contact.state.augment();
            }
        }
    }

    /// The smallest penetration that is asked for [m].
    pub fn smallest_tolerance(&self) -> Option<f64> {
        self.contacts.iter().filter_map(|contact| contact.tolerance).reduce(f64::min)
    }

    /// Makes stick stiffer than `given` by powers of two, so that no sticking point creeps faster than `speed` [m/s] or
    /// gives way by more than `slip` [m] under the friction tractions of now. Collective.
    pub fn stiffen_stick(&mut self, given: &[Option<Regularization>], speed: f64, slip: f64) {
        /// A law is made stiffer by this factor at most.
        const MOST: f64 = 1024.0;
        for (contact, given) in self.contacts.iter_mut().zip(given) {
            let Some(given) = *given else { continue };
            let wanted = match given {
                Regularization::StickVelocity { velocity } | Regularization::SmoothStickVelocity { velocity } => {
                    velocity / speed
                }
                Regularization::StickStiffness { stiffness } => {
                    let traction = |point: &crate::contact::point::PointState<D>| point.friction_traction.norm();
                    let own = contact.state.current.iter().map(traction).fold(0.0, f64::max);
                    let mut most = 0.0;
                    self.session.world().all_reduce_into(&own, &mut most, SystemOperation::max());
                    2.0 * most / (stiffness * slip)
                }
            };
            let factor = wanted.clamp(1.0, MOST).log2().ceil().exp2();
            if let Some(friction) = &mut contact.law_mut().friction {
                friction.regularization = given.stiffened(factor);
            }
        }
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
                match friction.regularization {
                    Regularization::StickStiffness { stiffness } => {
                        own[1] = own[1].max(point.friction_traction.norm() / stiffness);
                    }
                    _ => own[0] = own[0].max(point.slip_velocity.norm()),
                }
            }
        }
        let mut all = [0.0; 2];
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::max());
        Stuck { creep: all[0], give: all[1] }
    }

    /// Root mean square of a nodal field, weighted by the mass, by the nodes where there is none; `weight` is that of
    /// [`weight`](Self::weight). Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn mean_size(&mut self, field: &Vector, weight: f64) -> Result<f64> {
        let square = self.weighted_square(field)?;
        Ok((square / weight).max(0.0).sqrt())
    }

    fn weighted_square(&mut self, field: &Vector) -> Result<f64> {
        let Some(mass) = &self.mass else { return field.dot(field) };
        mass.multiply(field, &mut self.work)?;
        field.dot(&self.work)
    }

    /// Mass of all bodies [kg], or the number of nodes. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn weight(&mut self) -> Result<f64> {
        if self.mass.is_none() {
            return Ok(f64::from(self.local.index.total));
        }
        let mut ones = self.forces.like()?;
        ones.set(1.0);
        Ok(self.weighted_square(&ones)? / D as f64)
    }

    /// Sets the entries of prescribed unknowns to zero.
    pub fn clear_prescribed(&self, field: &mut Vector) {
        let mut owned = field.owned_mut();
        let held = self.supports.dofs.constrained.iter();
        owned.iter_mut().zip(held).filter(|(_, held)| **held).for_each(|(value, _)| *value = 0.0);
    }
}
