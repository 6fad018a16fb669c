//! State that the next step needs from the last one, written to and read from the tables of a
//! checkpoint.
//!
//! Rows are keyed by the nodes' numbers in the input mesh. Contact points are vertices, which are
//! at nodes.

use super::contact::LocalContact;
use super::system::ContactSystem;
use crate::checkpoint::StoredTable;
use crate::contact::evaluation::ContactFields;
use crate::contact::history::History;
use crate::dynamics::Stage;
use crate::error::{Error, Result};

/// Number of nodes that are written at a time.
const NODES: u64 = 1 << 16;
/// Columns of a contact point that precede those of its history.
const OWN: [&str; 1] = ["gap"];
const FIELDS: [&str; 5] = ["u", "v", "a", "force", "drive"];

impl<const D: usize> ContactSystem<D> {
    /// Writes the accepted state in `stage` with the ledger's `drive` \[N\] and the history of the
    /// contact points that this rank reports.
    pub fn memory(&self, stage: &Stage, drive: &[f64]) -> Vec<StoredTable> {
        let mut tables = vec![self.node_table()];
        let start = &stage.start;
        let fields = [start.u.owned(), start.v.owned(), start.a.owned(), stage.start_forces.owned()];
        for (node, row) in tables[0].rows_mut().enumerate() {
            // Without inertia, accelerations are zero.
            let of = |field: &[f64], i: usize| field.get(node * D + i).copied().unwrap_or(0.0);
            let all = fields.iter().flat_map(|field| (0..D).map(move |i| of(field, i)));
            let values = all.chain(drive[node * D..(node + 1) * D].iter().copied());
            row.iter_mut().zip(values).for_each(|(word, value)| *word = value.to_bits());
        }
        tables.extend(self.contacts.iter().map(|contact| self.filled(contact)));
        tables
    }

    /// Creates empty tables of all data that this rank has to read.
    pub fn wanted(&self) -> Vec<StoredTable> {
        let points = self.contacts.iter().map(|contact| self.point_table(contact));
        std::iter::once(self.node_table()).chain(points).collect()
    }

    /// Restores the tables of [`memory`](Self::memory) and returns the ledger's drive \[N\]. Call
    /// [`forget`](Self::forget) afterwards. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails, or the tables are not those of [`wanted`](Self::wanted).
    pub fn restore(&mut self, stage: &mut Stage, tables: &[StoredTable]) -> Result<Vec<f64>> {
        let Some((nodes, points)) = tables.split_first() else {
            return Err(Error::internal("the checkpoint has no nodes"));
        };
        let mut drive = vec![0.0; self.local.index.owned * D];
        {
            let start = &mut stage.start;
            let (mut u, mut v, mut a) = (start.u.owned_mut(), start.v.owned_mut(), start.a.owned_mut());
            let mut forces = stage.start_forces.owned_mut();
            let mut fields: [&mut [f64]; 5] = [&mut u, &mut v, &mut a, &mut forces, &mut drive];
            for (node, row) in nodes.rows().enumerate() {
                for (field, words) in fields.iter_mut().zip(row.chunks_exact(D)) {
                    let values = field.iter_mut().skip(node * D).take(D);
                    values.zip(words).for_each(|(value, word)| *value = f64::from_bits(*word));
                }
            }
        }
        stage.start.u.update_ghosts()?;
        stage.start.v.update_ghosts()?;
        stage.start.a.update_ghosts()?;
        for (contact, table) in self.contacts.iter_mut().zip(points) {
            recall(contact, table)?;
        }
        Ok(drive)
    }

    /// Discards all data that a run resumed from a checkpoint of this state cannot have.
    /// Collective.
    ///
    /// Contacts search again, and the pattern of the matrix contains the current neighbours.
    /// `stage` is at the start of a step.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn forget(&mut self, stage: &mut Stage) -> Result<()> {
        stage.trial.copy_from(&stage.start)?;
        self.contacts.iter_mut().for_each(LocalContact::begin_step);
        if self.interface.is_none() {
            return Ok(());
        }
        let (u, v) = (stage.start.u.local(), stage.start.v.local());
        self.renew_all(&ContactFields { u: &u, v: &v, u_start: &u })
    }

    fn node_table(&self) -> StoredTable {
        let names = FIELDS.iter().flat_map(|field| axes::<D>(field)).collect();
        let nodes = self.local.input_node[..self.local.index.owned].iter();
        StoredTable::keyed("nodes", names, nodes.map(|&node| u64::from(node)).collect(), NODES)
    }

    fn point_table(&self, contact: &LocalContact<D>) -> StoredTable {
        let names = OWN.iter().map(|name| (*name).to_owned()).chain(History::<D>::names()).collect();
        let key = |&node: &u32| u64::from(self.local.input_node[node as usize]);
        let keys = contact.vertices().iter().map(key).collect();
        StoredTable::keyed(&format!("contact {}", contact.name), names, keys, NODES)
    }

    fn filled(&self, contact: &LocalContact<D>) -> StoredTable {
        let mut table = self.point_table(contact);
        let mut columns = Vec::new();
        for (point, row) in table.rows_mut().enumerate() {
            columns.clear();
            contact.state.history[point].columns(&mut columns);
            row[0] = contact.state.current[point].gap.to_bits();
            row[OWN.len()..].iter_mut().zip(&columns).for_each(|(word, value)| *word = value.to_bits());
        }
        table
    }
}

/// Restores the history of the points of a contact from a table that contains all of them in their
/// order.
fn recall<const D: usize>(contact: &mut LocalContact<D>, table: &StoredTable) -> Result<()> {
    if table.keys.len() != contact.state.history.len() {
        return Err(Error::internal("the checkpoint does not fit the points of a contact"));
    }
    for (point, row) in table.rows().enumerate() {
        let values: Vec<f64> = row.iter().map(|word| f64::from_bits(*word)).collect();
        let history = values.get(OWN.len()..).and_then(History::from_columns);
        contact.state.history[point] =
            history.ok_or_else(|| Error::internal("the checkpoint has truncated rows"))?;
        contact.state.current[point].gap = values[0];
    }
    Ok(())
}

fn axes<const D: usize>(field: &'static str) -> impl Iterator<Item = String> {
    ["x", "y", "z"].iter().take(D).map(move |axis| format!("{field}_{axis}"))
}
