//! The reference page of all columns and fields of a results folder, from their tables.

use super::fields::GRID_FIELDS;
use super::iterations::ITERATION_COLUMNS;
use crate::observe::bodies::{BODY_COLUMNS, BODY_FILE};
use crate::observe::contact::{CONTACT_FILE, ContactColumn};
use crate::observe::energy::{ENERGY_COLUMNS, ENERGY_FILE, MOMENTUM_COLUMNS, MOMENTUM_FILE};
use crate::observe::fields::{ContactField, ELEMENT_FIELDS, NODAL_STRESS_FIELDS, NODE_FIELDS, STRESS_FIELDS};
use crate::observe::lines::{LINE_COLUMNS, LINE_FILE};
use crate::observe::loads::{LOAD_COLUMNS, LOAD_FILE};
use crate::observe::probes::{PROBE_FILE, ProbeColumn, ProbeValue};
use crate::observe::quantity::{DERIVED, DERIVED_FILE, QuantityShape, ReportedQuantity, TableFile};
use crate::observe::reactions::{REACTION_COLUMNS, REACTION_FILE};
use crate::observe::rigid::{RIGID_COLUMNS, RIGID_FILE};
use crate::observe::rigid_surfaces::RIGID_DISPLACEMENT;

const HEAD: &str = "\
# Columns and fields

Every column of every table and every field of a results folder, with units in SI. A case with other
units has those in its headings. `contact-petsc list --results` prints this page. The
[results folder](results.md) explains the files.
";

/// The page, in Markdown.
pub fn results_reference() -> String {
    let mut page = HEAD.to_owned();
    let probes = ProbeColumn::<3>::TABLE.iter().map(|column| {
        let place = match column.value {
            ProbeValue::Field(_) => "every probe",
            ProbeValue::Contact(_) => "probes on a contactor",
        };
        (column.quantity, place)
    });
    table(&mut page, &PROBE_FILE, "NAME.", "Where", probes);
    let both = ContactColumn::<2>::TABLE.iter().zip(ContactColumn::<3>::TABLE);
    let contact = both.map(|(plane, space)| {
        let (plane, own) = (plane.value.about(), space.value.about());
        (space.quantity, if plane == own { own.to_owned() } else { format!("{plane}; in 3D {own}") })
    });
    table(&mut page, &CONTACT_FILE, "", "Over the points", contact);
    let plain = |quantity: ReportedQuantity| (quantity, "");
    let reactions = REACTION_COLUMNS.iter().map(|column| plain(column.quantity));
    table(&mut page, &REACTION_FILE, "", "", reactions);
    table(&mut page, &RIGID_FILE, "", "", RIGID_COLUMNS.iter().map(|column| plain(column.quantity)));
    table(&mut page, &BODY_FILE, "", "", BODY_COLUMNS.iter().map(|column| plain(column.quantity)));
    table(&mut page, &LOAD_FILE, "", "", LOAD_COLUMNS.iter().map(|column| plain(column.quantity)));
    table(&mut page, &LINE_FILE, "", "", LINE_COLUMNS.iter().map(|column| plain(column.quantity)));
    table(&mut page, &ENERGY_FILE, "", "", ENERGY_COLUMNS.iter().map(|column| plain(column.quantity)));
    table(&mut page, &MOMENTUM_FILE, "", "", MOMENTUM_COLUMNS.iter().map(|column| plain(column.quantity)));
    table(&mut page, &DERIVED_FILE, "", "", [plain(DERIVED)].into_iter());
    let iterations = TableFile { name: "iterations.csv", rows: "one per iteration", keys: &[] };
    table(&mut page, &iterations, "", "", ITERATION_COLUMNS.iter().map(|column| plain(column.quantity)));
    fields(&mut page);
    page
}

fn table(
    page: &mut String,
    file: &TableFile,
    prefix: &str,
    more: &str,
    columns: impl Iterator<Item = (ReportedQuantity, impl AsRef<str>)>,
) {
    page.push_str(&format!("\n## `{}`\n\nRows: {}.\n\n", file.name, file.rows));
    let row = |page: &mut String, cells: [&str; 4]| {
        let cells = if more.is_empty() { &cells[..3] } else { &cells[..] };
        page.push_str(&format!("| {} |\n", cells.join(" | ")));
    };
    row(page, ["Column", "Unit", "Meaning", more]);
    row(page, ["---"; 4]);
    for key in file.keys {
        row(page, [&names(key, ""), key.unit, key.about, ""]);
    }
    for (quantity, note) in columns {
        row(page, [&names(&quantity, prefix), quantity.unit, quantity.about, note.as_ref()]);
    }
}

/// The names of a quantity's columns.
fn names(quantity: &ReportedQuantity, prefix: &str) -> String {
    let name = |axis: &str| format!("`{prefix}{}_{axis}`", quantity.name);
    match quantity.components {
        QuantityShape::One => format!("`{prefix}{}`", quantity.name),
        QuantityShape::Rotations => format!("{}, in 3D also {}, {}", name("z"), name("x"), name("y")),
        _ => format!("{}, {}, in 3D also {}", name("x"), name("y"), name("z")),
    }
}

fn fields(page: &mut String) {
    page.push_str(
        "\n## Fields\n\nWith `format: vtkhdf` the files are `fields.vtkhdf`, `contact.vtkhdf` and `rigid.vtkhdf` instead \
         of\n`fields.pvd`, `contact.pvd` and `rigid.pvd`.\n",
    );
    page.push_str("\n| Field | File | At | Unit | Meaning |\n| --- | --- | --- | --- | --- |\n");
    let mut row = |file: &str, at: &str, quantity: &ReportedQuantity| {
        let ReportedQuantity { name, unit, about, .. } = quantity;
        page.push_str(&format!("| `{name}` | {file} | {at} | {unit} | {about} |\n"));
    };
    for field in NODE_FIELDS {
        let file = if field.on_surfaces { "`fields.pvd`, `contact.pvd`" } else { "`fields.pvd`" };
        row(file, "nodes", &field.quantity);
    }
    let stresses = "`fields.pvd`, with `stresses: true`";
    NODAL_STRESS_FIELDS.iter().for_each(|field| row(stresses, "nodes", &field.quantity));
    ELEMENT_FIELDS.iter().for_each(|field| row("`fields.pvd`", "elements", &field.quantity));
    STRESS_FIELDS.iter().for_each(|field| row(stresses, "elements", &field.quantity));
    ContactField::<3>::TABLE.iter().for_each(|field| row("`contact.pvd`", "nodes", &field.quantity));
    row("`rigid.pvd`", "nodes", &RIGID_DISPLACEMENT);
    GRID_FIELDS.iter().for_each(|(file, at, quantity)| row(file, at, quantity));
}
