//! Takes what contact pairs contribute: own rows at once, rows of other ranks into buffers that are sent later.

use super::couplings::{Couples, Place};
use crate::contact::deformable::PairSink;
use crate::petsc::BlockValues;

/// Where forces of rows that this rank does not own are collected.
pub struct RemoteForce<'a> {
    /// Number of the remote row of each node beyond the owned ones.
    pub row_of: &'a [u32],
    /// `row * D + component` [N].
    pub values: &'a mut [f64],
}

/// Takes forces only.
pub struct PairForces<'a, const D: usize> {
    /// Owned rows [N].
    pub own: &'a mut [f64],
    /// The others.
    pub remote: RemoteForce<'a>,
}

impl<const D: usize> PairSink for PairForces<'_, D> {
    fn pair(&mut self, _: usize, _: u32, nodes: &[u32], force: &[f64], _: Option<&[f64]>) {
        let owned = self.own.len() / D;
        for (&node, part) in nodes.iter().zip(force.chunks_exact(D)) {
            let node = node as usize;
            let entries = match node.checked_sub(owned) {
                None => &mut self.own[node * D..][..D],
                Some(beyond) => &mut self.remote.values[self.remote.row_of[beyond] as usize * D..][..D],
            };
            entries.iter_mut().zip(part).for_each(|(entry, value)| *entry += value);
        }
    }
}

/// The prescribed unknowns, and where their columns go.
pub struct PairLift<'a> {
    /// Change of the prescribed unknowns at all nodes [m].
    pub change: &'a [f64],
    /// Right side, owned rows [N].
    pub rhs: &'a mut [f64],
    /// Right side, other rows.
    pub remote: RemoteForce<'a>,
}

/// Takes stiffness only; rows and columns of prescribed unknowns are left out and, where asked for, lifted.
pub struct PairStiffness<'a, 'm, const D: usize> {
    /// Couples of the contact being swept.
    pub couples: &'a Couples,
    /// Prescribed unknowns of all nodes.
    pub constrained: &'a [bool],
    /// Matrix values of the own rows.
    pub values: &'a mut BlockValues<'m>,
    /// Blocks of the others, D * D each.
    pub remote: &'a mut [f64],
    /// Right side for prescribed changes.
    pub lift: Option<PairLift<'a>>,
}

impl<const D: usize> PairSink for PairStiffness<'_, '_, D> {
    fn pair(&mut self, facet: usize, target: u32, nodes: &[u32], _: &[f64], stiffness: Option<&[f64]>) {
        let (Some(stiffness), Some(couple)) = (stiffness, self.couples.find(facet, target)) else { return };
        let mut block = [0.0; 9];
        let block = &mut block[..D * D];
        for (a, &row) in nodes.iter().enumerate() {
            for (b, &column) in nodes.iter().enumerate() {
                let pair = a * nodes.len() + b;
                block.copy_from_slice(&stiffness[pair * D * D..][..D * D]);
                self.release(row, column, block);
                match self.couples.place(couple, pair) {
                    Some(Place::Slot(slot)) => self.values.add(slot, block),
                    Some(Place::Remote(at)) => {
                        let entries = &mut self.remote[at as usize * D * D..][..D * D];
                        entries.iter_mut().zip(&*block).for_each(|(entry, value)| *entry += value);
                    }
                    None => {}
                }
            }
        }
    }
}

impl<const D: usize> PairStiffness<'_, '_, D> {
    /// Takes prescribed rows and columns out of a block; the columns go to the right side.
    fn release(&mut self, row: u32, column: u32, block: &mut [f64]) {
        let (row, column) = (row as usize * D, column as usize * D);
        for i in 0..D {
            for j in 0..D {
                let (held_row, held_column) = (self.constrained[row + i], self.constrained[column + j]);
                if !held_row && held_column {
                    self.lift(row + i, column + j, block[i * D + j]);
                }
                if held_row || held_column {
                    block[i * D + j] = 0.0;
                }
            }
        }
    }

    fn lift(&mut self, row: usize, column: usize, stiffness: f64) {
        let Some(lift) = &mut self.lift else { return };
        let part = stiffness * lift.change[column];
        match row.checked_sub(lift.rhs.len()) {
            None => lift.rhs[row] -= part,
            Some(beyond) => {
                let at = lift.remote.row_of[beyond / D] as usize * D + beyond % D;
                lift.remote.values[at] -= part;
            }
        }
    }
}
