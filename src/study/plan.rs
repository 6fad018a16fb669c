//! The members of a study: every combination of its axes, the named members, and the reference.

use crate::case::{At, Case, Named};
use crate::error::Result;
use crate::reader::document::Document;
use crate::reader::node::{Node, Tree};
use crate::study::file::{Reference, Study, SweepAxis};

/// Maximum number of members. A larger number is treated as a mistake.
const MOST: usize = 10_000;

/// Name of the separate run of the reference.
pub const REFERENCE: &str = "reference";

/// A run of the study.
#[derive(Debug, Clone)]
pub struct Member {
    /// Its name, which is also that of its folder.
    pub name: String,
    /// Labels of its values, one per axis; empty for members outside the grid.
    pub labels: Vec<String>,
    /// Its case.
    pub case: Case,
    /// Digest that identifies the member in a later run.
    pub digest: String,
}

/// A point of an axis.
struct Choice {
    label: String,
    values: Named<Node>,
}

/// The names of the axes. A list of named members counts as one axis.
pub fn axes(study: &Study) -> Vec<String> {
    let axes: Vec<String> = study.sweep.names().map(str::to_owned).collect();
    if axes.is_empty() { vec!["member".into()] } else { axes }
}

/// All members, read and checked, in the order in which they are run. The reference is first.
///
/// # Errors
/// A path or a value is invalid. The error names the position in the study or in the case.
pub fn members(study: &Study, case_text: &str) -> Result<Vec<Member>> {
    let path = study.source().directory.join(&study.case.value);
    let mut document = Document::read(case_text, &path, study.source().clone())?;
    document.put(&study.set)?;
    let mut members = Vec::new();
    let add = |members: &mut Vec<Member>, name: String, labels: Vec<String>, values: &[&Named<Node>]| {
        let mut own = document.clone();
        values.iter().try_for_each(|values| own.put(values))?;
        let case = Case::from_document(&own)?;
        let digest = case.digest()?;
        members.push(Member { name: unique(members, &name), labels, case, digest });
        Ok::<_, crate::error::Error>(())
    };
    let count = study.sweep.len();
    if let Some(At { value: Reference::Member(values), .. }) = &study.reference {
        add(&mut members, REFERENCE.into(), vec![String::new(); count.max(1)], &[values])?;
    }
    for combination in combinations(study)? {
        let labels: Vec<String> = combination.iter().map(|choice| choice.label.clone()).collect();
        let parts = study.sweep.names().zip(&labels).map(|(axis, label)| format!("{axis}-{label}"));
        let name = tame(&parts.collect::<Vec<_>>().join("_"));
        let values: Vec<&Named<Node>> = combination.iter().map(|choice| &choice.values).collect();
        add(&mut members, name, labels, &values)?;
    }
    for (name, values) in study.members.iter() {
        let labels = if count == 0 { vec![name.value.clone()] } else { vec![String::new(); count] };
        add(&mut members, tame(&name.value), labels, &[values])?;
    }
    Ok(members)
}

/// The points of the grid, with the last axis varying fastest; no points without axes.
fn combinations(study: &Study) -> Result<Vec<Vec<Choice>>> {
    let mut all: Vec<Vec<Choice>> = Vec::new();
    for (name, axis) in study.sweep.iter() {
        let choices = choices(axis);
        if all.len().max(1) * choices.len() > MOST {
            let message = format!("the grid has more than {MOST} members");
            return Err(study.error(name.place, message, "vary fewer keys at a time"));
        }
        let with = |before: &[Choice]| -> Vec<Vec<Choice>> {
            let again =
                |choice: &Choice| Choice { label: choice.label.clone(), values: choice.values.clone() };
            choices.iter().map(|choice| before.iter().chain([choice]).map(again).collect()).collect()
        };
        all = if all.is_empty() { with(&[]) } else { all.iter().flat_map(|before| with(before)).collect() };
    }
    Ok(all)
}

fn choices(axis: &SweepAxis) -> Vec<Choice> {
    if let Some(choices) = &axis.choices {
        let choice = |(name, values): (&At<String>, &Named<Node>)| Choice {
            label: name.value.clone(),
            values: values.clone(),
        };
        return choices.iter().map(choice).collect();
    }
    let (Some(key), Some(values)) = (&axis.key, &axis.values) else { return Vec::new() };
    let choice = |label: String, value: &Node| Choice {
        label,
        values: std::iter::once((key.clone(), value.clone())).collect(),
    };
    match &values.tree {
        Tree::List(values) => values.iter().map(|value| choice(value.label(), value)).collect(),
        Tree::Map(values) => values.iter().map(|(label, value)| choice(label.value.clone(), value)).collect(),
        _ => Vec::new(),
    }
}

/// Converts a name to a valid folder name.
fn tame(name: &str) -> String {
    let tame: String =
        name.chars().map(|c| if c.is_alphanumeric() || "-_.+".contains(c) { c } else { '-' }).collect();
    let tame = tame.trim_matches(['.', '-']).to_owned();
    if tame.is_empty() { "member".into() } else { tame.chars().take(120).collect() }
}

/// The name, with a number appended if another member already uses it.
fn unique(members: &[Member], name: &str) -> String {
    let is_taken = |name: &str| members.iter().any(|member| member.name == name);
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    std::iter::once(name.to_owned()).chain(numbered).find(|name| !is_taken(name)).unwrap_or_default()
}
