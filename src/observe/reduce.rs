//! Reductions over all ranks in place, so that no value has a position that two places must
//! remember.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

/// Replaces each value by its sum over all ranks. All ranks pass the same number of values.
/// Collective.
pub fn sum_over_ranks<'a>(
    world: &impl CommunicatorCollectives,
    values: impl IntoIterator<Item = &'a mut f64>,
) {
    reduce(world, values, SystemOperation::sum());
}

/// Replaces each value by its maximum over all ranks. All ranks pass the same number of values.
/// Collective.
pub fn max_over_ranks<'a>(
    world: &impl CommunicatorCollectives,
    values: impl IntoIterator<Item = &'a mut f64>,
) {
    reduce(world, values, SystemOperation::max());
}

fn reduce<'a>(
    world: &impl CommunicatorCollectives,
    values: impl IntoIterator<Item = &'a mut f64>,
    operation: SystemOperation,
) {
    let mut values: Vec<&mut f64> = values.into_iter().collect();
    let own: Vec<f64> = values.iter().map(|value| **value).collect();
    let mut all = vec![0.0; own.len()];
    world.all_reduce_into(&own[..], &mut all[..], operation);
    values.iter_mut().zip(all).for_each(|(value, all)| **value = all);
}
