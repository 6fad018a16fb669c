//! `probes.csv`: displacement, velocity and contact state of chosen points, one row per step.

use std::path::Path;

use crate::case::Units;
use crate::error::Result;

use super::table::{Cell, Marks, Table};
use super::{AXES, Status};

/// Name of a probe, and whether it lies on a contact surface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProbeColumns {
    /// Name in the case file.
    pub name: String,
    /// Whether the probe has the five contact columns.
    pub on_contact: bool,
}

/// Values of one probe in one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeRow<const D: usize> {
    /// Displacement \[m\].
    pub u: [f64; D],
    /// Velocity \[m/s\].
    pub v: [f64; D],
    /// The contact columns. They are written only if [`ProbeColumns::on_contact`] is set; `None`
    /// then leaves them empty.
    pub contact: Option<ProbeContact>,
}

/// The contact state at a probe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeContact {
    /// `t_n` \[Pa\], positive in compression.
    pub contact_pressure: f64,
    /// Friction traction on the contactor \[Pa\]: signed along the target's tangent in 2D, its
    /// length in 3D.
    pub traction_t: f64,
    /// `g_n` \[m\], positive if open; `None` if there is no target opposite.
    pub gap: Option<f64>,
    /// Speed of the contactor against the target \[m/s\]: signed as `traction_t` in 2D, its length
    /// in 3D.
    pub slip_velocity: f64,
    /// Open, stick or slip.
    pub status: Status,
}

/// The table of all probes.
#[derive(Debug)]
pub struct ProbeTable<const D: usize> {
    table: Table,
    probes: Vec<ProbeColumns>,
}

impl<const D: usize> ProbeTable<D> {
    /// Name of the file in the results folder.
    pub const FILE: &str = "probes.csv";

    /// Opens the table in `folder` with headings in `units`, see [`Table::open`]. Rank 0 only.
    ///
    /// # Errors
    /// See [`Table::open`].
    pub fn open(
        folder: &Path,
        units: Units,
        probes: Vec<ProbeColumns>,
        past: Option<&Marks>,
    ) -> Result<Self> {
        let table = Table::open(&folder.join(Self::FILE), units.headings(columns::<D>(&probes)), past)?;
        Ok(Self { table, probes })
    }

    /// The underlying CSV table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Writes the row of a step: time and length of the step \[s\], and the probes in the order of
    /// [`Self::open`].
    ///
    /// # Errors
    /// A value is not finite, the number of probes is wrong, or the disk can not be written.
    pub fn row(&mut self, step: u64, time: f64, dt: f64, rows: &[ProbeRow<D>]) -> Result<()> {
        let mut cells = vec![Cell::Count(step), Cell::Number(time), Cell::Number(dt)];
        for (probe, row) in self.probes.iter().zip(rows) {
            cells.extend(row.u.iter().chain(&row.v).map(|&value| Cell::Number(value)));
            if probe.on_contact {
                cells.extend(contact_cells(row.contact.as_ref()));
            }
        }
        self.table.row(&cells)
    }
}

fn contact_cells(contact: Option<&ProbeContact>) -> [Cell<'static>; 5] {
    let Some(contact) = contact else { return [Cell::Absent; 5] };
    [
        Cell::Number(contact.contact_pressure),
        Cell::Number(contact.traction_t),
        contact.gap.into(),
        Cell::Number(contact.slip_velocity),
        Cell::Text(contact.status.name()),
    ]
}

fn columns<const D: usize>(probes: &[ProbeColumns]) -> Vec<String> {
    let mut columns = super::table::named(&["step", "time [s]", "dt [s]"]);
    for ProbeColumns { name, on_contact } in probes {
        columns.extend(AXES[..D].iter().map(|axis| format!("{name}.u_{axis} [m]")));
        columns.extend(AXES[..D].iter().map(|axis| format!("{name}.v_{axis} [m/s]")));
        if *on_contact {
            let quantities =
                ["contact_pressure [Pa]", "traction_t [Pa]", "gap [m]", "slip_velocity [m/s]", "status"];
            columns.extend(quantities.map(|quantity| format!("{name}.{quantity}")));
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;

    fn probe(name: &str, on_contact: bool) -> ProbeColumns {
        ProbeColumns { name: name.into(), on_contact }
    }

    /// The header in 2D follows the documented format, with contact columns only for probes on a
    /// contact surface.
    #[test]
    fn plane_header_and_rows_follow_the_contract() {
        let scratch = Scratch::new("probes-2d");
        let mut table = ProbeTable::<2>::open(
            &scratch.0,
            Units::SI,
            vec![probe("node_50", true), probe("top", false)],
            None,
        )
        .unwrap();
        let contact = ProbeContact {
            contact_pressure: 2e5,
            traction_t: -1e5,
            gap: None,
            slip_velocity: 0.25,
            status: Status::Slip,
        };
        let first = ProbeRow { u: [0.5, -0.25], v: [1.0, 0.0], contact: Some(contact) };
        let second = ProbeRow { u: [0.0; 2], v: [0.0; 2], contact: None };
        table.row(3, 1.5e-3, 5e-4, &[first, second]).unwrap();
        let unmatched = ProbeRow { contact: None, ..first };
        table.row(4, 2e-3, 5e-4, &[unmatched, second]).unwrap();
        let text = std::fs::read_to_string(scratch.0.join("probes.csv")).unwrap();
        let expected = "step,time [s],dt [s],node_50.u_x [m],node_50.u_y [m],node_50.v_x [m/s],node_50.v_y [m/s],\
            node_50.contact_pressure [Pa],node_50.traction_t [Pa],node_50.gap [m],node_50.slip_velocity [m/s],\
            node_50.status,top.u_x [m],top.u_y [m],top.v_x [m/s],top.v_y [m/s]\n\
            3,0.0015,0.0005,0.5,-0.25,1,0,200000,-100000,,0.25,slip,0,0,0,0\n\
            4,0.002,0.0005,0.5,-0.25,1,0,,,,,,0,0,0,0\n";
        assert_eq!(text, expected);
        assert!(table.row(5, 2e-3, 5e-4, &[first]).is_err());
    }

    /// In 3D each vector has its third component.
    #[test]
    fn space_header_follows_the_contract() {
        assert_eq!(
            columns::<3>(&[probe("p", true)]).join(","),
            "step,time [s],dt [s],p.u_x [m],p.u_y [m],p.u_z [m],p.v_x [m/s],p.v_y [m/s],p.v_z [m/s],\
             p.contact_pressure [Pa],p.traction_t [Pa],p.gap [m],p.slip_velocity [m/s],p.status"
        );
    }
}
