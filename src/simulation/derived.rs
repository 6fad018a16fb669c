//! `derived.csv`: quantities that the case derives from columns of the other tables.

use crate::assembly::ContactSystem;
use crate::case::{Case, Derived, Output};
use crate::error::Result;
use crate::model::Model;
use crate::observe::bodies::{BODY_COLUMNS, BodyReport};
use crate::observe::contact::{ContactColumn, ContactReport};
use crate::observe::energy::{ENERGY_COLUMNS, Energies, MOMENTUM_COLUMNS, Momentum};
use crate::observe::loads::{LOAD_COLUMNS, load_names};
use crate::observe::probes::{ProbeColumn, Watched, watch};
use crate::observe::quantity::{Cell, Column, ReportedQuantity};
use crate::observe::reactions::{REACTION_COLUMNS, Reaction};
use crate::observe::rigid::{RIGID_COLUMNS, RigidReport};
use crate::reader::complaint::Complaint;

/// Rows of all tables of one step, from which quantities are derived.
pub struct StepRows<'a, const D: usize> {
    /// Time at the end of the step \[s\].
    pub time: f64,
    /// The probes, with their cells.
    pub probes: (&'a [Watched<D>], &'a [Vec<Cell<'static>>]),
    /// The contacts.
    pub contacts: &'a [ContactReport],
    /// The supports.
    pub reactions: &'a [Reaction],
    /// The bodies of `rigid`.
    pub rigid: &'a [RigidReport],
    /// The deformable bodies, if the case requests their table.
    pub bodies: &'a [BodyReport],
    /// The loads, if the case requests their table.
    pub loads: &'a [Reaction],
    /// The energies.
    pub energies: &'a Energies,
    /// The momentum of all bodies.
    pub momentum: &'a Momentum,
}

/// Names of the columns of a table, without units.
fn names<'a, const D: usize>(quantities: impl Iterator<Item = &'a ReportedQuantity>) -> Vec<String> {
    quantities
        .flat_map(ReportedQuantity::headings::<D>)
        .map(|heading| without_unit(&heading).to_owned())
        .collect()
}

fn without_unit(heading: &str) -> &str {
    heading.split(" [").next().unwrap_or(heading)
}

fn names_of<const D: usize, S>(columns: &[Column<S>]) -> Vec<String> {
    names::<D>(columns.iter().map(|column| &column.quantity))
}

/// All columns to which an expression of the case may refer. Columns with words are not among them.
/// Before the probes are `watched`, all of them have the columns of contact.
fn known<const D: usize>(case: &Case, model: &Model<D>, watched: Option<&[Watched<D>]>) -> Vec<String> {
    let mut all = Vec::new();
    let mut add = |table: &str, rows: Vec<&str>, columns: Vec<String>| {
        for row in rows {
            all.extend(columns.iter().map(|column| format!("{table}.{row}.{column}")));
        }
    };
    let contact = names::<D>(ContactColumn::<D>::TABLE.iter().map(|column| &column.quantity));
    add("contact", model.contacts.iter().map(|contact| contact.name.as_str()).collect(), contact);
    let supports = model.supports.iter().map(|support| support.name.as_str());
    let springs = model.elastic_supports.iter().map(|support| support.name.as_str());
    let rollers = model.rollers.iter().map(|roller| roller.name.as_str());
    let ties = model.ties.iter().map(|tie| tie.name.as_str());
    let rows = supports.chain(rollers).chain(springs).chain(ties).collect();
    add("reactions", rows, names_of::<D, _>(REACTION_COLUMNS));
    let rigid = model.rigid.iter().map(|body| body.name.as_str()).collect();
    add("rigid", rigid, names_of::<D, _>(RIGID_COLUMNS));
    if case.output.bodies {
        let bodies = model.bodies.iter().map(|body| body.name.as_str()).collect();
        add("bodies", bodies, names_of::<D, _>(BODY_COLUMNS));
    }
    if case.output.loads {
        let loads = load_names(model.loads.iter().map(|load| load.name.as_str()));
        add("loads", loads, names_of::<D, _>(LOAD_COLUMNS));
    }
    match watched {
        None => {
            let columns = names::<D>(ProbeColumn::<D>::TABLE.iter().map(|column| &column.quantity));
            add("probes", model.probes.iter().map(|probe| probe.name.as_str()).collect(), columns);
        }
        Some(watched) => {
            let headings = watched.iter().flat_map(Watched::headings);
            all.extend(headings.map(|heading| format!("probes.{}", without_unit(&heading))));
        }
    }
    all.retain(|name| !(name.starts_with("probes.") && name.ends_with(".status")));
    all.extend(names_of::<D, _>(ENERGY_COLUMNS).iter().map(|name| format!("energy.{name}")));
    all.extend(names_of::<D, _>(MOMENTUM_COLUMNS).iter().map(|name| format!("momentum.{name}")));
    all
}

/// Checks that all columns in the derived quantities of the case exist.
///
/// # Errors
/// A column does not exist, at its position in the case. The hint lists those of the same row or table.
pub fn require_columns<const D: usize>(
    case: &Case,
    model: &Model<D>,
    watched: Option<&[Watched<D>]>,
) -> Result<()> {
    if case.output.derived.is_empty() {
        return Ok(());
    }
    let known = known(case, model, watched);
    for derived in case.output.derived.values() {
        let missing = derived.columns().iter().find(|(column, _)| !known.contains(column));
        if let Some((column, offset)) = missing {
            let complaint = unknown(column, &known, &case.output);
            return Err(case.complain(&complaint.at(derived.place).offset(*offset)));
        }
    }
    Ok(())
}

