//! Current number of matrices and vectors on this rank, and their memory. They show
//! whether a case allocates objects that it does not need.
//!
//! PETSc's internal objects (factors, multigrid levels, bases of Krylov methods) are not counted;
//! `-log_view` reports them.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Kind of object that is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A [`Matrix`](super::Matrix).
    Matrix,
    /// A [`Vector`](super::Vector) with entries on this rank.
    Vector,
}

/// Existing objects and their memory \[bytes\].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Census {
    /// Number.
    pub count: u64,
    /// Values, indices and maps \[bytes\].
    pub bytes: u64,
}

/// Number and bytes of matrices, then of vectors.
static COUNTS: [AtomicU64; 4] = [const { AtomicU64::new(0) }; 4];

/// Objects of a kind on this rank.
pub fn census(kind: Kind) -> Census {
    let [count, bytes] = counters(kind);
    Census { count: count.load(Relaxed), bytes: bytes.load(Relaxed) }
}

fn counters(kind: Kind) -> [&'static AtomicU64; 2] {
    let first = 2 * kind as usize;
    [&COUNTS[first], &COUNTS[first + 1]]
}

/// Counts a new object. An object without memory is not counted.
pub(super) fn made(kind: Kind, bytes: usize) {
    let [count, sum] = counters(kind);
    count.fetch_add(u64::from(bytes > 0), Relaxed);
    sum.fetch_add(bytes as u64, Relaxed);
}

pub(super) fn gone(kind: Kind, bytes: usize) {
    let [count, sum] = counters(kind);
    count.fetch_sub(u64::from(bytes > 0), Relaxed);
    sum.fetch_sub(bytes as u64, Relaxed);
}
