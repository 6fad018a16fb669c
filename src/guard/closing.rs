//! Contacts that closed in a step, and their closing speeds.

use mpi::collective::SystemOperation;

use crate::assembly::{ContactSystem, LocalContact};
use crate::collective::Collective;
use crate::dynamics::Stage;
use crate::mesh::Facet;
use crate::tensor::Vector as Point;

/// Data of a contact that closed in a step, over all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosingContact {
    /// Name of the contact.
    pub contact: String,
    /// Number of points that closed in the step.
    pub now: u64,
    /// Number of points that were closed at its start.
    pub before: u64,
    /// Number of all points.
    pub points: u64,
    /// Largest closing speed of a gap \[m/s\].
    ///
    /// It is the larger of the approach speed of the surfaces at the start of the step and the mean
    /// speed of the gap over the step. The mean is small in a step that is much longer than the
    /// flight.
    pub speed: f64,
}

/// Returns how each contact closed in the step that ends in the trial state. Call it before the
/// step is accepted. Collective.
pub fn closings<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Vec<ClosingContact> {
    let count = system.contacts().len();
    let targets = target_velocities(system, stage);
    let velocity = stage.start.v.local();
    let start = stage.start.u.local();
    let displacement = |node: u32| Point::<D>::from_column_slice(&start[node as usize * D..][..D]);
    let mut sums = vec![0u64; 3 * count];
    let mut speeds = vec![0.0f64; count];
    for (k, (contact, of_target)) in system.contacts().iter().zip(&targets).enumerate() {
        let state = &contact.state;
        for (point, &node) in contact.vertices().iter().enumerate() {
            let [was, is] = [state.history[point].gap, state.current[point].gap];
            // The side of an edge that stands upright on a plane touches it, but carries nothing.
            let closed = was > 0.0 && is <= 0.0 && state.current[point].area > 0.0;
            sums[3 * k] += u64::from(closed);
            sums[3 * k + 1] += u64::from(was <= 0.0);
            sums[3 * k + 2] += 1;
            if !closed {
                continue;
            }
            if was.is_finite() {
                speeds[k] = speeds[k].max((was - is) / stage.dt);
            }
            let normal = state.current[point].normal;
            let own = Point::<D>::from_column_slice(&velocity[node as usize * D..][..D]);
            let place = contact.reference_point(point) + displacement(node);
            let of_target = of_target + contact.target().velocity_at_start(&place);
            speeds[k] = speeds[k].max((of_target - own).dot(&normal));
        }
    }
    let mut all = vec![0u64; sums.len()];
    let mut fastest = vec![0.0f64; count];
    let world = system.session().world();
    world.reduce_all(&sums[..], &mut all[..], SystemOperation::sum());
    world.reduce_all(&speeds[..], &mut fastest[..], SystemOperation::max());
    let closing = |(k, contact): (usize, &LocalContact<D>)| ClosingContact {
        contact: contact.name.clone(),
        now: all[3 * k],
        before: all[3 * k + 1],
        points: all[3 * k + 2],
        speed: fastest[k],
    };
    system.contacts().iter().enumerate().map(closing).collect()
}

/// Mean velocity of each deformable target at the start of the step \[m/s\]; zero for a rigid one.
/// Collective.
fn target_velocities<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Vec<Point<D>> {
    let velocity = stage.start.v.local();
    let mut own = vec![0.0_f64; system.contacts().len() * (D + 1)];
    let mut nodes = Vec::new();
    for (contact, sums) in system.contacts().iter().zip(own.chunks_exact_mut(D + 1)) {
        // A facet that several ranks have counts once.
        let mine = |facet: &&Facet| system.bodies().local().mine[facet.element as usize];
        for &facet in contact.pair.target_facets().iter().filter(mine) {
            system.bodies().local().mesh.facet_nodes(facet, &mut nodes);
            for &node in &nodes {
                sums[D] += 1.0;
                (0..D).for_each(|i| sums[i] += velocity[node as usize * D + i]);
            }
        }
    }
    let mut all = vec![0.0_f64; own.len()];
    system.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::sum());
    all.chunks_exact(D + 1).map(|sums| Point::from_fn(|i, _| sums[i] / sums[D].max(1.0))).collect()
}
