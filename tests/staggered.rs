//! The staggered strategy and the two-stage preconditioner: the results of the monolithic solve,
//! with symmetric matrices.

mod common;

use common::{Folder, Output, Results, Table, near, rubber_pad, run, shipped};

/// A rubber layer dragged over a plane fast enough to slip within a few steps.
const LAYER: &str = "
dimension: 2
bodies:
  layer:
    mesh: { box: { min: [0, 0], max: [0.4, 0.1], cells: [8, 4], element: quad4 } }
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.45 } }
    density: 1700
    kinematics: finite
    locking: selective_reduced
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact:
  sole:
    contactor: layer.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-10 } }
    friction: { coulomb: { coefficient: MU, regularization: { stick_velocity: 1.0e-3 } } }
    initial_overclosure: accept
boundary: { clamp: { on: layer.top, displacement: { x: '5.0 * t', y: -0.005 } } }
start: { equilibrium: { friction: false, increments: 2 } }
time: { end: 5.0e-3, step: 5.0e-4, cuts: 0, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
output: { fields: { every: 100 }, probes: { left: { at: [0, 0] }, middle: { at: [0.2, 0] }, right: { at: [0.4, 0] } } }
";

/// A cube dragged obliquely over a plane. With the return map friction is a stiffness.
const CUBE: &str = "
dimension: 3
bodies:
  cube:
    mesh: { box: { min: [0, 0, 0], max: [0.1, 0.1, 0.1], cells: [4, 4, 4], element: hex8 } }
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }
    density: 1700
    kinematics: finite
obstacles: { floor: { plane: { point: [0, 0, 0], normal: [0, 0, 1] } } }
contact:
  sole:
    contactor: cube.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-9 } }
    friction: { coulomb: { coefficient: MU, regularization: { stick_stiffness: 1.0e8 } } }
    initial_overclosure: accept
boundary: { clamp: { on: cube.top, displacement: { x: '0.02 * t', y: '0.01 * t', z: '-0.01 * t' } } }
time: { end: 1, scheme: { static: { increments: 4 } } }
output: { fields: { every: 100 }, probes: { corner: { at: [0.1, 0.1, 0] }, centre: { at: [0.05, 0.05, 0] } } }
";

const MONOLITHIC: &str = "{ linear: direct }";

/// A tolerance tighter than the default, so that the remaining error of the sweeps does not
/// accumulate over the steps.
const STAGGERED: &str = "{ strategy: { staggered: { tolerance: 1e-8 } } }";

/// A run with a coefficient of friction and the given `solver` block.
struct Solved {
    folder: Folder,
    output: Output,
}

impl Solved {
    fn by(case: &str, mu: f64, solver: &str, ranks: usize) -> Self {
        Self::with(case, mu, solver, ranks, &[])
    }

    fn with(case: &str, mu: f64, solver: &str, ranks: usize, petsc: &[&str]) -> Self {
        let folder = Folder::new("staggered");
        folder.write("case.yml", &format!("{}solver: {solver}\n", case.replace("MU", &mu.to_string())));
        let args: Vec<&str> = ["case.yml", "--output", "out", "--"].iter().chain(petsc).copied().collect();
        let output = run(ranks, &args, &folder);
        Self { folder, output }
    }

    #[track_caller]
    fn well(self) -> Self {
        Self { output: self.output.success(), ..self }
    }

    fn table(&self, name: &str) -> Table {
        Table::read(&self.folder.join("out").join(name))
    }

    fn count(&self, key: &str) -> u64 {
        let text = std::fs::read_to_string(self.folder.join("out/run.json")).expect("a run record");
        let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        record[key].as_u64().unwrap_or_else(|| panic!("no count {key}"))
    }

    /// The columns of a table whose names contain a word.
    fn columns(&self, table: &str, word: &str) -> Vec<Vec<f64>> {
        let table = self.table(table);
        let names = table.names().filter(|name| name.contains(word));
        let columns: Vec<Vec<f64>> = names.map(|name| table.numbers(name)).collect();
        assert!(columns.iter().any(|column| column.len() > 1), "no column {word}");
        columns
    }

    /// Displacements of all probes over the steps.
    fn displacements(&self) -> Vec<Vec<f64>> {
        self.columns("probes.csv", ".u_")
    }

    /// Forces of all contacts over the steps.
    fn forces(&self) -> Vec<Vec<f64>> {
        self.columns("contact.csv", "force_")
    }

    fn slips(&self) -> bool {
        self.table("contact.csv").numbers("slip").iter().any(|points| *points > 0.0)
    }
}

