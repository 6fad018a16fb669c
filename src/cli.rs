//! The command line: `contact-petsc case.yml`, its sisters, and what they take.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::Shell;

use crate::error::{Error, Result};

const EXAMPLES: &str = "\
Examples:
  contact-petsc meshes/rubber-block/case.yml
  mpirun -n 2 contact-petsc meshes/rubber-block/case.yml --output results/block
  contact-petsc check case.yml
  contact-petsc case.yml -v -- -log_view
  contact-petsc plot results/block results/block-power-law
  contact-petsc study meshes/rubber-block/study.yml

Exit codes: 0 done, 2 usage, 3 invalid case, 4 mesh or file, 5 not converged (results up to the last good step are
kept), 6 physics guard, 70 internal fault.";

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
    /// Compute a case; the word may be left out
    Run(RunArguments),
    /// Parse, mesh and pair a case, print it completed with derived numbers, solve nothing
    Check {
        /// Case file
        case: PathBuf,
        /// PETSc's own options, after `--`
        #[arg(last = true, value_name = "PETSC OPTIONS", allow_hyphen_values = true)]
        petsc: Vec<String>,
    },
    /// List what a case can name: elements, materials, laws, schemes, solvers
    List,
    /// Print the JSON schema (draft-07) of a case file, for editors
    Schema {
        /// That of a study file instead
        #[arg(long)]
        study: bool,
    },
    /// Run a study: a case with keys varied, errors against costs, advice; goes on where it was left
    Study(StudyArguments),
    /// Draw figures (SVG) of one result, or of several in common figures
    Plot {
        /// Results folders
        #[arg(required = true)]
        results: Vec<PathBuf>,
        /// Folder of the figures; the first results folder unless given
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
    },
    /// Write one page about a result or a study, report.html: pictures, numbers, warnings, the case; needs no network
    Report {
        /// Results folder of a run or of a study
        results: PathBuf,
        /// Times [s] at which the bodies are shown; start, middle and end unless given
        #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', allow_negative_numbers = true)]
        at: Vec<f64>,
        /// File of the page; `report.html` in the results folder unless given
        #[arg(short, long, value_name = "HTML")]
        output: Option<PathBuf>,
    },
    /// Draw columns of a table (CSV) over another one: curves of studies, as scripts/compare-solvers makes them
    Chart(ChartArguments),
    /// Cut the mesh of a case into parts without solving, print what each number of parts would cost (CSV)
    Parts {
        /// Case file
        case: PathBuf,
        /// Numbers of parts
        #[arg(required = true, value_parser = clap::value_parser!(u32).range(1..=65536))]
        counts: Vec<u32>,
    },
    /// Print completions for a shell, to be sourced or saved where the shell looks
    Completions {
        /// Shell
        shell: Shell,
    },
}

/// What a run takes.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct RunArguments {
    /// Case file
    pub case: PathBuf,
    /// Results folder; `results/` and the name of the case's folder or file unless given
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Print the Newton table (-v), and the linear solvers' iterations (-vv)
    #[arg(short, long, action = clap::ArgAction::Count, conflicts_with = "quiet")]
    pub verbose: u8,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// PETSc's own options, after `--`; they win over those of the case
    #[arg(last = true, value_name = "PETSC OPTIONS", allow_hyphen_values = true)]
    pub petsc: Vec<String>,
}

/// What a study takes.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct StudyArguments {
    /// Study file
    pub study: PathBuf,
    /// Results folder; `results/` and the name of the study's folder or file unless given
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// List the members, run none
    #[arg(long)]
    pub dry_run: bool,
    /// Run members once more that failed before
    #[arg(long)]
    pub rerun_failed: bool,
    /// Let the members speak (-v), with their Newton tables (-vv)
    #[arg(short, long, action = clap::ArgAction::Count, conflicts_with = "quiet")]
    pub verbose: u8,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// PETSc's own options, after `--`; they win over those of the case
    #[arg(last = true, value_name = "PETSC OPTIONS", allow_hyphen_values = true)]
    pub petsc: Vec<String>,
}

/// What a chart takes.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct ChartArguments {
    /// Table with a header row
    pub table: PathBuf,
    /// Column across
    #[arg(long, value_name = "COLUMN")]
    pub x: String,
    /// Column upward
    #[arg(long, value_name = "COLUMN")]
    pub y: String,
    /// Column that parts the rows into curves
    #[arg(long, value_name = "COLUMN")]
    pub by: String,
    /// Column that parts the rows into panels
    #[arg(long, value_name = "COLUMN")]
    pub panels: Option<String>,
    /// Only rows in which a column has one of these values
    #[arg(long = "where", value_name = "COLUMN=VALUE,...")]
    pub only: Vec<String>,
    /// Rows in which a column has none of these values are gaps in their curves
    #[arg(long, value_name = "COLUMN=VALUE,...")]
    pub valid: Vec<String>,
    /// Axes with a logarithmic scale
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
    /// Across.
    X,
    /// Upward.
    Y,
}

