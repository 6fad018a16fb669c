//! The requested penetration: which contacts it limits, and how their penalty follows.

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact, depths, excess_penetration};
use crate::collective::Collective;
use crate::contact::multipliers::MultiplierSource;
use crate::dynamics::Shortfall;

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

/// Limits the penetration of every penalty law.
///
/// Without inertia, the limit is met by multipliers. In dynamics, a multiplier that changes
/// pushes nodes by the whole tolerance within one step and feeds energy into the contact. The
/// penalty is therefore increased instead, see [`keep`]. A
/// power law is not changed, because its penetration is that of the surface.
pub fn limit<const D: usize>(system: &mut ContactSystem<D>, asked: Asked) {
    let multipliers = !system.bodies().is_dynamic();
    for contact in system.contacts_mut() {
        if let Some(tolerance) = asked.of(contact) {
            contact.tolerance = Some(tolerance);
            contact.state.augment(if multipliers {
                MultiplierSource::Sought
            } else {
                MultiplierSource::Carried
            });
        }
    }
}

/// Smallest tolerance that this request gives for a contact \[m\]; `None` if no contact has a
/// penalty.
pub fn tolerance<const D: usize>(system: &ContactSystem<D>, asked: Asked) -> Option<f64> {
    system.contacts().iter().filter_map(|contact| asked.of(contact)).reduce(f64::min)
}

/// Smallest requested penetration tolerance \[m\].
pub fn smallest_tolerance<const D: usize>(system: &ContactSystem<D>) -> Option<f64> {
    system.contacts().iter().filter_map(|contact| contact.tolerance).reduce(f64::min)
}

/// Largest deviation of the closed points of penalty contacts from touching exactly \[m\].
/// Collective.
pub fn depth<const D: usize>(system: &ContactSystem<D>) -> f64 {
    let depths = depths(system.session().world(), system.contacts()).into_iter().zip(system.contacts());
    let penalties = depths.filter(|(_, contact)| contact.law().normal.is_penalty());
    penalties.map(|(depth, _)| depth).fold(0.0, f64::max)
}

/// The penetration that misses its tolerance most; `None` if none is limited. Collective.
pub fn excess<const D: usize>(system: &ContactSystem<D>) -> Option<Shortfall> {
    excess_penetration(system.session().world(), system.contacts())
}

/// Stiffens a contact in motion if half as much pressure again would exceed its penetration
/// tolerance. The tractions at the end of the present step, which is accepted, do not change.
/// Collective.
pub fn keep<const D: usize>(system: &mut ContactSystem<D>) {
    /// Ratio of the elastic part of the penetration to the remaining tolerance, above which the
    /// contact becomes stiffer.
    const GROWTH: f64 = 2.0;
    /// Smallest part of the tolerance that is assumed to remain.
    const LEAST: f64 = 0.25;
    if system.bodies().is_dynamic() {
        note_gaps(system);
        stiffen_where(system, |[depth, elastic]| elastic > GROWTH * (1.0 - depth).max(LEAST));
    }
}

/// Stiffens a contact in motion that exceeds its tolerance in the present step. The tractions
/// at the start of the step do not change. Collective.
///
/// Returns whether a contact benefits, with the same result on all ranks.
pub fn mend<const D: usize>(system: &mut ContactSystem<D>) -> bool {
    /// Ratio of elastic part to tolerance below which stiffening hardly changes a contact.
    const HARDLY: f64 = 1.0 / 32.0;
    /// Part of the tolerance to be kept, because a stiffened contact still yields a little.
    const INSIDE: f64 = 0.97;
    system.bodies().is_dynamic()
        && stiffen_where(system, |[depth, elastic]| depth > INSIDE && elastic > HARDLY)
}

/// Stiffens contacts according to their depth and its elastic part, both relative to the
/// tolerance. Collective.
fn stiffen_where<const D: usize>(system: &mut ContactSystem<D>, stiffens: impl Fn([f64; 2]) -> bool) -> bool {
    /// Factor of one stiffening.
    const FACTOR: f64 = 4.0;
    if system.contacts().iter().all(|contact| contact.tolerance.is_none()) {
        return false;
    }
    let depths = depths(system.session().world(), system.contacts());
    let elastic = |contact: &LocalContact<D>| {
        let pressures = contact.state.current.iter().map(|point| point.normal_traction);
        contact.law().normal.penetration(pressures.fold(0.0, f64::max))
    };
    let own: Vec<f64> = system.contacts().iter().map(elastic).collect();
    let mut all = vec![0.0; own.len()];
    system.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::max());
    let mut stiffer = false;
    for ((contact, depth), elastic) in system.contacts_mut().iter_mut().zip(depths).zip(all) {
        let Some(tolerance) = contact.tolerance else { continue };
        if stiffens([depth / tolerance, elastic / tolerance]) {
            let factor = contact.stiffen(FACTOR);
            contact.state.stiffen(factor);
            stiffer |= factor > 1.0;
        }
    }
    stiffer
}

/// Factors by which the contacts are stiffer than their laws.
pub fn stiffenings<const D: usize>(system: &ContactSystem<D>) -> Vec<f64> {
    system.contacts().iter().map(|contact| contact.stiffening).collect()
}

/// Records the gaps at the last residual as those of the last accepted step.
pub fn note_gaps<const D: usize>(system: &mut ContactSystem<D>) {
    system.contacts_mut().iter_mut().for_each(|contact| contact.state.note_gaps());
}
