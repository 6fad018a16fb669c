//! The page about a study.

use std::path::Path;

use serde_json::Value;

use super::html::{HtmlCell, Page};
use super::run::{figures_of, text_of};
use crate::error::Result;
use crate::files;
use crate::plot::Csv;

/// The page about the study in a folder, and notes on what is missing.
///
/// # Errors
/// The table is broken.
pub fn page(folder: &Path, marker: &Value) -> Result<(String, Vec<String>)> {
    let title = marker["title"].as_str().unwrap_or("Study").to_owned();
    let mut notes = Vec::new();
    let mut page = Page::default();
    let words = format!(
        "{}, written {} by contact-petsc {}",
        text_of(&marker["study"]),
        text_of(&marker["written"]),
        text_of(&marker["version"])
    );
    page.head(&title, marker["state"].as_str().unwrap_or("unknown"), &words);
    let texts =
        |key: &str| -> Vec<String> { marker[key].as_array().into_iter().flatten().map(text_of).collect() };
    page.section("advice", "Advice");
    let advice = texts("advice");
    if advice.is_empty() {
        page.paragraph("None yet: the study has not ended.");
    }
    page.list(&advice);
    page.section("figures", "Figures");
    for name in texts("figures") {
        let is_inside =
            Path::new(&name).components().all(|part| matches!(part, std::path::Component::Normal(_)));
        match files::read_text(&folder.join(&name), files::LONGEST_RECORD) {
            Ok(svg) if is_inside && svg.starts_with("<svg") => page.figure(&name, &svg),
            _ => notes.push(format!("{name}: file not found")),
        }
    }
    page.section("members", "Members");
    match Csv::read(&folder.join("study.csv"))? {
        Some(csv) => members(&mut page, &csv, &texts("axes")),
        None => notes.push("study.csv: file not found".into()),
    }
    page.section("study", "The study");
    page.details("as written (YAML)", &text_of(&marker["text"]));
    if !notes.is_empty() {
        page.section("notes", "Not on this page");
        page.list(&notes);
    }
    Ok((page.finish(&title), notes))
}

/// The members with their values, errors and costs. All other data are in `study.csv`.
fn members(page: &mut Page, csv: &Csv, axes: &[String]) {
    let costs = ["cpu [s]", "newton", "steps", "unknowns", "peak memory [MiB]", "energy drift", "reason"];
    let is_axis = |name: &&String| axes.contains(name);
    let is_shown = |name: &&String| {
        is_axis(name) || *name == "verdict" || name.ends_with(" error") || costs.contains(&name.as_str())
    };
    let named: Vec<&str> = csv.words("member").unwrap_or_default();
    let mut header = Vec::new();
    let mut columns: Vec<Vec<&str>> = Vec::new();
    if !csv.columns().iter().any(|name| is_axis(&name)) {
        header.push("member");
        columns.push(named.clone());
    }
    for name in csv.columns().iter().filter(is_shown) {
        header.push(name.as_str());
        columns.push(csv.words(name).unwrap_or_default());
    }
    let cell = |row: usize, column: usize| match columns[column][row] {
        // A member outside the grid has a name instead of values.
        "" if column == 0 => HtmlCell::text(named[row]),
        word => match word.parse::<f64>() {
            Ok(number) => HtmlCell::Number(figures_of(number, 3)),
            Err(_) => HtmlCell::text(word),
        },
    };
    let rows: Vec<Vec<HtmlCell>> =
        (0..named.len()).map(|row| (0..columns.len()).map(|column| cell(row, column)).collect()).collect();
    page.table(&header, &rows);
    page.paragraph("Errors are relative; values and further costs are in study.csv.");
}
