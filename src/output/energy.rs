//! `energy.csv`: the energy balance, one row per step. Energies are per unit of length of depth in
//! 2D.

use std::path::Path;

use crate::case::Units;
use crate::error::Result;

use super::table::{Cell, Marks, Table};

const COLUMNS: [&str; 10] = [
    "step",
    "time [s]",
    "kinetic [J]",
    "strain [J]",
    "contact [J]",
    "friction_dissipated [J]",
    "damping_dissipated [J]",
    "external_work [J]",
    "numerical [J]",
    "total [J]",
];

/// The energy balance of one step \[J\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyRow {
    /// `v . M v / 2`.
    pub kinetic: f64,
    /// Stored in the solids.
    pub strain: f64,
    /// Stored in the normal contact law.
    pub contact: f64,
    /// Lost to friction since the start, >= 0.
    pub friction_dissipated: f64,
    /// Lost to damping since the start, >= 0.
    pub damping_dissipated: f64,
    /// Work of loads and supports since the start.
    pub external_work: f64,
    /// Energy that the balance leaves unexplained.
    pub numerical: f64,
    /// `kinetic + strain + contact`.
    pub total: f64,
}

/// The table of the energy balance.
#[derive(Debug)]
pub struct EnergyTable {
    table: Table,
}

impl EnergyTable {
    /// Name of the file in the results folder.
    pub const FILE: &str = "energy.csv";

    /// Opens the table in `folder` with headings in `units`, see [`Table::open`]. Rank 0 only.
    ///
    /// # Errors
    /// See [`Table::open`].
    pub fn open(folder: &Path, units: Units, past: Option<&Marks>) -> Result<Self> {
        Ok(Self { table: Table::open(&folder.join(Self::FILE), units.headings(COLUMNS), past)? })
    }

    /// The underlying CSV table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Writes the row of a step at a time \[s\].
    ///
    /// # Errors
    /// A value is not finite, or the disk can not be written.
    pub fn row(&mut self, step: u64, time: f64, row: &EnergyRow) -> Result<()> {
        let head = [Cell::Count(step), Cell::Number(time)];
        let stored = [row.kinetic, row.strain, row.contact];
        let lost = [row.friction_dissipated, row.damping_dissipated];
        let balance = [row.external_work, row.numerical, row.total];
        let values = stored.into_iter().chain(lost).chain(balance).map(Cell::Number);
        self.table.row(&head.into_iter().chain(values).collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;

    /// Header and row follow the documented format, with each value under its name.
    #[test]
    fn follows_the_contract() {
        let scratch = Scratch::new("energy");
        let mut table = EnergyTable::open(&scratch.0, Units::SI, None).unwrap();
        let row = EnergyRow {
            kinetic: 1.0,
            strain: 2.0,
            contact: 3.0,
            friction_dissipated: 4.0,
            damping_dissipated: 5.0,
            external_work: 6.0,
            numerical: 7.0,
            total: 8.0,
        };
        table.row(2, 0.5, &row).unwrap();
        let text = std::fs::read_to_string(scratch.0.join("energy.csv")).unwrap();
        let expected = "step,time [s],kinetic [J],strain [J],contact [J],friction_dissipated [J],\
            damping_dissipated [J],external_work [J],numerical [J],total [J]\n2,0.5,1,2,3,4,5,6,7,8\n";
        assert_eq!(text, expected);
    }
}
