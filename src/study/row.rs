//! Results of a member: its cost, its quantities, and their errors against the reference.

use std::path::Path;

use serde_json::Value;

use super::file::{KnownReference, Measure, Study, StudyQuantity};
use super::plan::{Member, REFERENCE};
use super::series::{Interval, TimeSeries};
use crate::case::{At, Named, Units};
use crate::error::{Cause, Error, Result};
use crate::output::folder::record;
use crate::plot::Csv;

/// State of a member.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemberState {
    /// Not run yet, or interrupted.
    Waiting,
    /// Completed.
    Completed,
    /// Ended early for a reason specific to the member.
    Failed,
}

impl MemberState {
    /// The word in `study.csv`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Completed => "completed",
            Self::Failed => "failed",
        }
    }
}

/// Cost of a member. Values are sums over ranks unless stated otherwise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cost {
    /// Processor time in user mode \[s\].
    pub cpu: f64,
    /// Wall time \[s\].
    pub wall: f64,
    /// Newton iterations.
    pub newton: u64,
    /// Krylov iterations.
    pub krylov: u64,
    /// Completed steps.
    pub steps: u64,
    /// Cuts of steps.
    pub cuts: u64,
    /// Unknowns per step.
    pub unknowns: u64,
    /// Sum of the peak memory of all ranks \[MiB\], as measured for a separate run of this member,
    /// including libraries; `None` if it is unknown for a rank.
    pub memory: Option<f64>,
    /// Number of ranks.
    pub ranks: u64,
    /// Largest numerical energy over the largest total energy or external work; `None` without a
    /// table of energies.
    pub drift: Option<f64>,
}

impl Cost {
    /// Total number of unknowns of all steps.
    pub fn size(&self) -> f64 {
        self.unknowns as f64 * self.steps as f64
    }
}

/// A member and its results.
#[derive(Debug, Clone)]
pub struct StudyRow {
    /// Its name.
    pub name: String,
    /// Labels of its values, one per axis.
    pub labels: Vec<String>,
    /// Its state.
    pub state: MemberState,
    /// Reason of its failure, in one line.
    pub reason: String,
    /// Its cost.
    pub cost: Cost,
    /// Its curves, one per quantity.
    curves: Vec<Option<TimeSeries>>,
    /// Its values, one per quantity.
    pub values: Vec<Option<f64>>,
    /// Relative errors, one per quantity.
    pub errors: Vec<Option<f64>>,
    /// Whether it is the reference for the other members, one entry per quantity. Its own error is
    /// then meaningless.
    pub is_measure: Vec<bool>,
}

impl StudyRow {
    /// The row of a member that has not been run.
    pub fn waiting(member: &Member, quantities: usize) -> Self {
        Self::blank(member.name.clone(), member.labels.clone(), quantities)
    }

    /// A row with the given name and no results.
    pub(super) fn blank(name: String, labels: Vec<String>, quantities: usize) -> Self {
        Self {
            name,
            labels,
            state: MemberState::Waiting,
            reason: String::new(),
            cost: Cost::default(),
            curves: vec![None; quantities],
            values: vec![None; quantities],
            errors: vec![None; quantities],
            is_measure: vec![false; quantities],
        }
    }

    /// Reads the results of a member. Errors against the reference are computed later.
    ///
    /// # Errors
    /// A table can not be read, or it lacks a column, which means that the study is invalid.
    pub fn read(member: &Member, folder: &Path, study: &Study) -> Result<Self> {
        let record = record(folder);
        let mut row = Self::waiting(member, study.quantities.value.len());
        row.state = match record["verdict"].as_str() {
            Some("completed") => MemberState::Completed,
            Some("failed" | "stopped") => MemberState::Failed,
            _ => return Ok(row),
        };
        row.reason = one_line(record["reason"].as_str().unwrap_or_default());
        row.cost = cost(&record, folder)?;
        for (index, (_, quantity)) in study.quantities.value.iter().enumerate() {
            let curve = curve(quantity, folder, study, member.case.units)?;
            if row.state == MemberState::Completed {
                row.values[index] = curve
                    .as_ref()
                    .and_then(|curve| curve.measured(quantity.measure.value, interval(quantity)));
                row.curves[index] = curve;
            }
        }
        Ok(row)
    }
}

fn cost(record: &Value, folder: &Path) -> Result<Cost> {
    let count = |key: &str| record[key].as_u64().unwrap_or(0);
    let sum = |list: &Value| -> f64 { list.as_array().into_iter().flatten().filter_map(Value::as_f64).sum() };
    Ok(Cost {
        cpu: sum(&record["balance"]["cpu_seconds"]),
        wall: record["wall_seconds"].as_f64().unwrap_or(0.0),
        newton: count("newton_iterations"),
        krylov: count("krylov_iterations"),
        steps: count("steps"),
        cuts: count("cut_steps"),
        unknowns: count("unknowns"),
        memory: memory(&record["peak_memory_bytes"]),
        ranks: count("ranks"),
        drift: drift(&folder.join("energy.csv"), Units::of_record(record))?,
    })
}

/// Sum of the peaks of all ranks \[MiB\]; `None` if one is unknown.
fn memory(peaks: &Value) -> Option<f64> {
    let peaks: Vec<f64> = peaks.as_array()?.iter().filter_map(Value::as_f64).collect();
    let known = !peaks.is_empty() && peaks.iter().all(|peak| *peak > 0.0);
    known.then(|| peaks.iter().sum::<f64>() / f64::from(1 << 20))
}

