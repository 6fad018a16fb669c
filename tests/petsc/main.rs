//! The owners of PETSc's objects on one and more ranks.
//!
//! Run as a test, this program starts itself again with `mpirun`, once for each line of `RUNS`.
//! With the name of a case in the environment it is one of the ranks and runs that case.

mod algebra;
#[path = "../common/mod.rs"]
mod common;
mod faults;
mod lattice;
mod solvers;

use std::process::ExitCode;
use std::time::Duration;

use common::Running;

const CASE: &str = "CONTACT_PETSC_TEST_CASE";

/// Time limit of a run, generous for a loaded machine. A hang is a failure, too.
const LIMIT: Duration = Duration::from_secs(300);

/// A case, the number of ranks (at most one: started without `mpirun`), the exit code and the expected
/// output.
type Run = (&'static str, usize, i32, &'static str);

const RUNS: &[Run] = &[
    ("algebra", 0, 0, "algebra done"),
    ("algebra", 2, 0, "algebra done"),
    ("algebra", 3, 0, "algebra done"),
    ("solvers", 1, 0, "solvers done"),
    ("solvers", 2, 0, "solvers done"),
    ("solvers", 3, 0, "solvers done"),
    ("panic_on_one_rank", 2, 70, "internal error: rank 1 gives up"),
    ("abort_on_one_rank", 3, 7, ""),
    ("error_on_one_rank", 3, 4, "error: rank 1 alone fails"),
    ("error_on_all_ranks", 3, 4, "error: all ranks fail"),
    ("errors", 1, 0, "errors done"),
    ("options", 2, 0, "options done"),
];

fn main() -> ExitCode {
    if let Ok(case) = std::env::var(CASE) {
        run_case(&case);
        return ExitCode::SUCCESS;
    }
    let filter = std::env::args().skip(1).find(|argument| !argument.starts_with('-')).unwrap_or_default();
    let runs = RUNS.iter().filter(|run| run.0.contains(&filter));
    let failures = runs.filter(|run| !passes(run)).count();
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn run_case(case: &str) {
    match case {
        "algebra" => algebra::run(),
        "solvers" => solvers::run(),
        "panic_on_one_rank" => faults::panic_on_one_rank(),
        "error_on_one_rank" => faults::error_on_one_rank(),
        "error_on_all_ranks" => faults::error_on_all_ranks(),
        "abort_on_one_rank" => faults::abort_on_one_rank(),
        "errors" => faults::errors(),
        "options" => faults::options(),
        other => panic!("no case {other}"),
    }
}

fn passes(&(case, ranks, code, text): &Run) -> bool {
    let run = Running::of_this_test(ranks, &[(CASE, case.as_ref())]).wait(LIMIT);
    let (actual, output) = (run.code, run.text());
    let good = actual == Some(code) && output.contains(text);
    let verdict = if good { "ok" } else { "FAILED" };
    println!("test petsc::{case}_on_{ranks}_ranks ... {verdict} ({:.1} s)", run.took.as_secs_f64());
    let shows = std::env::args().any(|argument| argument == "--nocapture");
    if !good || shows {
        println!("exit code {actual:?}, expected {code} and the text {text:?}\n{output}");
    }
    good
}
