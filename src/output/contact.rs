//! `contact.csv`: resultants and counts of each contact, one row per step and contact.

use std::path::Path;

use crate::case::Units;
use crate::error::Result;

use super::AXES;
use super::table::{Cell, Marks, Table, named};

/// One contact in one step. Forces act on the contactor, per metre of depth in 2D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactRow<const D: usize> {
    /// `int t_n da` \[N\], positive in compression.
    pub force_n: f64,
    /// Resultant of normal and friction tractions \[N\].
    pub force: [f64; D],
    /// Friction on the contactor \[N\]. In the plane `int t_T . e da` with its sign, `e` the normal
    /// outward from the target turned clockwise by a right angle (to the right on a target that
    /// faces up); in space the length `|int t_T da|`.
    pub force_t: f64,
    /// Area of the contact zone \[m2\].
    pub area: f64,
    /// Contact points with gap <= 0.
    pub points: u64,
    /// Number of sticking points among them.
    pub stick: u64,
    /// Number of slipping points among them.
    pub slip: u64,
    /// Largest `-g_n` \[m\], 0 if the contact is open.
    pub max_penetration: f64,
    /// Largest `t_n` \[Pa\].
    pub max_pressure: f64,
    /// `-int t_T . v_T da` \[W\]: the power that friction removes from the motion at that instant.
    /// It is never negative in the velocity form. Elastic stick returns the energy that it stored.
    pub friction_power: f64,
}

/// The table of all contacts.
#[derive(Debug)]
pub struct ContactTable<const D: usize> {
    table: Table,
}

impl<const D: usize> ContactTable<D> {
    /// Name of the file in the results folder.
    pub const FILE: &str = "contact.csv";

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

    /// Writes the row of one contact at a time \[s\].
    ///
    /// # Errors
    /// A value is not finite, or the disk can not be written.
    pub fn row(&mut self, step: u64, time: f64, contact: &str, row: &ContactRow<D>) -> Result<()> {
        let mut cells =
            vec![Cell::Count(step), Cell::Number(time), Cell::Text(contact), Cell::Number(row.force_n)];
        cells.extend(row.force.map(Cell::Number));
        cells.extend([row.force_t, row.area].map(Cell::Number));
        cells.extend([row.points, row.stick, row.slip].map(Cell::Count));
        cells.extend([row.max_penetration, row.max_pressure, row.friction_power].map(Cell::Number));
        self.table.row(&cells)
    }
}

fn columns<const D: usize>() -> Vec<String> {
    let mut columns = named(&["step", "time [s]", "contact", "force_n [N]"]);
    columns.extend(AXES[..D].iter().map(|axis| format!("force_{axis} [N]")));
    columns.extend(named(&["force_t [N]", "area [m2]", "points", "stick", "slip"]));
    columns.extend(named(&["max_penetration [m]", "max_pressure [Pa]", "friction_power [W]"]));
    columns
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;

    /// Header and row in 2D follow the documented format; the header in 3D has `force_z`.
    #[test]
    fn follows_the_contract() {
        let scratch = Scratch::new("contact");
        let mut table = ContactTable::<2>::open(&scratch.0, Units::SI, None).unwrap();
        let row = ContactRow {
            force_n: 8.0,
            force: [-3.0, 8.0],
            force_t: 3.0,
            area: 0.5,
            points: 9,
            stick: 4,
            slip: 5,
            max_penetration: 1e-5,
            max_pressure: 2e5,
            friction_power: -2.5,
        };
        table.row(1, 0.5, "sole", &row).unwrap();
        let text = std::fs::read_to_string(scratch.0.join("contact.csv")).unwrap();
        let expected = "step,time [s],contact,force_n [N],force_x [N],force_y [N],force_t [N],area [m2],points,stick,slip,\
            max_penetration [m],max_pressure [Pa],friction_power [W]\n1,0.5,sole,8,-3,8,3,0.5,9,4,5,1e-5,200000,-2.5\n";
        assert_eq!(text, expected);
        assert_eq!(columns::<3>()[4..7].join(","), "force_x [N],force_y [N],force_z [N]");
    }
}
