//! Runs that are stopped by a signal or by a time limit.

use super::to_the_bit::{accurate_block, with_cadence};
use super::*;

/// Waits until a run has written the given number of rows, then sends it a signal.
fn signalled(folder: &Folder, ranks: usize, signal: &str, more: &[&str]) -> Output {
    let rows = || fs::read_to_string(folder.join("out/energy.csv")).map_or(0, |text| text.lines().count());
    let before = rows();
    let running = Running::start_patient(ranks, &[&["case.yml", "-q", "-o", "out"], more].concat(), folder);
    let deadline = std::time::Instant::now() + Duration::from_secs(300);
    while rows() < before.max(3) + 8 && std::time::Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(2));
    }
    send(signal, &running.id().to_string());
    running.wait(Duration::from_secs(300))
}

/// A signal ends the run with code 7 and a checkpoint, which the case need not request. SIGUSR1
/// through `mpirun` does this as well.
#[test]
fn signals_stop_with_a_checkpoint() {
    // Under `nohup` the runs would ignore SIGHUP as this process does; what it catches is as it ever was for those it starts.
    signal_hook::flag::register(signal_hook::consts::SIGHUP, std::sync::Arc::default()).expect("a handler");
    // A thousand steps: however late a signal comes on a busy machine, it comes before the end.
    let text = rubber_block(TIGHT, "end: 0.05", 5).replace("step: 5.0e-4", "step: 5.0e-5");
    assert!(text.contains("step: 5.0e-5"));
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
    // Without the word nothing is lost.
    let forgotten = compute(&folder, 0, "out", &[]);
    assert_eq!(forgotten.code, Some(4), "{}", forgotten.stderr);
    assert!(
        forgotten.stderr.contains("resume with contact-petsc case.yml --output out --restart"),
        "{}",
        forgotten.stderr
    );
    compute(&folder, 0, "out", &["--restart"]).success();
    assert_eq!(record(&folder.join("out"))["restarts"], 4);
    let apart = apart(&folder.join("whole"), &folder.join("out"));
    assert!(apart <= AGREEMENT, "{apart:.1e}");
}

/// A block with long steps: about a second each, in four to six iterations.
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

/// Sends a signal as soon as this step, or a later one, has an iteration. Iterations of an earlier
/// run in the folder do not count: a signal before the program waits for signals would kill it.
fn signalled_within(folder: &Folder, ranks: usize, step: &str, signal: &str, more: &[&str]) -> Output {
    let number = |step: &str| step.parse::<u32>().expect("a step");
    let last = || iterations(&folder.join("out")).last().map(|(own, _)| number(own));
    let wanted = number(step).max(last().map_or(0, |last| last + 1));
    let running = Running::start_patient(ranks, &[&["case.yml", "-q", "-o", "out"], more].concat(), folder);
    let deadline = std::time::Instant::now() + Duration::from_secs(300);
    while last().is_none_or(|last| last < wanted) && std::time::Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(2));
    }
    running.signal(signal);
    running.wait(Duration::from_secs(300))
}

