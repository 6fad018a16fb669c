//! The page about a study.

use std::path::Path;

use serde_json::Value;

use super::html::{Cell, Page};
use super::run::{figures_of, text_of};
use crate::error::Result;
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
        match std::fs::read_to_string(folder.join(&name)) {
            Ok(svg) if is_inside && svg.starts_with("<svg") => page.figure(&name, &svg),
            _ => notes.push(format!("{name}: not there")),
        }
    }
    page.section("members", "Members");
    match Csv::read(&folder.join("study.csv"))? {
        Some(csv) => members(&mut page, &csv),
        None => notes.push("study.csv: not there".into()),
    }
    page.section("study", "The study");
    page.details("as written (YAML)", &text_of(&marker["text"]));
    if !notes.is_empty() {
        page.section("notes", "Not on this page");
        page.list(&notes);
    }
    Ok((page.finish(&title), notes))
}

fn members(page: &mut Page, csv: &Csv) {
    // The labels of the axes say the same as the name.
    let shown: Vec<&String> = csv.columns().iter().collect();
    let columns: Vec<Vec<&str>> = shown.iter().filter_map(|name| csv.words(name)).collect();
    let count = columns.first().map_or(0, Vec::len);
    let cell = |word: &str| match word.parse::<f64>() {
        Ok(number) => Cell::Number(figures_of(number, 4)),
        Err(_) => Cell::text(word),
    };
    let rows: Vec<Vec<Cell>> =
        (0..count).map(|row| columns.iter().map(|column| cell(column[row])).collect()).collect();
    let header: Vec<&str> = shown.iter().map(|name| name.as_str()).collect();
    page.table(&header, &rows);
}