/// Largest difference of any column at any step, divided by the largest value.
#[track_caller]
fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let lengths = |columns: &[Vec<f64>]| columns.iter().map(Vec::len).collect::<Vec<usize>>();
    assert_eq!(lengths(a), lengths(b), "the steps differ");
    let largest = a.iter().flatten().fold(0.0f64, |most, value| most.max(value.abs()));
    let differences = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / largest
}

/// Largest difference of the displacements of two runs.
#[track_caller]
fn apart(a: &Solved, b: &Solved) -> f64 {
    difference(&a.displacements(), &b.displacements())
}

/// Checks two runs with the same steps, none of them cut. They agree at each step: displacements to
/// the first tolerance and contact forces to the second.
#[track_caller]
fn agree(a: &Solved, b: &Solved, tolerances: (f64, f64), what: &str) {
    assert_eq!((a.count("cut_steps"), b.count("cut_steps")), (0, 0), "{what}");
    let found = (apart(a, b), difference(&a.forces(), &b.forces()));
    assert!(found.0 < tolerances.0 && found.1 < tolerances.1, "{what}: {:.1e} and {:.1e}", found.0, found.1);
}

/// The shipped rubber block on 12 by 12 elements under a tenth of its pressure, which slips with
/// any friction.
fn light(end: &str) -> String {
    let edits = [
        ("cells: [48, 50]", "cells: [12, 12]"),
        ("y: -0.05", "y: -0.005"),
        ("coefficient: 1.0", "coefficient: MU"),
        ("step: 5.0e-4", "step: 1.0e-3, cuts: 0"),
        ("end: 0.07", end),
    ];
    let case = shipped("rubber-block/case.yml", &edits);
    case.lines().filter(|line| !line.starts_with("solver:")).map(|line| format!("{line}\n")).collect()
}

/// Layer and cube, two coefficients: the staggered result equals the monolithic one at every step,
/// on any number of ranks, and takes more than one sweep.
#[test]
fn staggered_is_monolithic_on_1_2_3_ranks() {
    let all = &[1, 2, 3][..];
    for (case, mu, ranks) in [(LAYER, 0.3, all), (LAYER, 1.0, all), (CUBE, 0.3, &[2]), (CUBE, 1.0, &[1])] {
        let expected = Solved::by(case, mu, MONOLITHIC, 1).well();
        assert!(expected.slips() || mu > 0.5, "friction holds everything");
        for &ranks in ranks {
            let found = Solved::by(case, mu, STAGGERED, ranks).well();
            agree(&expected, &found, (1e-6, 1e-6), &format!("mu = {mu} on {ranks} ranks"));
            let sweeps = found.table("iterations.csv").only("stage", "sweep").numbers("iteration");
            assert!(sweeps.iter().any(|number| *number >= 3.0), "mu = {mu} on {ranks} ranks: no sweeps");
        }
    }
}

/// With default settings the result equals the monolithic one, also at the end of a long path with
/// slip everywhere. The error of a step has the same sign each time and accumulates. At a coefficient of 16
/// slip reverses in many iterates; without a line search there the monolithic strategy fails at 27 ms.
#[test]
fn what_slips_on_and_on_does_not_drift_on_1_rank() {
    let case = light("end: 0.07");
    for mu in [0.3, 16.0] {
        let expected = Solved::by(&case, mu, MONOLITHIC, 1).well();
        let found = Solved::by(&case, mu, "{ strategy: staggered }", 1).well();
        agree(&expected, &found, (1e-6, 1e-5), &format!("mu = {mu}"));
    }
}

/// Sweeps that overshoot by more than their error, 1.6 times at a coefficient of 4, converge at the
/// requested step, in both variants, to the monolithic result. The reported contraction is that of
/// whole sweeps.
#[test]
fn what_overshoots_converges_at_the_given_step_on_1_2_ranks() {
    let case = light("end: 0.013");
    for (mu, variant, ranks) in
        [(3.0, "frozen_bound", 1), (4.0, "frozen_bound", 2), (4.0, "frozen_traction", 1)]
    {
        let expected = Solved::by(&case, mu, MONOLITHIC, 1).well();
        let solver = format!("{{ strategy: {{ staggered: {{ variant: {variant} }} }} }}");
        let found = Solved::by(&case, mu, &solver, ranks).well();
        agree(&expected, &found, (1e-7, 1e-6), &format!("{variant} at mu = {mu}"));
        let contractions = found.table("iterations.csv").only("stage", "sweep").numbers("contraction");
        let above = contractions.iter().filter(|contraction| **contraction > 1.0).count();
        assert!(above > 5, "{variant} at mu = {mu}: {above} sweeps above 1");
    }
}

