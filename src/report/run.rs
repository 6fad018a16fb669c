//! The page about a run.

use serde_json::Value;

use super::html::{HtmlCell, Page};
use crate::case::Units;
use crate::error::Result;
use crate::output::folder::{ResultsFolder, record};
use crate::output::process::verdict;
use crate::plot;

/// Maximum size of a picture \[bytes\]. Larger ones are left out, because a browser could not
/// display them.
const MOST: usize = 12 << 20;

/// Number of warnings that are always visible. The others open on demand.
const SHOWN: usize = 8;

/// The page about the results in a folder, and notes on what is missing.
///
/// # Errors
/// A table is broken.
pub fn page(folder: &ResultsFolder, times: &[f64]) -> Result<(String, Vec<String>)> {
    let record = record(folder.path());
    let mut album = plot::album(folder.path(), times)?;
    let title = record["case"]["title"].as_str().unwrap_or("Results of contact-petsc").to_owned();
    let mut page = Page::default();
    head(&mut page, &record, &title);
    warnings(&mut page, &record);
    page.section("bodies", "Deformed bodies");
    figures(&mut page, &album.bodies, &mut album.notes, |_| true);
    page.section("histories", "Histories");
    let is_own = |name: &str| ["energy", "iterations"].contains(&name);
    figures(&mut page, &album.curves, &mut album.notes, |name| !is_own(name));
    page.section("energy", "Energy");
    figures(&mut page, &album.curves, &mut album.notes, |name| name == "energy");
    page.section("iterations", "Iterations");
    counts(&mut page, &record);
    figures(&mut page, &album.curves, &mut album.notes, |name| name == "iterations");
    page.section("phases", "Seconds per phase");
    phases(&mut page, &record);
    page.section("ranks", "Balance of the ranks");
    balance(&mut page, &record);
    page.section("versions", "Versions and input");
    versions(&mut page, &record);
    page.section("case", "The case");
    page.details("as completed with its defaults (YAML)", &super::yaml(&record["case"])?);
    if !album.notes.is_empty() {
        page.section("notes", "Not on this page");
        page.list(&album.notes);
    }
    Ok((page.finish(&title), album.notes))
}

fn head(page: &mut Page, record: &Value, title: &str) {
    let verdict = verdict(record);
    let number = |key: &str| record[key].as_f64().unwrap_or(0.0);
    let words = format!(
        "t = {} {} after {} of wall time on {} ranks, started {}",
        figures_of(number("simulated_time"), 6),
        Units::of_record(record).of("s"),
        seconds(number("wall_seconds")),
        record["ranks"],
        record["start"].as_str().unwrap_or("at an unknown time")
    );
    page.head(title, verdict, &words);
    if let Some(reason) = record["reason"].as_str() {
        page.verbatim(reason);
    }
}

