//! The owners of PETSc's objects on one and more ranks.
//!
//! Run as a test this program starts itself again by `mpirun`, once for each line of `RUNS`; with a case's name in
//! the environment it is one of the ranks and runs that case.

mod algebra;
mod faults;
mod lattice;
mod solvers;

use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

const CASE: &str = "CONTACT_PETSC_TEST_CASE";

/// Most time that a run may take, generous for a loaded machine: a hang is a failure too.
const LIMIT: Duration = Duration::from_secs(60);

/// A case, the number of ranks (0: started without `mpirun`), the exit code and a text to be printed.
type Run = (&'static str, u32, i32, &'static str);

const RUNS: &[Run] = &[
    ("algebra", 0, 0, "algebra done"),
    ("algebra", 2, 0, "algebra done"),
    ("algebra", 3, 0, "algebra done"),
    ("solvers", 1, 0, "solvers done"),
    ("solvers", 2, 0, "solvers done"),
    ("solvers", 3, 0, "solvers done"),
    ("panic_on_one_rank", 2, 70, "fault of the program: rank 1 gives up"),
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
    let started = Instant::now();
    let (actual, output) = start(case, ranks);
    let good = actual == Some(code) && output.contains(text);
    let verdict = if good { "ok" } else { "FAILED" };
    println!("test petsc::{case}_on_{ranks}_ranks ... {verdict} ({:.1} s)", started.elapsed().as_secs_f64());
    let shows = std::env::args().any(|argument| argument == "--nocapture");
    if !good || shows {
        println!("exit code {actual:?}, expected {code} and the text {text:?}\n{output}");
    }
    good
}

/// Exit code (none: killed for its time) and everything printed.
fn start(case: &str, ranks: u32) -> (Option<i32>, String) {
    let this = std::env::current_exe().expect("the path of this program");
    let mut command = match ranks {
        0 => Command::new(this),
        _ => {
            let mut mpirun = Command::new("mpirun");
            mpirun.args(["-n", &ranks.to_string()]).arg(this);
            mpirun
        }
    };
    command.env(CASE, case).envs([
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OMPI_MCA_hwloc_base_binding_policy", "none"),
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
        ("OPENBLAS_NUM_THREADS", "1"),
    ]);
    let log = std::env::temp_dir().join(format!("contact-petsc-test-{}-{case}-{ranks}", std::process::id()));
    let file = std::fs::File::create(&log).expect("a file for the output");
    let error = file.try_clone().expect("a second handle");
    let mut child = command.stdin(Stdio::null()).stdout(file).stderr(error).spawn().expect("mpirun starts");
    let deadline = Instant::now() + LIMIT;
    let status = loop {
        match child.try_wait().expect("the state of the run") {
            Some(status) => break Some(status),
            None if Instant::now() > deadline => break None,
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    if status.is_none() {
        let _ = child.kill().and_then(|()| child.wait());
    }
    let output = std::fs::read(&log).unwrap_or_default();
    let _ = std::fs::remove_file(&log);
    (status.and_then(|status| status.code()), String::from_utf8_lossy(&output).into_owned())
}
