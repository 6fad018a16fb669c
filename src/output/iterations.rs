//! `iterations.csv`: how each step was solved, one row per iteration, including failed attempts.

use std::path::Path;

use crate::case::Units;
use crate::error::Result;

use super::table::{Cell, Marks, Table};
use crate::observe::quantity::{Column, ReportedQuantity, Value, headings};

/// One iteration of a nonlinear solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationRow {
    /// Number of the step.
    pub step: u64,
    /// Time at its end \[s\].
    pub time: f64,
    /// Its length \[s\].
    pub dt: f64,
    /// 1 for the first attempt, one more after each cut.
    pub attempt: u64,
    /// What is being solved: `start`, `monolithic`, or of the staggered strategy `I`, `II` and
    /// `sweep`. A `sweep` row ends a sweep over both stages: it has the number of the sweep, the
    /// monolithic residual and the distance of the stages.
    pub stage: &'static str,
    /// 0 is the predicted state, before any correction.
    pub iteration: u64,
    /// Norm of the residual that the convergence test uses; `None` if a trial state could not be
    /// evaluated.
    pub residual: Option<f64>,
    /// Norm of the correction; `None` before the first.
    pub increment: Option<f64>,
    /// Iterations of the linear solver for this correction.
    pub krylov_iterations: u64,
    /// Contact points with gap <= 0.
    pub points: u64,
    /// Contact points whose status changed in this iteration.
    pub changed: u64,
    /// Factor on the correction; `None` before the first.
    pub line_search: Option<f64>,
    /// Distance of the stages over that of the previous sweep; `None` except for a sweep with a
    /// predecessor.
    pub contraction: Option<f64>,
}

/// The columns of `iterations.csv`.
pub const ITERATION_COLUMNS: &[Column<IterationRow>] = &[
    Column {
        quantity: ReportedQuantity::number("step", "", "the step that is sought"),
        value: Value::Count(|row| row.step),
    },
    Column {
        quantity: ReportedQuantity::number("time", "s", "time at its end"),
        value: Value::Number(|row| row.time),
    },
    Column {
        quantity: ReportedQuantity::number("dt", "s", "its length"),
        value: Value::Number(|row| row.dt),
    },
    Column {
        quantity: ReportedQuantity::number("attempt", "", "1 for the first attempt, one more after each cut"),
        value: Value::Count(|row| row.attempt),
    },
    Column {
        quantity: ReportedQuantity::number(
            "stage",
            "",
            "`start`, `monolithic`; for the staggered strategy `I`, `II` and `sweep`",
        ),
        value: Value::Word(|row| row.stage),
    },
    Column {
        quantity: ReportedQuantity::number("iteration", "", "0 is the predicted state"),
        value: Value::Count(|row| row.iteration),
    },
    Column {
        quantity: ReportedQuantity::number("residual", "", "relative residual of the convergence test"),
        value: Value::Optional(|row| row.residual),
    },
    Column {
        quantity: ReportedQuantity::number("increment", "", "norm of the correction"),
        value: Value::Optional(|row| row.increment),
    },
    Column {
        quantity: ReportedQuantity::number("krylov_iterations", "", "iterations of the linear solver"),
        value: Value::Count(|row| row.krylov_iterations),
    },
    Column {
        quantity: ReportedQuantity::number("points", "", "closed contact points"),
        value: Value::Count(|row| row.points),
    },
    Column {
        quantity: ReportedQuantity::number(
            "changed",
            "",
            "contact points that changed their status in this iteration",
        ),
        value: Value::Count(|row| row.changed),
    },
    Column {
        quantity: ReportedQuantity::number("line_search", "", "factor on the correction"),
        value: Value::Optional(|row| row.line_search),
    },
    Column {
        quantity: ReportedQuantity::number(
            "contraction",
            "",
            "for `sweep`: distance of the stages over that of the sweep before",
        ),
        value: Value::Optional(|row| row.contraction),
    },
];

/// The table of all iterations.
#[derive(Debug)]
pub struct IterationTable {
    table: Table,
}

impl IterationTable {
    /// Name of the file in the results folder.
    pub const FILE: &str = "iterations.csv";

    /// Opens the table in `folder` with headings in `units`, see [`Table::open`]. Rank 0 only.
    ///
    /// # Errors
    /// See [`Table::open`].
    pub fn open(folder: &Path, units: Units, past: Option<&Marks>) -> Result<Self> {
        let columns = headings::<3>(ITERATION_COLUMNS.iter().map(|column| &column.quantity));
        Ok(Self { table: Table::open(&folder.join(Self::FILE), units.headings(columns), past)? })
    }

    /// The underlying CSV table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Writes the row of an iteration.
    ///
    /// # Errors
    /// A value is not finite, or the disk can not be written.
    pub fn row(&mut self, row: &IterationRow) -> Result<()> {
        let cells: Vec<Cell> = ITERATION_COLUMNS.iter().flat_map(|column| column.cells::<3>(row)).collect();
        self.table.row(&cells)
    }
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;

    /// Header and rows follow the documented format; an unknown value is an empty field.
    #[test]
    fn follows_the_contract() {
        let scratch = Scratch::new("iterations");
        let mut table = IterationTable::open(&scratch.0, Units::SI, None).unwrap();
        let predicted = IterationRow {
            step: 1,
            time: 0.5,
            dt: 0.25,
            attempt: 2,
            stage: "monolithic",
            iteration: 0,
            residual: Some(1e-3),
            increment: None,
            krylov_iterations: 0,
            points: 49,
            changed: 3,
            line_search: None,
            contraction: None,
        };
        table.row(&predicted).unwrap();
        let corrected =
            IterationRow { iteration: 1, increment: Some(2e-5), line_search: Some(1.0), ..predicted };
        table.row(&IterationRow { krylov_iterations: 8, contraction: Some(0.25), ..corrected }).unwrap();
        let text = std::fs::read_to_string(scratch.0.join("iterations.csv")).unwrap();
        let expected = "step,time [s],dt [s],attempt,stage,iteration,residual,increment,krylov_iterations,points,\
            changed,line_search,contraction\n1,0.5,0.25,2,monolithic,0,0.001,,0,49,3,,\n\
            1,0.5,0.25,2,monolithic,1,0.001,2e-5,8,49,3,1,0.25\n";
        assert_eq!(text, expected);
    }
}
