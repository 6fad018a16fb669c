//! A run that is interrupted and goes on leaves the results of one that was not: to the last bit on the same number of
//! ranks, to rounding on another one. What is wrong with a checkpoint is told before anything is touched.
//!
//! Bits are compared with GMRES, and from one and the same start: MUMPS on several ranks, which solves the static start,
//! too, rounds differently each time.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use common::{Folder, Output, Running, Table, run};

/// Displacements on other ranks agree to this part of the largest one.
const AGREEMENT: f64 = 1e-10;
const GMRES: &str = "{ linear: gmres_asm_ilu }";
const TIGHT: &str = "{ linear: direct, newton: { inexact: false, tolerance: 1.0e-11 } }";

/// A shipped case with some of its text replaced, a solver, and a checkpoint every so many steps, of which all are kept.
#[track_caller]
fn shipped(case: &str, changes: &[(&str, &str)], solver: &str, every: u32) -> String {
    let checkpoint = format!("output:\n  checkpoint: {{ every: {every}, keep: 1000 }}\n");
    let text = common::shipped(case, &[changes, &[("output:\n", &checkpoint)]].concat());
    let others = text.lines().filter(|line| !line.starts_with("solver:"));
    others.chain([&*format!("solver: {solver}")]).map(|line| format!("{line}\n")).collect()
}

/// Friction by velocity on a rigid plane, Newmark.
fn rubber_block(solver: &str, end: &str, every: u32) -> String {
    let small = [("cells: [48, 50]", "cells: [12, 13]"), ("end: 0.07", end)];
    shipped("rubber-block/case.yml", &small, solver, every)
}

/// Two bodies, return map, statics: points change facets, the pattern of the matrix grows.
fn ironing(solver: &str) -> String {
    let small = [("cells: [48, 6]", "cells: [16, 3]"), ("cells: [40, 10]", "cells: [20, 4]")];
    shipped("ironing/case.yml", &small, solver, 8)
}

/// Three dimensions.
fn rubber_cube(solver: &str) -> String {
    let small = [("cells: [10, 10, 10]", "cells: [4, 4, 4]"), ("end: 0.03", "end: 0.004")];
    shipped("rubber-cube/case.yml", &small, solver, 3)
}

/// Two bodies by velocity, generalised-alpha: the forces at the start of a step count.
fn concrete_block(solver: &str) -> String {
    shipped("concrete-block/case.yml", &[("end: 0.094", "end: 0.01")], solver, 16)
}

/// A folder with a case, in which runs are made.
fn place(text: &str) -> Folder {
    let folder = Folder::new("restart");
    folder.write("case.yml", text);
    folder
}

fn compute(folder: &Folder, ranks: usize, output: &str, more: &[&str]) -> Output {
    run(ranks, &[&["case.yml", "-q", "-o", output], more].concat(), folder)
}

