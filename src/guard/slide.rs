//! Sliding distance of surfaces in contact in a step, compared with their facets.

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact};
use crate::collective::Collective;
use crate::dynamics::Stage;

/// Motion of the two surfaces of a contact with friction in a step, with the same values on all
/// ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Slide {
    /// Name of the contact.
    pub contact: String,
    /// Largest extent of a facet of either side \[m\].
    pub facet: f64,
    /// Largest displacement of a node of either side in the step \[m\].
    pub motion: f64,
    /// Largest sliding distance in the step of surfaces that are in contact at its end \[m\]. It is
    /// 0 on an obstacle, which has no facets.
    pub slid: f64,
    /// Centre of the normal forces on the undeformed contactor \[m\]; `None` if the contact is
    /// open. It moves when one surface rolls on the other.
    pub centre: Option<[f64; 3]>,
}

/// Motions of the contacts with friction in the step that ends in the trial state. Collective.
pub fn slides<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Vec<Slide> {
    let contacts: Vec<&LocalContact<D>> =
        system.contacts().iter().filter(|contact| contact.law().friction.is_some()).collect();
    if contacts.is_empty() {
        return Vec::new();
    }
    let (start, end) = (stage.start.u.local(), stage.trial.u.local());
    let moved = |node: u32| {
        let dofs = node as usize * D..node as usize * D + D;
        dofs.map(|dof| (end[dof] - start[dof]).powi(2)).sum::<f64>().sqrt()
    };
    let mut most: Vec<[f64; 2]> = Vec::with_capacity(contacts.len());
    let mut sums: Vec<[f64; 4]> = Vec::with_capacity(contacts.len());
    for contact in &contacts {
        let (slid, force) = slid_and_pressed(contact);
        most.push([largest_motion(system, contact, moved), slid]);
        sums.push(force);
    }
    let mut all_most = vec![[0.0_f64; 2]; most.len()];
    let mut all_sums = vec![[0.0_f64; 4]; sums.len()];
    let world = system.session().world();
    world.reduce_all(most.as_flattened(), all_most.as_flattened_mut(), SystemOperation::max());
    world.reduce_all(sums.as_flattened(), all_sums.as_flattened_mut(), SystemOperation::sum());
    let slide =
        |(contact, ([motion, slid], [force, x, y, z])): (&&LocalContact<D>, ([f64; 2], [f64; 4]))| Slide {
            contact: contact.name.clone(),
            facet: contact.largest_facet(),
            motion,
            slid,
            centre: (force > 0.0).then(|| [x, y, z].map(|moment| moment / force)),
        };
    contacts.iter().zip(all_most.into_iter().zip(all_sums)).map(slide).collect()
}

/// Largest value of `moved` over the nodes of both surfaces on this rank.
fn largest_motion<const D: usize>(
    system: &ContactSystem<D>,
    contact: &LocalContact<D>,
    moved: impl Fn(u32) -> f64,
) -> f64 {
    let surface = contact.surface();
    let contactor = surface.facets().iter().flat_map(|facet| surface.facet_nodes(facet));
    let mut most = contactor.map(|&node| moved(node)).fold(0.0, f64::max);
    let mut nodes = Vec::new();
    for &facet in contact.pair.target_facets() {
        system.bodies().local().mesh.facet_nodes(facet, &mut nodes);
        most = nodes.iter().map(|&node| moved(node)).fold(most, f64::max);
    }
    most
}

/// Largest slip of this rank's points in contact \[m\], their normal force \[N\], and its moments
/// about the undeformed vertices \[N m\].
fn slid_and_pressed<const D: usize>(contact: &LocalContact<D>) -> (f64, [f64; 4]) {
    let mut slid = 0.0_f64;
    let mut sums = [0.0; 4];
    let points = contact.state.current.iter().zip(contact.gaps());
    for (point, (_, place)) in points.filter(|(point, _)| point.is_closed()) {
        let force = point.normal_traction * point.area;
        if contact.target().has_facets() {
            slid = slid.max(point.slip_increment.norm());
        }
        sums[0] += force;
        (0..D).for_each(|i| sums[1 + i] += force * place[i]);
    }
    (slid, sums)
}
