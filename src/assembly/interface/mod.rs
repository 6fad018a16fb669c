//! Data that the contacts of a rank share: fields of foreign nodes, and the transfer of forces and
//! blocks to the ranks that own their rows.
//!
//! A vertex is evaluated by the rank that owns its node. Its contributions to rows of other ranks
//! are collected and sent, with one message per neighbour. Their order is agreed when the couplings
//! are found.

mod couplings;
mod numbering;
mod sinks;

use mpi::traits::CommunicatorCollectives;

use super::scatter::LiftTarget;
use crate::contact::evaluation::ContactFields;
use crate::error::Result;
use crate::partition::IndexMap;
use crate::partition::exchange::{ExchangedField, ForeignRows, NodeExchange, RowExchange};
use crate::petsc::{BlockPattern, BlockValues, Event, NO_SLOT, Symmetry};
use crate::space::Held;

pub use couplings::{Couplings, blocks_of};
pub use numbering::Numbering;
pub use sinks::{NO_ROW, PairLift, RemoteForce, VertexForces, VertexStiffness, add_forces};

/// Fields beyond the rank's own mesh, rows of other ranks, and the communication pattern.
pub struct Interface<const D: usize> {
    foreign: Vec<i32>,
    bring: NodeExchange,
    /// Values at local nodes, then at foreign ones.
    u: Vec<f64>,
    v: Vec<f64>,
    u_start: Vec<f64>,
    change: Vec<f64>,
    held: Held<D>,
    rows: Option<Rows>,
    /// Event that measures the time of the messages.
    exchange: Event,
}

/// Rows of other ranks that this rank adds to.
struct Rows {
    give: NodeExchange,
    blocks: RowExchange,
    remote: ForeignRows,
    row_of: Vec<u32>,
    /// Blocks of the rank's own rows that couplings need, including those to which others add.
    own: Vec<(u32, i32)>,
    /// Slots of the blocks that may arrive, and of those that did.
    received: Vec<u32>,
    slots: Vec<u32>,
    force: Vec<f64>,
    values: Vec<f64>,
}

impl<const D: usize> Interface<D> {
    /// Creates an interface with the foreign nodes, in ascending order, and without couplings.
    /// Collective.
    ///
    /// # Errors
    /// The same on all ranks, if a node does not exist.
    pub fn new(
        world: &impl CommunicatorCollectives,
        index: &IndexMap,
        held: &Held<D>,
        foreign: Vec<i32>,
        exchange: Event,
    ) -> Result<Self> {
        let mut bring = NodeExchange::new(world, index, &foreign)?;
        let local = index.local_count() * D;
        let count = local + foreign.len() * D;
        let mut projections = vec![0.0; foreign.len() * D * D];
        let projection = |node: u32, values: &mut [f64]| {
            values.copy_from_slice(held.projection(node as usize).as_flattened());
        };
        bring.forward_from(world, D * D, projection, &mut projections);
        let held = held.clone().followed_by(&projections);
        let zero = || vec![0.0; count];
        Ok(Self {
            foreign,
            bring,
            u: zero(),
            v: zero(),
            u_start: zero(),
            change: Vec::new(),
            held,
            rows: None,
            exchange,
        })
    }

    /// Numbers of the nodes in the fields.
    pub fn numbering<'a>(&'a self, index: &'a IndexMap) -> Numbering<'a> {
        Numbering { index, foreign: &self.foreign }
    }

    /// Updates the fields of the rank's nodes, including ghosts, and of the foreign nodes, with one
    /// message per neighbour. Collective.
    pub fn bring(&mut self, world: &impl CommunicatorCollectives, fields: &ContactFields) {
        let state = [(&mut self.u, fields.u), (&mut self.v, fields.v), (&mut self.u_start, fields.u_start)];
        let _running = self.exchange.begin();
        let mut travelling = state.map(|(all, owned)| travel::<D>(all, owned));
        self.bring.forward_many(world, &mut travelling);
    }

    /// Whether these fields equal the last updated ones, as far as this rank can determine.
    fn has_brought(&self, fields: &ContactFields) -> bool {
        let state = [(&self.u, fields.u), (&self.v, fields.v), (&self.u_start, fields.u_start)];
        state.into_iter().all(|(all, owned)| all.get(..owned.len()) == Some(owned))
    }

