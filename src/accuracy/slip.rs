//! The requested slip: how far sticking points move, and how it is limited. In statics multipliers
//! take elastic slip away, otherwise stick becomes stiffer.

use mpi::collective::SystemOperation;

use crate::assembly::ContactSystem;
use crate::collective::Collective;
use crate::contact::friction::Regularization;
use crate::contact::point::Status;

/// Residual motion of points that stick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stuck {
    /// Largest slip velocity of a sticking point under a law with a stick velocity \[m/s\].
    pub creep: f64,
    /// Largest elastic slip of a sticking point under a law with a stick stiffness \[m\].
    pub give: f64,
}

/// Current regularisations of the friction laws.
pub fn regularizations<const D: usize>(system: &ContactSystem<D>) -> Vec<Option<Regularization>> {
    let friction = system.contacts().iter().map(|contact| contact.law().friction);
    friction.map(|law| law.map(|friction| friction.regularization)).collect()
}

/// Augments the friction of every contact in statics, so that multipliers take elastic slip away. The
/// laws keep their stick stiffness. Does nothing in dynamics.
///
/// `part` is the limit relative to the largest displacement.
pub fn augment<const D: usize>(system: &mut ContactSystem<D>, part: f64) {
    if system.bodies().is_dynamic() || !system.has_friction() {
        return;
    }
    for contact in system.contacts_mut() {
        if contact.law().friction.is_some() {
            contact.state.augment_friction();
        }
    }
    system.limit_slip(part, 0.0);
}

/// Increases the stick stiffness so that no sticking point yields by more than `slip` \[m\]
/// under the bound on its friction. Collective.
///
/// A law with a stick velocity would creep forever, so it gets a return map. The stiffness is a
/// power of two times the larger of the `given` stiffness and that of the normal law. Returns
/// whether a law changed.
pub fn stiffen_stick<const D: usize>(
    system: &mut ContactSystem<D>,
    given: &[Option<Regularization>],
    slip: f64,
) -> bool {
    /// Largest factor by which a law is stiffened.
    const MOST: f64 = 1024.0;
    let mut changed = false;
    let session = system.session().clone();
    for (contact, given) in system.contacts_mut().iter_mut().zip(given) {
        let Some(given) = *given else { continue };
        let bounds = contact.state.history.iter().map(|history| history.bound);
        let trial = contact.state.current.iter().map(|point| point.bound);
        let own = bounds.chain(trial).filter(|bound| bound.is_finite()).fold(0.0, f64::max);
        let mut bound = 0.0;
        session.world().reduce_all(&own, &mut bound, SystemOperation::max());
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

/// Motion of sticking points at the last residual, over all ranks. Collective.
pub fn stuck<const D: usize>(system: &ContactSystem<D>) -> Stuck {
    let mut own = [0.0f64; 2];
    for contact in system.contacts() {
        let Some(friction) = contact.law().friction else { continue };
        for point in contact.state.current.iter().filter(|point| point.status == Status::Stick) {
            match friction.regularization.stiffness() {
                Some(_) => own[1] = own[1].max(point.elastic_slip.norm()),
                None => own[0] = own[0].max(point.slip_velocity.norm()),
            }
        }
    }
    let mut all = [0.0; 2];
    system.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::max());
    Stuck { creep: all[0], give: all[1] }
}
