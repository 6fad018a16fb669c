//! One page about a result. `contact-petsc report RESULTS` writes `report.html`, which contains all
//! of its pictures, has no external references, and prints well.

mod html;
mod run;
mod study;

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Result};
use crate::output::folder::{PROGRAM, ResultsFolder, json_of, write_whole};

/// Result of writing a report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The page.
    pub file: PathBuf,
    /// What was missing or left out, one line each.
    pub notes: Vec<String>,
}

/// File that marks the folder of a study.
const STUDY: &str = "study.json";

/// Writes the page about the results of a run, finished or not, or about a study. The bodies are
/// shown at `times` \[s\], or at the start, the middle and the end.
///
/// # Errors
/// The folder is not a result of this program, a table is broken, or the page can not be written.
pub fn report(folder: &Path, times: &[f64], output: Option<&Path>) -> Result<Written> {
    let study = json_of(&folder.join(STUDY));
    let (page, notes) = if study["program"] == PROGRAM {
        study::page(folder, &study)?
    } else {
        let folder = ResultsFolder::open(folder)?;
        run::page(&folder, times)?
    };
    let file = output.map_or_else(|| folder.join("report.html"), Path::to_path_buf);
    write_whole(&file, page.as_bytes())?;
    Ok(Written { file, notes })
}

/// A value of the record as YAML.
fn yaml(value: &Value) -> Result<String> {
    serde_saphyr::to_string(value).map_err(|error| Error::internal(format!("case to YAML: {error}")))
}

#[cfg(test)]
mod tests;
