//! Remarks on the case at the start, and on its contacts at the end.

use crate::assembly::{ContactSystem, Overclosure};
use crate::case::Units;
use crate::dynamics::Equations;
use crate::error::shown;
use crate::model::ContactModel;
use crate::observe::energy::Energies;
use crate::observe::probes::Watched;
use crate::output::record::PenetrationRecord;
use crate::output::summary::ContactStart;
use crate::petsc::Session;

/// Fraction of a facet. If a target is deeper than this between two vertices of the contactor, the
/// contact is under-resolved. Shipped scenes stay below 0.06 on smooth surfaces, and below 0.13
/// where coarse balls and corners of cubes hit.
const SUNK: f64 = 0.2;

/// The record of a contact before anything has touched.
pub(super) fn untouched<const D: usize>(contact: &ContactModel<D>) -> PenetrationRecord {
    PenetrationRecord {
        contact: contact.name.clone(),
        deepest: 0.0,
        between: [0.0; 2],
        force: 0.0,
        asked: contact.penetration,
    }
}

/// A warning on a contact that never closed, was poorly resolved, or exceeded its penetration
/// tolerance. A contact between all surfaces may stay open.
pub(super) fn warning(contact: &PenetrationRecord, is_general: bool, units: Units) -> Option<String> {
    let name = &contact.contact;
    let [between, facets] = contact.between;
    if facets > SUNK && between > 2.0 * contact.deepest {
        let m = units.of("m");
        let cure = if is_general {
            "refine the meshes of the bodies there"
        } else {
            "refine the mesh of the contactor there, or exchange contactor and target"
        };
        return Some(format!(
            "warning: contact '{name}': the target penetrated the contactor by up to {between:.3e} {m} \
             ({facets:.2} facets) between two vertices\n\
             hint: {cure}"
        ));
    }
    if !contact.has_closed() && !is_general {
        return Some(format!("warning: contact '{name}' never closed: its surfaces did not meet"));
    }
    let asked = contact.asked.filter(|asked| contact.deepest > *asked)?;
    let deepest = contact.deepest;
    let m = units.of("m");
    Some(format!(
        "warning: contact '{name}' penetrated by {deepest:.3e} {m}, but {asked:.3e} {m} was requested\n\
         hint: request {:.1e} {m}, or set normal: {{ penalty: {{ compliance: ... }} }}",
        asked * asked / deepest
    ))
}

/// Largest energies of a run, of all contacts and of the bodies.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SpringEnergies {
    /// Energy that the contact laws store \[J\].
    pub contact: f64,
    /// Strain energy \[J\].
    pub strain: f64,
}

impl SpringEnergies {
    /// Ratio of both from which on the contacts give way too much. Where a contact and the body beneath
    /// it are springs in series, the force is too small by this ratio over one plus this ratio.
    const SOFT: f64 = 0.25;

    /// Adds the energies of a step. The first row may be one before the first balance.
    pub fn record(&mut self, energies: &Energies) {
        self.contact = self.contact.max(energies.contact);
        self.strain = self.strain.max(energies.strain + energies.viscous_stored);
    }

    /// A warning on contacts that are soft beside the bodies. `chosen` are the names of all contacts if
    /// the program chose their stiffness, and empty otherwise.
    pub fn warning(&self, chosen: &[&str], units: Units) -> Option<String> {
        if chosen.is_empty() || self.strain <= 0.0 || self.contact <= Self::SOFT * self.strain {
            return None;
        }
        let ratio = 100.0 * self.contact / self.strain;
        Some(format!(
            "warning: the contacts store {:.2e} {}, {ratio:.0} % of the largest strain energy of the bodies: they \
             give way beside the bodies, and forces are too small\n\
             hint: the stiffness of {} follows Young's modulus, and is low beside nearly incompressible bodies \
             that are confined; set normal: {{ penalty: {{ compliance: ... }} }}",
            self.contact,
            units.of("J"),
            chosen.iter().map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ")
        ))
    }
}

/// Whether the program chooses the stiffness of a contact, from Young's modulus and the size of the
/// facets.
pub(super) fn is_chosen<const D: usize>(contact: &ContactModel<D>) -> bool {
    contact.penetration.is_none() && contact.normal.follows_surfaces()
}

/// Warnings about PETSc options of the user that PETSc did not read.
pub(super) fn unused(session: &Session) -> Vec<String> {
    let options = session.unused_options().unwrap_or_default();
    let words = |option: String| format!("warning: the PETSc option `{}` was not used", shown(&option));
    options.into_iter().map(words).collect()
}

