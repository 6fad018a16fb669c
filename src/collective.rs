//! Collective operations whose buffers have one type and the right length.
//!
//! The functions of `mpi` take two buffers of any types. An integer without a type beside a `u64` is an
//! `i32` to the compiler, and MPI writes eight bytes into its four. Here the compiler checks the types, and
//! each call the lengths.

use mpi::collective::Operation;
use mpi::datatype::{Buffer, BufferMut, Equivalence};
use mpi::traits::CommunicatorCollectives;

/// Collective operations of a communicator. All ranks call them in the same order.
pub trait Collective: CommunicatorCollectives {
    /// Combines the values of all ranks, entry by entry, for all ranks.
    ///
    /// # Panics
    /// The lengths differ.
    fn reduce_all<T>(&self, own: &T, all: &mut T, operation: impl Operation)
    where
        T: Buffer + BufferMut + ?Sized,
    {
        assert_eq!(own.count(), all.count(), "lengths of a reduction");
        self.all_reduce_into(own, all, operation);
    }

    /// Combines the values of the ranks up to this one, entry by entry.
    ///
    /// # Panics
    /// The lengths differ.
    fn reduce_up_to<T>(&self, own: &T, up_to: &mut T, operation: impl Operation)
    where
        T: Buffer + BufferMut + ?Sized,
    {
        assert_eq!(own.count(), up_to.count(), "lengths of a scan");
        self.scan_into(own, up_to, operation);
    }

    /// Gathers the values of all ranks, in the order of the ranks, on all ranks. Each rank gives the
    /// same number of values.
    ///
    /// # Panics
    /// `all` is not as long as the values of all ranks.
    fn gather_all<T: Equivalence>(&self, own: &[T], all: &mut [T]) {
        assert_eq!(own.len() * self.size() as usize, all.len(), "lengths of a gathering");
        self.all_gather_into(own, all);
    }

    /// Gives `own[rank]` to each rank, and receives `arriving[rank]` from each.
    ///
    /// # Panics
    /// A list does not have one entry for each rank.
    fn exchange_all<T: Equivalence>(&self, own: &[T], arriving: &mut [T]) {
        assert_eq!([own.len(), arriving.len()], [self.size() as usize; 2], "lengths of an exchange");
        self.all_to_all_into(own, arriving);
    }
}

impl<C: CommunicatorCollectives + ?Sized> Collective for C {}