/// Checks that all columns in the derived quantities of the case exist, also those of the probes, of which
/// only those on a contactor have the columns of contact. Collective.
///
/// # Errors
/// See [`require_columns`]; the error is the same on all ranks.
pub fn require_derived<const D: usize>(
    system: &ContactSystem<D>,
    case: &Case,
    model: &Model<D>,
) -> Result<()> {
    if case.output.derived.is_empty() {
        return Ok(());
    }
    require_columns(case, model, Some(&watch(system, &model.probes)?))
}

/// The complaint about an unknown column: it lists the columns of its row, else the rows of its table,
/// else the tables.
fn unknown(column: &str, known: &[String], output: &Output) -> Complaint {
    let table = column.split('.').next().unwrap_or_default();
    let is_off = matches!(table, "bodies" if !output.bodies) || matches!(table, "loads" if !output.loads);
    if is_off {
        return Complaint::new(format!("'{column}' is in `{table}.csv`, which this case does not write"))
            .hint(format!("add `{table}: true` to `output`"));
    }
    let start = format!("{column}-");
    if let Some(name) = known.iter().find(|name| name.starts_with(&start)) {
        return Complaint::new(format!("unknown column '{column}': a name with a `-` needs backticks"))
            .hint(format!("write the reference in backticks, such as \"`{name}`\", or rename the item"));
    }
    let row = column.rsplit_once('.').map_or("", |(row, _)| row);
    let within = |prefix: &str| -> Vec<&str> {
        let inside =
            known.iter().filter(|name| name.strip_prefix(prefix).is_some_and(|rest| rest.starts_with('.')));
        inside.map(String::as_str).collect()
    };
    let of_row = within(row);
    if !of_row.is_empty() {
        return Complaint::unknown("column", column, of_row.into_iter());
    }
    let mut rows: Vec<&str> =
        within(table).iter().filter_map(|name| name.rsplit_once('.').map(|(row, _)| row)).collect();
    rows.dedup();
    if !rows.is_empty() {
        return Complaint::unknown("row", row, rows.into_iter());
    }
    let mut tables: Vec<&str> = known.iter().filter_map(|name| name.split('.').next()).collect();
    tables.dedup();
    Complaint::unknown("table", table, tables.into_iter())
}

/// The values of the derived quantities in a step. A value that is not finite is absent, and so is one
/// that depends on an absent value.
pub fn derived_cells<const D: usize>(derived: &[Derived], rows: &StepRows<'_, D>) -> Vec<Cell<'static>> {
    let value = |derived: &Derived| {
        let columns: Vec<f64> =
            derived.columns().iter().map(|(column, _)| rows.value(column).unwrap_or(f64::NAN)).collect();
        Some(derived.value(&columns, rows.time)).filter(|value| value.is_finite())
    };
    derived.iter().map(|derived| value(derived).into()).collect()
}

impl<const D: usize> StepRows<'_, D> {
    /// The number in a column; `None` if it is absent.
    fn value(&self, column: &str) -> Option<f64> {
        let (table, rest) = column.split_once('.')?;
        // Rows of springs, such as `ball.spring`, have a dot; columns have none, except those of probes.
        let (row, name) = rest.rsplit_once('.').unwrap_or(("", rest));
        match table {
            "contact" => {
                let report = self.contacts.iter().find(|report| report.name == row)?;
                let names = names::<D>(ContactColumn::<D>::TABLE.iter().map(|column| &column.quantity));
                number(&names, &report.cells::<D>(), name)
            }
            "reactions" => {
                of_row::<D, _>(REACTION_COLUMNS, self.reactions.iter().find(|own| own.name == row)?, name)
            }
            "rigid" => {
                of_row::<D, _>(RIGID_COLUMNS, self.rigid.iter().find(|own| own.state.name == row)?, name)
            }
            "bodies" => of_row::<D, _>(BODY_COLUMNS, self.bodies.iter().find(|own| own.name == row)?, name),
            "loads" => of_row::<D, _>(LOAD_COLUMNS, self.loads.iter().find(|own| own.name == row)?, name),
            "probes" => {
                let place = self.probes.0.iter().position(|probe| probe.name == row)?;
                let headings = self.probes.0[place].headings();
                let names: Vec<&str> = headings.iter().map(|heading| without_unit(heading)).collect();
                number(&names, self.probes.1.get(place)?, rest)
            }
            "energy" => of_row::<D, _>(ENERGY_COLUMNS, self.energies, name),
            "momentum" => of_row::<D, _>(MOMENTUM_COLUMNS, self.momentum, name),
            _ => None,
        }
    }
}

fn of_row<const D: usize, S>(columns: &[Column<S>], source: &S, name: &str) -> Option<f64> {
    let cells: Vec<Cell> = columns.iter().flat_map(|column| column.cells::<D>(source)).collect();
    number(&names_of::<D, _>(columns), &cells, name)
}

fn number(names: &[impl AsRef<str>], cells: &[Cell], name: &str) -> Option<f64> {
    let place = names.iter().position(|known| known.as_ref() == name)?;
    match cells.get(place)? {
        Cell::Number(value) => Some(*value),
        Cell::Count(count) => Some(*count as f64),
        Cell::Text(_) | Cell::Absent => None,
    }
}