/// All files of a result but the record and the checkpoints, by name.
fn files(results: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut folders) = (BTreeMap::new(), vec![results.to_path_buf()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            let name = path.strip_prefix(results).expect("a file within").to_path_buf();
            if path.is_dir() && !name.starts_with("checkpoints") {
                folders.push(path);
            } else if path.is_file() && name != Path::new("run.json") {
                found.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    found
}

#[track_caller]
fn same_bits(one: &Path, other: &Path) {
    let (one, other) = (files(one), files(other));
    assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
    assert!(one.contains_key(Path::new("energy.csv")) && one.contains_key(Path::new("fields.pvd")));
    let apart: Vec<_> = one.iter().filter(|(name, bytes)| other[*name] != **bytes).map(|(n, _)| n).collect();
    assert!(apart.is_empty(), "not the same: {apart:?}");
}

fn copy(from: &Path, to: &Path) {
    let copied = std::process::Command::new("cp").arg("-r").args([from, to]).status();
    assert!(copied.is_ok_and(|status| status.success()));
}

fn checkpoints(results: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(results.join("checkpoints")).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    found.sort();
    found
}

fn record(results: &Path) -> serde_json::Value {
    let text = fs::read_to_string(results.join("run.json")).expect("a record");
    serde_json::from_str(&text).expect("JSON")
}

/// Largest difference of the displacements of all probes over the largest of them.
#[track_caller]
fn apart(one: &Path, other: &Path) -> f64 {
    let [one, other] = [one, other].map(|results| {
        let table = Table::read(&results.join("probes.csv"));
        let names = table.names().filter(|name| name.contains(".u_"));
        let steps: Vec<f64> = table.numbers("step");
        assert!(steps.iter().enumerate().all(|(row, step)| row as f64 == *step), "a gap or a double row");
        names.flat_map(|name| table.numbers(name)).collect::<Vec<_>>()
    });
    assert!(!one.is_empty() && one.len() == other.len(), "{} and {} numbers", one.len(), other.len());
    let largest = one.iter().fold(0.0f64, |most, u| most.max(u.abs()));
    one.iter().zip(&other).fold(0.0f64, |most, (a, b)| most.max((a - b).abs())) / largest
}

/// Goes on from the first checkpoint and from the one in the middle of an uninterrupted run.
#[track_caller]
fn goes_on_to_the_last_bit(text: &str, ranks: usize) {
    let folder = place(text);
    compute(&folder, ranks, "whole", &[]).success();
    let all = checkpoints(&folder.join("whole"));
    assert!(all.len() > 2, "{all:?}");
    for from in [&all[0], &all[all.len() / 2]] {
        let _ = fs::remove_dir_all(folder.join("part"));
        copy(&folder.join("whole"), &folder.join("part"));
        let name = from.file_name().and_then(|name| name.to_str()).expect("a name");
        compute(&folder, ranks, "part", &[&format!("--restart=checkpoints/{name}")]).success();
        same_bits(&folder.join("whole"), &folder.join("part"));
        let [whole, part] = ["whole", "part"].map(|results| record(&folder.join(results)));
        assert_eq!((&whole["restarts"], &part["restarts"]), (&0.into(), &1.into()));
        for key in ["steps", "newton_iterations", "krylov_iterations", "penetration", "start"] {
            assert_eq!(whole[key], part[key], "{key}");
        }
    }
}

/// A rigid target and friction by velocity.
#[test]
fn rubber_block_to_the_last_bit_on_1_and_2_ranks() {
    goes_on_to_the_last_bit(&rubber_block(GMRES, "end: 0.015", 8), 1);
    goes_on_to_the_last_bit(&rubber_block(GMRES, "end: 0.015", 8), 2);
}

/// Deformable targets: facets of the points, traction histories, couplings.
#[test]
fn ironing_to_the_last_bit_on_1_2_and_3_ranks() {
    goes_on_to_the_last_bit(&ironing("{ linear: auto }"), 1);
    goes_on_to_the_last_bit(&ironing(GMRES), 2);
    goes_on_to_the_last_bit(&ironing(GMRES), 3);
}

/// Forces at the start of a step, midpoint and stages.
#[test]
fn other_schemes_to_the_last_bit_on_1_and_2_ranks() {
    goes_on_to_the_last_bit(&concrete_block(GMRES), 2);
    let flight = shipped("collision/case.yml", &[("end: 0.012", "end: 0.003")], GMRES, 20);
    goes_on_to_the_last_bit(&flight, 1);
    let small = [("cells: [16, 4]", "cells: [8, 2]"), ("end: 0.25", "end: 0.03")];
    let staggered = "{ strategy: staggered, linear: cg_icc }";
    goes_on_to_the_last_bit(&shipped("sliding-block/return-map.yml", &small, staggered, 10), 1);
}

/// Statics of bodies that contact and a spring in the matrix hold: the spring is as it was.
/// Steps that follow their errors, penalties that became stiffer, and the conserving scheme go on as they were.
#[test]
fn accuracies_and_the_conserving_scheme_to_the_last_bit_on_1_and_2_ranks() {
    let tolerances = "accuracy: { time: 2.0e-3, penetration: 2.0e-5, slip: 1.0e-2, energy: none }\ntime:";
    let small = [("cells: [48, 50]", "cells: [8, 8]"), ("end: 0.07", "end: 0.01"), ("time:", tolerances)];
    let accurate = shipped("rubber-block/case.yml", &small, GMRES, 7);
    goes_on_to_the_last_bit(&accurate, 1);
    goes_on_to_the_last_bit(&accurate, 2);
    let friction = shipped("collision/friction.yml", &[("end: 0.012", "end: 0.004")], GMRES, 25);
    goes_on_to_the_last_bit(&friction, 1);
    goes_on_to_the_last_bit(&friction, 2);
}

#[test]
fn loose_bodies_to_the_last_bit_on_1_and_2_ranks() {
    let text = shipped("patch/plane.yml", &[("increments: 2", "increments: 6")], "{ linear: auto }", 2);
    goes_on_to_the_last_bit(&text, 1);
    goes_on_to_the_last_bit(&text.replace("linear: auto", "linear: gmres_asm_ilu"), 2);
}

/// Three dimensions.
#[test]
fn rubber_cube_to_the_last_bit_on_1_and_2_ranks() {
    goes_on_to_the_last_bit(&rubber_cube("{ linear: auto }"), 1);
    goes_on_to_the_last_bit(&rubber_cube(GMRES), 2);
}

/// A checkpoint of one number of ranks is one for any other, also when some own nothing.
#[test]
fn other_ranks_agree() {
    for text in [rubber_block(TIGHT, "end: 0.01", 8), ironing(TIGHT), rubber_cube(TIGHT)] {
        let folder = place(&text);
        compute(&folder, 2, "whole", &[]).success();
        let first = checkpoints(&folder.join("whole"))[0].display().to_string();
        for ranks in [1, 3, 7] {
            let name = format!("on-{ranks}");
            copy(&folder.join("whole"), &folder.join(&name));
            compute(&folder, ranks, &name, &[&format!("--restart={first}")]).success();
            let apart = apart(&folder.join("whole"), &folder.join(&name));
            println!("2 -> {ranks} ranks: {apart:.1e}");
            assert!(apart <= AGREEMENT, "2 -> {ranks} ranks: {apart:.1e}");
            // No piece of the two ranks is left beside those of the new ones.
            let fields = fs::read_dir(folder.join(&name).join("fields")).into_iter().flatten().flatten();
            let last = fields.map(|entry| entry.path()).max().expect("fields");
            let pieces = fs::read_dir(last).expect("the last fields");
            assert_eq!(pieces.count(), 2 * (ranks + 1));
        }
    }
}

/// Numbers between 0 and 1 that are the same each time (a linear congruence).
fn chance(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Size of the table of energies, which grows with each step.
fn size(results: &Path) -> u64 {
    fs::metadata(results.join("energy.csv")).map_or(0, |data| data.len())
}

/// Killed at random moments so many times, going on each time: the results are those of a run that was let be. Every
/// fourth time the moment lies in the start of the process, else `span` from the first new row on.
fn survives(text: &str, ranks: usize, kills: usize, kill: impl Fn(&Running), span: Duration) {
    let folder = place(text);
    compute(&folder, ranks, "whole", &[]).success();
    let (results, mut chance) = (folder.join("out"), chance(20260101));
    let mut restarts = 0;
    for number in 0..kills {
        let again = !checkpoints(&results).is_empty();
        restarts += usize::from(again);
        let more: &[&str] = if again { &["--restart"] } else { &[] };
        let mut running = Running::start(ranks, &[&["case.yml", "-q", "-o", "out"], more].concat(), &folder);
        let mut before = u64::MAX;
        while number % 4 != 3 && running.goes_on() && size(&results) <= before {
            before = size(&results).min(before);
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(span.mul_f64(chance()));
        kill(&running);
        let ended = running.wait(Duration::from_secs(20));
        assert!(ended.code != Some(0) || record(&results)["verdict"] == "completed", "{}", ended.stderr);
        assert!(!ended.stderr.contains("error:"), "{}", ended.stderr);
    }
    assert!(restarts > kills / 2, "{restarts} restarts of {kills} kills");
    compute(&folder, ranks, "out", &["--restart"]).success();
    same_bits(&folder.join("whole"), &results);
    let [whole, part] = ["whole", "out"].map(|results| record(&folder.join(results)));
    for key in ["steps", "newton_iterations", "krylov_iterations", "penetration"] {
        assert_eq!(whole[key], part[key], "{key}");
    }
    println!("{restarts} restarts after {kills} kills");
}

/// `kill -9`, twenty times.
#[test]
fn survives_twenty_kills() {
    let text = rubber_block(GMRES, "end: 0.2", 5);
    survives(&text, 0, 20, |running| running.signal("KILL"), Duration::from_millis(450));
}

/// One rank of two is killed; the other goes with it.
#[test]
fn survives_kills_of_a_rank_on_2_ranks() {
    let kill = |running: &Running| {
        let children = format!("/proc/{0}/task/{0}/children", running.id());
        let ranks = fs::read_to_string(children).unwrap_or_default();
        if let Some(rank) = ranks.split_whitespace().last() {
            let _ = std::process::Command::new("kill").args(["-9", rank]).status();
        }
    };
    survives(&ironing(GMRES), 2, 4, kill, Duration::from_millis(1500));
}

/// Waits until a run has written so many rows, then sends it a signal.
fn signalled(folder: &Folder, ranks: usize, signal: &str, more: &[&str]) -> Output {
    let rows = || fs::read_to_string(folder.join("out/energy.csv")).map_or(0, |text| text.lines().count());
    let before = rows();
    let running = Running::start(ranks, &[&["case.yml", "-q", "-o", "out"], more].concat(), folder);
    let deadline = std::time::Instant::now() + Duration::from_secs(60);
    while rows() < before.max(3) + 8 && std::time::Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(2));
    }
    let _ =
        std::process::Command::new("kill").args([&format!("-{signal}"), &running.id().to_string()]).status();
    running.wait(Duration::from_secs(60))
}

/// A signal ends the run with code 7 and a checkpoint, which the case need not ask for; so does `mpirun` with SIGUSR1.
#[test]
fn signals_stop_with_a_checkpoint() {
    let text = rubber_block(TIGHT, "end: 0.1", 5);
    let silent: String =
        text.lines().filter(|line| !line.contains("checkpoint")).map(|l| format!("{l}\n")).collect();
    let folder = place(&silent);
    compute(&folder, 0, "whole", &[]).success();
    assert!(checkpoints(&folder.join("whole")).is_empty());
    for (ranks, signal, more) in [
        (0, "TERM", &[][..]),
        (2, "USR1", &["--restart"]),
        (0, "INT", &["--restart"]),
        (0, "HUP", &["--restart"]),
    ] {
        let stopped = signalled(&folder, ranks, signal, more);
        assert_eq!(stopped.code, Some(7), "{}", stopped.stderr);
        let told = format!("contact-petsc: stopped: SIG{signal} at t = ");
        assert_eq!(stopped.stderr.matches(&told).count(), 1, "{}", stopped.stderr);
        assert!(
            stopped.stderr.contains("contact-petsc case.yml --output out --restart"),
            "{}",
            stopped.stderr
        );
        let record = record(&folder.join("out"));
        assert_eq!((&record["verdict"], &record["exit_code"]), (&"stopped".into(), &7.into()));
        let step = record["steps"].as_u64().expect("steps");
        let name = format!("step-{step:06}.ckpt");
        assert_eq!(checkpoints(&folder.join("out")).last().and_then(|p| p.file_name()), Some(name.as_ref()));
    }
    compute(&folder, 0, "out", &["--restart"]).success();
    assert_eq!(record(&folder.join("out"))["restarts"], 4);
    let apart = apart(&folder.join("whole"), &folder.join("out"));
    assert!(apart <= AGREEMENT, "{apart:.1e}");
}

/// A block whose steps take long: a second or so each, in four to six iterations.
fn slow_block() -> String {
    let slow = [("cells: [48, 50]", "cells: [72, 75]"), ("end: 0.07", "end: 0.002")];
    shipped("rubber-block/case.yml", &slow, TIGHT, 1000)
}

/// The steps and the stages of the rows of iterations.
fn iterations(results: &Path) -> Vec<(String, String)> {
    let text = fs::read_to_string(results.join("iterations.csv")).unwrap_or_default();
    let words = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        (cells[0].to_owned(), [cells[3], cells[4], cells[5]].join(" "))
    };
    text.lines().skip(1).filter(|line| line.split(',').count() > 5).map(words).collect()
}

/// Sends a signal as soon as there is an iteration of a step.
fn signalled_within(folder: &Folder, ranks: usize, step: &str, signal: &str, more: &[&str]) -> Output {
    let running = Running::start(ranks, &[&["case.yml", "-q", "-o", "out"], more].concat(), folder);
    let deadline = std::time::Instant::now() + Duration::from_secs(120);
    while !iterations(&folder.join("out")).iter().any(|(own, _)| own == step)
        && std::time::Instant::now() < deadline
    {
        std::thread::sleep(Duration::from_millis(2));
    }
    running.signal(signal);
    running.wait(Duration::from_secs(60))
}

/// A signal does not wait for the end of a long step: the step is given up at its next iterate, the checkpoint is of the last one,
/// and the run that goes on has each iteration once. In the static start there is nothing to keep.
#[test]
fn signals_stop_within_a_step_on_1_and_2_ranks() {
    let folder = place(&slow_block());
    let stopped = signalled_within(&folder, 0, "0", "TERM", &[]);
    assert_eq!(stopped.code, Some(7), "{}", stopped.stderr);
    assert!(stopped.stderr.contains("stopped: SIGTERM in the static start"), "{}", stopped.stderr);
    assert!(checkpoints(&folder.join("out")).is_empty());
    compute(&folder, 0, "whole", &[]).success();
    let whole = iterations(&folder.join("whole"));
    for (ranks, step, signal, more) in [(0, "2", "TERM", &[][..]), (2, "3", "USR1", &["--restart"])] {
        let stopped = signalled_within(&folder, ranks, step, signal, more);
        assert_eq!(stopped.code, Some(7), "{}", stopped.stderr);
        let before = step.parse::<u32>().unwrap() - 1;
        let last = checkpoints(&folder.join("out")).pop().expect("a checkpoint");
        assert!(last.ends_with(format!("step-{before:06}.ckpt")), "{}", last.display());
        let of_step = |rows: &[(String, String)]| rows.iter().filter(|(own, _)| own == step).count();
        let given_up = of_step(&iterations(&folder.join("out")));
        assert!(given_up < of_step(&whole), "{given_up} iterations of step {step}");
    }
    compute(&folder, 0, "out", &["--restart"]).success();
    assert_eq!(iterations(&folder.join("out")), whole);
    let apart = apart(&folder.join("whole"), &folder.join("out"));
    assert!(apart <= AGREEMENT, "{apart:.1e}");
}

/// `mpirun` hands SIGTERM on, kills its ranks a second later and returns 1 whatever they do: by then the checkpoint is there,
/// unless the machine is so busy that a second is not enough, three times.
#[test]
fn mpirun_leaves_time_for_a_checkpoint() {
    let folder = place(&rubber_block(TIGHT, "end: 0.15", 1000));
    let in_time = (0..3).any(|_| {
        let _ = fs::remove_dir_all(folder.join("out"));
        let stopped = signalled(&folder, 2, "TERM", &[]);
        assert!([Some(1), Some(7)].contains(&stopped.code), "{:?} {}", stopped.code, stopped.stderr);
        let record = record(&folder.join("out"));
        record["verdict"] == "stopped" && record["exit_code"] == 7
    });
    assert!(in_time);
    compute(&folder, 2, "out", &["--restart"]).success();
}

/// A second SIGINT does not wait for the end of the step.
#[test]
fn a_second_interrupt_ends_at_once() {
    let slow = [("cells: [48, 50]", "cells: [150, 150]"), ("end: 0.07", "end: 0.01")];
    let folder = place(&shipped("rubber-block/case.yml", &slow, "{ linear: direct }", 5));
    let running = Running::start(0, &["case.yml", "-q", "-o", "out"], &folder);
    let deadline = std::time::Instant::now() + Duration::from_secs(60);
    while !folder.join("out/run.json").exists() && std::time::Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(5));
    }
    let interrupt = || std::process::Command::new("kill").args(["-INT", &running.id().to_string()]).status();
    for _ in 0..2 {
        interrupt().expect("kill");
        std::thread::sleep(Duration::from_millis(300));
    }
    let ended = running.wait(Duration::from_secs(30));
    assert_eq!(ended.code, Some(130), "{}", ended.stderr);
    assert!(checkpoints(&folder.join("out")).is_empty());
}

