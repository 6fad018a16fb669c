//! Reads a results folder for the figures: titles and all tables that exist.

use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use crate::case::Units;
use crate::error::Result;
use crate::output::folder::{ResultsFolder, record};
use crate::output::process::verdict;
use crate::output::table::Mark;

use super::axis::Display;
use super::csv::Csv;

/// One run.
#[derive(Debug, Clone)]
pub struct Run {
    /// Its folder.
    pub folder: ResultsFolder,
    /// Units of its tables and fields.
    pub units: Units,
    /// Title of its case, or the folder's name.
    pub title: String,
    /// `probes.csv`.
    pub probes: Option<Csv>,
    /// `energy.csv`.
    pub energy: Option<Csv>,
    /// `iterations.csv`.
    pub iterations: Option<Csv>,
}

impl Run {
    /// Reads a run. Remarks on missing data go to `notes`.
    ///
    /// # Errors
    /// The folder does not belong to this program, or a table in it is broken. A truncated last row
    /// is not an error.
    pub fn read(path: &Path, notes: &mut Vec<String>) -> Result<Self> {
        let folder = ResultsFolder::open(path)?;
        let record = record(path);
        if record["verdict"] != "completed" {
            let verdict = verdict(&record);
            notes.push(format!(
                "{}: the run has not completed (verdict: {verdict}); the available rows are drawn",
                path.display()
            ));
        }
        let mut table = |name: &str| -> Result<Option<Csv>> {
            let file = folder.join(name);
            let csv = Csv::read(&file)?;
            match &csv {
                None => notes.push(format!("{}: file not found; its figures are omitted", file.display())),
                Some(csv) if csv.is_cut => {
                    notes.push(format!("{}: the last row is truncated and omitted", file.display()))
                }
                Some(_) => {}
            }
            notes.extend(csv.as_ref().and_then(|_| damage(&record, name, &file)));
            Ok(csv)
        };
        let (probes, energy, iterations) =
            (table("probes.csv")?, table("energy.csv")?, table("iterations.csv")?);
        let title = record["case"]["title"].as_str().filter(|title| !title.is_empty());
        let title = title.map_or_else(|| folder_name(path), str::to_string);
        Ok(Self { folder, units: Units::of_record(&record), title, probes, energy, iterations })
    }

    /// A column of a table in the units of a figure, given its SI heading.
    ///
    /// # Errors
    /// A field is not a number.
    pub fn column(&self, csv: &Csv, heading: &str, display: &Display) -> Result<Option<Vec<f64>>> {
        let unit =
            heading.strip_suffix(']').and_then(|text| text.rsplit_once('[')).map_or("", |parts| parts.1);
        let factor = display.factor(self.units, unit);
        let values = csv.numbers(&self.units.heading(heading))?;
        Ok(values.map(|values| values.into_iter().map(|value| factor * value).collect()))
    }

    /// Names of the probes, in the order of the file.
    pub fn probe_names(&self) -> Vec<String> {
        let columns = self.probes.iter().flat_map(Csv::columns);
        let ending = self.units.heading(".u_x [m]");
        columns.filter_map(|column| column.strip_suffix(&ending)).map(str::to_string).collect()
    }
}

/// Describes the damage to a table of a run that has ended, by comparison with the run record.
pub(super) fn damage(record: &Value, name: &str, file: &Path) -> Option<String> {
    let mark = Mark::deserialize(&record["tables"][name]).ok()?;
    let damage = mark.check(file).err()?;
    Some(format!("{damage}; the available rows are drawn"))
}

/// Makes equal titles distinct by the names of the folders, or by their full paths.
pub fn distinguish(runs: &mut [Run]) {
    type Name = fn(&Path) -> String;
    let names: [Name; 2] = [folder_name, |path| path.display().to_string()];
    for name in names {
        let titles: Vec<String> = runs.iter().map(|run| run.title.clone()).collect();
        for run in runs.iter_mut() {
            if titles.iter().filter(|title| **title == run.title).count() > 1 {
                run.title = format!("{} ({})", run.title, name(run.folder.path()));
            }
        }
    }
}

fn folder_name(path: &Path) -> String {
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    whole.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::folder::RECORD;
    use crate::output::folder::tests::Scratch;

    fn run_in(path: &Path, title: &str) -> Run {
        std::fs::create_dir_all(path).unwrap();
        let record = format!(
            r#"{{"program": "contact-petsc", "verdict": "completed", "case": {{"title": "{title}"}}}}"#
        );
        std::fs::write(path.join(RECORD), record).unwrap();
        Run::read(path, &mut Vec::new()).unwrap()
    }

    /// Equal titles are distinguished by folder, and by path if the folders' names are equal too.
    #[test]
    fn titles_are_distinct() {
        let scratch = Scratch::new("titles");
        let mut runs = ["a/x", "b/x", "b/y", "b/z"].map(|name| run_in(&scratch.0.join(name), "Block"));
        runs[3].title = "Other".into();
        distinguish(&mut runs);
        let titles: Vec<&str> = runs.iter().map(|run| run.title.as_str()).collect();
        assert_eq!(titles[2..], ["Block (y)", "Other"]);
        assert!(titles[0] != titles[1] && titles[0].starts_with("Block (x) ("), "{titles:?}");
    }

    /// A killed run is read up to its last complete row, and the notes report it.
    #[test]
    fn a_killed_run_is_read_with_notes() {
        let scratch = Scratch::new("killed");
        let (folder, _lock) = ResultsFolder::create(&scratch.0).unwrap();
        std::fs::write(
            folder.join("probes.csv"),
            "step,time [s],dt [s],p.u_x [m],p.u_y [m]\n0,0,0,1,2\n1,0.",
        )
        .unwrap();
        let mut notes = Vec::new();
        let run = Run::read(&scratch.0, &mut notes).unwrap();
        assert_eq!(run.probe_names(), ["p"]);
        assert_eq!(run.probes.unwrap().numbers("p.u_y [m]").unwrap().unwrap(), [2.0]);
        assert!(notes[0].contains("not completed") && notes[1].contains("truncated"), "{notes:?}");
        assert_eq!(notes.len(), 4);
    }
}
