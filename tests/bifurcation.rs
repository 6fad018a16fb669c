//! Slender bodies near their critical loads: a solve follows only descent directions, and a run
//! ends.

mod common;

use common::{Folder, Table, run};

/// Shortest correction of a line search.
const SHORTEST: f64 = 1.0 / 512.0;

/// Number of consecutive corrections at the shortest length that may leave a larger residual. The
/// second one ends the attempt.
const RISES: usize = 2;

/// A clamped column of 1 m, 0.05 m wide and slightly bent. It buckles at 0.5 MPa on its top.
const COLUMN: &str = "
dimension: 2
bodies:
  column:
    mesh: { box: { min: [0, 0], max: [0.05, 1], cells: [1, 40], element: quad8, map: { x: 'x + 1e-4 * (1 - cos(3.14159265 * y))' } } }
    material: { neo_hookean: { young_modulus: 1.0e9, poisson_ratio: 0.3 } }
boundary:
  foot: { on: column.bottom, displacement: { x: 0, y: 0 } }
  top: { on: column.top, LOAD }
time: { end: 1, scheme: { static: { increments: 20 } } }
output: { fields: { every: 0 }, probes: { head: { at: [0.05, 1] } } }
";

/// A shallow arch between clamps, with twenty times its snap-through load.
const ARCH: &str = "
dimension: 2
bodies:
  arch:
    mesh: { box: { min: [0, 0], max: [1, 0.02], cells: [40, 1], element: quad8, map: { y: 'y + 0.1 * sin(3.14159265 * x)' } } }
    material: { neo_hookean: { young_modulus: 1.0e9, poisson_ratio: 0.3 } }
boundary:
  left: { on: arch.left, displacement: { x: 0, y: 0 } }
  right: { on: arch.right, displacement: { x: 0, y: 0 } }
  press: { on: arch.top, traction: { y: '-2e6 * t' } }
time: { end: 1, cuts: 5, scheme: { static: { increments: 20 } } }
output: { fields: { every: 0 } }
";

/// No attempt continues after corrections of the shortest length that increase the residual. An
/// accepted step ends in equilibrium. Returns the number of all corrections.
#[track_caller]
fn descends(rows: &Table) -> usize {
    let column = |name| rows.numbers(name);
    let [step, attempt, iteration, residual, length] =
        ["step", "attempt", "iteration", "residual", "line_search"].map(column);
    let mut rises = 0;
    for k in 1..residual.len() {
        let starts = iteration[k] == 0.0;
        assert!(
            starts || rises < RISES,
            "step {}, attempt {}, iteration {}",
            step[k],
            attempt[k],
            iteration[k]
        );
        let rose = !starts && length[k] <= SHORTEST && residual[k] >= residual[k - 1];
        rises = if rose { rises + 1 } else { 0 };
        if step[k] > step[k - 1] {
            assert!(residual[k - 1] <= 1e-7, "step {} ends at {}", step[k - 1], residual[k - 1]);
        }
    }
    iteration.iter().filter(|iteration| **iteration > 0.0).count()
}

/// Beyond its critical load a column bends far to the side, under a load or a displacement. The run
/// completes.
#[test]
fn a_column_buckles() {
    for (load, most, aside) in
        [("traction: { y: '-1.1e6 * t' }", 1000, 0.5), ("displacement: { y: '-0.3 * t' }", 60, 0.002)]
    {
        let folder = Folder::new("column");
        folder.write("case.yml", &COLUMN.replace("LOAD", load));
        run(0, &["case.yml", "-o", "out", "-q"], &folder).success();
        let corrections = descends(&Table::read(&folder.join("out/iterations.csv")));
        let head = Table::read(&folder.join("out/probes.csv")).last("head.u_x");
        println!("{load}: {corrections} corrections, {head} m aside");
        assert!(corrections <= most && head.abs() > aside, "{corrections} corrections, {head} m aside");
    }
}

/// If there is no nearby equilibrium, the run ends within a bounded number of corrections and
/// suggests a remedy.
#[test]
fn an_arch_that_snaps_through_ends_the_run() {
    let folder = Folder::new("arch");
    folder.write("case.yml", ARCH);
    let output = run(0, &["case.yml", "-o", "out", "-q"], &folder);
    assert_eq!(output.code, Some(5), "{}", output.stderr);
    assert!(output.stderr.contains("prescribe a displacement instead of the load"), "{}", output.stderr);
    assert!(!output.stderr.contains("penalty"), "{}", output.stderr);
    let corrections = descends(&Table::read(&folder.join("out/iterations.csv")));
    println!("{corrections} corrections");
    assert!(corrections <= 400, "{corrections}");
}
