//! Oscillation of nodes in contact, and how impulses move free bodies.

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact};
use crate::collective::Collective;
use crate::dynamics::MultigridHints;
use crate::error::Result;

/// Whether the mass of a node can chatter on a penalty that was stiffened.
///
/// If the nodes of either side have no mass, the elements behind them participate in every
/// motion, and these are softer.
pub fn rattles<const D: usize>(system: &ContactSystem<D>) -> bool {
    let stiffer = system.contacts().iter().filter(|contact| contact.stiffening > 1.0);
    stiffer.into_iter().any(|contact| !system.bodies().is_calm(contact))
}

/// Whether a side of each contact has nodes without mass. Forces of other contacts belong to
/// chattering nodes and are no measure of an impulse.
pub fn calm<const D: usize>(system: &ContactSystem<D>) -> Vec<bool> {
    system.contacts().iter().map(|contact| system.bodies().is_calm(contact)).collect()
}

/// For each contact, the root mean square speed of all bodies that an impulse on it gives to
/// those of its bodies that are free to move \[1/kg\]. Collective.
pub fn recoils<const D: usize>(system: &ContactSystem<D>) -> Vec<f64> {
    let masses = system.bodies().masses();
    let rigid = system.bodies().rigid_masses();
    let all: f64 = masses.iter().chain(&rigid).sum();
    let flies = |body: &usize| masses[*body] > 0.0 && system.bodies().holding().leaves_free(*body);
    let recoil = |contact: &LocalContact<D>| {
        let flying = contact.bodies.iter().filter(|body| flies(body));
        let target = contact.target().free_body().map(|body| rigid[body]).filter(|mass| *mass > 0.0);
        let moving = flying.map(|&body| masses[body]).chain(target);
        moving.map(|mass| 1.0 / (mass * all)).sum::<f64>().sqrt()
    };
    system.contacts().iter().map(recoil).collect()
}

/// Period in which the nodes in contact oscillate on their penalty, `2 pi sqrt(m / k)` \[s\].
/// Collective.
///
/// It uses the mass that moves along the normals, and force over depth. It is 0 if nothing is
/// closed.
///
/// # Errors
/// If a PETSc call fails.
pub fn swing<const D: usize>(system: &mut ContactSystem<D>) -> Result<f64> {
    let mut normals = system.pattern_vector().like()?;
    system.contact_normals(&mut normals)?;
    let mass = system.bodies().weighted_square(&normals)?.max(0.0);
    let world = system.session().world();
    let stiffness = |contact: &LocalContact<D>| {
        let closed = || contact.state.current.iter().filter(|point| point.is_closed());
        let own: f64 = closed().map(|point| point.normal_traction * point.area).sum();
        let deepest = closed().map(|point| -point.gap).fold(0.0, f64::max);
        let mut force = 0.0;
        let mut depth = 0.0;
        world.reduce_all(&own, &mut force, SystemOperation::sum());
        world.reduce_all(&deepest, &mut depth, SystemOperation::max());
        if depth > 0.0 { force / depth } else { 0.0 }
    };
    let stiffness: f64 = system.contacts().iter().map(stiffness).sum();
    Ok(if stiffness > 0.0 { std::f64::consts::TAU * (mass / stiffness).sqrt() } else { 0.0 })
}

/// Number of nodes of all bodies on all ranks.
pub fn nodes<const D: usize>(system: &ContactSystem<D>) -> u32 {
    system.bodies().local().index.total.unsigned_abs()
}
