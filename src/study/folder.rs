//! The files of a study: `study.csv`, `study.md`, `advice.txt`, `figures/`, `members/`, and
//! `study.json`, which marks the folder as created by this program.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::advice::{StudyFindings, percent, seconds};
use super::file::Study;
use super::row::MemberState;
use super::table;
use crate::error::{Error, Result};
use crate::output::anchor::Anchor;
use crate::output::folder::{PROGRAM, default_folder, json_of, write_whole};
use crate::output::io_error::{trouble, unwritable};
use crate::output::lock::{LOCK, Lock};
use crate::output::timestamp::timestamp;

/// File that marks the folder of a study.
pub const MARKER: &str = "study.json";

/// Default folder of a study, without `--output`: `results/<folder>-study` for a file called
/// `study.yml`, `results/<folder>-study-x` for one called `study-x.yml`, `results/<stem>` for any
/// other.
///
/// # Errors
/// The path names no file, or the working directory does not exist.
pub fn default_place(path: &Path) -> Result<PathBuf> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if stem != "study" && !stem.starts_with("study-") {
        return default_folder(path);
    }
    let case = default_folder(&path.with_file_name("case.yml"))?;
    let name = case.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(case.with_file_name(format!("{name}-{stem}")))
}

/// Files that a study may leave in its folder.
const OWN: [&str; 8] =
    [MARKER, LOCK, table::FILE, "study.md", "advice.txt", "figures", "members", "report.html"];

/// The folder of a running study, which no other run of the study may use.
#[derive(Debug)]
pub struct StudyFolder {
    folder: Anchor,
    lock: Lock,
}

impl StudyFolder {
    /// Checks that the folder is in place and still locked by this run.
    ///
    /// # Errors
    /// It was moved or deleted, or another run has taken it.
    pub fn check(&self) -> Result<()> {
        self.lock.check()?;
        self.folder.check()
    }
}

/// Creates the folder, or opens one that a study of this program has created.
///
/// # Errors
/// It holds something else, another run of the study uses it, or it can not be written.
pub fn prepare(folder: &Path) -> Result<StudyFolder> {
    let names: Vec<_> = match std::fs::read_dir(folder) {
        Ok(entries) => entries.flatten().map(|entry| entry.file_name()).collect(),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        Err(e) => return Err(trouble(folder, "read", &e)),
    };
    let is_occupied = names.iter().any(|name| name != LOCK);
    let marker = json_of(&folder.join(MARKER));
    // A marker that exists but is damaged still marks a study.
    let is_damaged = marker.is_null()
        && names.iter().any(|name| name == MARKER)
        && names.iter().all(|name| OWN.iter().any(|own| name == own));
    let is_ours = marker["program"] == PROGRAM || is_damaged;
    if is_occupied && !is_ours {
        let text =
            format!("{}: not empty and not a study of {PROGRAM}; nothing was changed", folder.display());
        return Err(Error::file(text).hint("choose another folder with --output, or empty this folder"));
    }
    std::fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
    let place = StudyFolder { lock: Lock::take(folder)?, folder: Anchor::of(folder)? };
    if !is_occupied {
        write_whole(
            &folder.join(MARKER),
            json!({ "program": PROGRAM, "state": "running" }).to_string().as_bytes(),
        )?;
    }
    Ok(place)
}

/// The present state of a study, for its output files.
pub struct Papers<'a> {
    /// Folder of the study.
    pub folder: &'a Path,
    /// The study.
    pub study: &'a Study,
    /// The results so far.
    pub findings: StudyFindings<'a>,
}

impl Papers<'_> {
    /// Writes the table and the marker. Once the study has ended, it also writes the figures and
    /// the advice.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn write(&self, state: MemberState) -> Result<()> {
        let findings = &self.findings;
        let fronts: Vec<Vec<usize>> = (0..findings.quantities.len()).map(|k| findings.front(k)).collect();
        let text = table::text(findings.axes, findings.quantities, findings.rows, &fronts)?;
        write_whole(&self.folder.join(table::FILE), text.as_bytes())?;
        let advice = self.advice();
        let word = if state == MemberState::Waiting { "running" } else { state.name() };
        let figures = if state == MemberState::Waiting { Vec::new() } else { self.draw()? };
        if state != MemberState::Waiting {
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
            "advice": if state == MemberState::Waiting { Vec::new() } else { advice },
            "figures": figures,
            "text": self.study.source().text,
        });
        let text = serde_json::to_string_pretty(&marker).map_err(|e| Error::internal(e.to_string()))?;
        write_whole(&self.folder.join(MARKER), (text + "\n").as_bytes())
    }

    /// The sentences of advice.
    pub fn advice(&self) -> Vec<String> {
        let targets: Vec<f64> = self.study.accuracy.value.iter().map(|target| target.value).collect();
        self.findings.advice(&targets)
    }

    /// Draws the figures and returns their names relative to the folder.
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
        let StudyFindings { quantities, rows, .. } = self.findings;
        let mut text = format!("# {}\n\n", self.study.title.as_deref().unwrap_or("Study"));
        let failed = rows.iter().filter(|row| row.state == MemberState::Failed).count();
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
                let member = self.findings.described(row);
                let time = seconds(row.cost.cpu);
                let cost = &row.cost;
                let number = number + 1;
                text.push_str(&format!(
                    "| {number} | {member} | {error} | {time} | {} | {} |\n",
                    cost.unknowns, cost.steps
                ));
            }
        }
        if failed > 0 {
            text.push_str("\n## Failed\n\n");
            for row in rows.iter().filter(|row| row.state == MemberState::Failed) {
                text.push_str(&format!("- {}: {}\n", row.name, row.reason));
            }
        }
        text.push('\n');
        figures.iter().for_each(|figure| text.push_str(&format!("![]({figure})\n")));
        text
    }
}
