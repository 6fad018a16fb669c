//! Curves from a table of a study: one column over another, with a curve for each word of a third.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::output::folder::{record, write_whole};
use crate::output::io_error::unwritable;

use super::axis::{AxisQuantity, Scale};
use super::chart::{Curve, Figure, Panel};
use super::csv::Csv;
use super::results::damage;
use super::style::Stroke;

/// Half the size of the mark at a point. Marks are used because curves of studies have few points.
const MARK: f64 = 3.0;

/// Selection of what to draw from a table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableFigure {
    /// The table.
    pub table: PathBuf,
    /// Column of the horizontal axis.
    pub x: String,
    /// Column of the vertical axis.
    pub y: String,
    /// Column that divides the rows into curves.
    pub by: String,
    /// Column that divides the rows into panels.
    pub panels: Option<String>,
    /// Columns with the words that select the rows to draw.
    pub only: Vec<(String, Vec<String>)>,
    /// Columns with accepted words; a row with any other word is a gap.
    pub valid: Vec<(String, Vec<String>)>,
    /// Whether the horizontal and the vertical axis are logarithmic.
    pub logarithmic: [bool; 2],
    /// Title.
    pub title: String,
}

/// Draws a figure of a table into a file. Returns notes on what was left out, one line each.
///
/// # Errors
/// The table, a column or a number is missing, nothing is left to draw, or the file can not be
/// written.
pub fn draw_table(wanted: &TableFigure, file: &Path) -> Result<Vec<String>> {
    let csv = Csv::read(&wanted.table)?;
    let csv =
        csv.ok_or_else(|| Error::file(format!("{}: the table does not exist", wanted.table.display())))?;
    let mut notes = Vec::new();
    let svg = figure(wanted, &csv, &mut notes)?.svg()?;
    if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
    }
    write_whole(file, svg.as_bytes())?;
    if csv.is_cut {
        notes.push(format!("{}: the last row has no line end and is omitted", wanted.table.display()));
    }
    let folder = wanted.table.parent().unwrap_or(Path::new(""));
    let name = wanted.table.file_name().unwrap_or_default().to_string_lossy();
    notes.extend(damage(&record(folder), &name, &wanted.table));
    Ok(notes)
}

/// Maximum number of curves, and of panels, of a figure.
///
/// A numeric column that is used for labels has a different word in every row, and a figure with
/// thousands of curves or panels is useless. The limit is well above what a reader can distinguish,
/// so that it refuses only such mistakes. Half or twice of it has the same effect.
const MOST: usize = 200;

/// One row that is drawn.
struct Point<'a> {
    /// Line number in the table.
    line: usize,
    panel: &'a str,
    curve: &'a str,
    at: [f64; 2],
}

/// Builds the figure. What was left out is reported in `notes`.
fn figure(wanted: &TableFigure, csv: &Csv, notes: &mut Vec<String>) -> Result<Figure> {
    let mut points = points(wanted, csv, notes)?;
    for (axis, column) in [&wanted.x, &wanted.y].into_iter().enumerate() {
        // A value that is not positive has no logarithm.
        let negative = |point: &&mut Point| wanted.logarithmic[axis] && point.at[axis] <= 0.0;
        let lines: Vec<usize> = points
            .iter_mut()
            .filter(negative)
            .map(|point| {
                point.at[axis] = f64::NAN;
                point.line
            })
            .collect();
        notes.extend(left_out(wanted, column, "not positive, and the axis is logarithmic", &lines));
    }
    if !points.iter().any(|point| point.at.iter().all(|value| value.is_finite())) {
        let message = format!("{}: no rows remain to draw", wanted.table.display());
        return Err(Error::file(message).hint("check the requested columns and values"));
    }
    let curves = distinct(points.iter().map(|point| point.curve));
    let panels = distinct(points.iter().map(|point| point.panel));
    if curves.len().max(panels.len()) > MOST {
        let column = if curves.len() > MOST { Some(&wanted.by) } else { wanted.panels.as_ref() };
        let column = column.map_or("", String::as_str);
        let text = format!(
            "{}: the column `{column}` has more than {MOST} different values: too many for a figure",
            wanted.table.display()
        );
        return Err(Error::file(text).hint("group the rows by another column, or select some with --where"));
    }
    let stroke = |index: usize| Stroke { mark: MARK, ..Stroke::of(index) };
    let panels = panels.into_iter().map(|panel| {
        let of = |curve: &str| {
            let own = points.iter().filter(|point| point.panel == panel && point.curve == curve);
            let mut own: Vec<[f64; 2]> = own.map(|point| point.at).collect();
            own.sort_by(|a, b| a[0].total_cmp(&b[0]));
            own
        };
        let curves = curves.iter().enumerate();
        let curves = curves.map(|(index, curve)| Curve { points: of(curve), stroke: stroke(index) });
        let across = if panel.is_empty() { wanted.x.clone() } else { format!("{panel}: {}", wanted.x) };
        let x = quantity(across, wanted.logarithmic[0]);
        let y = quantity(wanted.y.clone(), wanted.logarithmic[1]);
        Panel { x, y, curves: curves.collect(), at_least: Vec::new(), labels: Vec::new() }
    });
    let panels: Vec<Panel> = panels.collect();
    let legend = curves.iter().enumerate().map(|(index, curve)| (curve.to_string(), stroke(index))).collect();
    let columns = panels.len().min(2);
    Ok(Figure { title: wanted.title.clone(), legend, panels, columns })
}

