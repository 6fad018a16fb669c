//! Collects seconds and memory of all ranks for the run record.

use std::rc::Rc;

use mpi::collective::SystemOperation;

use crate::collective::Collective;
use crate::output::record::PhaseTime;
use crate::petsc::{Event, Session, peak_memory as own_peak_memory};

/// Phases in the order of the record: name in the record and name of the PETSc event.
const PHASES: [(&str, &str); 8] = [
    ("search", "ContactSearch"),
    ("exchange", "ContactExchange"),
    ("contact", "Contact"),
    ("element_forces", "ElementForces"),
    ("element_tangents_and_insertion", "Tangent"),
    ("solver_set_up", "SolverSetUp"),
    ("solve", "Solve"),
    ("output", "Output"),
];

/// The largest wall time of each phase over the ranks, and the number of calls. Collective.
pub fn phases(session: &Rc<Session>) -> Vec<(String, PhaseTime)> {
    let events = PHASES.map(|(_, event)| Event::totals(session, event));
    let own = events.map(|(seconds, _)| seconds);
    let mut most = [0.0; PHASES.len()];
    session.world().reduce_all(&own[..], &mut most[..], SystemOperation::max());
    let phase = |k: usize| (PHASES[k].0.to_owned(), PhaseTime { seconds: most[k], count: events[k].1 });
    (0..PHASES.len()).map(phase).collect()
}

/// Phases in which ranks do not wait for each other.
const WORK: [&str; 4] = ["ContactSearch", "Contact", "ElementForces", "Tangent"];

/// Processor time of each rank, and its wall time in [`WORK`] \[s\]. Collective.
pub fn seconds(session: &Rc<Session>) -> [Vec<f64>; 2] {
    let work = WORK.iter().map(|event| Event::totals(session, event).0).sum();
    [session.user_seconds(), work].map(|own: f64| {
        let mut all = vec![0.0; session.size() as usize];
        session.world().gather_all(&[own], &mut all[..]);
        all
    })
}

/// Largest resident memory of each rank \[bytes\]. Collective.
pub fn peak_memory(session: &Rc<Session>) -> Vec<u64> {
    of_each_rank(session, own_peak_memory())
}

/// Gathers a count from each rank. Collective.
pub fn of_each_rank(session: &Rc<Session>, own: u64) -> Vec<u64> {
    let mut all = vec![0; session.size() as usize];
    session.world().gather_all(&[own], &mut all[..]);
    all
}
