//! A row of the table: cases to run, and the expected properties of their results.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::common::{Folder, Table, run_within};

/// Time limit of one case. A hang is a failure.
const LIMIT: Duration = Duration::from_secs(300);

/// The finding of a row.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// The finding in words and figures.
    pub answer: String,
    /// The expected finding.
    pub expected: String,
    /// Whether the finding is as expected.
    pub holds: bool,
}

impl Verdict {
    /// A figure that must equal another one within a relative `tolerance`.
    pub fn close(found: f64, expected: f64, tolerance: f64) -> Self {
        let error = (found - expected).abs() / expected.abs().max(f64::MIN_POSITIVE);
        Self {
            answer: format!("{found:.10e}, off by {error:.1e}"),
            expected: format!("{expected:.6e} to {tolerance:.0e}"),
            holds: error <= tolerance,
        }
    }

    /// A figure that must equal another one within an absolute `slack`.
    pub fn near(found: f64, expected: f64, slack: f64) -> Self {
        Self {
            answer: format!("{found:.6e}"),
            expected: format!("{expected:.6e} to {slack:.1e}"),
            holds: (found - expected).abs() <= slack,
        }
    }

    /// Lists of dimensionless figures that must agree, relative to the largest of each.
    pub fn same(found: &[f64], expected: &[f64], tolerance: f64) -> Self {
        let off = |(f, e): (&f64, &f64)| (f - e).abs() / e.abs().max(f64::MIN_POSITIVE);
        let worst = found.iter().zip(expected).map(off).fold(0.0, f64::max);
        Self {
            answer: format!("{:.8e}, worst of {} off by {worst:.1e}", found[0], found.len()),
            expected: format!("{:.6e} to {tolerance:.0e}", expected[0]),
            holds: worst <= tolerance && found.iter().all(|x| x.is_finite()),
        }
    }

    /// A statement.
    pub fn says(answer: String, expected: &str, holds: bool) -> Self {
        Self { answer, expected: expected.to_owned(), holds }
    }

    /// Combines two findings.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            answer: format!("{}; {}", self.answer, other.answer),
            expected: format!("{}; {}", self.expected, other.expected),
            holds: self.holds && other.holds,
        }
    }
}

/// The results of one case.
pub struct Results {
    /// Exit code.
    pub code: Option<i32>,
    /// The message.
    pub stderr: String,
    folder: PathBuf,
}

impl Results {
    /// A table of the results folder.
    pub fn table(&self, name: &str) -> Table {
        Table::read(&self.folder.join(name))
    }

    /// The rows of one contact.
    pub fn contact(&self, name: &str) -> Table {
        self.table("contact.csv").only("contact", name)
    }

    /// Totals of `run.json`.
    pub fn record(&self) -> serde_json::Value {
        let text = fs::read_to_string(self.folder.join("run.json")).unwrap_or_default();
        serde_json::from_str(&text).unwrap_or_default()
    }

    /// The program's reason, in one line.
    pub fn reason(&self) -> String {
        let line = self.stderr.lines().find(|line| line.contains("error:")).unwrap_or("no reason given");
        line.trim_start_matches("contact-petsc: error: ").to_owned()
    }
}

/// How a row is judged.
pub type Judge = Box<dyn Fn(&[Results]) -> Verdict + Sync>;

/// A row of the table.
pub struct Row {
    /// The swept parameter.
    pub group: &'static str,
    /// The value of the parameter.
    pub name: String,
    /// Whether the row belongs to the quick rows, which every test run executes.
    pub quick: bool,
    /// Case files.
    pub cases: Vec<String>,
    /// Ranks of each case.
    pub ranks: usize,
    /// Accepted exit codes.
    pub codes: Vec<i32>,
    /// Checks of results that end with code 0.
    pub judge: Judge,
}

impl Row {
    /// A row that must converge.
    pub fn new(
        group: &'static str,
        name: impl Into<String>,
        cases: Vec<String>,
        judge: impl Fn(&[Results]) -> Verdict + Sync + 'static,
    ) -> Self {
        let name = name.into();
        Self { group, name, quick: false, cases, ranks: 0, codes: vec![0], judge: Box::new(judge) }
    }