fn warnings(page: &mut Page, record: &Value) {
    page.section("warnings", "Warnings");
    let warnings: Vec<&str> =
        record["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    warnings.iter().take(SHOWN).for_each(|warning| page.warning(warning));
    if warnings.len() > SHOWN {
        page.details(&format!("{} more", warnings.len() - SHOWN), &warnings[SHOWN..].join("\n"));
    }
    match (&record["warnings"], warnings.is_empty()) {
        (Value::Array(_), true) => page.paragraph("None."),
        (Value::Null, _) => page.paragraph("This result has no list of warnings."),
        _ => {}
    }
}

fn figures(
    page: &mut Page,
    drawings: &plot::Drawings,
    notes: &mut Vec<String>,
    is_meant: impl Fn(&str) -> bool,
) {
    let mut is_empty = true;
    for (name, svg) in drawings.iter().filter(|(name, _)| is_meant(name)) {
        if svg.len() > MOST {
            notes.push(format!("{name}: {} MB, too large for this page", svg.len() >> 20));
            continue;
        }
        page.figure(name, svg);
        is_empty = false;
    }
    if is_empty {
        page.paragraph("Nothing to show.");
    }
}

fn counts(page: &mut Page, record: &Value) {
    let names = [
        ("steps", "Steps"),
        ("cut_steps", "Steps cut"),
        ("newton_iterations", "Newton iterations"),
        ("krylov_iterations", "Krylov iterations"),
        ("inner_krylov_iterations", "Krylov iterations within preconditioners"),
        ("linear_fallbacks", "Fallbacks to a more robust linear solver"),
        ("unknowns", "Unknowns per step"),
    ];
    let mut rows: Vec<Vec<HtmlCell>> = Vec::new();
    for (key, name) in names {
        rows.push(vec![HtmlCell::text(name), HtmlCell::number(text_of(&record[key]))]);
    }
    let m = Units::of_record(record).of("m");
    for contact in record["penetration"].as_array().into_iter().flatten() {
        let name = format!("Deepest penetration of {}", contact["contact"].as_str().unwrap_or("a contact"));
        let deepest = contact["deepest"].as_f64().unwrap_or(0.0);
        let asked =
            contact["asked"].as_f64().map_or(String::new(), |asked| format!(", requested {asked:.2e} {m}"));
        rows.push(vec![HtmlCell::text(name), HtmlCell::number(format!("{deepest:.2e} {m}{asked}"))]);
    }
    page.table(&[], &rows);
}

fn phases(page: &mut Page, record: &Value) {
    let wall = record["wall_seconds"].as_f64().unwrap_or(0.0);
    let phases: Vec<(String, f64, String)> = record["phases"]
        .as_object()
        .into_iter()
        .flatten()
        .map(|(name, phase)| {
            (name.replace('_', " "), phase["seconds"].as_f64().unwrap_or(0.0), text_of(&phase["count"]))
        })
        .collect();
    let known: f64 = phases.iter().map(|(_, seconds, _)| seconds).sum();
    let other = ("other".to_owned(), (wall - known).max(0.0), "–".to_owned());
    let rows: Vec<Vec<HtmlCell>> = phases
        .into_iter()
        .chain([other])
        .map(|(name, time, calls)| {
            let share = time / wall.max(f64::MIN_POSITIVE);
            let percent = format!("{:.0} %", 100.0 * share);
            vec![
                HtmlCell::Text(name),
                HtmlCell::Number(figures_of(time, 3)),
                HtmlCell::Number(percent),
                HtmlCell::Bar(share),
                HtmlCell::Number(calls),
            ]
        })
        .collect();
    page.table(&["phase", "seconds", "share", "", "calls"], &rows);
    page.paragraph("Wall time, largest value of all ranks.");
}

fn balance(page: &mut Page, record: &Value) {
    let balance = &record["balance"];
    let columns = [
        ("elements", &balance["elements"], 1.0),
        ("nodes", &balance["nodes"], 1.0),
        ("contact facets", &balance["contact_facets"], 1.0),
        ("memory [MiB]", &record["peak_memory_bytes"], f64::from(1 << 20)),
        ("CPU [s]", &balance["cpu_seconds"], 1.0),
        ("work [s]", &balance["work_seconds"], 1.0),
    ];
    let ranks = record["ranks"].as_u64().unwrap_or(0) as usize;
    let value = |list: &Value, rank: usize, unit: f64| list[rank].as_f64().map(|value| value / unit);
    let work = &balance["work_seconds"];
    let most = (0..ranks).filter_map(|rank| value(work, rank, 1.0)).fold(0.0, f64::max);
    let mut rows: Vec<Vec<HtmlCell>> = (0..ranks)
        .map(|rank| {
            let numbers = columns.iter().map(|(_, list, unit)| {
                HtmlCell::Number(value(list, rank, *unit).map_or("–".into(), |value| figures_of(value, 3)))
            });
            let bar = HtmlCell::Bar(value(work, rank, 1.0).unwrap_or(0.0) / most.max(f64::MIN_POSITIVE));
            std::iter::once(HtmlCell::number(rank)).chain(numbers).chain([bar]).collect()
        })
        .collect();
    let imbalance = |list: &Value, unit: f64| {
        let all: Vec<f64> = (0..ranks).filter_map(|rank| value(list, rank, unit)).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let ratio = all.iter().fold(0.0, |most: f64, value| most.max(*value)) / mean;
        if ratio.is_finite() { format!("{ratio:.3}") } else { "–".into() }
    };
    if ranks > 1 {
        let last = columns.iter().map(|(_, list, unit)| HtmlCell::Number(imbalance(list, *unit)));
        rows.push(std::iter::once(HtmlCell::text("max / mean")).chain(last).collect());
    }
    let header: Vec<&str> =
        std::iter::once("rank").chain(columns.iter().map(|(name, _, _)| *name)).chain([""]).collect();
    page.table(&header, &rows);
    page.paragraph(
        "Work is search, contact, element forces and tangents, in which no rank waits for another. CPU \
         includes waiting.",
    );
}

fn versions(page: &mut Page, record: &Value) {
    let versions = record["versions"].as_object().into_iter().flatten();
    let mut rows: Vec<Vec<HtmlCell>> = versions
        .map(|(name, version)| vec![HtmlCell::text(name), HtmlCell::text(text_of(version))])
        .collect();
    for input in record["inputs"].as_array().into_iter().flatten() {
        let hash = input["sha256"].as_str().unwrap_or_default();
        rows.push(vec![HtmlCell::text(text_of(&input["path"])), HtmlCell::text(format!("SHA-256 {hash}"))]);
    }
    if let Some(hash) = record["case_sha256"].as_str() {
        rows.push(vec![HtmlCell::text("the completed case"), HtmlCell::text(format!("SHA-256 {hash}"))]);
    }
    page.table(&[], &rows);
}

/// A text without its quotes, a number unchanged, and a dash for null.
pub fn text_of(value: &Value) -> String {
    match value {
        Value::Null => "–".into(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A number with the given number of significant digits; integers are shown without decimals.
pub fn figures_of(value: f64, figures: i32) -> String {
    if value == 0.0 || (value.fract() == 0.0 && value.abs() < 1e9) {
        return format!("{value}");
    }
    if !(1e-4..1e9).contains(&value.abs()) {
        return format!("{value:.2e}");
    }
    let decimals = (figures - 1 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn seconds(time: f64) -> String {
    format!("{} s", figures_of(time, 3))
}
