//! The linear solvers by name: each solves its problems on any number of ranks, and a stronger one
//! follows a failed one.

mod common;

use common::{Folder, Output, Results, Table, run, shipped};
use contact_petsc::solvers::Preset;

/// Dynamic contact with friction in 2D.
const DYNAMIC: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [0.4, 0.5], cells: [8, 10], element: quad4 } }
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.45 } }
    density: 1700
    kinematics: finite
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact:
  sole:
    contactor: block.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-9 } }
    friction: { coulomb: { coefficient: 1.0, regularization: { stick_velocity: 1.0e-3 } } }
    initial_overclosure: accept
boundary: { clamp: { on: block.top, displacement: { x: '1.0 * t', y: -0.02 } } }
start: { equilibrium: { friction: false, increments: 2 } }
time: { end: 2.0e-3, step: 5.0e-4, scheme: { newmark: { beta: 0.25, gamma: 0.5 } } }
output: { fields: { every: 100 }, probes: { corner: { at: [0.4, 0] } } }
";

/// Static contact in 3D; friction is inserted.
const STATIC: &str = "
dimension: 3
bodies:
  cube:
    mesh: { box: { min: [0, 0, 0], max: [0.1, 0.1, 0.1], cells: [5, 5, 5], element: hex8 } }
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }
    density: 1700
    kinematics: finite
obstacles: { floor: { plane: { point: [0, 0, 0], normal: [0, 0, 1] } } }
contact:
  sole:
    contactor: cube.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-8 } }
    friction: FRICTION
    initial_overclosure: accept
boundary: { clamp: { on: cube.top, displacement: { x: '0.002 * t', y: '0.001 * t', z: '-0.004 * t' } } }
time: { end: 1, scheme: { static: { increments: 2 } } }
output: { fields: { every: 100 }, probes: { corner: { at: [0.1, 0.1, 0] } } }
";

const COULOMB: &str = "{ coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 1.0e8 } } }";

fn with_friction() -> String {
    STATIC.replace("FRICTION", COULOMB)
}

fn frictionless() -> String {
    STATIC.replace("FRICTION", "none")
}

/// A run with a linear solver by name and options of PETSc.
struct Solved {
    folder: Folder,
    output: Output,
}

impl Solved {
    fn by(case: &str, linear: &str, ranks: usize, petsc: &[&str]) -> Self {
        let folder = Folder::new("linear");
        folder.write("case.yml", &format!("{case}solver: {{ linear: {linear} }}\n"));
        let args: Vec<&str> = ["case.yml", "--output", "out", "--"].iter().chain(petsc).copied().collect();
        let output = run(ranks, &args, &folder);
        Self { folder, output }
    }

    #[track_caller]
    fn well(self) -> Self {
        Self { output: self.output.success(), ..self }
    }

    fn fallbacks(&self) -> u64 {
        self.count("linear_fallbacks")
    }

    /// A number of the run record.
    fn count(&self, name: &str) -> u64 {
        let text = std::fs::read_to_string(self.folder.join("out/run.json")).expect("a run record");
        let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        record[name].as_u64().expect("a count")
    }

    fn displacements(&self) -> Vec<f64> {
        let probes = Table::read(&self.folder.join("out/probes.csv"));
        let names: Vec<&str> = probes.names().filter(|name| name.contains(".u_")).collect();
        names.iter().flat_map(|name| probes.numbers(name)).collect()
    }
}

/// Each preset alone, without the next one as a fallback, gives the result of the factorisation.
#[track_caller]
fn presets_agree(case: &str, presets: &[&str], ranks: &[usize]) {
    let expected = Solved::by(case, "direct", 1, &[]).well().displacements();
    let largest = expected.iter().fold(0.0f64, |most, u| most.max(u.abs()));
    for preset in presets {
        for &ranks in ranks {
            let solved = Solved::by(case, preset, ranks, &[]).well();
            assert_eq!(solved.fallbacks(), 0, "{preset} on {ranks} ranks:\n{}", solved.output.stdout);
            let found = solved.displacements();
            let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
            let apart = apart.fold(0.0, f64::max) / largest;
            assert!(apart < 1e-8, "{preset} on {ranks} ranks: {apart:.1e}");
        }
    }
}

/// Dynamic contact with friction in 2D.
#[test]
fn presets_solve_dynamic_contact_on_1_2_3_ranks() {
    let presets = ["direct", "gmres_asm_ilu", "gmres_asm_ilu1", "gmres_amg", "filtered_ilu"];
    presets_agree(DYNAMIC, &presets, &[1, 2, 3]);
}