fn quantity(name: String, logarithmic: bool) -> AxisQuantity {
    let scale = if logarithmic { Scale::Logarithmic } else { Scale::Linear };
    AxisQuantity { scale, ..AxisQuantity::new(name, "") }
}

/// A note about values that are left out, in these lines of the table.
fn left_out(wanted: &TableFigure, column: &str, why: &str, lines: &[usize]) -> Option<String> {
    let first = lines.first()?;
    let count = lines.len();
    let (values, are) = if count == 1 { ("value", "is") } else { ("values", "are") };
    Some(format!(
        "{}: {count} {values} of column `{column}` {are} omitted ({why}), the first in line {first}",
        wanted.table.display()
    ))
}

/// The requested rows. A value that is not finite is a gap, with a note unless its field is empty.
fn points<'a>(wanted: &TableFigure, csv: &'a Csv, notes: &mut Vec<String>) -> Result<Vec<Point<'a>>> {
    let absent = |column: &str| {
        let columns = csv.columns().join(", ");
        Error::file(format!("{}: there is no column `{column}`", wanted.table.display()))
            .hint(&format!("known: {columns}"))
    };
    let numbers = |column: &str| csv.numbers(column)?.ok_or_else(|| absent(column));
    let words = |column: &str| csv.words(column).ok_or_else(|| absent(column));
    let conditions = |conditions: &[(String, Vec<String>)]| -> Result<Vec<bool>> {
        let mut holds = vec![true; words(&wanted.by)?.len()];
        for (column, values) in conditions {
            for (hold, word) in holds.iter_mut().zip(words(column)?) {
                *hold &= values.iter().any(|value| value == word);
            }
        }
        Ok(holds)
    };
    let (x, y, curves) = (numbers(&wanted.x)?, numbers(&wanted.y)?, words(&wanted.by)?);
    let panels = wanted.panels.as_deref().map(words).transpose()?.unwrap_or_else(|| vec![""; x.len()]);
    let (drawn, valid) = (conditions(&wanted.only)?, conditions(&wanted.valid)?);
    for (column, values) in [(&wanted.x, &x), (&wanted.y, &y)] {
        let written = words(column)?;
        let is_lost =
            |&row: &usize| drawn[row] && valid[row] && !values[row].is_finite() && !written[row].is_empty();
        let lines: Vec<usize> = (0..values.len()).filter(is_lost).map(|row| csv.line(row)).collect();
        notes.extend(left_out(wanted, column, "not finite", &lines));
    }
    let point = |row: usize| {
        let upward = if valid[row] { y[row] } else { f64::NAN };
        Point { line: csv.line(row), panel: panels[row], curve: curves[row], at: [x[row], upward] }
    };
    Ok((0..x.len()).filter(|&row| drawn[row]).map(point).collect())
}