/// How much a run says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// One line a step.
    Normal,
    /// The Newton table.
    Newton,
    /// The linear solvers, too.
    Linear,
}

impl RunArguments {
    /// How much the run says.
    pub fn verbosity(&self) -> Verbosity {
        Verbosity::of(self.quiet, self.verbose)
    }
}

impl StudyArguments {
    /// How much the study says.
    pub fn verbosity(&self) -> Verbosity {
        Verbosity::of(self.quiet, self.verbose)
    }
}

impl Verbosity {
    fn of(quiet: bool, verbose: u8) -> Self {
        match (quiet, verbose) {
            (true, _) => Self::Quiet,
            (false, 0) => Self::Normal,
            (false, 1) => Self::Newton,
            (false, _) => Self::Linear,
        }
    }
}

/// What the user asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Compute a case.
    Run(RunArguments),
    /// Check a case without solving it.
    Check {
        /// Case file.
        case: PathBuf,
        /// PETSc's own options.
        petsc: Vec<String>,
    },
    /// List what a case can name.
    List,
    /// Print the schema of a case file, or of a study file.
    Schema {
        /// Of a study file.
        study: bool,
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
        /// Times [s] at which the bodies are shown.
        at: Vec<f64>,
        /// File of the page.
        output: Option<PathBuf>,
    },
    /// Draw columns of a table.
    Chart(ChartArguments),
    /// Count what numbers of parts would cost.
    Parts {
        /// Case file.
        case: PathBuf,
        /// Numbers of parts, at least one.
        counts: Vec<u32>,
    },
    /// Print completions.
    Completions(Shell),
    /// Print this text and end well: `--help`, `--version`.
    Print(String),
}

/// Reads a command line, the program's name first. `versions` are the lines that `--version` shows below its own.
///
/// # Errors
/// [`crate::error::Cause::Usage`] with what is wrong and how it is used.
pub fn parse<I, T>(arguments: I, versions: &str) -> Result<Command>
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    let version = format!("{}\n{versions}", env!("CARGO_PKG_VERSION"));
    let command =
        Line::command().version(env!("CARGO_PKG_VERSION")).long_version(version.trim_end().to_string());
    let line = command.try_get_matches_from(arguments).and_then(|matches| Line::from_arg_matches(&matches));
    let line = match line {
        Ok(line) => line,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            return Ok(Command::Print(error.render().to_string()));
        }
        Err(error) => return Err(usage(&error)),
    };
    match (line.command, line.run) {
        (None, Some(run)) | (Some(Sub::Run(run)), _) => Ok(Command::Run(run)),
        (Some(Sub::Check { case, petsc }), _) => Ok(Command::Check { case, petsc }),
        (Some(Sub::List), _) => Ok(Command::List),
        (Some(Sub::Schema { study }), _) => Ok(Command::Schema { study }),
        (Some(Sub::Study(study)), _) => Ok(Command::Study(study)),
        (Some(Sub::Plot { results, output }), _) => Ok(Command::Plot { results, output }),
        (Some(Sub::Report { results, at, output }), _) => Ok(Command::Report { results, at, output }),
        (Some(Sub::Chart(chart)), _) => Ok(Command::Chart(chart)),
        (Some(Sub::Parts { case, counts }), _) => Ok(Command::Parts { case, counts }),
        (Some(Sub::Completions { shell }), _) => Ok(Command::Completions(shell)),
        (None, None) => Err(Error::usage("no case is given").hint("contact-petsc --help")),
    }
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
mod tests {
    use super::*;
    use crate::error::Cause;

    const VERSIONS: &str = "PETSc 3.18.5\nOpen MPI 4.1.4\nMETIS 5.1.0\n";

    fn read(line: &str) -> Result<Command> {
        parse(std::iter::once("contact-petsc").chain(line.split_whitespace()), VERSIONS)
    }

    fn run(line: &str) -> RunArguments {
        match read(line) {
            Ok(Command::Run(run)) => run,
            other => panic!("{line}: {other:?}"),
        }
    }

    fn printed(line: &str) -> String {
        match read(line) {
            Ok(Command::Print(text)) => text,
            other => panic!("{line}: {other:?}"),
        }
    }

    /// The definition is consistent in clap's own eyes.
    #[test]
    fn the_definition_is_sound() {
        Line::command().debug_assert();
    }

    /// A first argument that is no command is a case.
    #[test]
    fn a_case_alone_is_a_run() {
        let plain = RunArguments {
            case: "case.yml".into(),
            output: None,
            verbose: 0,
            quiet: false,
            petsc: Vec::new(),
        };
        assert_eq!(run("case.yml"), plain);
        assert_eq!(run("run case.yml"), plain);
        assert_eq!(run("run run").case, PathBuf::from("run"));
        assert_eq!(run("./check").case, PathBuf::from("./check"));
    }

