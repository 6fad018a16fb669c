//! `momentum.csv`: linear and angular momentum of all bodies together, one row per step.

use std::path::Path;

use crate::case::Units;
use crate::error::Result;

use super::AXES;
use super::table::{Cell, Marks, Table, named};

/// The momentum at the end of one step, per metre of depth in 2D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MomentumRow {
    /// `int rho v dV` \[N s\]; 2D has the first two components.
    pub linear: [f64; 3],
    /// `int rho x x v dV` about the origin in the current configuration [N m s]; 2D has the last
    /// component.
    pub angular: [f64; 3],
}

/// The table of the momentum.
#[derive(Debug)]
pub struct MomentumTable<const D: usize> {
    table: Table,
}

impl<const D: usize> MomentumTable<D> {
    /// Name of the file in the results folder.
    pub const FILE: &str = "momentum.csv";

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

    /// Writes the row of a step at a time \[s\].
    ///
    /// # Errors
    /// A value is not finite, or the disk can not be written.
    pub fn row(&mut self, step: u64, time: f64, row: &MomentumRow) -> Result<()> {
        let head = [Cell::Count(step), Cell::Number(time)];
        let values = row.linear[..D].iter().chain(&row.angular[turning::<D>()]).copied().map(Cell::Number);
        self.table.row(&head.into_iter().chain(values).collect::<Vec<_>>())
    }
}

/// The axes about which bodies in `D` dimensions can rotate.
fn turning<const D: usize>() -> std::ops::Range<usize> {
    if D == 2 { 2..3 } else { 0..3 }
}

fn columns<const D: usize>() -> Vec<String> {
    let mut columns = named(&["step", "time [s]"]);
    columns.extend(AXES[..D].iter().map(|axis| format!("linear_{axis} [N s]")));
    columns.extend(AXES[turning::<D>()].iter().map(|axis| format!("angular_{axis} [N m s]")));
    columns
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;

    /// Header and rows in 2D and 3D; components that do not exist in 2D are left out.
    #[test]
    fn has_the_components_of_its_space() {
        let scratch = Scratch::new("momentum");
        let row = MomentumRow { linear: [1.0, 2.0, 3.0], angular: [4.0, 5.0, 6.0] };
        MomentumTable::<2>::open(&scratch.0, Units::SI, None).unwrap().row(1, 0.5, &row).unwrap();
        let text = std::fs::read_to_string(scratch.0.join("momentum.csv")).unwrap();
        assert_eq!(text, "step,time [s],linear_x [N s],linear_y [N s],angular_z [N m s]\n1,0.5,1,2,6\n");
        MomentumTable::<3>::open(&scratch.0, Units::SI, None).unwrap().row(1, 0.5, &row).unwrap();
        let text = std::fs::read_to_string(scratch.0.join("momentum.csv")).unwrap();
        assert!(text.ends_with("angular_x [N m s],angular_y [N m s],angular_z [N m s]\n1,0.5,1,2,3,4,5,6\n"));
    }
}
