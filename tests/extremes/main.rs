//! Parameters at their extremes: each row of the table converges to a checked result, or ends with
//! the reason.
//!
//! The quick rows run with every test. `scripts/extremes` runs all of them and writes the table of
//! `docs/validation/extremes.md`.

mod between;
#[path = "../common/mod.rs"]
mod common;
mod known;
mod motion;
mod row;
mod scaling;
mod scenes;
mod shapes;
mod statics;
mod units;

use std::fmt::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use row::{Outcome, Row, judge};

/// Number of rows that run at a time.
const AT_ONCE: usize = 3;

/// Runs rows, a few at a time. The outcomes are in the order of the rows.
fn outcomes(rows: &[Row]) -> Vec<Option<Outcome>> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(rows.iter().map(|_| None).collect::<Vec<_>>()));
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(|| {
                while let Some((at, row)) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|at| Some((at, rows.get(at)?)))
                {
                    let outcome = judge(row);
                    if std::env::var_os("EXTREMES_TABLE").is_some() {
                        let mark = if outcome.verdict.holds { "ok  " } else { "FAIL" };
                        eprintln!(
                            "{mark} {:.1} s  {} | {} | {} | {}",
                            outcome.seconds,
                            row.group,
                            row.name,
                            outcome.verdict.answer,
                            outcome.verdict.expected
                        );
                    }
                    done.lock().expect("no thread panics")[at] = Some(outcome);
                }
            });
        }
    });
    done.into_inner().expect("no thread panics")
}

fn hold(rows: Vec<Row>) {
    let rows: Vec<Row> = rows.into_iter().filter(|row| row.quick).collect();
    assert!(!rows.is_empty());
    let mut wrong = String::new();
    for (row, outcome) in rows.iter().zip(outcomes(&rows)) {
        let Some(Outcome { verdict, code, .. }) = outcome else { panic!("{} was not judged", row.name) };
        if !verdict.holds {
            let (found, expected) = (verdict.answer, verdict.expected);
            let _ =
                writeln!(wrong, "{}, {}: {found}, not {expected}; exit code {code:?}", row.group, row.name);
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Stiffness, pair ratio, compliance, Poisson's ratio, snap-through and remote positions, compared
/// with closed forms.
#[test]
fn statics_at_the_extremes() {
    hold(statics::rows());
}

/// Friction, stick velocity, steps, speeds and thin targets.
#[test]
fn motion_at_the_extremes() {
    hold(motion::rows());
}

/// Waves, shear and sliding, compared with closed forms that depend on the swept parameter.
#[test]
fn what_is_known_at_the_extremes() {
    hold(known::rows());
}

/// Obstacles and bodies smaller than the spacing of contact points, and similar configurations.
#[test]
fn nothing_is_missed_between_points() {
    hold(between::rows());
}

/// Wedges, spikes, cliffs, internal edges.
#[test]
fn shapes_at_the_extremes() {
    hold(shapes::rows());
}

/// The result is the same in every unit system.
#[test]
fn units_make_no_difference() {
    hold(scaling::rows());
}

/// Writes the whole table to the file named by `EXTREMES_TABLE`. With `EXTREMES_ONLY` only groups
/// whose name contains its text run.
#[test]
#[ignore = "minutes; scripts/extremes runs it"]
fn the_whole_table() {
    let Some(path) = std::env::var_os("EXTREMES_TABLE") else { panic!("run scripts/extremes") };
    let only = std::env::var("EXTREMES_ONLY").unwrap_or_default();
    let mut rows: Vec<Row> =
        [statics::rows(), known::rows(), motion::rows(), between::rows(), shapes::rows(), scaling::rows()]
            .into_iter()
            .flatten()
            .collect();
    rows.retain(|row| format!("{}: {}", row.group, row.name).contains(&only));
    rows.sort_by_key(|row| ORDER.iter().position(|group| *group == row.group));
    let mut table = String::from(
        "| Row | Answer | Expected | Verdict | Exit code | Seconds |\n|---|---|---|---|---|---|\n",
    );
    let (mut group, mut wrong) = ("", 0);
    for (row, outcome) in rows.iter().zip(outcomes(&rows)) {
        let Some(Outcome { verdict, code, seconds }) = outcome else { continue };
        if row.group != group {
            group = row.group;
            let _ = writeln!(table, "| **{group}** | | | | | |");
        }
        wrong += usize::from(!verdict.holds);
        let code = code.map_or("killed".to_owned(), |code| code.to_string());
        let holds = if verdict.holds { "holds" } else { "FAILS" };
        let row = &row.name;
        let _ = writeln!(
            table,
            "| {row} | {} | {} | {holds} | {code} | {seconds:.1} |",
            verdict.answer, verdict.expected
        );
    }
    std::fs::write(&path, table).expect("the table");
    assert_eq!(wrong, 0, "rows that fail stand in {}", path.display());
}

/// Order of the groups in the table.
const ORDER: [&str; 15] = [
    "stiffness [Pa]",
    "pair ratio",
    "friction",
    "compliance [m/Pa]",
    "stick velocity [m/s]",
    "Poisson's ratio",
    "step [s]",
    "speed [m/s]",
    "density [kg/m3]",
    "size [m]",
    "between points",
    "far away [m]",
    "snap-through",
    "shapes",
    "units",
];