/// A wall time ends the run with code 7, from the command line or the case; jobs one after the other come to the end, and
/// the last one may be told to go on once more.
#[test]
fn wall_times_chain() {
    let text = rubber_block(TIGHT, "end: 0.15", 1000);
    let folder = place(&text);
    compute(&folder, 0, "whole", &[]).success();
    let limited = text.replace("keep: 1000", "keep: 2, wall_time: \"300 ms\"");
    folder.write("case.yml", &limited);
    let first = compute(&folder, 0, "out", &[]);
    assert_eq!(first.code, Some(7), "{}", first.stderr);
    assert!(first.stderr.contains("the wall time is over at t = "), "{}", first.stderr);
    let second = compute(&folder, 2, "out", &["--restart", "--wall-time", "0.2"]);
    assert_eq!(second.code, Some(7), "{}", second.stderr);
    assert_eq!(compute(&folder, 0, "out", &["--restart", "--wall-time", "1 h"]).code, Some(0));
    assert_eq!(compute(&folder, 0, "out", &["--restart"]).code, Some(0));
    let apart = apart(&folder.join("whole"), &folder.join("out"));
    assert!(apart <= AGREEMENT, "{apart:.1e}");
    assert_eq!(checkpoints(&folder.join("out")).len(), 2, "the last two are kept");
}