    /// A row that must be refused with one of `codes` and a reason that contains `words`.
    pub fn refused(
        group: &'static str,
        name: impl Into<String>,
        case: String,
        codes: &[i32],
        words: &'static str,
    ) -> Self {
        let judge = move |results: &[Results]| {
            let reason = results[0].reason();
            let holds = reason.contains(words);
            Verdict::says(reason, &format!("a reason: {words}"), holds)
        };
        Self { codes: codes.to_vec(), ..Self::new(group, name, vec![case], judge) }
    }

    /// Adds this row to the quick ones.
    #[must_use]
    pub fn quick(self) -> Self {
        Self { quick: true, ..self }
    }

    /// Runs this row on several ranks.
    #[must_use]
    pub fn on(self, ranks: usize) -> Self {
        Self { ranks, ..self }
    }

    /// Permits this row to end with one of `codes` and a reason.
    #[must_use]
    pub fn or_refused(self, codes: &[i32]) -> Self {
        Self { codes: [&self.codes[..], codes].concat(), ..self }
    }
}

/// The outcome of a row.
pub struct Outcome {
    /// Its verdict.
    pub verdict: Verdict,
    /// Exit code of its last case.
    pub code: Option<i32>,
    /// Seconds of all its cases.
    pub seconds: f64,
}

/// Runs a row. Never panics: failures are in the verdict.
pub fn judge(row: &Row) -> Outcome {
    let folder = Folder::new("extremes");
    let (mut results, mut seconds) = (Vec::new(), 0.0);
    for (number, case) in row.cases.iter().enumerate() {
        let (file, out) = (format!("case-{number}.yml"), format!("out-{number}"));
        folder.write(&file, case);
        if let Some(keep) = std::env::var_os("EXTREMES_KEEP") {
            let name = format!("{}-{}-{number}.yml", row.group, row.name).replace([' ', '/', ','], "_");
            let _ = fs::write(Path::new(&keep).join(name), case);
        }
        let output = run_within(LIMIT, row.ranks, &[&file, "--output", &out, "--quiet"], &folder);
        seconds += output.took.as_secs_f64();
        let result = Results { code: output.code, stderr: output.stderr, folder: folder.join(&out) };
        let (code, last) = (output.code, number + 1 == row.cases.len());
        let allowed = code.is_some_and(|code| if last { row.codes.contains(&code) } else { code == 0 });
        let trouble = match code {
            None => Some("killed at its time limit".to_owned()),
            Some(code) if !allowed => Some(format!("exit code {code}: {}", result.reason())),
            Some(code) if code != 0 && !result.stderr.contains("error:") => Some("no reason given".into()),
            Some(_) => not_a_number(&result.folder).map(|at| format!("not a number in {at}")),
        };
        if let Some(trouble) = trouble {
            let verdict = Verdict::says(trouble, &format!("exit code {:?}", row.codes), false);
            return Outcome { verdict, code, seconds };
        }
        results.push(result);
    }
    let code = results.last().and_then(|result| result.code);
    let refused = code != Some(0) && row.codes.contains(&0);
    let verdict = match refused {
        true => Verdict::says(results[results.len() - 1].reason(), "an answer, or a reason", true),
        false => (row.judge)(&results),
    };
    Outcome { verdict, code, seconds }
}

/// The first file below `folder` with a non-finite number, and its location.
fn not_a_number(folder: &Path) -> Option<String> {
    let entries = fs::read_dir(folder).ok()?;
    entries.filter_map(Result::ok).find_map(|entry| {
        let path = entry.path();
        if path.is_dir() {
            return not_a_number(&path);
        }
        let name = path.file_name()?.to_string_lossy().into_owned();
        let sick = if name.ends_with(".vtu") {
            binary_has_nan(&path)
        } else {
            let bytes = fs::read(&path).ok()?;
            let text = String::from_utf8_lossy(&bytes).to_lowercase();
            let mut words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '.');
            words.any(|word| word == "nan" || word == "inf" || word == "infinity")
        };
        sick.then_some(name)
    })
}

fn binary_has_nan(path: &Path) -> bool {
    use contact_petsc::output::vtu::VtuValues;
    let Ok(piece) = contact_petsc::output::vtu_reader::read_piece(path) else { return true };
    let sick = |values: &VtuValues| match values {
        VtuValues::Float64(values) => values.iter().any(|x| !x.is_finite()),
        _ => false,
    };
    piece.point_data.values().chain(piece.cell_data.values()).any(|field| sick(&field.values))
}
