//! Runs that are killed without notice.

use super::*;

/// Reproducible pseudo-random numbers between 0 and 1 (a linear congruence).
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

/// Kills a run repeatedly at random times and resumes it each time. The results must be those of an
/// uninterrupted run. Every fourth kill occurs while the process starts. The others occur within
/// `span` after the first new row, and only after the first checkpoint, so that the next run can
/// restart on a machine of any speed.
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
        let waits = |before| size(&results) <= before || checkpoints(&results).is_empty();
        while number % 4 != 3 && running.goes_on() && waits(before) {
            before = size(&results).min(before);
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(span.mul_f64(chance()));
        kill(&running);
        let ended = running.wait(Duration::from_secs(300));
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

/// Kills a run with `kill -9` twenty times.
#[test]
fn survives_twenty_kills() {
    let text = rubber_block(GMRES, "end: 0.2", 5);
    survives(&text, 0, 20, |running| running.signal("KILL"), Duration::from_millis(450));
}

/// One rank of two is killed, and the other ends with it.
#[test]
fn survives_kills_of_a_rank_on_2_ranks() {
    let kill = |running: &Running| {
        let children = format!("/proc/{0}/task/{0}/children", running.id());
        let ranks = fs::read_to_string(children).unwrap_or_default();
        if let Some(rank) = ranks.split_whitespace().last() {
            send("KILL", rank);
        }
    };
    survives(&ironing(GMRES), 2, 4, kill, Duration::from_millis(1500));
}
