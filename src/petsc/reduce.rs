//! Reductions over all ranks in place, so that no value has a position that two places must
//! remember.

use crate::collective::Collective;
use mpi::collective::SystemOperation;
use mpi::traits::{CommunicatorCollectives, Equivalence};

/// Replaces each value by its sum over all ranks. All ranks pass the same number of values.
/// Collective.
pub fn sum_over_ranks<'a, T: Equivalence + Copy + 'a>(
    world: &impl CommunicatorCollectives,
    values: impl IntoIterator<Item = &'a mut T>,
) {
    reduce(world, values, SystemOperation::sum());
}

/// Replaces each value by its maximum over all ranks. All ranks pass the same number of values.
/// Collective.
pub fn max_over_ranks<'a, T: Equivalence + Copy + 'a>(
    world: &impl CommunicatorCollectives,
    values: impl IntoIterator<Item = &'a mut T>,
) {
    reduce(world, values, SystemOperation::max());
}

fn reduce<'a, T: Equivalence + Copy + 'a>(
    world: &impl CommunicatorCollectives,
    values: impl IntoIterator<Item = &'a mut T>,
    operation: SystemOperation,
) {
    let mut values: Vec<&mut T> = values.into_iter().collect();
    let own: Vec<T> = values.iter().map(|value| **value).collect();
    let mut all = own.clone();
    world.reduce_all(&own[..], &mut all[..], operation);
    values.iter_mut().zip(all).for_each(|(value, all)| **value = all);
}
