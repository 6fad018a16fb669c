//! Only what a scene requires: from linear statics to a pair of deformable bodies each scene holds what it needs and nothing
//! more. Counted twice: by the program's own census, and by PETSc's log of all objects that it made.

mod common;

use common::{Folder, Output, run};

const N: usize = 6;

/// A rung of the ladder: its case, and what it adds to the list of what is used.
struct Rung {
    name: &'static str,
    case: String,
    adds: &'static [&'static str],
    /// Matrices and vectors that the program holds before the first solve.
    held: [usize; 2],
}

const FRICTION: &str =
    "friction: { coulomb: { coefficient: 0.3, regularization: { stick_stiffness: 1.0e9 } } }";

fn case(kinematics: &str, contact: &str, time: &str) -> String {
    format!(
        "dimension: 2\nbodies:\n  block:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 1], cells: [{N}, {N}] }} }}\n    \
         kinematics: {kinematics}\n    density: 1000\n    \
         material: {{ saint_venant_kirchhoff: {{ young_modulus: 5.0e6, poisson_ratio: 0.3 }} }}\n{contact}\
         boundary:\n  push: {{ on: block.top, displacement: {{ x: 0, y: \"-0.01 * t\" }} }}\n{}{time}\n\
         output: {{ fields: {{ every: 0 }} }}\n",
        if contact.is_empty() { "  foot: { on: block.bottom, displacement: { x: 0, y: 0 } }\n" } else { "" }
    )
}

fn ladder() -> Vec<Rung> {
    let statics = "time: { end: 1, scheme: { static: { increments: 2 } } }";
    let dynamics = "time: { end: 0.002, step: 0.001 }";
    let on = |target: &str, friction: &str| {
        format!(
            "contact:\n  sole:\n    contactor: block.bottom\n    target: {target}\n    \
             normal: {{ penalty: {{ compliance: 1.0e-9 }} }}\n    {friction}\n"
        )
    };
    let floor = "obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }\n";
    let smooth = floor.to_owned() + &on("floor", "friction: none");
    let rough = floor.to_owned() + &on("floor", FRICTION);
    let base = format!(
        "  base:\n    mesh: {{ box: {{ min: [0, -1], max: [1, 0], cells: [{N}, {N}] }} }}\n    density: 1000\n    \
         material: {{ saint_venant_kirchhoff: {{ young_modulus: 5.0e6, poisson_ratio: 0.3 }} }}\n"
    );
    let pair = case("finite", &(base + &on("base.top", FRICTION)), dynamics)
        .replace("boundary:", "boundary:\n  ground: { on: base.bottom, displacement: { x: 0, y: 0 } }");
    // Static: forces, work, u and v at start and trial, forces at the start, base of v. Inertia adds the mass matrix, a at
    // start and trial, its base, and its product with the mass.
    let (still, moving) = ([1, 8], [2, 12]);
    let inertia: &[&str] = &["M (mass)", "mass matrix", "accelerations"];
    vec![
        Rung {
            name: "linear static",
            case: case("linear", "", statics),
            adds: &["K_0", "symmetric matrix", "matrix"],
            held: still,
        },
        Rung {
            name: "finite static",
            case: case("finite", "", statics),
            adds: &["K_NL", "K_S (geometric"],
            held: still,
        },
        Rung {
            name: "frictionless contact",
            case: case("finite", &smooth, statics),
            adds: &["K_CN (normal contact)"],
            held: still,
        },
        Rung {
            name: "friction",
            case: case("finite", &rough, statics),
            adds: &["K_T", "K_nT", "zone terms", "stick memory"],
            held: still,
        },
        Rung { name: "dynamics", case: case("finite", &rough, dynamics), adds: inertia, held: moving },
        Rung {
            name: "deformable pair",
            case: pair,
            adds: &["K_CG", "search and exchange of facets"],
            held: moving,
        },
    ]
}

/// Names of what a check says is used.
fn used(output: &Output) -> Vec<String> {
    let lines = output.stdout.lines().filter(|line| line.starts_with("#   ") && line.len() > 60);
    let rows = lines.filter(|line| line.contains(" used ") && !line.contains(" not used "));
    rows.map(|line| line[4..].split(" used ").next().unwrap_or_default().trim().to_owned()).collect()
}

/// Matrices, their bytes, vectors, their bytes.
fn held(output: &Output) -> [usize; 4] {
    let line = output.stdout.lines().find(|line| line.contains("held before the first solve")).unwrap();
    let numbers: Vec<usize> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
    numbers.try_into().unwrap()
}

/// Each rung of the ladder uses one thing more, and matrices and vectors that it does not use are not there, on any rank.
#[test]
fn unused_matrices_are_not_allocated_on_1_and_2_ranks() {
    let folder = Folder::new("needs");
    let mut expected: Vec<&str> = Vec::new();
    for Rung { name, case, adds, held: [matrices, vectors] } in ladder() {
        folder.write("case.yml", &case);
        let output = run(0, &["check", "case.yml"], &folder).success();
        expected.extend(adds);
        if name == "friction" {
            expected.retain(|need| *need != "symmetric matrix");
        }
        let used = used(&output);
        let missing: Vec<_> =
            expected.iter().filter(|need| !used.iter().any(|name| name.starts_with(**need))).collect();
        assert!(
            missing.is_empty() && used.len() == expected.len(),
            "{name}: {used:?}, expected {expected:?}"
        );
        let [matrices_held, matrix_bytes, vectors_held, vector_bytes] = held(&output);
        assert_eq!([matrices_held, vectors_held], [matrices, vectors], "{name}");
        let bodies = if name == "deformable pair" { 2 } else { 1 };
        let unknowns = 2 * bodies * (N + 1) * (N + 1);
        assert_eq!(vector_bytes, 8 * vectors * unknowns, "{name}");
        assert!(matrix_bytes > 8 * unknowns, "{name}: {matrix_bytes}");
        folder.write("case.yml", &case);
        let output = run(2, &["check", "case.yml"], &folder).success();
        assert_eq!([held(&output)[0], held(&output)[2]], [matrices, vectors], "{name} on 2 ranks");
    }
}

/// PETSc's own log: statics make one matrix and its factor in a whole run; inertia makes the mass matrix, its form for all
/// components, and nothing else that lasts.
#[test]
fn petsc_makes_no_more_matrices_than_are_needed() {
    let folder = Folder::new("needs-log");
    for Rung { name, case, .. } in ladder().into_iter().take(5) {
        folder.write("case.yml", &(case + "solver: { linear: direct }\n"));
        let output = run(0, &["case.yml", "-o", "out", "-q", "--", "-log_view"], &folder).success();
        let line = output.stdout.lines().find(|line| line.trim_start().starts_with("Matrix "));
        let made = line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok());
        let most = if name == "dynamics" { 4 } else { 2 };
        assert_eq!(made, Some(most), "{name}\n{}", output.stdout);
    }
}

/// Without fields there is no file of them and no index.
#[test]
fn no_fields_no_files() {
    let folder = Folder::new("needs-fields");
    for (every, there) in [(0, false), (1, true)] {
        let case = &ladder()[2].case;
        folder.write("case.yml", &case.replace("every: 0", &format!("every: {every}")));
        run(2, &["case.yml", "-o", "out"], &folder).success();
        for name in ["out/fields", "out/fields.pvd"] {
            assert_eq!(folder.join(name).exists(), there, "{name}");
        }
    }
}