/// The forces of the full system are those that a step leaves. The monolithic residual is small at
/// each last sweep, and the friction in the tables is that of the monolithic run.
#[test]
fn a_step_ends_with_the_full_balance_on_1_rank() {
    let found = Solved::by(LAYER, 0.3, STAGGERED, 1).well();
    let expected = Solved::by(LAYER, 0.3, MONOLITHIC, 1).well();
    agree(&expected, &found, (1e-7, 1e-6), "mu = 0.3");
    let sweeps = found.table("iterations.csv").only("stage", "sweep");
    let (steps, residuals) = (sweeps.numbers("step"), sweeps.numbers("residual"));
    for row in 0..sweeps.len() {
        let last = row + 1 == sweeps.len() || steps[row + 1] > steps[row];
        assert!(!last || residuals[row] <= 1e-8, "step {}: residual {:.1e}", steps[row], residuals[row]);
    }
}

/// Contraction of a run: the median over the sweeps that are not yet at rounding, while the whole
/// base slips.
fn contraction(mu: f64) -> f64 {
    let solved = Solved::by(LAYER, mu, STAGGERED, 1).well();
    let sweeps = solved.table("iterations.csv").only("stage", "sweep");
    let rows = sweeps.numbers("contraction").into_iter().zip(sweeps.numbers("increment"));
    let mut factors: Vec<f64> =
        rows.filter(|(factor, distance)| factor.is_finite() && *distance > 1e-11).map(|row| row.0).collect();
    assert!(factors.len() > 10, "mu = {mu}: {factors:?}");
    factors.sort_by(f64::total_cmp);
    factors[factors.len() / 2]
}

/// The scheme contracts by a factor proportional to the coefficient of friction.
#[test]
fn contraction_is_proportional_to_mu_on_1_rank() {
    let factors = [0.1, 0.2, 0.4].map(contraction);
    for pair in factors.windows(2) {
        let ratio = pair[1] / pair[0];
        assert!((1.5..2.7).contains(&ratio), "{factors:?}");
    }
    assert!((0.1..0.6).contains(&(factors[2] / 0.4)), "{factors:?}");
}

/// A sweep loop that reaches its cap fails the step. It reports the figures and a remedy, and keeps
/// the previous steps.
#[test]
fn a_cap_that_is_hit_fails_on_1_2_ranks() {
    for ranks in [1, 2] {
        let solver = "{ strategy: { staggered: { tolerance: 1e-8, max_sweeps: 3 } } }";
        let failed = Solved::by(LAYER, 0.4, solver, ranks);
        let said = &failed.output.stderr;
        assert_eq!(failed.output.code, Some(5), "{said}");
        assert_eq!(said.matches("contact-petsc: error:").count(), 1, "{said}");
        for words in ["after 3 sweeps", "contraction 0.", "1.0e-8", "strategy: monolithic"] {
            assert!(said.contains(words), "no '{words}' in:\n{said}");
        }
        assert!(failed.table("probes.csv").len() >= 2, "nothing was kept");
    }
}

/// The variant that freezes the friction traction finds the same result in another way. Without a
/// check of the full residual it ends some 1e-3 away, with a check to the tolerance of the sweeps
/// 8e-7.
#[test]
fn frozen_traction_agrees_on_2_ranks() {
    let solver = "{ strategy: { staggered: { variant: frozen_traction } } }";
    let expected = Solved::by(LAYER, 0.3, MONOLITHIC, 1).well();
    let found = Solved::by(LAYER, 0.3, solver, 2).well();
    agree(&expected, &found, (1e-7, 1e-6), "frozen traction");
    let by_bound = Solved::by(LAYER, 0.3, STAGGERED, 2).well();
    let first = |solved: &Solved| solved.table("iterations.csv").only("stage", "I").numbers("residual");
    assert_ne!(first(&found), first(&by_bound));
}

