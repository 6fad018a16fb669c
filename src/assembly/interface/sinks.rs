//! Receivers of the contributions of contact pairs. Own rows are added at once; rows of other ranks
//! go to buffers that are sent later.

use super::couplings::{CouplingSlots, Couplings};
use crate::contact::mortar::contact::ContactSink;
use crate::petsc::{BlockValues, Symmetry};
use crate::space::Held;

/// Marks a node beyond the owned ones that has no coupling.
pub const NO_ROW: u32 = u32::MAX;

/// Buffer for forces on rows that this rank does not own.
pub struct RemoteForce<'a> {
    /// Number of the remote row of each node beyond the owned ones.
    pub row_of: &'a [u32],
    /// `row * D + component` \[N\].
    pub values: &'a mut [f64],
}

impl RemoteForce<'_> {
    /// Borrows this buffer for a shorter lifetime.
    pub fn reborrow(&mut self) -> RemoteForce<'_> {
        RemoteForce { row_of: self.row_of, values: &mut *self.values }
    }

    /// The entries of a node beyond the owned ones.
    fn entries<const D: usize>(&mut self, beyond: usize) -> Option<&mut [f64]> {
        let row = self.row_of[beyond] as usize;
        self.values.get_mut(row.saturating_mul(D)..row.saturating_add(1).saturating_mul(D))
    }
}

/// Adds forces on nodes to the rows that this rank owns and to those that it sends.
pub fn add_forces<const D: usize>(
    nodes: &[u32],
    force: &[f64],
    own: &mut [f64],
    remote: &mut RemoteForce<'_>,
) {
    let owned = own.len() / D;
    for (&node, part) in nodes.iter().zip(force.chunks_exact(D)) {
        let node = node as usize;
        let entries = match node.checked_sub(owned) {
            None => Some(&mut own[node * D..][..D]),
            Some(beyond) => remote.entries::<D>(beyond),
        };
        let Some(entries) = entries else { continue };
        entries.iter_mut().zip(part).for_each(|(entry, value)| *entry += value);
    }
}

/// Receives the forces of a contact.
pub struct VertexForces<'a, const D: usize> {
    /// Owned rows \[N\].
    pub own: &'a mut [f64],
    /// Rows of other ranks.
    pub remote: RemoteForce<'a>,
}

impl<const D: usize> ContactSink for VertexForces<'_, D> {
    fn force(&mut self, nodes: &[u32], force: &[f64]) {
        add_forces::<D>(nodes, force, self.own, &mut self.remote);
    }

    fn stiffness(&mut self, _: usize, _: &[u32], _: &[f64]) {}
}

/// The prescribed unknowns, and the destination of their columns.
pub struct PairLift<'a> {
    /// Change of the prescribed unknowns at all nodes \[m\].
    pub change: &'a [f64],
    /// Right side, owned rows \[N\].
    pub rhs: &'a mut [f64],
    /// Right side, rows of other ranks.
    pub remote: RemoteForce<'a>,
}

impl PairLift<'_> {
    /// Borrows this target for a shorter lifetime.
    pub fn reborrow(&mut self) -> PairLift<'_> {
        let remote = self.remote.reborrow();
        PairLift { change: self.change, rhs: &mut *self.rhs, remote }
    }
}

/// Receives stiffness only. Rows and columns of prescribed unknowns are omitted and, if requested,
/// moved to the right side.
pub struct VertexStiffness<'a, 'm, const D: usize> {
    /// Nodes that the vertices of the contact couple.
    pub couplings: &'a Couplings,
    /// Held directions of all nodes.
    pub held: &'a Held<D>,
    /// Matrix values of the rank's own rows.
    pub values: &'a mut BlockValues<'m>,
    /// Blocks of rows of other ranks, D * D values each.
    pub remote: &'a mut [f64],
    /// Right side for prescribed changes.
    pub lift: Option<PairLift<'a>>,
    /// Symmetry that the matrix guarantees. If it is symmetric, each block is replaced by its
    /// symmetric part.
    pub symmetry: Symmetry,
}

impl<const D: usize> ContactSink for VertexStiffness<'_, '_, D> {
    fn force(&mut self, _: &[u32], _: &[f64]) {}

    /// The nodes that a vertex couples are in ascending order.
    fn stiffness(&mut self, vertex: usize, nodes: &[u32], stiffness: &[f64]) {
        let known = self.couplings.nodes_of(vertex);
        let width = known.len();
        let places: Vec<usize> =
            nodes.iter().map(|node| known.binary_search(node).unwrap_or(width)).collect();
        if places.contains(&width) {
            return;
        }
        self.add(vertex, nodes, stiffness, |a, b| places[a] * width + places[b]);
    }

    fn lift(&mut self, nodes: &[u32], force: &[f64]) {
        let Some(lift) = &mut self.lift else { return };
        let mut free = [0.0; 3];
        for (&node, force) in nodes.iter().zip(force.chunks_exact(D)) {
            free[..D].copy_from_slice(force);
            self.held.clear_node(node as usize, &mut free[..D]);
            add_forces::<D>(&[node], &free[..D], lift.rhs, &mut lift.remote);
        }
    }
}

impl<const D: usize> VertexStiffness<'_, '_, D> {
    /// Adds the blocks of `nodes`; `place(a, b)` is the number of their block among those of the
    /// vertex.
    fn add(
        &mut self,
        vertex: usize,
        nodes: &[u32],
        stiffness: &[f64],
        place: impl Fn(usize, usize) -> usize,
    ) {
        let mut block = [0.0; 9];
        let block = &mut block[..D * D];
        let held: Vec<bool> = nodes.iter().map(|&node| self.held.holds(node as usize)).collect();
        for (a, &row) in nodes.iter().enumerate() {
            for (b, &column) in nodes.iter().enumerate() {
                let at = a * nodes.len() + b;
                block.copy_from_slice(&stiffness[at * D * D..][..D * D]);
                if self.symmetry != Symmetry::None {
                    let mirrored = &stiffness[(b * nodes.len() + a) * D * D..][..D * D];
                    for (ij, entry) in block.iter_mut().enumerate() {
                        *entry = 0.5 * (*entry + mirrored[ij % D * D + ij / D]);
                    }
                }
                if held[a] || held[b] {
                    self.release(row as usize, column as usize, block);
                }
                match self.couplings.place(vertex, place(a, b)) {
                    Some(CouplingSlots::Slot(slot)) => self.values.add(slot, block),
                    Some(CouplingSlots::Remote(at)) => {
                        let entries = &mut self.remote[at as usize * D * D..][..D * D];
                        entries.iter_mut().zip(&*block).for_each(|(entry, value)| *entry += value);
                    }
                    None => {}
                }
            }
        }
    }

    /// Restricts a block to the free directions of its nodes. What the change of the held ones adds
    /// goes to the right side.
    fn release(&mut self, row: usize, column: usize, block: &mut [f64]) {
        if let (true, Some(lift)) = (self.held.holds(column), &mut self.lift) {
            let change = &lift.change[column * D..][..D];
            let mut part: [f64; D] =
                std::array::from_fn(|i| -(0..D).map(|j| block[i * D + j] * change[j]).sum::<f64>());
            self.held.clear_node(row, &mut part);
            add_forces::<D>(&[row as u32], &part, lift.rhs, &mut lift.remote);
        }
        self.held.restrict(row, column, block);
    }
}