/// The initial state of the contacts between the undeformed bodies.
pub(super) fn contact_starts<const D: usize>(system: &ContactSystem<D>) -> Vec<ContactStart> {
    let start = |found: &Overclosure<D>| ContactStart {
        name: found.contact.clone(),
        unit: system.units().of("m"),
        points: found.candidates,
        paired: found.paired,
        closed: found.nodes,
        widest: (found.largest_gap > 0.0).then(|| (found.largest_gap, found.far_place.to_vec())),
        nearest: is_near(found).then(|| (found.smallest_gap, found.place.to_vec())),
    };
    system.overclosures().iter().map(start).collect()
}

/// Whether any contactor point has a target.
fn is_near<const D: usize>(found: &Overclosure<D>) -> bool {
    found.paired > 0
}

/// Notes before the run: bodies that in dynamics are free to fly, and bodies with massless contact
/// nodes.
pub(super) fn notes<const D: usize>(system: &ContactSystem<D>) -> Vec<String> {
    let mut notes = unsupported_bodies(system);
    let [spared, _] = system.bodies().redistributed();
    if !spared.is_empty() {
        notes.push(format!(
            "mass: redistributed: the nodes of contact surfaces are massless in {}",
            spared.join(", ")
        ));
    }
    notes
}

/// Note on runs whose restarts on several ranks are not bitwise reproducible.
pub(super) const RESTARTS_TO_ROUNDING: &str = "on several ranks MUMPS rounds differently in each run: a run \
                                               resumed from a checkpoint agrees with an uninterrupted run \
                                               only to rounding; for bitwise agreement use linear: \
                                               gmres_asm_ilu, or PETSc's -pc_type redundant \
                                               -redundant_pc_type lu -redundant_pc_factor_mat_solver_type \
                                               mumps";

/// A sentence that names the bodies that neither supports nor contacts can hold, if there are any.
/// Statics rejects such bodies.
fn unsupported_bodies<const D: usize>(system: &ContactSystem<D>) -> Vec<String> {
    let lost = system.bodies().holding().lost_bodies();
    if lost.is_empty() {
        Vec::new()
    } else {
        vec![format!("no support or contact holds {}", lost.join("; "))]
    }
}

/// Warnings before the run.
pub(super) fn remarks<const D: usize>(system: &ContactSystem<D>, watched: &[Watched<D>]) -> Vec<String> {
    let mut remarks = Vec::new();
    if !system.bodies().is_dynamic() {
        remarks.extend(system.bodies().holding().hinged_bodies().into_iter().map(|(name, motions)| {
            let s = if motions == 1 { "" } else { "s" };
            format!(
                "{name} can move without strain ({motions} motion{s}), and no support or contact resists \
                 this: its loads must not drive it"
            )
        }));
    }
    let [_, short] = system.bodies().redistributed();
    if !short.is_empty() {
        remarks.push(format!(
            "too few layers of elements to make the contact surfaces of {} massless: they oscillate on a \
             penalty that is stiff, or is increased for accuracy.penetration",
            short.join(", ")
        ));
    }
    remarks.extend(system.bodies().mostly_massless().into_iter().map(|(name, counts)| {
        format!(
            "{} of the {} nodes of '{name}' ({:.0} %) are massless (`mass`): steps may not \
             converge; write `mass: consistent` for this body, or mesh it with more elements through the \
             thickness",
            counts.massless,
            counts.all,
            100.0 * counts.massless as f64 / counts.all as f64
        )
    }));
    let extent = system.extent();
    let m = system.units().of("m");
    let far = system.overclosures().iter().filter(|found| is_near(found) && found.smallest_gap > extent);
    remarks.extend(far.map(|found| {
        format!(
            "contact '{}' starts with a gap of {:.3e} {m}, more than the size of all bodies, {extent:.3e} \
             {m}: check that it can close",
            found.contact, found.smallest_gap
        )
    }));
    let away = system.overclosures().iter().filter(|found| found.looks_away);
    remarks.extend(away.map(|found| {
        format!(
            "contact '{}': all facets of its contactor face away from the target or are perpendicular to \
             it: check that it is the right side",
            found.contact
        )
    }));
    let off = watched.iter().filter(|point| point.distance > 1e-6 * extent);
    remarks.extend(off.map(|point| {
        let Watched { name, place, distance, line, .. } = point;
        let line = if *line > 0 { format!(" (line {line})") } else { String::new() };
        format!(
            "probe '{name}'{line} uses the nearest node at {} {m}, {distance:.3e} {m} from the requested \
             position",
            crate::mesh::spelled(place)
        )
    }));
    remarks
}