/// Both stages are solved with methods for symmetric matrices, which the monolithic matrix refuses.
#[test]
fn stages_are_solved_by_conjugate_gradients_on_2_ranks() {
    let refused = Solved::by(LAYER, 0.3, "{ linear: cg_icc }", 2).output;
    assert_eq!(refused.code, Some(3), "{}", refused.stderr);
    assert!(refused.stderr.contains("`strategy: staggered`"), "{}", refused.stderr);
    let expected = Solved::by(LAYER, 0.3, STAGGERED, 1).well();
    for linear in ["cg_icc", "direct"] {
        let solver = format!("{{ strategy: {{ staggered: {{ tolerance: 1e-8 }} }}, linear: {linear} }}");
        let found = Solved::by(LAYER, 0.3, &solver, 2).well();
        assert!(apart(&expected, &found) < 1e-7, "{linear}");
        assert_eq!(found.count("linear_fallbacks"), 0, "{linear}");
        let iterations = found.table("iterations.csv").only("stage", "II").numbers("krylov_iterations");
        let most = iterations.iter().copied().fold(0.0, f64::max);
        assert!(if linear == "direct" { most == 1.0 } else { most > 3.0 }, "{linear}: {most}");
        let name = if linear == "direct" { "cholesky" } else { "cg_icc" };
        assert!(found.output.stdout.contains(&format!("staggered, each stage by {name}")), "{linear}");
    }
}

/// Without friction there is nothing to alternate, which is reported.
#[test]
fn staggered_without_friction_is_monolithic_on_1_rank() {
    let coulomb = "{ coulomb: { coefficient: MU, regularization: { stick_velocity: 1.0e-3 } } }";
    let case = LAYER.replace(coulomb, "none");
    let [whole, turns] = ["{ linear: auto }", "{ strategy: staggered }"].map(|solver| {
        let solved = Solved::by(&case, 0.0, solver, 1).well();
        (solved.displacements(), solved.output.stdout + &solved.output.stderr)
    });
    assert_eq!(whole.0, turns.0);
    let idle = Solved::by(&case, 0.0, "{ linear: two_stage }", 1).output;
    assert_eq!(idle.code, Some(3), "{}", idle.stderr);
    assert!(idle.stderr.contains("no contact has friction"), "{}", idle.stderr);
    assert!(!whole.1.contains("no contact has friction") && turns.1.contains("no contact has friction"));
}

/// Both forms of the preconditioner give the result of the factorisation in far fewer outer
/// iterations than an incomplete factorisation, and report their inner iterations.
#[test]
fn two_stage_saves_outer_iterations_on_1_2_3_4_ranks() {
    for (case, ranks) in [(LAYER, &[1, 2, 3, 4][..]), (CUBE, &[3])] {
        let expected = Solved::by(case, 1.0, MONOLITHIC, 1).well();
        for &ranks in ranks {
            let plain = Solved::by(case, 1.0, "{ linear: gmres_asm_ilu }", ranks).well();
            assert_eq!(plain.count("inner_krylov_iterations"), 0);
            for options in ["inner: cg_icc", "inner: cg_icc, second: friction_stage", "inner: cholesky"] {
                let solver = format!("{{ linear: {{ two_stage: {{ {options} }} }} }}");
                let found = Solved::by(case, 1.0, &solver, ranks).well();
                assert_eq!(found.count("linear_fallbacks"), 0, "{options} on {ranks} ranks");
                let apart = apart(&expected, &found);
                assert!(apart < 1e-8, "{options} on {ranks} ranks: {apart:.1e}");
                let [outer, outer_of_plain] =
                    [&found, &plain].map(|solved| solved.count("krylov_iterations") as f64);
                assert!(
                    outer < 0.6 * outer_of_plain,
                    "{options} on {ranks} ranks: {outer} and {outer_of_plain}"
                );
                assert!(found.count("inner_krylov_iterations") as f64 >= outer, "{options} on {ranks} ranks");
            }
        }
    }
}

/// If an inner solver fails, the preconditioner fails, and the next preset takes over.
#[test]
fn two_stage_falls_back_on_1_2_ranks() {
    let expected = Solved::by(LAYER, 0.3, MONOLITHIC, 1).well();
    for ranks in [1, 2] {
        let solver = "{ linear: { two_stage: { inner: cg_icc } } }";
        let found = Solved::with(LAYER, 0.3, solver, ranks, &["-two_stage_ksp_max_it", "1"]).well();
        assert!(found.count("linear_fallbacks") > 0);
        assert!(apart(&expected, &found) < 1e-8);
        let said = format!("{}{}", found.output.stdout, found.output.stderr);
        assert!(said.contains("gmres_asm_ilu took over"), "{said}");
    }
}

