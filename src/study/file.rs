//! `study.yml`: a case, what is varied in it, what is looked at, and what it is compared with.

use schemars::JsonSchema;
use serde::Deserialize;

use super::columns::COLUMNS;
use crate::case::{At, Named, Place, Units};
use crate::error::{Error, Result};
use crate::reader::complaint::Complaint;
use crate::reader::document::{Document, read_as};
use crate::reader::node::{Node, Tree};
use crate::reader::quantity::{Duration, Number};
use crate::reader::source::Source;
use crate::reader::tagged::tagged;

/// A study as written in `study.yml`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Description of the study.
    #[serde(default)]
    pub title: Option<String>,
    /// The case file, relative to the study file.
    pub case: At<String>,
    /// Values for all members by their paths in the case, such as `time.end` or
    /// `bodies.block.mesh.box.cells[0]`; `null` removes a key.
    #[serde(default)]
    pub set: Named<Node>,
    /// Axes; the members are all combinations of their values.
    #[serde(default)]
    pub sweep: Named<SweepAxis>,
    /// Further members by name, each with its own values.
    #[serde(default)]
    pub members: Named<Named<Node>>,
    /// Reference of the quantities that have none of their own.
    #[serde(default)]
    pub reference: Option<At<Reference>>,
    /// Quantities of interest, by name.
    pub quantities: At<Named<StudyQuantity>>,
    /// Relative errors for which advice is given, > 0; 10, 1 and 0.1 % if absent.
    #[serde(default = "targets")]
    pub accuracy: At<Vec<Number>>,
    /// The text, for errors that are found later.
    #[serde(skip)]
    source: Source,
}

fn targets() -> At<Vec<Number>> {
    [0.1, 0.01, 0.001].map(Number::new).to_vec().into()
}

/// An axis of the grid: one key with values, or choices that set several keys at once.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepAxis {
    /// Path of the key that receives the `values`.
    #[serde(default)]
    pub key: Option<At<String>>,
    /// A list of values, or a mapping from labels to values.
    #[serde(default)]
    #[schemars(schema_with = "list_or_mapping")]
    pub values: Option<Node>,
    /// Choices by name, each with values by their paths.
    #[serde(default)]
    pub choices: Option<Named<Named<Node>>>,
}

/// What the schema says of the values of an axis.
fn list_or_mapping(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    schemars::json_schema!({ "anyOf": [
        { "type": "array", "items": true },
        { "type": "object", "additionalProperties": true },
        { "type": "null" },
    ] })
}

/// Reference of the members.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Reference")]
pub enum Reference {
    /// The completed member with the most unknowns times steps.
    Finest,
    /// A separate run, with values by their paths in addition to `set`.
    Member(Named<Node>),
}

/// A quantity of interest.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyQuantity {
    /// A table of the results: `probes.csv`, `contact.csv`, `reactions.csv`, `rigid.csv`,
    /// `bodies.csv`, `loads.csv`, `derived.csv`, `energy.csv`, `momentum.csv`.
    pub table: At<String>,
    /// Column, with its unit as in the header.
    pub column: At<String>,
    /// Selection of rows by values of their columns, such as `{ boundary: clamp }`.
    #[serde(default, rename = "where")]
    pub only: Named<At<String>>,
    /// How the column is reduced to a quantity.
    pub measure: At<Measure>,
    /// First and last instant that are used, in the unit of time of the case; all if absent.
    #[serde(default)]
    pub between: Option<At<[Duration; 2]>>,
    /// Size to which errors are relative, > 0, in the unit of the column; the size of the reference
    /// if absent.
    #[serde(default)]
    pub scale: Option<Number>,
    /// Reference of this quantity, instead of that of the study.
    #[serde(default)]
    pub reference: Option<At<KnownReference>>,
}

/// How a column over time is reduced to a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Measure")]
pub enum Measure {
    /// Its value at an instant, in the unit of time of the case, interpolated between two rows.
    At(Duration),
    /// Its last value.
    Last,
    /// Its largest value.
    Maximum,
    /// Its smallest value.
    Minimum,
    /// The whole curve: the error is the L2 norm over time of the difference from the reference's curve.
    L2,
}

/// Reference of a quantity.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Known")]
pub enum KnownReference {
    /// A value, in the unit of the column.
    Value(Number),
    /// A table with a column `time [s]`, or the case's unit of time instead of s, and the column of
    /// the quantity, relative to the study file.
    Csv(At<String>),
}

tagged!(read Reference, "reference");
tagged!(read Measure, "measure");
tagged!(read KnownReference, "reference");

/// Tables of a results folder that have a row a step.
pub const TABLES: [&str; 9] = [
    "probes.csv",
    "contact.csv",
    "reactions.csv",
    "rigid.csv",
    "bodies.csv",
    "loads.csv",
    "derived.csv",
    "energy.csv",
    "momentum.csv",
];

impl Study {
    /// Reads and checks the text of a study; errors show the name, and its folder is the
    /// base of relative paths.
    ///
    /// # Errors
    /// What is wrong, as `name:line:column: message`, with the line itself and a hint.
    pub fn parse(text: &str, name: &std::path::Path) -> Result<Self> {
        Self::parse_in(text, name, Units::SI)
    }