    /// The last updated fields.
    pub fn fields(&self) -> ContactFields<'_> {
        ContactFields { u: &self.u, v: &self.v, u_start: &self.u_start }
    }

    /// Agrees with the other ranks on the rows that couplings contribute to. Collective.
    ///
    /// # Errors
    /// All ranks return the same error.
    pub fn agree_on<'a>(
        &mut self,
        world: &impl CommunicatorCollectives,
        index: &IndexMap,
        couplings: impl Iterator<Item = &'a Couplings>,
    ) -> Result<()> {
        let (mut own, remote) = blocks_of(couplings, &self.numbering(index));
        let globals: Vec<i32> = remote.iter().map(|(row, _)| row).collect();
        let give = NodeExchange::new(world, index, &globals)?;
        let blocks = RowExchange::new(world, index, &remote)?;
        for (row, columns) in blocks.received() {
            own.extend(columns.iter().map(|&column| (row, column)));
        }
        own.sort_unstable();
        own.dedup();
        let beyond = index.owned as u32..self.numbering(index).count() as u32;
        let row = |node| globals.binary_search(&self.numbering(index).global(node));
        let row_of = beyond.map(|node| row(node).map_or(NO_ROW, |row| row as u32)).collect();
        let force = vec![0.0; globals.len() * D];
        let values = vec![0.0; remote.blocks() * D * D];
        let (received, slots) = (Vec::new(), Vec::new());
        self.rows = Some(Rows { give, blocks, remote, row_of, own, received, slots, force, values });
        Ok(())
    }

    /// Blocks (owned row, global column) that the couplings need on this rank, sorted.
    pub fn blocks(&self) -> &[(u32, i32)] {
        self.rows.as_ref().map_or(&[], |rows| &rows.own)
    }

    /// Finds the positions of all blocks in a pattern that contains them.
    pub fn locate<'a>(
        &mut self,
        index: &IndexMap,
        pattern: &BlockPattern,
        couplings: impl Iterator<Item = &'a mut Couplings>,
    ) {
        let numbering = Numbering { index, foreign: &self.foreign };
        let Some(rows) = &mut self.rows else { return };
        couplings.for_each(|couplings| couplings.locate(&numbering, pattern, &rows.remote));
        rows.received.clear();
        for (row, columns) in rows.blocks.received() {
            let slot = |&column: &i32| pattern.slot(row as usize, column).unwrap_or(NO_SLOT);
            rows.received.extend(columns.iter().map(slot));
        }
    }

    /// Collects forces with `evaluate`, sends those of other ranks' rows, and runs `meanwhile`
    /// until those of other ranks arrive. Collective.
    ///
    /// `meanwhile` must not wait for another rank.
    pub fn add_forces(
        &mut self,
        world: &impl CommunicatorCollectives,
        own: &mut [f64],
        evaluate: impl FnOnce(&ContactFields, &mut [f64], RemoteForce),
        meanwhile: impl FnOnce(),
    ) {
        let fields = ContactFields { u: &self.u, v: &self.v, u_start: &self.u_start };
        let Some(rows) = self.rows.as_mut() else {
            return meanwhile();
        };
        rows.force.fill(0.0);
        let remote = RemoteForce { row_of: &rows.row_of, values: &mut rows.force };
        evaluate(&fields, own, remote);
        let sending = self.exchange.begin();
        let _waiting = rows.give.reverse_add_while(world, D, &rows.force, own, || {
            drop(sending);
            meanwhile();
            self.exchange.begin()
        });
    }

    /// Collects blocks with `evaluate`, sends those of other ranks' rows, and runs `meanwhile`
    /// until those of other ranks arrive, as in [`add_forces`](Self::add_forces). Collective.
    ///
    /// The blocks are evaluated with the fields that were updated for the forces. A `lift` adds the
    /// columns of prescribed unknowns. It contains their change at owned nodes followed by ghosts,
    /// which is updated, and the owned rows that are modified.
    pub fn add_stiffness(
        &mut self,
        (world, fields): (&impl CommunicatorCollectives, &ContactFields),
        (values, symmetry): (&mut BlockValues, Symmetry),
        mut lift: Option<LiftTarget>,
        evaluate: impl FnOnce(&ContactFields, &mut Opening<'_, '_, D>),
        meanwhile: impl FnOnce(&mut BlockValues, Option<LiftTarget>),
    ) {
        debug_assert!(self.has_brought(fields), "the tangent is evaluated before the forces");
        if let Some(lift) = &lift {
            self.change.resize(self.u.len(), 0.0);
            let _running = self.exchange.begin();
            self.bring.forward_many(world, &mut [travel::<D>(&mut self.change, lift.change)]);
        }
        let fields = ContactFields { u: &self.u, v: &self.v, u_start: &self.u_start };
        let Some(rows) = self.rows.as_mut() else { return meanwhile(values, lift) };
        rows.values.fill(0.0);
        rows.force.fill(0.0);
        let lifted = lift.as_mut().map(|lift| PairLift {
            change: &self.change,
            rhs: &mut *lift.rhs,
            remote: RemoteForce { row_of: &rows.row_of, values: &mut rows.force },
        });
        let mut opening = Opening {
            held: &self.held,
            values: &mut *values,
            remote: &mut rows.values,
            lift: lifted,
            symmetry,
        };
        evaluate(&fields, &mut opening);
        let sending = self.exchange.begin();
        if let Some(lift) = &mut lift {
            rows.give.reverse_add(world, D, &rows.force, lift.rhs);
        }
        let (arrived, _waiting) = rows.blocks.send_values_while(world, D * D, &rows.values, || {
            drop(sending);
            meanwhile(values, lift);
            self.exchange.begin()
        });
        rows.slots.clear();
        rows.slots.extend(arrived.numbers.iter().map(|&number| rows.received[number as usize]));
        values.add_blocks(&rows.slots, arrived.blocks);
    }
}

/// Destination of the blocks of pairs.
pub struct Opening<'a, 'm, const D: usize> {
    /// Held directions of all nodes.
    pub held: &'a Held<D>,
    /// Matrix values of the rank's own rows.
    pub values: &'a mut BlockValues<'m>,
    /// Blocks of rows of other ranks.
    pub remote: &'a mut [f64],
    /// Right side for prescribed changes.
    pub lift: Option<PairLift<'a>>,
    /// Symmetry that the matrix guarantees.
    pub symmetry: Symmetry,
}

/// A field of the rank's nodes, prepared for exchange. It is copied to the front of `all`, and the
/// foreign values follow.
fn travel<'a, const D: usize>(all: &'a mut [f64], owned: &'a [f64]) -> ExchangedField<'a> {
    let (local, wanted) = all.split_at_mut(owned.len());
    local.copy_from_slice(owned);
    ExchangedField { width: D, owned, wanted }
}