    /// Options stand before and after the case, PETSc's after `--`, whatever they look like.
    #[test]
    fn options_reach_the_run() {
        for line in ["case.yml -vv --output out", "run -o out -v -v case.yml"] {
            let run = run(&format!("{line} -- -ksp_monitor -pc_type lu -v --help"));
            assert_eq!(run.output, Some("out".into()));
            assert_eq!(run.petsc, ["-ksp_monitor", "-pc_type", "lu", "-v", "--help"]);
        }
        let levels = [("", Verbosity::Normal), ("-q", Verbosity::Quiet), ("-v", Verbosity::Newton)];
        for (flag, level) in
            levels.into_iter().chain([("-vv", Verbosity::Linear), ("-vvv", Verbosity::Linear)])
        {
            assert_eq!(run(&format!("case.yml {flag}")).verbosity(), level);
        }
    }

    /// The other commands read their arguments.
    #[test]
    fn commands_are_read() {
        let petsc = vec!["-info".to_string()];
        assert_eq!(
            read("check case.yml -- -info").unwrap(),
            Command::Check { case: "case.yml".into(), petsc }
        );
        assert_eq!(read("list").unwrap(), Command::List);
        assert_eq!(read("schema").unwrap(), Command::Schema { study: false });
        let results = vec![PathBuf::from("a"), PathBuf::from("b")];
        assert_eq!(read("plot a b -o c").unwrap(), Command::Plot { results, output: Some("c".into()) });
        assert_eq!(
            read("parts case.yml 2 64").unwrap(),
            Command::Parts { case: "case.yml".into(), counts: vec![2, 64] }
        );
        assert_eq!(
            read("report a --at 0,0.5 -o a.html").unwrap(),
            Command::Report { results: "a".into(), at: vec![0.0, 0.5], output: Some("a.html".into()) }
        );
        let study = match read("study s.yml --rerun-failed -v -o a -- -ksp_monitor") {
            Ok(Command::Study(study)) => study,
            other => panic!("{other:?}"),
        };
        assert!(study.rerun_failed && !study.dry_run && study.petsc == ["-ksp_monitor"]);
        assert_eq!((study.verbosity(), study.output), (Verbosity::Newton, Some("a".into())));
        assert_eq!(read("schema --study").unwrap(), Command::Schema { study: true });
        let chart = match read("chart a.csv --x m --y s --by k --where v=a,b --where c=0 --log x -o a.svg") {
            Ok(Command::Chart(chart)) => chart,
            other => panic!("{other:?}"),
        };
        assert_eq!((&chart.x[..], &chart.y[..], &chart.log[..]), ("m", "s", &[ChartAxis::X][..]));
        assert_eq!(chart.only, ["v=a,b", "c=0"]);
        assert_eq!(read("completions bash").unwrap(), Command::Completions(Shell::Bash));
    }

    /// A wrong line is a usage error, exit code 2, that says what is wrong.
    #[test]
    fn wrong_lines_are_usage_errors() {
        for (line, words) in [
            ("", "Usage"),
            ("run", "CASE"),
            ("case.yml other.yml", "other.yml"),
            ("case.yml --outptu x", "--outptu"),
            ("case.yml -q -v", "--quiet"),
            ("case.yml --output", "--output"),
            ("case.yml -ksp_monitor", "-k"),
            ("plot", "RESULTS"),
            ("chart a.csv --x m", "--y"),
            ("parts case.yml 0", "0"),
            ("completions tcsh", "bash"),
            ("list more", "more"),
        ] {
            let error = read(line).map(|command| panic!("{line}: {command:?}")).unwrap_err();
            assert_eq!((error.cause, error.exit_code()), (Cause::Usage, 2), "{line}");
            assert!(
                error.message.contains(words) && !error.message.starts_with("error"),
                "{line}: {}",
                error.message
            );
        }
    }

    /// Help has an example, the version names the libraries.
    #[test]
    fn help_and_version_inform() {
        for words in ["mpirun -n 2 contact-petsc", "--output", "plot", "Exit codes", "-- -log_view"] {
            assert!(printed("--help").contains(words), "{words}: {}", printed("--help"));
        }
        assert!(printed("plot --help").contains("RESULTS"));
        assert!(printed("--version").contains("PETSc 3.18.5\nOpen MPI 4.1.4\nMETIS 5.1.0"));
        assert_eq!(printed("-V").trim(), format!("contact-petsc {}", env!("CARGO_PKG_VERSION")));
    }

    /// Completions know the commands.
    #[test]
    fn completions_know_the_commands() {
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            assert!(completions(shell).contains("schema"), "{shell}");
        }
    }
}