/// Largest unexplained energy of the balance over the largest of total energy and external work.
fn drift(path: &Path, units: Units) -> Result<Option<f64>> {
    let Some(csv) = Csv::read(path)? else { return Ok(None) };
    let largest = |column: &str| -> Result<f64> {
        let values = csv.numbers(&units.heading(column))?.unwrap_or_default();
        Ok(values.iter().filter(|v| v.is_finite()).fold(0.0, |most, v| v.abs().max(most)))
    };
    let size = largest("total [J]")?.max(largest("external_work [J]")?);
    Ok((size > 0.0).then_some(largest("numerical [J]")? / size))
}

fn curve(quantity: &StudyQuantity, folder: &Path, study: &Study, units: Units) -> Result<Option<TimeSeries>> {
    let only: Vec<(&str, &str)> =
        quantity.only.iter().map(|(column, word)| (column.value.as_str(), word.value.as_str())).collect();
    let path = folder.join(&quantity.table.value);
    TimeSeries::read(&path, &quantity.column.value, &only, units).map_err(|error| match error.cause {
        Cause::Case => at_quantity(study, quantity, &error),
        _ => error,
    })
}

/// Adds the position in the study to an error about a column.
fn at_quantity(study: &Study, quantity: &StudyQuantity, error: &Error) -> Error {
    let (message, hint) = error.message.split_once("\nhint: ").unwrap_or((&error.message, ""));
    study.error(quantity.column.place, message, hint)
}

/// First line of a reason.
fn one_line(reason: &str) -> String {
    reason.lines().next().unwrap_or_default().trim().to_owned()
}

/// First and last instant of a quantity \[s\].
fn interval(quantity: &StudyQuantity) -> Interval {
    quantity.between.as_ref().map(|between| between.value.map(|time| time.value))
}

/// The references of the quantities.
#[derive(Debug, Clone)]
pub struct References(Vec<Option<Standard>>);

#[derive(Debug, Clone)]
enum Standard {
    Value(f64),
    Curve(TimeSeries),
}

impl References {
    /// Reads the reference tables given in the study, for results in `units`.
    ///
    /// # Errors
    /// A table is missing or lacks a column.
    pub fn read(study: &Study, units: Units) -> Result<Self> {
        let standard = |quantity: &StudyQuantity| match &quantity.reference {
            None => Ok(None),
            Some(At { value: KnownReference::Value(value), .. }) => Ok(Some(Standard::Value(value.value))),
            Some(At { value: KnownReference::Csv(file), .. }) => {
                let path = study.source().directory.join(&file.value);
                let absent =
                    |error: String| study.error(file.place, error, "paths are relative to the study file");
                if Csv::read(&path).is_ok_and(|csv| csv.is_some_and(|csv| csv.is_cut)) {
                    return Err(absent(format!(
                        "{}: its last line has no line end: the file may be truncated",
                        path.display()
                    )));
                }
                let read = TimeSeries::read(&path, &quantity.column.value, &[], units)
                    .map_err(|e| absent(e.message))?;
                let curve = read.filter(|curve| !curve.is_empty());
                let curve = curve.ok_or_else(|| absent(format!("{}: no reference curve", path.display())))?;
                Ok(Some(Standard::Curve(curve)))
            }
        };
        study.quantities.value.values().map(standard).collect::<Result<_>>().map(Self)
    }

    /// Whether errors in a quantity may still change, because they are relative to the finest
    /// member so far.
    pub fn is_provisional(&self, index: usize, rows: &[StudyRow]) -> bool {
        let has_own = rows.iter().any(|row| row.name == REFERENCE);
        self.0[index].is_none() && !has_own && rows.iter().any(|row| row.state == MemberState::Waiting)
    }

    /// Computes the errors of all rows. Quantities without a separate reference are compared with
    /// the reference of the study.
    pub fn compare(&self, rows: &mut [StudyRow], quantities: &Named<StudyQuantity>) {
        let finest = finest(rows);
        for (index, quantity) in quantities.values().enumerate() {
            let measure = quantity.measure.value;
            let own = self.0[index].clone();
            let is_own = own.is_some();
            let standard = own.or_else(|| {
                let row = &rows[finest?];
                match measure {
                    Measure::L2 => row.curves[index].clone().map(Standard::Curve),
                    _ => row.values[index].map(Standard::Value),
                }
            });
            for (position, row) in rows.iter_mut().enumerate() {
                row.is_measure[index] = !is_own && finest == Some(position);
                row.errors[index] =
                    standard.as_ref().and_then(|standard| error(row, index, quantity, standard));
            }
        }
    }
}

fn error(row: &StudyRow, index: usize, quantity: &StudyQuantity, standard: &Standard) -> Option<f64> {
    let measure = quantity.measure.value;
    let interval = interval(quantity);
    let scale = quantity.scale.map(|scale| scale.value);
    let target = match standard {
        Standard::Value(value) => *value,
        Standard::Curve(other) if measure == Measure::L2 => {
            return row.curves[index].as_ref()?.distance(other, interval, scale);
        }
        Standard::Curve(other) => other.measured(measure, interval)?,
    };
    let size = scale.unwrap_or(target.abs());
    (size > 0.0).then_some((row.values[index]? - target).abs() / size)
}

/// The separate run of the reference, or else the completed member with the largest product of
/// unknowns and steps.
fn finest(rows: &[StudyRow]) -> Option<usize> {
    let completed = |k: &usize| rows[*k].state == MemberState::Completed;
    match rows.iter().position(|row| row.name == REFERENCE) {
        Some(own) => Some(own).filter(completed),
        None => (0..rows.len())
            .filter(completed)
            .max_by(|&a, &b| rows[a].cost.size().total_cmp(&rows[b].cost.size()).then(b.cmp(&a))),
    }
}