/// Static contact with friction in 3D.
#[test]
fn presets_solve_static_friction_on_1_2_3_ranks() {
    let presets = ["gmres_asm_ilu", "gmres_asm_ilu1", "gmres_amg", "filtered_ilu"];
    presets_agree(&with_friction(), &presets, &[1, 2, 3]);
}

/// Frictionless static contact in 3D. The matrix is symmetric, and methods that require this agree
/// with LU.
#[test]
fn symmetric_presets_solve_frictionless_contact_on_1_2_3_ranks() {
    presets_agree(&frictionless(), &["cholesky", "cg_jacobi", "cg_icc", "cg_amg"], &[1, 2, 3]);
    let solved = Solved::by(&frictionless(), "auto", 2, &[]).well();
    assert!(solved.output.stdout.contains("solver    cholesky"), "{}", solved.output.stdout);
}

/// Over a ball the tangent is not symmetric even without friction. The full one takes fewer corrections than its symmetric part, which
/// solvers for symmetric matrices get, and leads to the same place.
#[test]
fn frictionless_contact_over_a_ball_has_its_full_tangent() {
    let coarse = [
        ("cells: [10, 10, 10]", "cells: [4, 4, 4]"),
        ("end: 0.03, step: 5.0e-4", "end: 0.01, step: 1.0e-3"),
        ("{ coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 1.0e9 } } }", "none"),
    ];
    let case = shipped("rubber-cube/sphere.yml", &coarse);
    let [full, part] = ["auto", "cholesky"].map(|linear| Solved::by(&case, linear, 0, &[]).well());
    let [most, least] = [&part, &full].map(|solved| solved.count("newton_iterations"));
    assert!(5 * least < 4 * most, "{least} corrections, {most} by the symmetric part");
    let (places, others) = (full.displacements(), part.displacements());
    let largest = places.iter().fold(0.0f64, |most, u| most.max(u.abs()));
    assert!(places.iter().zip(&others).all(|(a, b)| (a - b).abs() < 1e-7 * largest));
    let told = &full.output.stdout;
    assert!(!told.contains("solver    cholesky") && !told.contains("solver    cg"), "{told}");
}

/// The subdomains of two ranks are as good as the whole: GMRES needs hardly more iterations, in 2D
/// and 3D.
#[test]
fn subdomains_cost_hardly_any_iterations_on_2_ranks() {
    let plane = shipped(
        "rubber-block/case.yml",
        &[
            ("cells: [48, 50]", "cells: [32, 32]"),
            ("end: 0.07", "end: 0.005"),
            ("solver: { strategy: monolithic }", ""),
        ],
    );
    let space = shipped(
        "rubber-cube/case.yml",
        &[
            ("cells: [10, 10, 10]", "cells: [8, 24, 8]"),
            ("max: [0.1, 0.1, 0.1]", "max: [0.1, 0.4, 0.1]"),
            ("end: 0.03", "end: 0.003"),
        ],
    );
    for case in [plane, space] {
        let [alone, both] = [1, 2]
            .map(|ranks| Solved::by(&case, "gmres_asm_ilu", ranks, &[]).well().count("krylov_iterations"));
        assert!(alone > 100 && both * 100 <= alone * 104, "{alone} and {both} iterations");
    }
}

/// If a preset runs out of iterations, a stronger one follows, which is reported and counted.
#[test]
fn failures_fall_back_on_1_2_ranks() {
    for ranks in [1, 2] {
        let solved = Solved::by(DYNAMIC, "gmres_asm_ilu", ranks, &["-ksp_max_it", "1"]).well();
        assert!(solved.fallbacks() > 0);
        let words = "linear solver gmres_asm_ilu failed (iteration limit reached after 1 iterations); direct took over";
        let said = format!("{}{}", solved.output.stdout, solved.output.stderr);
        assert!(said.contains(words), "{said}");
    }
}

/// Conjugate gradients are refused if friction makes the matrix non-symmetric, by name and through
/// PETSc's options.
#[test]
fn conjugate_gradients_are_refused_with_friction_on_2_ranks() {
    for (linear, petsc) in [("cg_icc", &[][..]), ("auto", &["-ksp_type", "cg"][..])] {
        let refused = Solved::by(DYNAMIC, linear, 2, petsc).output;
        assert_eq!(refused.code, Some(3), "{}", refused.stderr);
        assert_eq!(refused.stderr.matches("symmetric matrix").count(), 1, "{}", refused.stderr);
    }
}

