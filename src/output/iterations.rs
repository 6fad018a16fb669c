//! `iterations.csv`: how each step was solved, one row per iteration, including failed attempts.

use std::path::Path;

use crate::case::Units;
use crate::error::Result;

use super::table::{Cell, Marks, Table};

const COLUMNS: [&str; 13] = [
    "step",
    "time [s]",
    "dt [s]",
    "attempt",
    "stage",
    "iteration",
    "residual",
    "increment",
    "krylov_iterations",
    "points",
    "changed",
    "line_search",
    "contraction",
];

/// One iteration of a nonlinear solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationRow<'a> {
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
    pub stage: &'a str,
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
        Ok(Self { table: Table::open(&folder.join(Self::FILE), units.headings(COLUMNS), past)? })
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
        self.table.row(&[
            Cell::Count(row.step),
            Cell::Number(row.time),
            Cell::Number(row.dt),
            Cell::Count(row.attempt),
            Cell::Text(row.stage),
            Cell::Count(row.iteration),
            row.residual.into(),
            row.increment.into(),
            Cell::Count(row.krylov_iterations),
            Cell::Count(row.points),
            Cell::Count(row.changed),
            row.line_search.into(),
            row.contraction.into(),
        ])
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