/// The code, the words, and that no file of the results has changed.
#[track_caller]
fn refused(folder: &Folder, more: &[&str], code: i32, words: &[&str]) {
    let before = files(&folder.join("out"));
    let output = compute(folder, 0, "out", more);
    assert_eq!(output.code, Some(code), "{}", output.stderr);
    assert_eq!(output.stderr.matches("contact-petsc: error:").count(), 1, "{}", output.stderr);
    for word in words {
        assert!(output.stderr.contains(word), "no '{word}' in: {}", output.stderr);
    }
    assert_eq!(files(&folder.join("out")), before);
}

/// A checkpoint that is not whole is an error that offers the one before; another case, another mesh and lost rows are
/// errors, too. Nothing is touched by any of them.
#[test]
fn what_does_not_fit_is_refused() {
    let folder = place(&rubber_block(GMRES, "end: 0.01", 5));
    let out = folder.join("out");
    let none = compute(&folder, 0, "out", &["--restart"]);
    assert!(none.code == Some(4) && none.stderr.contains("no such folder"), "{}", none.stderr);
    compute(&folder, 0, "out", &[]).success();
    let all = checkpoints(&out);
    let (newest, older) = (&all[all.len() - 1], &all[all.len() - 2]);
    let whole = fs::read(newest).expect("a checkpoint");
    let offer =
        format!("--restart=out/checkpoints/{}", older.file_name().and_then(|n| n.to_str()).expect("a name"));
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let mut later = whole.clone();
    later[25] = 99;
    for (bytes, words) in [
        (&whole[..whole.len() / 2], "cut short"),
        (&whole[..10], "cut short"),
        (&flipped, "its SHA-256 is another one"),
        (&later, "format 99; this program reads format 1"),
        (b"something else that is long enough to be looked at", "not a checkpoint"),
    ] {
        fs::write(newest, bytes).expect("a damaged checkpoint");
        refused(&folder, &["--restart"], 4, &[words, "an older one is whole", &offer]);
    }
    refused(&folder, &["--restart=out/checkpoints/step-000001.ckpt"], 4, &["step-000001.ckpt", &offer]);
    fs::write(newest, &whole).expect("the checkpoint");

    let case = fs::read_to_string(folder.join("case.yml")).expect("the case");
    for (from, to, words) in [
        ("coefficient: 1.0", "coefficient: 0.9", "contact.sole.friction"),
        ("step: 5.0e-4", "step: 2.5e-4", "time.step was 0.0005 and is 0.00025"),
        ("cells: [12, 13]", "cells: [12, 12]", "bodies.block.mesh"),
        ("node_50: { at: [0, 0] }", "node_50: { at: [0, 0.1] }", "output.probes"),
        ("end: 0.01", "end: 0.005", "the case ends at"),
    ] {
        assert!(case.contains(from), "{from}");
        folder.write("case.yml", &case.replace(from, to));
        refused(&folder, &["--restart"], 3, &[words, "hint: "]);
    }
    folder.write("case.yml", &case);
    let rows = fs::read(out.join("energy.csv")).expect("a table");
    fs::write(out.join("energy.csv"), &rows[..rows.len() - 10]).expect("a shorter table");
    refused(&folder, &["--restart"], 4, &["energy.csv", "lacks rows"]);
    fs::write(out.join("energy.csv"), rows).expect("the table");

    // What may change: title, solver, fields, end.
    let more =
        case.replace("end: 0.01", "end: 0.012").replace("fields: { every: 10 }", "fields: { every: 3 }");
    folder.write("case.yml", &more.replace("title: ", "title: Again, ").replace(GMRES, TIGHT));
    compute(&folder, 0, "out", &["--restart"]).success();
    assert_eq!(Table::read(&out.join("energy.csv")).last("step"), 24.0);

    fs::remove_dir_all(out.join("checkpoints")).expect("no checkpoints");
    refused(&folder, &["--restart"], 4, &["no checkpoint to go on from", "start anew without --restart"]);
}

