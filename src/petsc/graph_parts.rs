//! Partition of a distributed graph by a library behind PETSc, such as PT-Scotch.

use super::call::petsc;
use super::threads::address;
use crate::error::{Error, Result};
use mpi::traits::AsRaw;
use petsc_sys as sys;
use std::ffi::{CStr, c_void};
use std::ptr::{null, null_mut};
use std::slice;

/// What to do if PETSc lacks the library.
const CURE: &str = "use a PETSc that is linked with it, such as that of the Debian package petsc-dev, or \
                    `partition: metis`";

/// Consecutive rows of an undirected graph, those of one rank; the rows of the ranks follow each other.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct GraphRows {
    /// Number of rows on all ranks.
    pub total: i32,
    /// The entries of row `r` are `offsets[r]..offsets[r + 1]`. There is always a first offset.
    pub offsets: Vec<i32>,
    /// Neighbours, as numbers of rows of the whole graph; each edge from both ends.
    pub neighbours: Vec<i32>,
    /// Positive weight of each entry of `neighbours`, equal from both ends.
    pub edge_weights: Vec<i32>,
    /// Load of each row, not negative; the sum over all ranks fits into 32 bits.
    pub loads: Vec<i32>,
}

/// Partitions the graph whose rows the ranks of `world` hold by the library that PETSc calls `library`.
/// Returns the part of each row of this rank, below `parts`. The same rows give the same parts.
/// Collective.
///
/// # Errors
/// PETSc lacks the library, or the library fails.
pub fn partition_graph(
    world: &impl AsRaw<Raw = sys::MPI_Comm>,
    rows: &GraphRows,
    parts: i32,
    library: &CStr,
) -> Result<Vec<i32>> {
    restart_random_numbers();
    let adjacency = Adjacency::new(world, rows)?;
    let partitioning = Partitioning::new(world, library)?;
    petsc!(MatPartitioningSetAdjacency(partitioning.0, adjacency.0))?;
    petsc!(MatPartitioningSetNParts(partitioning.0, parts))?;
    petsc!(MatPartitioningSetUseEdgeWeights(partitioning.0, sys::PETSC_TRUE))?;
    // The partitioning owns and frees the loads.
    petsc!(MatPartitioningSetVertexWeights(partitioning.0, copied(&rows.loads)?))?;
    petsc!(MatPartitioningSetFromOptions(partitioning.0))?;
    let mut found = IndexSet(null_mut());
    petsc!(MatPartitioningApply(partitioning.0, &mut found.0))?;
    found.values()
}

/// Scotch draws from one sequence of pseudo-random numbers in a process. It begins anew, so that parts
/// do not depend on earlier calls.
fn restart_random_numbers() {
    if let Some(restart) = address(c"SCOTCH_randomReset") {
        // SAFETY: a function of that name takes and returns nothing, in every release of Scotch.
        unsafe { std::mem::transmute::<*mut c_void, unsafe extern "C" fn()>(restart)() };
    }
}

/// A copy of the values in memory of PETSc, for an object of PETSc that frees it.
fn copied(values: &[i32]) -> Result<*mut sys::PetscInt> {
    let mut memory = null_mut();
    petsc!(contact_allocate(size_of_val(values), &mut memory))?;
    let copy = memory.cast::<sys::PetscInt>();
    if !values.is_empty() {
        // SAFETY: PETSc has allocated as many integers, aligned for any type.
        unsafe { copy.copy_from_nonoverlapping(values.as_ptr(), values.len()) };
    }
    Ok(copy)
}

/// The graph as a matrix of PETSc.
struct Adjacency(sys::Mat);

impl Adjacency {
    fn new(world: &impl AsRaw<Raw = sys::MPI_Comm>, rows: &GraphRows) -> Result<Self> {
        let own = rows.offsets.len() as i32 - 1;
        let (offsets, neighbours) = (copied(&rows.offsets)?, copied(&rows.neighbours)?);
        let weights = copied(&rows.edge_weights)?;
        let mut raw = null_mut();
        petsc!(MatCreateMPIAdj(world.as_raw(), own, rows.total, offsets, neighbours, weights, &mut raw))?;
        Ok(Self(raw))
    }
}

impl Drop for Adjacency {
    fn drop(&mut self) {
        let _ = petsc!(MatDestroy(&mut self.0));
    }
}

struct Partitioning(sys::MatPartitioning);

impl Partitioning {
    fn new(world: &impl AsRaw<Raw = sys::MPI_Comm>, library: &CStr) -> Result<Self> {
        let mut new = Self(null_mut());
        petsc!(MatPartitioningCreate(world.as_raw(), &mut new.0))?;
        petsc!(MatPartitioningSetType(new.0, library.as_ptr())).map_err(|_| {
            let library = library.to_string_lossy();
            Error::case(format!("partition: the installed PETSc has no partitioner '{library}'")).hint(CURE)
        })?;
        Ok(new)
    }
}

impl Drop for Partitioning {
    fn drop(&mut self) {
        let _ = petsc!(MatPartitioningDestroy(&mut self.0));
    }
}

struct IndexSet(sys::IS);

impl IndexSet {
    fn values(&self) -> Result<Vec<i32>> {
        let (mut count, mut indices) = (0, null());
        petsc!(ISGetLocalSize(self.0, &mut count))?;
        petsc!(ISGetIndices(self.0, &mut indices))?;
        let values = match count {
            0 => Vec::new(),
            // SAFETY: PETSc lends `count` integers until they are restored.
            _ => unsafe { slice::from_raw_parts(indices, count as usize) }.to_vec(),
        };
        petsc!(ISRestoreIndices(self.0, &mut indices))?;
        Ok(values)
    }
}

impl Drop for IndexSet {
    fn drop(&mut self) {
        let _ = petsc!(ISDestroy(&mut self.0));
    }
}
