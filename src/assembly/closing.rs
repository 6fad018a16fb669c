//! Which contacts closed in a step, and how fast.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::system::ContactSystem;

/// How a contact closed in a step, all ranks together.
#[derive(Debug, Clone, PartialEq)]
pub struct Closing {
    /// Name of the contact.
    pub contact: String,
    /// Points that closed in the step.
    pub now: u64,
    /// Points that were closed at its start.
    pub before: u64,
    /// All points.
    pub points: u64,
    /// Largest speed at which a gap closed \[m/s\].
    pub speed: f64,
}

impl<const D: usize> ContactSystem<D> {
    /// How each contact closed in the step of length `dt` \[s\] that ends in the trial state; to be called before it is
    /// accepted. Collective.
    pub fn closings(&self, dt: f64) -> Vec<Closing> {
        let count = self.contacts.len();
        let (mut sums, mut speeds) = (vec![0u64; 3 * count], vec![0.0f64; count]);
        for (k, contact) in self.contacts.iter().enumerate() {
            let state = &contact.state;
            for point in contact.reported_points() {
                let [was, is] = [state.history[point].gap, state.current[point].gap];
                sums[3 * k] += u64::from(was > 0.0 && is <= 0.0);
                sums[3 * k + 1] += u64::from(was <= 0.0);
                sums[3 * k + 2] += 1;
                if was > 0.0 && is <= 0.0 && was.is_finite() {
                    speeds[k] = speeds[k].max((was - is) / dt);
                }
            }
        }
        let (mut all, mut fastest) = (vec![0u64; sums.len()], vec![0.0f64; count]);
        let world = self.session.world();
        world.all_reduce_into(&sums[..], &mut all[..], SystemOperation::sum());
        world.all_reduce_into(&speeds[..], &mut fastest[..], SystemOperation::max());
        let closing = |(k, contact): (usize, &super::contact::Contact<D>)| Closing {
            contact: contact.name.clone(),
            now: all[3 * k],
            before: all[3 * k + 1],
            points: all[3 * k + 2],
            speed: fastest[k],
        };
        self.contacts.iter().enumerate().map(closing).collect()
    }
}
