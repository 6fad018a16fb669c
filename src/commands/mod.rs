//! The commands of the program. Each consists of a few calls to the other modules.

mod chart;
mod check;
mod list;
mod parts;
mod run;
mod study;

use std::io::{ErrorKind, Write};

use crate::case;
use crate::cli::{self, Command};
use crate::error::{Error, Result};
use crate::output::reference::results_reference;
use crate::plot;

/// Executes the command line. Collective for the commands that compute.
///
/// # Errors
/// The command fails; the error is the same on all ranks.
pub fn execute(command: Command) -> Result<()> {
    match command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Schema { study, markdown: true } => {
            let page =
                if study { case::study_reference(&crate::study::schema()) } else { case::case_reference() };
            print(page.trim_end())
        }
        Command::Schema { study, markdown: false } => {
            let schema = if study { crate::study::schema() } else { case::schema() };
            print(&serde_json::to_string_pretty(&schema).map_err(fault)?)
        }
        Command::Study(arguments) => study::study(&arguments),
        Command::Completions(shell) => print(&cli::completions(shell)),
        Command::Print(text) => print(text.trim_end()),
        Command::Plot { results, output } => {
            let plotted = plot::plot(&results, output.as_deref())?;
            print_notes(&plotted.notes)?;
            let files: Vec<String> = plotted.files.iter().map(|file| file.display().to_string()).collect();
            print(&files.join("\n"))
        }
        Command::Report { results, at, output } => {
            let written = crate::report::report(&results, &at, output.as_deref())?;
            print_notes(&written.notes)?;
            print(&written.file.display().to_string())
        }
        Command::Chart(chart) => print_notes(&plot::draw_table(&chart::figure(&chart)?, &chart.output)?),
        Command::Parts { case, counts } => print(parts::parts(&case, &counts)?.trim_end()),
        Command::Check { case, petsc } => print(&check::check(&case, &petsc)?),
        Command::List { results: true } => print(results_reference().trim_end()),
        Command::List { results: false } => print(&list::list()),
    }
}

/// Whether this process prints: it is the only process, or rank 0 under Open MPI. This also works
/// before MPI has started.
pub fn speaks() -> bool {
    std::env::var("OMPI_COMM_WORLD_RANK").map_or(true, |rank| rank == "0")
}

/// Prints to standard output. A reader that has closed the pipe is not an error.
///
/// # Errors
/// The output could not be written, for example on a full disk.
fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout();
    if speaks() {
        spoken("standard output", writeln!(out, "{text}").and_then(|()| out.flush()))
    } else {
        Ok(())
    }
}

/// Prints notes on what was left out on standard error.
fn print_notes(notes: &[String]) -> Result<()> {
    let text: String = notes.iter().map(|note| format!("note: {note}\n")).collect();
    spoken("standard error", std::io::stderr().write_all(text.as_bytes()))
}

fn spoken(place: &str, outcome: std::io::Result<()>) -> Result<()> {
    match outcome {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let text = format!("{place} can not be written: {error}");
            Err(Error::file(text)
                .hint("the output of this command is incomplete; redirect it to another file or device"))
        }
        _ => Ok(()),
    }
}

fn fault(error: serde_json::Error) -> Error {
    Error::internal(error.to_string())
}
