//! Whether loads move a body away from the contacts that hold it. Contacts push and do not pull.

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact};
use crate::collective::Collective;
use crate::dynamics::RigidMotion;
use crate::petsc::Vector;
use crate::tensor::Vector as Point;

/// Forces of the loads along each motion, and the norm of all loads, at the last residual
/// \[N\]. Collective.
pub fn loads_along<const D: usize>(system: &ContactSystem<D>, motions: &[RigidMotion]) -> (Vec<f64>, f64) {
    let loads = system.external_forces();
    let dot = |motion: &RigidMotion| motion.field.owned().iter().zip(loads).map(|(n, f)| n * f).sum();
    let mut own: Vec<f64> = motions.iter().map(dot).collect();
    own.push(loads.iter().map(|f| f * f).sum());
    let mut all = vec![0.0; own.len()];
    system.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::sum());
    let square = all.pop().unwrap_or(0.0);
    (all, square.sqrt())
}

/// Whether a point that was closed at the start of the step resists a motion. Its gap closes,
/// or it has friction and does not open. `u` are the displacements at the start of the step \[m\].
/// Collective.
pub fn contact_resists<const D: usize>(system: &ContactSystem<D>, motion: &Vector, u: &Vector) -> bool {
    /// Motion, relative to the largest motion of a node, below which a gap neither closes nor
    /// opens. It is well above rounding.
    const STILL: f64 = 1e-6;
    let field = motion.owned();
    let u = u.owned();
    let targets = mean_target_motions(system, &field);
    let rigid = system.rigid_motion_in(&field);
    let own = field.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let mut largest = 0.0_f64;
    let world = system.session().world();
    world.reduce_all(&own, &mut largest, SystemOperation::max());
    let touching = system.bodies().known_length();
    let resists = |(contact, target): (&LocalContact<D>, &Point<D>)| {
        let rubs = contact.law().friction.is_some();
        let least = if rubs { STILL } else { -STILL } * largest;
        let points = contact.state.history.iter().zip(&contact.state.current).enumerate();
        let free = contact.target().free_body().zip(contact.target().frame());
        // The side of an edge that stands upright on a plane touches it, but carries nothing.
        points.filter(|(_, (history, point))| history.gap <= touching && point.area > 0.0).any(
            |(vertex, (_, point))| {
                let first = contact.vertices()[vertex] as usize * D;
                let of = |field: &[f64]| Point::<D>::from_column_slice(&field[first..][..D]);
                let moved = of(&field);
                let target = match free {
                    Some((body, frame)) => {
                        rigid[body].at(&frame.arm_at_start(&(contact.reference_point(vertex) + of(&u))))
                    }
                    None => *target,
                };
                // Points whose bodies do not move are irrelevant.
                (moved - target).dot(&point.normal) < least && (moved - target).amax() > STILL * largest
            },
        )
    };
    let own = u8::from(system.contacts().iter().zip(&targets).any(resists));
    let mut any = 0u8;
    world.reduce_all(&own, &mut any, SystemOperation::max());
    any > 0
}

/// Mean motion of the nodes of each target surface; zero if the target is rigid.
/// Collective.
fn mean_target_motions<const D: usize>(system: &ContactSystem<D>, field: &[f64]) -> Vec<Point<D>> {
    let mut own = vec![0.0_f64; system.contacts().len() * (D + 1)];
    let mut nodes = Vec::new();
    for (contact, sums) in system.contacts().iter().zip(own.chunks_exact_mut(D + 1)) {
        for &facet in contact.pair.target_facets() {
            system.bodies().local().mesh.facet_nodes(facet, &mut nodes);
            for &node in nodes.iter().filter(|&&node| system.bodies().local().index.owns(node)) {
                sums[D] += 1.0;
                (0..D).for_each(|i| sums[i] += field[node as usize * D + i]);
            }
        }
    }
    let mut all = vec![0.0_f64; own.len()];
    system.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::sum());
    all.chunks_exact(D + 1).map(|sums| Point::from_fn(|i, _| sums[i] / sums[D].max(1.0))).collect()
}
