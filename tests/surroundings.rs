//! A run among terminals, pipes and libraries: none of them ends it, slows it down, or goes unrecorded.

mod common;

use std::fs;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use common::{ENVIRONMENT, Folder, PROGRAM, SMALL_BLOCK, Table, send};

/// A line of the shell in which `$PROGRAM` is the program; without `OPENBLAS_NUM_THREADS` and `OMP_NUM_THREADS`, which the
/// program does not need.
fn shell(line: &str, folder: &Folder) -> Output {
    let mut command = Command::new("timeout");
    command.args(["-k", "5", "90", "bash", "-c", line]).current_dir(&**folder).env("PROGRAM", PROGRAM);
    command.envs(ENVIRONMENT).env_remove("OPENBLAS_NUM_THREADS").env_remove("OMP_NUM_THREADS");
    command.output().expect("bash starts")
}

fn record(folder: &Folder) -> serde_json::Value {
    let text = fs::read_to_string(folder.join("out/run.json")).expect("a record");
    serde_json::from_str(&text).expect("JSON")
}

/// A case that goes on for thousands of steps.
fn long(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("case.yml", &SMALL_BLOCK.replace("end: 0.002", "end: 0.3"));
    folder
}

/// The BLAS has one thread, unless the user chose another number; both are on record, with the libraries by their names.
#[test]
fn the_blas_has_one_thread_unless_told() {
    let folder = Folder::new("threads");
    folder.write("case.yml", SMALL_BLOCK);
    let threads = |before: &str| {
        let output = shell(&format!("{before} $PROGRAM case.yml -q -o out"), &folder);
        assert!(output.status.success(), "{output:?}");
        record(&folder)["blas_threads"].clone()
    };
    let [own, chosen] = [threads(""), threads("OPENBLAS_NUM_THREADS=2")];
    if !own.is_null() {
        assert_eq!(own, 1);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        assert_eq!(chosen, cores.min(2));
    }
    let record = record(&folder);
    let versions = record["versions"].as_object().expect("versions");
    let names: Vec<&str> = versions.keys().map(String::as_str).collect();
    assert_eq!([names[0], names[1], names[3]], ["contact-petsc", "PETSc", "METIS"], "{names:?}");
    assert!(["Open MPI", "MPICH", "Intel(R) MPI Library"].contains(&names[2]), "{names:?}");
    let number = |text: &str| text.trim_start_matches('v').starts_with(|first: char| first.is_ascii_digit());
    assert!(versions.values().all(|version| version.as_str().is_some_and(number)), "{versions:?}");
}

/// A reader that goes away after three lines does not end the run, on one rank and on two.
#[test]
fn a_closed_pipe_ends_no_run_on_1_and_2_ranks() {
    for start in ["", "mpirun -n 2 "] {
        let folder = Folder::new("pipe");
        folder.write("case.yml", SMALL_BLOCK);
        let line = format!("{start}$PROGRAM case.yml -v -o out 2>&1 | head -3; exit ${{PIPESTATUS[0]}}");
        let output = shell(&line, &folder);
        if !start.is_empty() && record(&folder)["verdict"] == "stopped" {
            continue; // Open MPI 5 may ask its ranks to stop when its own output has nowhere to go.
        }
        assert_eq!(record(&folder)["verdict"], "completed", "{output:?}");
        assert!(!start.is_empty() || output.status.success(), "{output:?}");
        assert_eq!(Table::read(&folder.join("out/energy.csv")).len(), 5);
    }
}

