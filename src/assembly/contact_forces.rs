//! Forces of all contacts, with overlapping communication.

use mpi::traits::CommunicatorCollectives;

use super::contact::LocalContact;
use super::interface::{Interface, RemoteForce};
use super::phases::Phases;
use crate::contact::evaluation::{ContactFields, ContactRequest};

/// Adds the forces of the contacts, and runs `meanwhile` while those of other ranks are being
/// received. Collective.
pub(super) fn add_contact_forces<const D: usize>(
    interface: &mut Interface<D>,
    contacts: &mut [LocalContact<D>],
    world: &impl CommunicatorCollectives,
    phases: &Phases,
    request: &ContactRequest,
    force: &mut [f64],
    meanwhile: impl FnOnce(),
) {
    let evaluate = |fields: &ContactFields, own: &mut [f64], mut remote: RemoteForce| {
        let _running = phases.contact.begin();
        for contact in contacts {
            contact.add_force(fields, request, own, remote.reborrow());
        }
    };
    interface.add_forces(world, force, evaluate, meanwhile);
}
