//! The command line: `contact-petsc case.yml`, the other commands, and their arguments.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::Shell;

use crate::error::{Error, Result};
use crate::output::pace::wall_time;
use crate::reader::complaint::nearest;

const EXAMPLES: &str = "\
Examples:
  contact-petsc meshes/rubber-block/case.yml
  mpirun -n 2 contact-petsc meshes/rubber-block/case.yml --output results/block
  contact-petsc case.yml --wall-time \"55 min\"; contact-petsc case.yml --restart
  contact-petsc check case.yml
  contact-petsc case.yml -v -- -log_view
  contact-petsc plot results/block results/block-power-law
  contact-petsc study meshes/rubber-block/study.yml

Exit codes: 0 done, 2 usage, 3 invalid case, 4 mesh or file, 5 not converged (results up to the last good step are
kept), 6 physics guard, 7 stopped on request with a checkpoint, 70 internal fault.";

/// Parallel implicit finite elements for dynamic, large-deformation, frictional contact, on PETSc.
#[derive(Debug, Parser)]
#[command(name = "contact-petsc", after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
#[command(subcommand_negates_reqs = true, arg_required_else_help = true, infer_subcommands = false)]
#[command(
    override_usage = "contact-petsc [run] CASE [OPTIONS] [-- PETSC OPTIONS]\n       contact-petsc COMMAND ..."
)]
struct Line {
    #[command(flatten)]
    run: Option<RunArguments>,
    #[command(subcommand)]
    command: Option<Sub>,
}

#[derive(Debug, Subcommand)]
enum Sub {
    /// Compute a case; the word `run` is optional
    Run(RunArguments),
    /// Check a case without solving it and print it with all defaults and derived numbers; list the members of a study
    Check {
        /// Case file, or study file
        case: PathBuf,
        /// PETSc options, after `--`
        #[arg(last = true, value_name = "PETSC OPTIONS", allow_hyphen_values = true)]
        petsc: Vec<String>,
    },
    /// List the elements, materials, laws, schemes and solvers that a case can use
    List {
        /// List the columns and fields of the results instead (Markdown)
        #[arg(long)]
        results: bool,
    },
    /// Print the JSON schema (draft-07) of a case file, for editors, or its reference page
    Schema {
        /// Print that of a study file instead
        #[arg(long)]
        study: bool,
        /// Print the reference page (Markdown) instead of the JSON schema
        #[arg(long)]
        markdown: bool,
    },
    /// Run a study: a case with varied keys, errors against costs, advice; an interrupted study is resumed
    Study(StudyArguments),
    /// Draw figures (SVG) of one result, or of several results in common figures
    Plot {
        /// Results folders
        #[arg(required = true)]
        results: Vec<PathBuf>,
        /// Folder of the figures; default: the first results folder
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
    },
    /// Write a self-contained page about a result or a study, report.html: figures, numbers, warnings, the case
    Report {
        /// Results folder of a run or of a study; to compare several runs in common figures use `plot`
        results: PathBuf,
        /// Times in seconds at which the bodies are shown; default: start, middle and end
        #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', allow_negative_numbers = true, value_parser = instant)]
        at: Vec<f64>,
        /// File of the page; default: `report.html` in the results folder
        #[arg(short, long, value_name = "HTML")]
        output: Option<PathBuf>,
    },
    /// Plot a column of a table (CSV) against another one, for example the tables of scripts/compare-solvers
    Chart(ChartArguments),
    /// Partition the mesh of a case without solving it, print the costs of each number of parts (CSV)
    Parts {
        /// Case file
        case: PathBuf,
        /// Numbers of parts
        #[arg(required = true, value_parser = clap::value_parser!(u32).range(1..=65536))]
        counts: Vec<u32>,
    },
    /// Print the completion script of a shell, to be sourced or saved in the completions folder of the shell
    Completions {
        /// Shell
        shell: Shell,
    },
}

