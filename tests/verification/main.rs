//! Does the program solve the system of `docs/theory.md`? Manufactured solutions, tangents,
//! balances.
//!
//! Run as a test, this program starts itself again, alone or with `mpirun`, once for each line of
//! `RUNS`. With the name of a check in the environment it is one of the ranks and runs that check.
//! `-- NAME` selects checks, `-- --nocapture` shows the rates.

mod balances;
mod cases;
#[path = "../common/mod.rs"]
mod common;
mod free_motions;
mod manufactured;
mod march;
mod motion;
mod mutants;
mod oscillator;
mod scene;
mod stages;
mod tangent;
mod wave;

use std::process::ExitCode;
use std::rc::Rc;
use std::time::Duration;

use common::{Folder, Running};
use contact_petsc::petsc::Session;

const CHECK: &str = "CONTACT_PETSC_VERIFICATION";
/// Folder in which a check may write.
const FOLDER: &str = "CONTACT_PETSC_VERIFICATION_FOLDER";

/// Time limit of a run, generous for a loaded machine. A hang is a failure, too.
const LIMIT: Duration = Duration::from_secs(300);

/// Time limit for a mesh of a longer sweep.
const MESH: Duration = Duration::from_secs(2);

/// A check, and the numbers of ranks for it (at most one: started without `mpirun`).
type Run = (&'static str, fn(&Rc<Session>), &'static [usize]);

const RUNS: &[Run] = &[
    ("plane_elements", manufactured::plane_elements, &[0]),
    ("solid_elements", manufactured::solid_elements, &[2]),
    ("patches", manufactured::patches, &[0, 2]),
    ("schemes", motion::schemes, &[2]),
    ("oscillator", oscillator::orders, &[0]),
    ("start", motion::start, &[0]),
    ("balances", balances::all, &[0, 3]),
    ("tangents", tangent::all, &[0, 2, 3]),
    ("free_motions", free_motions::all, &[0, 2, 3, 4]),
    ("stages", stages::all, &[0, 2, 3]),
    ("mutants", mutants::all, &[0, 3]),
];

fn main() -> ExitCode {
    if let Ok(name) = std::env::var(CHECK) {
        let session = Session::start(&[]).expect("MPI and PETSc start");
        let (_, check, _) = RUNS.iter().find(|run| run.0 == name).expect("a check of that name");
        check(&session);
        if session.rank() == 0 {
            println!("{name} holds");
        }
        return ExitCode::SUCCESS;
    }
    let filter = std::env::args().skip(1).find(|argument| !argument.starts_with('-')).unwrap_or_default();
    let shows = std::env::args().any(|argument| argument == "--nocapture");
    let mut failures = 0;
    for (name, _, ranks) in RUNS.iter().filter(|run| run.0.contains(&filter)) {
        let ranks = if mutants::longer_sweep().is_some() { &[0] } else { *ranks };
        failures += ranks.iter().filter(|&&ranks| !passes(name, ranks, shows)).count();
    }
    ExitCode::from(u8::from(failures > 0))
}

fn passes(name: &str, ranks: usize, shows: bool) -> bool {
    let folder = Folder::new(name);
    let told = [(CHECK, name.as_ref()), (FOLDER, folder.as_os_str())];
    // A longer sweep of meshes takes its time.
    let limit = mutants::longer_sweep().map_or(LIMIT, |(count, _)| LIMIT + MESH * count as u32);
    let run = Running::of_this_test(ranks, &told).wait(limit);
    let output = run.text();
    let good = run.code == Some(0) && output.contains(&format!("{name} holds"));
    let verdict = if good { "ok" } else { "FAILED" };
    println!("test verification::{name}_on_{ranks}_ranks ... {verdict} ({:.1} s)", run.took.as_secs_f64());
    if !good || shows {
        println!("{output}");
    }
    good
}
