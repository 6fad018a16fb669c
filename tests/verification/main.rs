//! Is what the program solves the system of the formulation? Manufactured solutions, tangents, balances.
//!
//! Run as a test this program starts itself again, alone or by `mpirun`, once for each line of `RUNS`; with a check's
//! name in the environment it is one of the ranks and makes that check. `-- NAME` picks checks, `-- --nocapture` shows
//! the rates.

mod balances;
mod free_motions;
mod manufactured;
mod march;
mod motion;
mod scene;
mod stages;
mod tangent;
mod wave;

use std::process::{Command, ExitCode, Stdio};
use std::rc::Rc;
use std::time::{Duration, Instant};

use contact_petsc::petsc::Session;

const CHECK: &str = "CONTACT_PETSC_VERIFICATION";
/// Where a check may write.
const FOLDER: &str = "CONTACT_PETSC_VERIFICATION_FOLDER";

/// Most time that a run may take, generous for a loaded machine: a hang is a failure too.
const LIMIT: Duration = Duration::from_secs(300);

/// A check, and the numbers of ranks for it (0: started without `mpirun`).
type Run = (&'static str, fn(&Rc<Session>), &'static [u32]);

const RUNS: &[Run] = &[
    ("plane_elements", manufactured::plane_elements, &[0]),
    ("solid_elements", manufactured::solid_elements, &[2]),
    ("patches", manufactured::patches, &[0, 2]),
    ("schemes", motion::schemes, &[2]),
    ("start", motion::start, &[0]),
    ("balances", balances::all, &[0, 3]),
    ("tangents", tangent::all, &[0, 2, 3]),
    ("free_motions", free_motions::all, &[0, 2, 3, 4]),
    ("stages", stages::all, &[0, 2, 3]),
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
        failures += ranks.iter().filter(|&&ranks| !passes(name, ranks, shows)).count();
    }
    ExitCode::from(u8::from(failures > 0))
}

fn passes(name: &str, ranks: u32, shows: bool) -> bool {
    let started = Instant::now();
    let (good, output) = start(name, ranks);
    let verdict = if good { "ok" } else { "FAILED" };
    println!(
        "test verification::{name}_on_{ranks}_ranks ... {verdict} ({:.1} s)",
        started.elapsed().as_secs_f64()
    );
    if !good || shows {
        println!("{output}");
    }
    good
}

/// Whether the check holds, and everything printed.
fn start(name: &str, ranks: u32) -> (bool, String) {
    let this = std::env::current_exe().expect("the path of this program");
    let mut command = match ranks {
        0 => Command::new(this),
        _ => {
            let mut mpirun = Command::new("mpirun");
            mpirun.args(["-n", &ranks.to_string()]).arg(this);
            mpirun
        }
    };
    let folder = std::env::temp_dir().join(format!("contact-petsc-{}-{name}-{ranks}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    command.env(CHECK, name).env(FOLDER, &folder).envs([
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OMPI_MCA_hwloc_base_binding_policy", "none"),
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
        ("OPENBLAS_NUM_THREADS", "1"),
    ]);
    let log = folder.join("log");
    let file = std::fs::File::create(&log).expect("a file for the output");
    let error = file.try_clone().expect("a second handle");
    let mut child = command.stdin(Stdio::null()).stdout(file).stderr(error).spawn().expect("the run starts");
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
    let output = String::from_utf8_lossy(&std::fs::read(&log).unwrap_or_default()).into_owned();
    let _ = std::fs::remove_dir_all(&folder);
    let good = status.is_some_and(|status| status.success()) && output.contains(&format!("{name} holds"));
    (good, output)
}
