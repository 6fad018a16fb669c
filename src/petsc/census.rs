//! How many matrices and vectors this rank owns at present, and their memory: what a case does not need is not there.
//!
//! PETSc's own (factors, levels of multigrid, bases of Krylov methods) are not counted; `-log_view` tells of those.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// What is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A [`Matrix`](super::Matrix).
    Matrix,
    /// A [`Vector`](super::Vector) with entries on this rank.
    Vector,
}

/// Objects that are there, and their memory \[bytes\].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Census {
    /// Number.
    pub count: u64,
    /// Values, indices and maps \[bytes\].
    pub bytes: u64,
}

/// Number and bytes of matrices, then of vectors.
static COUNTS: [AtomicU64; 4] = [const { AtomicU64::new(0) }; 4];

/// Those of a kind on this rank.
pub fn census(kind: Kind) -> Census {
    let [count, bytes] = counters(kind);
    Census { count: count.load(Relaxed), bytes: bytes.load(Relaxed) }
}

fn counters(kind: Kind) -> [&'static AtomicU64; 2] {
    let first = 2 * kind as usize;
    [&COUNTS[first], &COUNTS[first + 1]]
}

/// A thing without memory is none.
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