/// A signal does not wait for the end of a long step. The step is abandoned at its next iterate,
/// and the checkpoint is of the last completed step. The resumed run has each iteration once. In
/// the static start there is nothing to save.
#[test]
fn signals_stop_within_a_step_on_1_and_2_ranks() {
    let folder = place(&slow_block());
    let stopped = signalled_within(&folder, 0, "0", "TERM", &[]);
    assert_eq!(stopped.code, Some(7), "{}", stopped.stderr);
    assert!(stopped.stderr.contains("stopped: SIGTERM during the static start"), "{}", stopped.stderr);
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

/// A step that a signal interrupts is repeated as a whole, with its rejected attempts. The runs that
/// continue compute the same bits as one that was not interrupted.
#[test]
fn signals_change_no_bit() {
    let text = with_cadence(&accurate_block(GMRES), None).replace("cells: [8, 8]", "cells: [32, 32]");
    let folder = place(&text);
    compute(&folder, 0, "whole", &[]).success();
    for (step, more) in [("2", &[][..]), ("7", &["--restart"]), ("12", &["--restart"])] {
        let stopped = signalled_within(&folder, 0, step, "TERM", more);
        assert_eq!(stopped.code, Some(7), "{}", stopped.stderr);
    }
    compute(&folder, 0, "out", &["--restart"]).success();
    same_bits(&folder.join("whole"), &folder.join("out"));
}

/// `mpirun` forwards SIGTERM, kills its ranks a second later and always returns 1. By then the
/// checkpoint exists, unless the machine is so busy that a second is not enough, three times.
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

/// A SIGINT or SIGTERM a second after the first one does not wait for the end of the iteration, nor
/// does the third one at any time. Two simultaneous signals, such as `timeout` sends to a process
/// and to its group, count as one request.
#[test]
fn a_later_signal_ends_at_once() {
    let slow = [("cells: [48, 50]", "cells: [420, 440]"), ("end: 0.07", "end: 0.01")];
    let long = place(&shipped("rubber-block/case.yml", &slow, "{ linear: direct }", 5));
    let short = place(&rubber_block(TIGHT, "end: 0.15", 1000));
    let sent = |folder: &Folder, rows: usize, signal: &str, count: usize, apart: u64| {
        let running = Running::start_patient(0, &["case.yml", "-q", "-o", "out"], folder);
        let deadline = std::time::Instant::now() + Duration::from_secs(300);
        let written =
            || fs::read_to_string(folder.join("out/energy.csv")).map_or(0, |text| text.lines().count());
        while written() < rows && std::time::Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        for _ in 0..count {
            assert!(send(signal, &running.id().to_string()));
            std::thread::sleep(Duration::from_millis(apart));
        }
        let ended = running.wait(Duration::from_secs(300));
        let checkpoints = checkpoints(&folder.join("out")).len();
        fs::remove_dir_all(folder.join("out")).expect("a results folder");
        (ended.code, checkpoints, ended.stderr)
    };
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        // The first iteration alone takes more than the time between the two.
        for (count, apart) in [(2, 1200), (3, 50)] {
            let (found, checkpoints, text) = sent(&long, 1, signal, count, apart);
            assert_eq!((found, checkpoints), (Some(code), 0), "{count} signals: {text}");
        }
        let (found, checkpoints, text) = sent(&short, 9, signal, 2, 0);
        assert_eq!((found, checkpoints), (Some(7), 1), "{text}");
    }
}

/// A stopped run is not replaced unless a new start is requested. Then nothing of it remains.
#[test]
fn a_stopped_run_is_begun_anew() {
    let folder = place(&rubber_block(GMRES, "end: 0.15", 4));
    for more in [&[][..], &["--anew"]] {
        let stopped = compute(&folder, 2, "out", &[more, &["--wall-time", "0.3"]].concat());
        assert_eq!(stopped.code, Some(7), "{}", stopped.stderr);
        assert_eq!(record(&folder.join("out"))["restarts"], 0);
        let steps = record(&folder.join("out"))["steps"].as_u64();
        let refused = compute(&folder, 0, "out", &[]);
        assert_eq!(refused.code, Some(4), "{}", refused.stderr);
        assert!(
            refused.stderr.contains("--restart") && refused.stderr.contains("--anew"),
            "{}",
            refused.stderr
        );
        assert_eq!(record(&folder.join("out"))["steps"].as_u64(), steps);
        let rows = Table::read(&folder.join("out/probes.csv")).numbers("step").len() as u64;
        assert_eq!(Some(rows), steps.map(|steps| steps + 1), "no row of the run before");
    }
}

/// A wall time limit ends the run with code 7, from the command line or the case. Consecutive jobs
/// complete the run, and the last one may be resumed once more.
#[test]
fn wall_times_chain() {
    let text = rubber_block(TIGHT, "end: 0.15", 1000);
    let folder = place(&text);
    compute(&folder, 0, "whole", &[]).success();
    let limited = text.replace("keep: 1000", "keep: 2, wall_time: \"300 ms\"");
    folder.write("case.yml", &limited);
    let first = compute(&folder, 0, "out", &[]);
    assert_eq!(first.code, Some(7), "{}", first.stderr);
    assert!(first.stderr.contains("wall time limit is reached at t = "), "{}", first.stderr);
    let second = compute(&folder, 2, "out", &["--restart", "--wall-time", "0.2"]);
    assert_eq!(second.code, Some(7), "{}", second.stderr);
    assert_eq!(compute(&folder, 0, "out", &["--restart", "--wall-time", "1 h"]).code, Some(0));
    assert_eq!(compute(&folder, 0, "out", &["--restart"]).code, Some(0));
    let apart = apart(&folder.join("whole"), &folder.join("out"));
    assert!(apart <= AGREEMENT, "{apart:.1e}");
    assert_eq!(checkpoints(&folder.join("out")).len(), 2, "the last two are kept");
}
