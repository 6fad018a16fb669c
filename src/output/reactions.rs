//! `reactions.csv`: the force of each support, one row per step and displacement boundary.

use std::path::Path;

use crate::case::Units;
use crate::error::Result;

use super::AXES;
use super::table::{Cell, Marks, Table, named};

/// The force that one support exerts on the bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReactionRow<const D: usize> {
    /// \[N\], per metre of depth in 2D; includes the inertia of the driven nodes.
    pub force: [f64; D],
}

/// The table of all displacement boundaries.
#[derive(Debug)]
pub struct ReactionTable<const D: usize> {
    table: Table,
}

impl<const D: usize> ReactionTable<D> {
    /// Name of the file in the results folder.
    pub const FILE: &str = "reactions.csv";

    /// Opens the table in `folder` with headings in `units`, see [`Table::open`]. Rank 0 only.
    ///
    /// # Errors
    /// See [`Table::open`].
    pub fn open(folder: &Path, units: Units, past: Option<&Marks>) -> Result<Self> {
        Ok(Self { table: Table::open(&folder.join(Self::FILE), units.headings(columns::<D>()), past)? })
    }

    /// The underlying CSV table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Writes the row of one boundary at a time \[s\].
    ///
    /// # Errors
    /// A value is not finite, or the disk can not be written.
    pub fn row(&mut self, step: u64, time: f64, boundary: &str, row: &ReactionRow<D>) -> Result<()> {
        let mut cells = vec![Cell::Count(step), Cell::Number(time), Cell::Text(boundary)];
        cells.extend(row.force.map(Cell::Number));
        self.table.row(&cells)
    }
}

fn columns<const D: usize>() -> Vec<String> {
    let mut columns = named(&["step", "time [s]", "boundary"]);
    columns.extend(AXES[..D].iter().map(|axis| format!("force_{axis} [N]")));
    columns
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;

    /// Header and rows in 2D and 3D follow the documented format.
    #[test]
    fn follows_the_contract() {
        let scratch = Scratch::new("reactions");
        let mut plane = ReactionTable::<2>::open(&scratch.0, Units::SI, None).unwrap();
        plane.row(1, 0.5, "clamp", &ReactionRow { force: [1.0, -2.0] }).unwrap();
        let text = std::fs::read_to_string(scratch.0.join("reactions.csv")).unwrap();
        assert_eq!(text, "step,time [s],boundary,force_x [N],force_y [N]\n1,0.5,clamp,1,-2\n");
        assert_eq!(columns::<3>().join(","), "step,time [s],boundary,force_x [N],force_y [N],force_z [N]");
    }
}
