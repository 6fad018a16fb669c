//! Sends that nobody waits for before their buffer is needed again.
//!
//! A message is there long before its sender hears that its buffer is free: Open MPI hears so when the receiver comes back
//! from its computing. Who waited for that would wait for the slowest neighbour after every exchange.

use std::ops::Range;

use mpi::datatype::Equivalence;
use mpi::ffi;
use mpi::raw::AsRaw;
use mpi::traits::Communicator;

/// Numbers on their way to other ranks. A copy has none on their way.
#[derive(Default)]
pub struct Sends {
    items: Vec<f64>,
    flying: Vec<ffi::MPI_Request>,
}

impl Sends {
    /// The buffer, empty, to be filled before the next [`post`](Self::post). Waits for the sends before, which the other ranks
    /// have received by the time that they send themselves.
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
            // SAFETY: the buffer is private to this type, which waits before it changes or frees it.
            unsafe {
                let from = part.as_ptr().cast();
                let count = part.len() as i32;
                ffi::MPI_Isend(from, count, kind.as_raw(), rank, 0, world.as_raw(), request);
            }
        }
    }

    fn wait(&mut self) {
        for mut request in self.flying.drain(..) {
            // SAFETY: the request is one of `post`, and waited for once.
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