    /// The same for a study of a case with these units: plain instants are in its unit of time.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_in(text: &str, name: &std::path::Path, units: Units) -> Result<Self> {
        let source = Source::new(text, name);
        let study: Self = read_as(1, &source, Some(units), Self::complaints)?;
        Ok(Self { source, ..study })
    }

    /// Whether a text means to be a study rather than a case: it names a case and has no bodies.
    pub fn is_meant(text: &str) -> bool {
        let path = std::path::Path::new("study.yml");
        Document::read(text, path, Source::new(text, path))
            .is_ok_and(|document| document.has("case") && !document.has("bodies"))
    }

    /// The file itself.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// The error that points at a place of the study.
    pub fn error(&self, place: Place, message: impl Into<String>, hint: &str) -> Error {
        self.source.error(&Complaint::new(message.into()).at(place).hint(hint))
    }

    fn complaints(&self) -> Vec<Complaint> {
        let mut complaints = Vec::new();
        self.check(&mut complaints);
        complaints
    }

    fn check(&self, complaints: &mut Vec<Complaint>) {
        self.sweep.iter().for_each(|(name, axis)| check_axis(name, axis, complaints));
        if self.quantities.value.is_empty() {
            let nothing = Complaint::new("a study needs at least one quantity".into());
            complaints.push(nothing.at(self.quantities.place));
        }
        for (name, quantity) in self.quantities.value.iter() {
            self.check_quantity(name, quantity, complaints);
        }
        if self.sweep.is_empty() && self.members.is_empty() {
            let nothing = Complaint::new("nothing is varied: neither `sweep` nor `members`".into());
            complaints.push(nothing.at(self.case.place));
        }
        let bad = self.accuracy.value.iter().find(|target| !(target.value > 0.0 && target.value < 1.0));
        complaints.extend(bad.map(|target| {
            let message = format!("an accuracy must be between 0 and 1, found {}", target.value);
            Complaint::new(message).at(target.place).hint("0.01 means 1 %")
        }));
        for name in
            self.sweep.iter().map(|(name, _)| name).chain(self.quantities.value.iter().map(|(name, _)| name))
        {
            if COLUMNS.contains(&name.value.as_str()) {
                let message = format!("'{}' is already the name of a column of study.csv", name.value);
                complaints.push(Complaint::new(message).at(name.place).hint("choose another name"));
            }
        }
        for reserved in self.members.iter().map(|(name, _)| name).filter(|name| name.value == "reference") {
            let message = "the name 'reference' is reserved for the reference run".into();
            complaints.push(Complaint::new(message).at(reserved.place));
        }
    }

    fn check_quantity(&self, name: &At<String>, quantity: &StudyQuantity, complaints: &mut Vec<Complaint>) {
        let table = &quantity.table;
        if !TABLES.contains(&table.value.as_str()) {
            let unknown = Complaint::unknown("table", &table.value, TABLES.into_iter());
            complaints.push(unknown.at(table.place));
        }
        if let Some(between) = &quantity.between
            && between.value[0].value >= between.value[1].value
        {
            complaints
                .push(Complaint::new("the first instant is not before the last".into()).at(between.place));
        }
        if let Some(scale) = quantity.scale.filter(|scale| scale.value <= 0.0) {
            complaints.push(Complaint::new("a size must be positive".into()).at(scale.place));
        }
        let own = quantity.reference.as_ref();
        if own.is_none() && self.reference.is_none() {
            let message = format!("'{}' has no reference", name.value);
            let cure = "add a `reference` to the study, or to this quantity: `reference: { value: ... }`";
            complaints.push(Complaint::new(message).at(name.place).hint(cure));
        }
        if let (Measure::L2, Some(At { value: KnownReference::Value(_), place })) =
            (quantity.measure.value, own)
        {
            let message = "a curve must be compared with a curve, not with a value".into();
            complaints.push(Complaint::new(message).at(*place).hint("reference: { csv: FILE }"));
        }
    }
}

fn check_axis(name: &At<String>, axis: &SweepAxis, complaints: &mut Vec<Complaint>) {
    let say = |message: &str, hint: &str| Complaint::new(message.to_owned()).at(name.place).hint(hint);
    let form = "`{ key: PATH, values: [...] }`, or `{ choices: { NAME: { PATH: VALUE } } }`";
    let count = match (&axis.key, &axis.values, &axis.choices) {
        (Some(_), Some(values), None) => match &values.tree {
            Tree::List(values) => values.len(),
            Tree::Map(values) => values.len(),
            _ => {
                return complaints.push(
                    Complaint::new("expected a list, or a mapping from labels".into()).at(values.place),
                );
            }
        },
        (None, None, Some(choices)) => choices.len(),
        _ => return complaints.push(say("an axis needs a key and its values, or choices", form)),
    };
    if count == 0 {
        complaints.push(say("this axis has no values", form));
    }
}