/// User options replace those of the preset.
#[test]
fn options_of_petsc_win_on_2_ranks() {
    let options = ["-ksp_rtol", "1e-3", "-ksp_converged_reason", "-pc_type", "jacobi"];
    let loose = Solved::by(DYNAMIC, "gmres_asm_ilu", 2, &options).well();
    assert!(!loose.output.stderr.contains("was not used"), "{}", loose.output.stderr);
    let viewed = Solved::by(DYNAMIC, "gmres_asm_ilu", 2, &[&options[..], &["-ksp_view"]].concat()).well();
    let text = viewed.output.stdout;
    assert!(text.contains("type: jacobi") && text.contains("relative=0.001"), "{text}");
}

/// PETSc queries every option of every preset: if the user gives them, none remains unused.
#[test]
fn options_of_presets_are_known_to_petsc_on_1_2_ranks() {
    let symmetric = frictionless();
    for name in [
        "direct",
        "gmres_asm_ilu",
        "gmres_asm_ilu1",
        "gmres_amg",
        "cholesky",
        "cg_jacobi",
        "cg_icc",
        "cg_amg",
    ] {
        let preset = Preset::named(name).expect("a preset");
        let case = if preset.symmetric { &*symmetric } else { DYNAMIC };
        for ranks in [1, 2] {
            let options = preset.options_on(ranks);
            let words: Vec<String> =
                options.iter().flat_map(|(key, value)| [format!("-{key}"), (*value).to_owned()]).collect();
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let solved = Solved::by(case, name, ranks, &words).well();
            let left = &solved.output.stderr;
            assert!(!left.contains("was not used"), "{name} on {ranks} ranks: {left}");
        }
    }
}

/// Multigrid uses the rigid-body modes: three in 2D, six in 3D.
#[test]
fn multigrid_knows_rigid_body_modes_on_2_ranks() {
    for (case, linear, modes) in [(DYNAMIC, "gmres_amg", 3), (&*frictionless(), "cg_amg", 6)] {
        let solved = Solved::by(case, linear, 2, &["-info", ":pc"]).well();
        let words = format!("n data cols={modes}");
        assert!(solved.output.stdout.contains(&words), "{linear}: {}", solved.output.stdout);
    }
}

/// Counts of the events in PETSc's log that occurred.
fn logged(solved: &Solved) -> std::collections::HashMap<String, u64> {
    let text = std::fs::read_to_string(solved.folder.join("log.txt")).expect("PETSc's log");
    let row = |line: &str| {
        let mut words = line.split_whitespace();
        Some((words.next()?.to_owned(), words.next()?.parse().ok()?))
    };
    text.lines().filter_map(row).collect()
}