/// Arguments of a run.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct RunArguments {
    /// Case file
    pub case: PathBuf,
    /// Results folder; default: `results/` and the name of the case's folder or file
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Resume from the last checkpoint of the results folder, or from CHECKPOINT, also in a new folder as a branch
    #[arg(long, value_name = "CHECKPOINT", num_args = 0..=1, require_equals = true)]
    pub restart: Option<Option<PathBuf>>,
    /// Start again although the folder holds an interrupted run of this case; deletes its checkpoints and results
    #[arg(long, conflicts_with = "restart")]
    pub anew: bool,
    /// Stop before this wall time with a checkpoint and exit code 7: seconds, or for example "55 min", "2 h", 1:30:00
    #[arg(long, value_name = "TIME", value_parser = wall_time)]
    pub wall_time: Option<Duration>,
    /// Print the Newton table (-v), and the linear solvers' iterations (-vv)
    #[arg(short, long, action = clap::ArgAction::Count, conflicts_with = "quiet")]
    pub verbose: u8,
    /// Print errors and warnings only
    #[arg(short, long)]
    pub quiet: bool,
    /// PETSc options, after `--`; they override those of the case
    #[arg(last = true, value_name = "PETSC OPTIONS", allow_hyphen_values = true)]
    pub petsc: Vec<String>,
}

/// Arguments of a study.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct StudyArguments {
    /// Study file
    pub study: PathBuf,
    /// Results folder; default: `results/` and the name of the study's folder or file
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// List the members without running them
    #[arg(long)]
    pub dry_run: bool,
    /// Run members that failed before again
    #[arg(long)]
    pub rerun_failed: bool,
    /// Print the output of the members (-v), with their Newton tables (-vv)
    #[arg(short, long, action = clap::ArgAction::Count, conflicts_with = "quiet")]
    pub verbose: u8,
    /// Print errors only; warnings of the members are in their run.json
    #[arg(short, long)]
    pub quiet: bool,
    /// PETSc options, after `--`; they override those of the case
    #[arg(last = true, value_name = "PETSC OPTIONS", allow_hyphen_values = true)]
    pub petsc: Vec<String>,
}

/// Arguments of a chart.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct ChartArguments {
    /// Table with a header row
    pub table: PathBuf,
    /// Column of the horizontal axis
    #[arg(long, value_name = "COLUMN")]
    pub x: String,
    /// Column of the vertical axis
    #[arg(long, value_name = "COLUMN")]
    pub y: String,
    /// Column that groups the rows into curves
    #[arg(long, value_name = "COLUMN")]
    pub by: String,
    /// Column that groups the rows into panels
    #[arg(long, value_name = "COLUMN")]
    pub panels: Option<String>,
    /// Use only rows in which a column has one of these values
    #[arg(long = "where", value_name = "COLUMN=VALUE,...")]
    pub only: Vec<String>,
    /// Draw only rows in which a column has one of these values, with gaps at the others
    #[arg(long, value_name = "COLUMN=VALUE,...")]
    pub valid: Vec<String>,
    /// Axes with logarithmic scale
    #[arg(long, value_name = "AXIS")]
    pub log: Vec<ChartAxis>,
    /// Title of the figure
    #[arg(long, default_value = "")]
    pub title: String,
    /// File of the figure
    #[arg(short, long, value_name = "SVG")]
    pub output: PathBuf,
}

/// An axis of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ChartAxis {
    /// Horizontal.
    X,
    /// Vertical.
    Y,
}

/// How much a run prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// Errors, and a run its warnings.
    Quiet,
    /// One line a step.
    Normal,
    /// The Newton table.
    Newton,
    /// The linear solvers, too.
    Linear,
}

impl RunArguments {
    /// How much the run prints.
    pub fn verbosity(&self) -> Detail {
        Detail::of(self.quiet, self.verbose)
    }
}

impl StudyArguments {
    /// How much the study prints.
    pub fn verbosity(&self) -> Detail {
        Detail::of(self.quiet, self.verbose)
    }
}

impl Detail {
    fn of(quiet: bool, verbose: u8) -> Self {
        match (quiet, verbose) {
            (true, _) => Self::Quiet,
            (false, 0) => Self::Normal,
            (false, 1) => Self::Newton,
            (false, _) => Self::Linear,
        }
    }
}