/// The disk is full when a checkpoint is written: an error that offers the older one, from which the run goes on as if
/// nothing had been.
#[test]
fn a_full_disk_loses_nothing_on_1_and_2_ranks() {
    let folder = place(&rubber_block(GMRES, "end: 0.005", 10));
    let out = folder.join("out");
    for ranks in [1, 2] {
        folder.write("case.yml", &rubber_block(GMRES, "end: 0.005", 10));
        compute(&folder, ranks, "out", &[]).success();
        let _ = fs::remove_dir_all(folder.join("whole"));
        copy(&out, &folder.join("whole"));
        folder.write("case.yml", &rubber_block(GMRES, "end: 0.015", 10));
        compute(&folder, ranks, "whole", &["--restart"]).success();
        // What is written here meets a disk without room.
        std::os::unix::fs::symlink("/dev/full", out.join("checkpoints/step-000020.part")).expect("a link");
        let full = compute(&folder, ranks, "out", &["--restart"]);
        assert_eq!(full.code, Some(4), "{}", full.stderr);
        assert_eq!(full.stderr.matches("contact-petsc: error:").count(), 1, "{}", full.stderr);
        for words in ["No space left", "step-000020.ckpt", "the checkpoint of step 10 is whole", "--restart"]
        {
            assert!(full.stderr.contains(words), "no '{words}' in: {}", full.stderr);
        }
        assert_eq!(checkpoints(&out).len(), 1, "{:?}", checkpoints(&out));
        compute(&folder, ranks, "out", &["--restart"]).success();
        same_bits(&folder.join("whole"), &out);
    }
}