/// A folder that a run writes into is refused to a second one, which changes nothing; a run that was killed is told from one
/// that goes on, and its folder is free.
#[test]
fn two_runs_do_not_share_a_folder() {
    let folder = Folder::new("shared");
    folder.write("case.yml", &SMALL_BLOCK.replace("end: 0.002", "end: 30.0"));
    let line = "$PROGRAM case.yml -q -o out & first=$!
        until [ -s out/energy.csv ]; do sleep 0.01; done
        $PROGRAM case.yml -q -o out; echo $?; $PROGRAM case.yml -q -o out --restart; echo $?
        $PROGRAM plot out; kill -9 $first; wait $first
        $PROGRAM plot out; $PROGRAM report out > page; grep -c '>killed</span>' out/report.html";
    let output = shell(line, &folder);
    let [said, warned] =
        [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    let codes: Vec<&str> = said.lines().filter(|line| line.parse::<i32>().is_ok()).collect();
    assert_eq!(codes, ["4", "4", "1"], "{output:?}");
    assert!(warned.contains("out: a run is writing there, process "), "{warned}");
    let verdicts: Vec<bool> = warned
        .lines()
        .filter(|line| line.contains("(verdict: "))
        .map(|line| line.contains("killed"))
        .collect();
    assert_eq!(verdicts, [false, true, true], "{warned}");
    let rows = Table::read(&folder.join("out/energy.csv")).numbers("step");
    assert!(rows.iter().zip(0..).all(|(&row, step)| row == f64::from(step)), "{rows:?}");
    fs::write(folder.join("case.yml"), SMALL_BLOCK).expect("a case that ends");
    assert!(shell("$PROGRAM case.yml -q -o out", &folder).status.success());
}

/// Under `nohup` a terminal that goes away is no reason to stop; without, it is one (tests/restart).
#[test]
fn nohup_keeps_a_run_going() {
    let folder = long("nohup");
    let line = "nohup $PROGRAM case.yml -q -o out > log 2>&1 & echo $! > id; wait $!";
    let mut command = Command::new("timeout");
    command.args(["-k", "5", "90", "bash", "-c", line]).current_dir(&*folder).env("PROGRAM", PROGRAM);
    let mut running = command.envs(ENVIRONMENT).spawn().expect("bash starts");
    let rows = || fs::read_to_string(folder.join("out/energy.csv")).map_or(0, |text| text.lines().count());
    let wait_for = |count: usize| {
        let deadline = Instant::now() + Duration::from_secs(60);
        while rows() < count && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        rows()
    };
    assert!(wait_for(5) >= 5);
    let id = fs::read_to_string(folder.join("id")).expect("the process");
    assert!(send("HUP", id.trim()));
    let reached = rows();
    assert!(wait_for(reached + 20) >= reached + 20, "it stopped at SIGHUP");
    assert!(send("TERM", id.trim()));
    assert_eq!(running.wait().expect("its end").code(), Some(7));
}

/// A body beside the others that nothing touches.
const BIRD: &str = "  bird:\n    mesh: { box: { min: [9, 9], max: [9.1, 9.1], cells: [1, 1] } }\n    \
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }\n    density: 1700\n";

/// An option that nothing used is on record, and a quiet run tells it and nothing else; a body that flies is no warning.
#[test]
fn the_record_has_what_the_console_leaves_out() {
    let folder = Folder::new("record");
    let free = SMALL_BLOCK
        .replace(
            "clamp: { on: block.top, displacement: { x: \"1.0 * t\", y: -0.01 } }",
            "push: { on: block.top, traction: { y: -10 } }",
        )
        .replace("start: { equilibrium: { friction: false, increments: 2 } }\n", "")
        .replace("obstacles:", &format!("{BIRD}obstacles:"));
    folder.write("case.yml", &free);
    let output = shell("$PROGRAM case.yml -q -o out -- -snes_mponitor 3", &folder);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && output.stdout.is_empty(), "{output:?}");
    assert!(told.starts_with("warning: the PETSc option") && told.lines().count() == 1, "{told}");
    let warnings = record(&folder)["warnings"].clone();
    let warnings: Vec<&str> =
        warnings.as_array().into_iter().flatten().filter_map(|text| text.as_str()).collect();
    assert!(warnings.contains(&"the PETSc option `-snes_mponitor 3` was used by nothing"), "{warnings:?}");
    assert!(!warnings.iter().any(|text| text.contains("holds")), "{warnings:?}");
    let output = shell("$PROGRAM case.yml -o out", &folder);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("note      no support and no contact holds 'bird' along x, y"), "{said}");
    // The floor holds it, as in every ordinary case.
    assert!(!said.contains("'block' along"), "{said}");
}

/// Two ranks that share neither memory nor a working directory, and talk by TCP: the answer of one host in as many messages as
/// planned. `scripts/two-hosts` without `SHORT` has them on two hosts, which takes network namespaces.
#[test]
fn two_hosts_need_no_shared_memory_on_2_ranks() {
    let folder = Folder::new("hosts");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/two-hosts");
    let output = shell(&format!("SHORT=1 {script} results"), &folder);
    let said = String::from_utf8_lossy(&output.stdout);
    let held = said.lines().filter(|line| line.starts_with("ok ")).count();
    assert!(output.status.success() && held == 8 && !said.contains("FAIL"), "{output:?}");
}