/// The distinct words in the order of their first appearance.
fn distinct<'a>(words: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = std::collections::HashSet::new();
    words.filter(|word| seen.insert(*word)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::tests::Scratch;

    const TABLE: &str = "scene,mu,way,solves,code\n\
        a,1,direct,3,0\na,0.1,direct,2,0\na,1,cg,9,0\na,2,cg,,5\na,4,cg,20,5\nb,1,direct,4,0\nc,7,direct,1,0\n";

    fn wanted(path: &Path) -> TableFigure {
        TableFigure {
            table: path.into(),
            x: "mu".into(),
            y: "solves".into(),
            by: "way".into(),
            panels: Some("scene".into()),
            only: vec![("scene".into(), vec!["a".into(), "b".into()])],
            valid: vec![("code".into(), vec!["0".into()])],
            logarithmic: [true, false],
            title: "Solves".into(),
        }
    }

    /// Rows are divided into panels and curves and sorted along the horizontal axis. Rows that are
    /// not selected are left out, and failed ones are gaps.
    #[test]
    fn rows_become_curves() {
        let scratch = Scratch::new("chart");
        let path = scratch.0.join("a.csv");
        std::fs::write(&path, TABLE).unwrap();
        let wanted = wanted(&path);
        let csv = Csv::read(&path).unwrap().unwrap();
        let drawn = figure(&wanted, &csv, &mut Vec::new()).unwrap();
        assert_eq!(drawn.panels.len(), 2);
        assert_eq!(drawn.panels[0].curves[0].points, [[0.1, 2.0], [1.0, 3.0]]);
        let cg = &drawn.panels[0].curves[1].points;
        assert!(cg.len() == 3 && cg[0] == [1.0, 9.0] && cg[1][1].is_nan() && cg[2][1].is_nan(), "{cg:?}");
        assert_eq!(drawn.legend.iter().map(|(name, _)| &name[..]).collect::<Vec<_>>(), ["direct", "cg"]);
        assert_eq!(drawn.panels[1].x.name, "b: mu");
        draw_table(&wanted, &scratch.0.join("figures/a.svg")).unwrap();
        assert!(std::fs::read_to_string(scratch.0.join("figures/a.svg")).unwrap().contains("Solves"));
    }

    /// The error for a missing column lists the existing columns. A table without rows to draw is
    /// an error.
    #[test]
    fn says_what_is_missing() {
        let scratch = Scratch::new("chart-missing");
        let path = scratch.0.join("a.csv");
        assert!(draw_table(&wanted(&path), &path).unwrap_err().message.contains("the table does not exist"));
        std::fs::write(&path, TABLE).unwrap();
        let error =
            |wanted: TableFigure| draw_table(&wanted, &scratch.0.join("a.svg")).unwrap_err().to_string();
        let text = error(TableFigure { y: "sovles".into(), ..wanted(&path) });
        assert!(text.contains("`sovles`") && text.contains("solves"), "{text}");
        let many: String = (0..300).map(|k| format!("a,{k},w{k},1,0\n")).collect();
        std::fs::write(&path, format!("scene,mu,way,solves,code\n{many}")).unwrap();
        assert!(error(wanted(&path)).contains("`way` has more than 200 different values"));
        std::fs::write(&path, "scene,mu,way,solves,code\na,-1,direct,3,0\n").unwrap();
        assert!(error(wanted(&path)).contains("no rows"), "a negative number has no logarithm");
        std::fs::write(&path, format!("{TABLE}a,9,direct,7,0")).unwrap();
        let notes = draw_table(&wanted(&path), &scratch.0.join("a.svg")).unwrap();
        assert!(notes.len() == 1 && notes[0].contains("the last row"), "{notes:?}");
        std::fs::write(&path, format!("{TABLE}a,0.5,cg,nan,0\na,0.6,cg,1e400,0\na,0,cg,1,0\n")).unwrap();
        let notes = draw_table(&wanted(&path), &scratch.0.join("a.svg")).unwrap();
        assert!(
            notes.len() == 2 && notes[0].contains("2 values of column `solves` are omitted"),
            "{notes:?}"
        );
        assert!(notes[0].contains("line 9") && notes[1].contains("1 value of column `mu`"), "{notes:?}");
        let nothing = TableFigure { only: vec![("scene".into(), vec!["d".into()])], ..wanted(&path) };
        assert!(error(nothing).contains("no rows"));
    }

    /// A table that lacks rows, according to the record of its run, is drawn with a note, even if
    /// it ends with a complete row.
    #[test]
    fn rows_that_the_record_proves_are_missed() {
        use sha2::Digest;
        let scratch = Scratch::new("chart-proof");
        let path = scratch.0.join("a.csv");
        let hash: String = sha2::Sha256::digest(TABLE).iter().map(|byte| format!("{byte:02x}")).collect();
        let bytes = TABLE.len();
        let mark =
            format!(r#"{{"tables": {{"a.csv": {{"rows": 7, "bytes": {bytes}, "sha256": "{hash}"}}}}}}"#);
        std::fs::write(scratch.0.join("run.json"), mark).unwrap();
        std::fs::write(&path, TABLE).unwrap();
        let draw = || draw_table(&wanted(&path), &scratch.0.join("a.svg")).unwrap();
        assert_eq!(draw(), Vec::<String>::new());
        std::fs::write(&path, TABLE.replace("c,7,direct,1,0\n", "")).unwrap();
        let notes = draw();
        assert!(notes.len() == 1 && notes[0].contains("rows are missing"), "{notes:?}");
    }
}
