//! Nonblocking sends whose completion is awaited only when their buffer is needed again.
//!
//! A message arrives long before its sender is notified that the buffer is free: Open MPI notifies
//! it when the receiver returns from its computation. Waiting earlier would mean waiting for the
//! slowest neighbour after every exchange.

use std::ops::Range;

use mpi::datatype::Equivalence;
use mpi::ffi;
use mpi::raw::AsRaw;
use mpi::traits::Communicator;

/// Values in transit to other ranks. A copy of this struct has no values in transit.
#[derive(Default)]
pub struct Sends {
    items: Vec<f64>,
    flying: Vec<ffi::MPI_Request>,
}

impl Sends {
    /// The empty buffer, to be filled before the next [`post`](Self::post). Waits for the previous
    /// sends. The other ranks have received them by the time they send their own messages.
    pub fn room(&mut self) -> &mut Vec<f64> {
        self.wait();
        self.items.clear();
        &mut self.items
    }

    /// Sends parts of the buffer, each to its rank.
    pub fn post(&mut self, world: &impl Communicator, parts: impl Iterator<Item = (i32, Range<usize>)>) {
        self.wait();
        let kind = f64::equivalent_datatype();
        for (rank, range) in parts {
            let part = &self.items[range];
            self.flying.push(null());
            let Some(request) = self.flying.last_mut() else { return };
            // SAFETY: the buffer is private to this type, which waits before it changes or frees
            // it.
            unsafe {
                let from = part.as_ptr().cast();
                let count = part.len() as i32;
                ffi::MPI_Isend(from, count, kind.as_raw(), rank, 0, world.as_raw(), request);
            }
        }
    }

    fn wait(&mut self) {
        for mut request in self.flying.drain(..) {
            // SAFETY: the request comes from `post` and is waited for once.
            unsafe { ffi::MPI_Wait(&mut request, ffi::RSMPI_STATUS_IGNORE) };
        }
    }
}

fn null() -> ffi::MPI_Request {
    // SAFETY: a constant of MPI.
    unsafe { ffi::RSMPI_REQUEST_NULL }
}

impl Drop for Sends {
    fn drop(&mut self) {
        self.wait();
    }
}

impl Clone for Sends {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl std::fmt::Debug for Sends {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sends").field("flying", &self.flying.len()).finish_non_exhaustive()
    }
}