/// Error-controlled steps are those of the monolithic strategy. The total number of iterations over
/// all sweeps of a step does not shorten the steps.
#[test]
fn sweeps_do_not_shorten_steps() {
    let changes = [
        ("cells: [48, 50]", "cells: [12, 13]"),
        ("end: 0.07", "end: 0.03"),
        ("step: 5.0e-4", "step: 4.0e-3"),
    ];
    let case = shipped("rubber-block/case.yml", &changes)
        + "accuracy: { time: 3e-3, penetration: none, slip: none, energy: none }\n";
    let [monolithic, staggered] = ["monolithic", "staggered"].map(|strategy| {
        let case = case.replace("strategy: monolithic", &format!("strategy: {strategy}"));
        Results::of(&case, 1).record()["steps"].as_u64().expect("a number of steps")
    });
    assert!(staggered.abs_diff(monolithic) <= 2, "{monolithic} monolithic steps, {staggered} staggered ones");
}

/// A thin belt that touches a drum in small steps. The rounding error of its residual exceeds the
/// requested tolerance, and keeps the stages apart by more than their tolerance. Both variants
/// detect this, and find the forces of the monolithic solve.
#[test]
fn stages_of_a_belt_agree_to_rounding() {
    let belt = |solver: &str| {
        let text = format!(
            "dimension: 2
bodies:
  belt:
    mesh: {{ box: {{ min: [-0.05, 0], max: [0.05, 1.0e-4], cells: [200, 2] }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e9, poisson_ratio: 0.3 }} }}
    kinematics: finite
obstacles: {{ drum: {{ sphere: {{ center: [0, -0.03], radius: 0.03, side: outside }} }} }}
contact:
  sole:
    contactor: belt.bottom
    target: drum
    normal: {{ penalty: {{ compliance: 1.0e-12 }} }}
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 1.0e11 }} }} }}
    initial_overclosure: accept
boundary:
  ends: {{ on: belt.left, displacement: {{ x: 0, y: '-1e-6 * t' }} }}
  pull: {{ on: belt.right, displacement: {{ x: 0, y: '-1e-6 * t' }} }}
time: {{ end: 1, step: 0.0333333, cuts: 0, scheme: {{ static: {{}} }} }}
output: {{ fields: {{ every: 0 }} }}
solver: {solver}
"
        );
        let results = Results::of(&text, 1);
        let iterations = results.record()["newton_iterations"].as_u64().expect("a count");
        (results.table("reactions.csv").last("force_y"), iterations)
    };
    let (force, _) = belt(MONOLITHIC);
    for variant in ["frozen_bound", "frozen_traction"] {
        let (found, iterations) =
            belt(&format!("{{ strategy: {{ staggered: {{ tolerance: 1e-6, variant: {variant} }} }} }}"));
        println!("{variant}: {found:e} N in {iterations} iterations, not {force:e} N");
        assert!(
            (found / force - 1.0).abs() < 1e-6 && iterations < 1500,
            "{variant}: {found:e} and {force:e}"
        );
    }
}

/// Over a round tool the symmetric terms alone find no balance in a stage, and the message names the
/// cure. With the complete matrix the stages find the result of the monolithic solve, also with GMRES
/// on two ranks.
#[test]
fn stages_with_the_complete_matrix_follow_a_round_tool() {
    let pad = |solver: &str| rubber_pad("[12, 5]", 0.49, 20) + &format!("solver: {solver}\n");
    let folder = Folder::new("pad");
    folder.write("case.yml", &pad("{ strategy: staggered }"));
    let failed = run(1, &["case.yml", "--output", "out", "--quiet"], &folder);
    assert_eq!(failed.code, Some(5), "{}", failed.stderr);
    assert!(failed.stderr.contains("`matrix: complete`"), "{}", failed.stderr);
    let force = |solver: &str, ranks: usize| {
        let results = Results::of(&pad(solver), ranks);
        let table = results.table("reactions.csv");
        assert_eq!(table.len(), 21, "{solver}: no step was cut");
        ["force_x", "force_y"].map(|column| table.last(column))
    };
    let known = force(MONOLITHIC, 1);
    let complete = "strategy: { staggered: { matrix: complete } }";
    for (linear, ranks) in [("direct", 1), ("gmres_asm_ilu", 2)] {
        near(&force(&format!("{{ {complete}, linear: {linear} }}"), ranks), &known, 1e-6);
    }
    folder.write("case.yml", &pad(&format!("{{ {complete}, linear: cg_icc }}")));
    let refused = run(0, &["check", "case.yml"], &folder);
    assert_eq!(refused.code, Some(3));
    assert!(refused.stderr.contains("`matrix: symmetric`"), "{}", refused.stderr);
}
