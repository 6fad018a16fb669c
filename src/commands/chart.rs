//! `contact-petsc chart TABLE`: converts the command line to the input of the plotter.

use crate::cli::{ChartArguments, ChartAxis};
use crate::error::{Error, Result};
use crate::plot::TableFigure;

/// The figure that the arguments describe.
///
/// # Errors
/// A condition is not `COLUMN=VALUE,...`.
pub fn figure(arguments: &ChartArguments) -> Result<TableFigure> {
    Ok(TableFigure {
        table: arguments.table.clone(),
        x: arguments.x.clone(),
        y: arguments.y.clone(),
        by: arguments.by.clone(),
        panels: arguments.panels.clone(),
        only: conditions(&arguments.only)?,
        valid: conditions(&arguments.valid)?,
        logarithmic: [ChartAxis::X, ChartAxis::Y].map(|axis| arguments.log.contains(&axis)),
        title: arguments.title.clone(),
    })
}

fn conditions(texts: &[String]) -> Result<Vec<(String, Vec<String>)>> {
    let condition = |text: &String| {
        let (column, values) = text.split_once('=')?;
        Some((column.to_owned(), values.split(',').map(str::to_owned).collect()))
    };
    let read = texts.iter().map(|text| {
        condition(text).ok_or_else(|| Error::usage(format!("expected COLUMN=VALUE,..., found `{text}`")))
    });
    read.collect()
}
