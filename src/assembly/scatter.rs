//! Positions of the entries of element and facet matrices. They are computed once, so that
//! insertion is an indexed add.

use crate::element::ElementSink;
use crate::partition::IndexMap;
use crate::petsc::{BlockPattern, BlockValues, NO_SLOT};
use crate::space::Held;

/// Scatter map of pieces (elements or facets) with the same number of nodes.
pub struct ScatterMap {
    /// Number of nodes per piece.
    pub width: usize,
    /// Local nodes, piece by piece.
    nodes: Vec<u32>,
    /// Slots of all node pairs, piece by piece, row-major; [`NO_SLOT`] in rows of other ranks.
    slots: Vec<u32>,
    /// Whether a piece has a held node.
    supported: Vec<bool>,
}

impl ScatterMap {
    /// Creates the map of pieces that are given by their local nodes, `width` each.
    pub fn new<const D: usize>(
        width: usize,
        nodes: Vec<u32>,
        pattern: &BlockPattern,
        index: &IndexMap,
        held: &Held<D>,
    ) -> Self {
        let touches = |piece: &[u32]| piece.iter().any(|&node| held.holds(node as usize));
        let supported = nodes.chunks(width.max(1)).map(touches).collect();
        let mut map = Self { width, nodes, slots: Vec::new(), supported };
        map.relocate(pattern, index);
        map
    }

    /// Recomputes all slots for another pattern.
    pub fn relocate(&mut self, pattern: &BlockPattern, index: &IndexMap) {
        let width = self.width.max(1);
        let globals: Vec<i32> = self.nodes.iter().map(|&node| index.global(node)).collect();
        self.slots.clear();
        self.slots.reserve(self.nodes.len() * width);
        for (piece, columns) in self.nodes.chunks(width).zip(globals.chunks(width)) {
            for &row in piece {
                let owned = index.owns(row);
                let slot = |&column: &i32| if owned { pattern.slot(row as usize, column) } else { None };
                self.slots.extend(columns.iter().map(|column| slot(column).unwrap_or(NO_SLOT)));
            }
        }
    }

    /// Local nodes of a piece.
    pub fn nodes(&self, piece: usize) -> &[u32] {
        &self.nodes[piece * self.width..(piece + 1) * self.width]
    }

    /// Slots of the node pairs of a piece, row-major.
    pub fn slots(&self, piece: usize) -> &[u32] {
        let pairs = self.width * self.width;
        &self.slots[piece * pairs..(piece + 1) * pairs]
    }
}

/// Right side from which the columns of prescribed unknowns are subtracted: `rhs -= K_fd change`.
pub struct LiftTarget<'a> {
    /// Change of the prescribed unknowns, owned and ghost \[m\].
    pub change: &'a [f64],
    /// Owned rows \[N\].
    pub rhs: &'a mut [f64],
}

impl LiftTarget<'_> {
    /// Borrows this target for a shorter lifetime.
    pub fn reborrow(&mut self) -> LiftTarget<'_> {
        LiftTarget { change: self.change, rhs: &mut *self.rhs }
    }
}

/// Receives forces only: owned rows, local node order \[N\].
pub struct ForceSink<'a, const D: usize> {
    /// Map of the current group.
    pub map: &'a ScatterMap,
    /// Owned rows.
    pub force: &'a mut [f64],
}

impl<const D: usize> ElementSink for ForceSink<'_, D> {
    #[inline]
    fn element(&mut self, index: usize, force: &[f64], _: Option<&[f64]>) {
        for (node, part) in self.map.nodes(index).iter().zip(force.chunks_exact(D)) {
            let row = *node as usize * D;
            if let Some(entries) = self.force.get_mut(row..row + D) {
                entries.iter_mut().zip(part).for_each(|(entry, value)| *entry += value);
            }
        }
    }
}

/// Receives stiffness only. Rows and columns of prescribed unknowns are omitted and, if requested,
/// moved to the right side.
pub struct MatrixSink<'a, 'm, const D: usize> {
    /// Map of the current group.
    pub map: &'a ScatterMap,
    /// Held directions of the local nodes.
    pub held: &'a Held<D>,
    /// Matrix values.
    pub values: &'a mut BlockValues<'m>,
    /// Right side for prescribed changes.
    pub lift: Option<LiftTarget<'a>>,
    /// Copy of a piece with prescribed unknowns.
    pub scratch: Vec<f64>,
}

impl<const D: usize> ElementSink for MatrixSink<'_, '_, D> {
    #[inline]
    fn element(&mut self, index: usize, _: &[f64], stiffness: Option<&[f64]>) {
        let Some(stiffness) = stiffness else { return };
        if self.map.supported[index] {
            self.lift_columns(index, stiffness);
            self.scratch.clear();
            self.scratch.extend_from_slice(stiffness);
            self.clear_prescribed(index);
            self.values.add_blocks(self.map.slots(index), &self.scratch);
        } else {
            self.values.add_blocks(self.map.slots(index), stiffness);
        }
    }
}

impl<'a, 'm, const D: usize> MatrixSink<'a, 'm, D> {
    /// A sink for pieces of this map.
    pub fn new(
        map: &'a ScatterMap,
        held: &'a Held<D>,
        values: &'a mut BlockValues<'m>,
        lift: Option<LiftTarget<'a>>,
    ) -> Self {
        Self { map, held, values, lift, scratch: Vec::new() }
    }

    /// Restricts the copy to the free directions of its nodes.
    fn clear_prescribed(&mut self, index: usize) {
        let nodes = self.map.nodes(index);
        let width = self.map.width;
        for (pair, block) in self.scratch.chunks_exact_mut(D * D).enumerate() {
            self.held.restrict(nodes[pair / width] as usize, nodes[pair % width] as usize, block);
        }
    }

    /// Moves the columns of prescribed unknowns to the right side.
    fn lift_columns(&mut self, index: usize, stiffness: &[f64]) {
        let nodes = self.map.nodes(index);
        let width = self.map.width;
        let Some(lift) = self.lift.as_mut() else { return };
        for (pair, block) in stiffness.chunks_exact(D * D).enumerate() {
            let row = nodes[pair / width] as usize * D;
            if row >= lift.rhs.len() {
                continue;
            }
            let change = &lift.change[nodes[pair % width] as usize * D..][..D];
            let mut part: [f64; D] =
                std::array::from_fn(|i| (0..D).map(|j| block[i * D + j] * change[j]).sum());
            self.held.clear_node(row / D, &mut part);
            lift.rhs[row..row + D].iter_mut().zip(part).for_each(|(rhs, part)| *rhs -= part);
        }
    }
}