/// The requested command.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Compute a case.
    Run(RunArguments),
    /// Check a case without solving it.
    Check {
        /// Case file, or study file.
        case: PathBuf,
        /// PETSc's own options.
        petsc: Vec<String>,
    },
    /// List the names that a case can use, or the columns and fields of the results.
    List {
        /// Those of the results.
        results: bool,
    },
    /// Print the schema of a case file, or of a study file.
    Schema {
        /// Of a study file.
        study: bool,
        /// As a Markdown page.
        markdown: bool,
    },
    /// Run a study.
    Study(StudyArguments),
    /// Draw figures.
    Plot {
        /// Results folders, at least one.
        results: Vec<PathBuf>,
        /// Folder of the figures.
        output: Option<PathBuf>,
    },
    /// Write a page about results.
    Report {
        /// Results folder of a run or of a study.
        results: PathBuf,
        /// Times \[s\] at which the bodies are shown.
        at: Vec<f64>,
        /// File of the page.
        output: Option<PathBuf>,
    },
    /// Draw columns of a table.
    Chart(ChartArguments),
    /// Print the costs of numbers of parts.
    Parts {
        /// Case file.
        case: PathBuf,
        /// Numbers of parts, at least one.
        counts: Vec<u32>,
    },
    /// Print completions.
    Completions(Shell),
    /// Print this text and exit successfully: `--help`, `--version`.
    Print(String),
}

/// Reads a command line, the program's name first. `versions` are the lines that `--version` shows below its own.
///
/// # Errors
/// [`crate::error::Cause::Usage`] with the fault and the usage.
pub fn parse<I, T>(arguments: I, versions: &str) -> Result<Command>
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    let version = format!("{}\n{versions}", env!("CARGO_PKG_VERSION"));
    let command =
        Line::command().version(env!("CARGO_PKG_VERSION")).long_version(version.trim_end().to_string());
    let words: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let first = words.get(1).map(PathBuf::from);
    let line = command.try_get_matches_from(words).and_then(|matches| Line::from_arg_matches(&matches));
    let line = match line {
        Ok(line) => line,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            return Ok(Command::Print(error.render().to_string()));
        }
        Err(error) if error.kind() == ErrorKind::UnknownArgument => {
            return Err(first.and_then(|word| mistyped(&word)).unwrap_or_else(|| usage(&error)));
        }
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let cure = "run a case file with contact-petsc CASE; list commands and options with \
                        contact-petsc --help";
            return Err(Error::usage("no case file and no command").hint(cure));
        }
        Err(error) => return Err(usage(&error)),
    };
    match (line.command, line.run) {
        (None, Some(run)) | (Some(Sub::Run(run)), _) => Ok(Command::Run(run)),
        (Some(Sub::Check { case, petsc }), _) => Ok(Command::Check { case, petsc }),
        (Some(Sub::List { results }), _) => Ok(Command::List { results }),
        (Some(Sub::Schema { study, markdown }), _) => Ok(Command::Schema { study, markdown }),
        (Some(Sub::Study(study)), _) => Ok(Command::Study(study)),
        (Some(Sub::Plot { results, output }), _) => Ok(Command::Plot { results, output }),
        (Some(Sub::Report { results, at, output }), _) => Ok(Command::Report { results, at, output }),
        (Some(Sub::Chart(chart)), _) => Ok(Command::Chart(chart)),
        (Some(Sub::Parts { case, counts }), _) => Ok(Command::Parts { case, counts }),
        (Some(Sub::Completions { shell }), _) => Ok(Command::Completions(shell)),
        (None, None) => Err(Error::usage("no case file and no command")
            .hint("list commands and options with contact-petsc --help")),
    }
}

/// An instant \[s\].
fn instant(text: &str) -> std::result::Result<f64, String> {
    let time = text.trim().parse().ok().filter(|time: &f64| time.is_finite());
    time.ok_or_else(|| "expected a time in seconds, such as 0.05".to_owned())
}

/// The error for a word in the place of a command or case file that is neither; `None` for what looks like a file.
pub fn mistyped(word: &Path) -> Option<Error> {
    let text = word.to_str().filter(|_| !word.exists())?;
    let line = Line::command();
    let commands: Vec<&str> = line.get_subcommands().map(clap::Command::get_name).collect();
    let is_word = text.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_');
    if !is_word || text.is_empty() || commands.contains(&text) {
        return None;
    }
    let cure = nearest(text, &commands).map_or_else(
        || "list the commands with contact-petsc --help; the name of a case file ends in .yml".to_owned(),
        |command| format!("did you mean `contact-petsc {command}`?"),
    );
    Some(Error::usage(format!("no such command or case file: '{text}'")).hint(&cure))
}

/// clap's own text, whose first word this program adds itself.
fn usage(error: &clap::Error) -> Error {
    let text = error.render().to_string();
    Error::usage(text.trim().trim_start_matches("error: ").to_string())
}

/// The completions script of a shell.
pub fn completions(shell: Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Line::command(), "contact-petsc", &mut script);
    String::from_utf8_lossy(&script).into_owned()
}

#[cfg(test)]
mod tests;