/// A factorisation is recomputed for each matrix, but its ordering is computed once for each
/// sparsity pattern. An incomplete factorisation and a hierarchy serve all matrices of these runs, over
/// iterations and steps.
#[test]
fn set_ups_are_skipped_on_2_ranks() {
    type Counts<'a> = &'a [(&'a str, Option<u64>)];
    const ONCE: Option<u64> = Some(1);
    const EACH: Option<u64> = None;
    let (rough, smooth) = (with_friction(), frictionless());
    let ordered = ["MatLUFactorSym", "MatLUFactorNum", "MatCholFctrSym", "MatCholFctrNum"];
    let [lu_order, lu, cholesky_order, cholesky] = ordered;
    // What each counts once, and what with every solve; the steps and the start of `DYNAMIC` have solvers of their own.
    let expected: [(&str, &str, Counts); 11] = [
        (&rough, "direct", &[(lu_order, ONCE), (lu, EACH)]),
        (&rough, "gmres_asm_ilu", &[("SubdomainILU", ONCE)]),
        (&rough, "gmres_asm_ilu1", &[("MatILUFactorSym", ONCE), (lu, ONCE)]),
        // The incomplete factors and those of the coarsest level.
        (&rough, "gmres_amg", &[("MatILUFactorSym", ONCE), (lu, Some(2))]),
        // The factors around the contact are made for each matrix; the bodies' matrix once more, as points turn.
        (&rough, "filtered_amg", &[("BulkHierarchy", Some(2)), ("ZoneFactors", EACH)]),
        (&rough, "{ two_stage: { inner: cholesky } }", &[(cholesky_order, ONCE), (cholesky, EACH)]),
        (&smooth, "cg_amg", &[(lu, ONCE)]),
        (DYNAMIC, "gmres_asm_ilu", &[("SubdomainILU", ONCE)]),
        (DYNAMIC, "filtered_amg", &[("BulkHierarchy", Some(2))]),
        (&rough, "filtered_ilu", &[("SubdomainILU", ONCE), ("CoarseMatrix", ONCE), ("ZoneFactors", ONCE)]),
        (DYNAMIC, "filtered_ilu", &[("SubdomainILU", ONCE), ("CoarseMatrix", ONCE), ("ZoneFactors", ONCE)]),
    ];
    for (case, linear, counts) in expected {
        let solved = Solved::by(case, linear, 2, &["-log_view", ":log.txt"]).well();
        let logged = logged(&solved);
        let solves = logged["Solve"];
        assert!(solves >= 4, "{linear}: {solves} solves");
        for (event, count) in counts {
            let found = logged.get(*event).copied().unwrap_or(0);
            assert_eq!(found, count.unwrap_or(solves), "{event} of {linear}, {solves} solves");
        }
    }
}

/// With error-controlled steps the tangent of an earlier step is reused with its preconditioner.
/// Far fewer tangents are assembled than with `inexact: false`, in the same steps. The motion is
/// the same to a tenth of the requested error, on two ranks as on one.
#[test]
fn a_tangent_serves_several_steps() {
    let changes = [
        ("cells: [48, 50]", "cells: [12, 13]"),
        ("end: 0.07", "end: 0.03"),
        ("step: 5.0e-4", "step: 4.0e-3"),
    ];
    let case = shipped("rubber-block/case.yml", &changes)
        + "accuracy: { time: 1e-3, penetration: none, slip: none, energy: none }\n";
    let solve = |solver: &str, ranks: usize| {
        let results = Results::of(&case.replace("{ strategy: monolithic }", solver), ranks);
        let record = results.record();
        let tangents = &record["phases"]["element_tangents_and_insertion"]["count"];
        (tangents.as_u64().expect("a count"), record["steps"].as_u64(), results.table("probes.csv"))
    };
    for (linear, ranks) in [("auto", 1), ("two_stage", 1), ("auto", 2)] {
        let (kept, steps, probes) = solve(&format!("{{ linear: {linear} }}"), ranks);
        let (made, others, reference) =
            solve(&format!("{{ linear: {linear}, newton: {{ inexact: false }} }}"), 1);
        assert!(4 * kept < 3 * made, "{linear}: {kept} tangents, {made} where none is kept");
        assert_eq!(steps, others, "{linear}");
        for column in ["node_50.u_x", "node_98.u_x"] {
            let apart = (probes.last(column) - reference.last(column)).abs();
            assert!(apart < 1e-4 * 0.05, "{linear}: {column}: {apart:e}");
        }
    }
}

/// The upper one of two boxes begins to slip. With the factors of an earlier matrix a solve takes 226
/// iterations.
#[test]
fn slip_takes_few_iterations_on_1_2_4_ranks() {
    let case = "
dimension: 3
bodies:
  lower:
    mesh: { box: { min: [0, 0, 0], max: [1, 1, 0.5], cells: [6, 6, 3], element: hex8 } }
    material: { neo_hookean: { young_modulus: 1.0e7, poisson_ratio: 0.3 } }
    density: 1000
    kinematics: finite
  upper:
    mesh: { box: { min: [0, 0, 0.49999], max: [1, 1, 1], cells: [5, 5, 3], element: hex8 } }
    material: { neo_hookean: { young_modulus: 1.0e7, poisson_ratio: 0.3 } }
    density: 1000
    kinematics: finite
    initial_velocity: [0.24, 0, 0]
contact:
  joint:
    contactor: upper.bottom
    target: lower.top
    normal: { penalty: { compliance: 1.66667e-10 } }
    friction: { coulomb: { coefficient: 1, regularization: { stick_velocity: 1.0e-3 } } }
    initial_overclosure: accept
boundary:
  base: { on: lower.bottom, displacement: { x: 0, y: 0, z: 0 } }
  press: { on: upper.top, displacement: { x: '0.24 * t', y: 0, z: -0.005 } }
start: { equilibrium: { friction: false, increments: 1 } }
time: { end: 0.0166667, step: 0.00833333, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
output: { fields: { every: 100 } }
";
    for ranks in [1, 2, 4] {
        for preset in ["gmres_asm_ilu", "gmres_asm_ilu1"] {
            let solved = Solved::by(case, preset, ranks, &["-ksp_rtol", "1e-8"]).well();
            assert_eq!(solved.fallbacks(), 0, "{preset} on {ranks} ranks");
            let iterations = Table::read(&solved.folder.join("out/iterations.csv"));
            let most = iterations.numbers("krylov_iterations").into_iter().fold(0.0, f64::max);
            assert!((1.0..=25.0).contains(&most), "{preset} on {ranks} ranks: {most}");
        }
    }
}
