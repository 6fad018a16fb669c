//! `study.csv`: one row per member.

use super::columns::COLUMNS;
use super::row::{MemberState, StudyRow};
use crate::error::Result;
use crate::output::table::{Cell, whole};

/// Name of the table in the folder of a study.
pub const FILE: &str = "study.csv";

/// The whole table. `fronts` are the members on the front of each quantity.
///
/// # Errors
/// An internal error of the program.
pub fn text(
    axes: &[String],
    quantities: &[String],
    rows: &[StudyRow],
    fronts: &[Vec<usize>],
) -> Result<String> {
    let own = |name: &str| name.to_owned();
    // A study without axes uses the names of its members as its axis.
    let axes_shown: &[String] = if axes == ["member"] { &[] } else { axes };
    let mut columns = vec![own("member")];
    columns.extend(axes_shown.iter().cloned());
    columns.push(own("verdict"));
    for quantity in quantities {
        columns.extend([quantity.clone(), format!("{quantity} error")]);
    }
    columns.extend(COLUMNS[2..].iter().map(|name| own(name)));
    let fronts: Vec<String> = (0..rows.len())
        .map(|row| {
            let on = quantities.iter().zip(fronts).filter(|(_, front)| front.contains(&row));
            on.map(|(quantity, _)| quantity.as_str()).collect::<Vec<_>>().join(" ")
        })
        .collect();
    let cells = rows.iter().zip(&fronts).map(|(row, front)| cells_of(row, axes_shown.len(), front));
    whole(FILE, &columns, &cells.collect::<Vec<_>>())
}

fn cells_of<'a>(row: &'a StudyRow, axes: usize, front: &'a str) -> Vec<Cell<'a>> {
    let finite = |value: Option<f64>| Cell::from(value.filter(|value| value.is_finite()));
    let mut cells = vec![Cell::Text(&row.name)];
    cells.extend(row.labels.iter().take(axes).map(|label| Cell::Text(label)));
    cells.push(Cell::Text(row.state.name()));
    for (value, error) in row.values.iter().zip(&row.errors) {
        cells.extend([finite(*value), finite(*error)]);
    }
    let cost = &row.cost;
    if row.state == MemberState::Waiting {
        cells.extend([Cell::Absent; COLUMNS.len() - 2]);
        return cells;
    }
    cells.extend([
        Cell::Number(rounded(cost.cpu)),
        Cell::Number(rounded(cost.wall)),
        Cell::Count(cost.newton),
        Cell::Count(cost.krylov),
        Cell::Count(cost.steps),
        Cell::Count(cost.cuts),
        Cell::Count(cost.unknowns),
        finite(cost.memory.map(|memory| (memory * 10.0).round() / 10.0)),
        finite(cost.drift),
        Cell::Count(cost.ranks),
        Cell::Text(front),
        Cell::Text(&row.reason),
    ]);
    cells
}

/// Rounds to a tenth of a millisecond, the resolution of the measurement.
fn rounded(seconds: f64) -> f64 {
    (seconds * 1e4).round() / 1e4
}
