//! What a study leaves behind: `study.csv`, `study.md`, `advice.txt`, `figures/`, `members/`, and `study.json`, which marks
//! the folder as ours.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::advice::{Findings, percent, seconds};
use super::file::Study;
use super::row::State;
use super::table;
use crate::error::{Error, Result};
use crate::output::folder::{PROGRAM, default_folder, trouble, unwritable, write_whole};
use crate::output::timestamp::timestamp;

/// Marks the folder of a study.
pub const MARKER: &str = "study.json";

/// Where a study goes unless `--output` says otherwise: `results/<folder>-study` for a file called `study.yml`,
/// `results/<folder>-study-x` for one called `study-x.yml`, `results/<stem>` for any other.
///
/// # Errors
/// The path names no file, or the working directory is gone.
pub fn default_place(path: &Path) -> Result<PathBuf> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if stem != "study" && !stem.starts_with("study-") {
        return default_folder(path);
    }
    let case = default_folder(&path.with_file_name("case.yml"))?;
    let name = case.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(case.with_file_name(format!("{name}-{stem}")))
}

/// Makes the folder, or goes on with one that a study of ours has made.
///
/// # Errors
/// It holds something else, or can not be written.
pub fn prepare(folder: &Path) -> Result<()> {
    let is_occupied = match std::fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_some(),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => false,
        Err(e) => return Err(trouble(folder, "read", &e)),
    };
    if is_occupied && marker(folder)["program"] != PROGRAM {
        let text =
            format!("{}: not empty and not a study of {PROGRAM}; nothing was changed", folder.display());
        return Err(Error::file(text).hint("give another folder with --output, or empty this one yourself"));
    }
    std::fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
    if !is_occupied {
        write_whole(
            &folder.join(MARKER),
            json!({ "program": PROGRAM, "state": "running" }).to_string().as_bytes(),
        )?;
    }
    Ok(())
}

/// What the marker says; nothing where there is none.
fn marker(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join(MARKER)).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// A study as it stands, ready to be written.
pub struct Papers<'a> {
    /// Folder of the study.
    pub folder: &'a Path,
    /// The study.
    pub study: &'a Study,
    /// What is known.
    pub findings: Findings<'a>,
}

impl Papers<'_> {
    /// Writes the table and the marker; once the study has ended, the figures and the advice as well.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn write(&self, state: State) -> Result<()> {
        let findings = &self.findings;
        let fronts: Vec<Vec<usize>> = (0..findings.quantities.len()).map(|k| findings.front(k)).collect();
        let text = table::text(findings.axes, findings.quantities, findings.rows, &fronts)?;
        write_whole(&self.folder.join(table::FILE), text.as_bytes())?;
        let advice = self.advice();
        let word = if state == State::Waiting { "running" } else { state.name() };
        let figures = if state == State::Waiting { Vec::new() } else { self.draw()? };
        if state != State::Waiting {
            write_whole(&self.folder.join("advice.txt"), (advice.join("\n") + "\n").as_bytes())?;
            write_whole(&self.folder.join("study.md"), self.summary(&fronts, &figures).as_bytes())?;
        }
        let marker = json!({
            "program": PROGRAM,
            "state": word,
            "title": self.study.title,
            "study": self.study.source().name,
            "version": env!("CARGO_PKG_VERSION"),
            "written": timestamp(std::time::SystemTime::now()),
            "axes": findings.axes,
            "quantities": findings.quantities,
            "advice": if state == State::Waiting { Vec::new() } else { advice },
            "figures": figures,
            "text": self.study.source().text,
        });
        let text = serde_json::to_string_pretty(&marker).map_err(|e| Error::internal(e.to_string()))?;
        write_whole(&self.folder.join(MARKER), (text + "\n").as_bytes())
    }

    /// The sentences of advice.
    pub fn advice(&self) -> Vec<String> {
        let targets: Vec<f64> = self.study.accuracy.value.iter().map(|target| target.si).collect();
        self.findings.advice(&targets)
    }

    /// Draws the figures; returns their names relative to the folder.
    fn draw(&self) -> Result<Vec<String>> {
        let folder = self.folder.join("figures");
        let drawn = self.findings.figures()?;
        std::fs::create_dir_all(&folder).map_err(|e| unwritable(&folder, &e))?;
        let mut names = Vec::new();
        for (name, svg) in drawn {
            write_whole(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
            names.push(format!("figures/{name}.svg"));
        }
        Ok(names)
    }

    fn summary(&self, fronts: &[Vec<usize>], figures: &[String]) -> String {
        let Findings { quantities, rows, .. } = self.findings;
        let mut text = format!("# {}\n\n", self.study.title.as_deref().unwrap_or("Study"));
        let failed = rows.iter().filter(|row| row.state == State::Failed).count();
        text.push_str(&format!(
            "{} members, {failed} failed; all numbers in `{}`.\n\n",
            rows.len(),
            table::FILE
        ));
        self.advice().iter().for_each(|sentence| text.push_str(&format!("- {sentence}\n")));
        for ((name, front), index) in quantities.iter().zip(fronts).zip(0..) {
            text.push_str(&format!(
                "\n## Front of {name}\n\n| | member | error | CPU time | unknowns | steps |\n"
            ));
            text.push_str("|---|---|---|---|---|---|\n");
            for (number, &row) in front.iter().enumerate() {
                let row = &rows[row];
                let error = row.errors[index].map_or(String::new(), percent);
                let (member, time, cost) = (self.findings.described(row), seconds(row.cost.cpu), &row.cost);
                let number = number + 1;
                text.push_str(&format!(
                    "| {number} | {member} | {error} | {time} | {} | {} |\n",
                    cost.unknowns, cost.steps
                ));
            }
        }
        if failed > 0 {
            text.push_str("\n## Failed\n\n");
            for row in rows.iter().filter(|row| row.state == State::Failed) {
                text.push_str(&format!("- {}: {}\n", row.name, row.reason));
            }
        }
        text.push('\n');
        figures.iter().for_each(|figure| text.push_str(&format!("![]({figure})\n")));
        text
    }
}