/// A checkpoint begins a branch in a new folder: its rows are those that the run went on with, and it can go on itself. The
/// first run is left alone. Without a checkpoint to name there is nothing to go on from.
#[test]
fn a_run_branches_off_on_1_and_2_ranks() {
    for ranks in [0, 2] {
        let folder = place(&rubber_block(GMRES, "end: 0.01", 5));
        compute(&folder, ranks, "whole", &[]).success();
        let before = files(&folder.join("whole"));
        let from = "--restart=whole/checkpoints/step-000010.ckpt";
        compute(&folder, ranks, "branch", &[from]).success();
        assert_eq!(before, files(&folder.join("whole")));
        for name in ["energy.csv", "probes.csv", "contact.csv"] {
            let text = |results: &str| fs::read_to_string(folder.join(results).join(name)).expect("a table");
            let (whole, branch) = (text("whole"), text("branch"));
            let mut rows = branch.lines();
            assert_eq!(rows.next(), whole.lines().next(), "{name}");
            let later: Vec<&str> = rows.collect();
            assert!(later.len() == 10 && later[0].starts_with("11,"), "{name}: {later:?}");
            assert!(whole.lines().skip(12).eq(later), "{name}");
        }
        assert_eq!(record(&folder.join("branch"))["restarts"], 1);
        let on = "--restart=branch/checkpoints/step-000015.ckpt";
        compute(&folder, ranks, "branch", &[on]).success();
        assert_eq!(Table::read(&folder.join("branch/energy.csv")).len(), 10);
        let absent = compute(&folder, ranks, "absent", &["--restart"]);
        assert_eq!(absent.code, Some(4), "{}", absent.stderr);
        assert!(
            absent.stderr.contains("nothing to go on from") && !absent.stderr.contains("plot"),
            "{}",
            absent.stderr
        );
        assert!(!folder.join("absent").exists());
    }
}
