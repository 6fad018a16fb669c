//! What lines mean, and what is said of those that mean nothing.

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

/// Only finite instants are times.
#[test]
fn instants_are_finite() {
    let times = |line: &str| match read(line) {
        Ok(Command::Report { at, .. }) => Ok(at),
        Ok(other) => panic!("{line}: {other:?}"),
        Err(error) => Err(error),
    };
    assert_eq!(times("report out --at 0,-1e-3,2.5").unwrap(), [0.0, -1e-3, 2.5]);
    for word in ["nan", "0,inf", "-inf", "1e999", "soon", ""] {
        let error = times(&format!("report out --at={word}")).unwrap_err();
        assert!(
            error.cause == Cause::Usage && error.message.contains("a time in seconds, such as 0.05"),
            "{word}: {error}"
        );
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
        restart: None,
        anew: false,
        wall_time: None,
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
    let levels = [("", Detail::Normal), ("-q", Detail::Quiet), ("-v", Detail::Newton)];
    for (flag, level) in levels.into_iter().chain([("-vv", Detail::Linear), ("-vvv", Detail::Linear)]) {
        assert_eq!(run(&format!("case.yml {flag}")).verbosity(), level);
    }
}

/// A restart names its checkpoint after `=` or none.
#[test]
fn restarts_are_read() {
    assert_eq!(run("--restart case.yml --wall-time 2min").restart, Some(None));
    assert_eq!(run("case.yml --restart=a.ckpt").restart, Some(Some("a.ckpt".into())));
    assert!(read("case.yml --wall-time soon").is_err());
    assert!(run("case.yml --anew").anew);
    assert!(read("case.yml --anew --restart").is_err());
}

/// The other commands read their arguments.
#[test]
fn commands_are_read() {
    let petsc = vec!["-info".to_string()];
    assert_eq!(read("check case.yml -- -info").unwrap(), Command::Check { case: "case.yml".into(), petsc });
    assert_eq!(read("list").unwrap(), Command::List { results: false });
    assert_eq!(read("list --results").unwrap(), Command::List { results: true });
    assert_eq!(read("schema").unwrap(), Command::Schema { study: false, markdown: false });
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
    assert_eq!((study.verbosity(), study.output), (Detail::Newton, Some("a".into())));
    assert_eq!(read("schema --study").unwrap(), Command::Schema { study: true, markdown: false });
    assert_eq!(read("schema --markdown").unwrap(), Command::Schema { study: false, markdown: true });
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
        ("", "no case file and no command"),
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
