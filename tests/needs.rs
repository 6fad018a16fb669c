//! Only what a scene requires: from linear statics to a pair of deformable bodies each scene holds
//! what it needs and nothing more. This is counted twice: by the program's own census, and by
//! PETSc's log of all objects that it created.

mod common;

use common::{Folder, Output, run};

const N: usize = 6;

/// A rung of the ladder: its case, and what it adds to the list of used features.
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
    // Damping adds its matrix and its forces.
    let still = [1, 8];
    let moving = [2, 12];
    let damped = [3, 13];
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
            case: pair.clone(),
            adds: &["K_CG", "search and exchange of facets"],
            held: moving,
        },
        Rung {
            name: "deformable pair with damping",
            case: pair.replacen("density:", "damping: { rayleigh: { stiffness: 1.0e-4 } }\n    density:", 1),
            adds: &["C (damping)"],
            held: damped,
        },
        Rung {
            name: "deformable pair with damping on dashpots",
            case: pair
                .replacen("density:", "damping: { rayleigh: { stiffness: 1.0e-4 } }\n    density:", 1)
                .replace(
                    "displacement: { x: 0, y: 0 } }",
                    "foundation: { stiffness: { normal: 1.0e8 }, damping: { normal: 1.0e3 } } }",
                ),
            adds: &["K_s, C_s (foundations"],
            held: damped,
        },
        Rung {
            name: "deformable pair with damping and viscoelasticity on dashpots",
            case: pair
                .replacen(
                    "density:",
                    "damping: { rayleigh: { stiffness: 1.0e-4 } }\n    \
                     viscoelasticity: { prony: [{ share: 0.5, time: 1 }] }\n    density:",
                    1,
                )
                .replace(
                    "displacement: { x: 0, y: 0 } }",
                    "foundation: { stiffness: { normal: 1.0e8 }, damping: { normal: 1.0e3 } } }",
                ),
            adds: &["history of viscous branches"],
            held: damped,
        },
    ]
}

/// Names of the features that `check` lists as used.
fn used(output: &Output) -> Vec<String> {
    let lines = output.stdout.lines().filter(|line| line.starts_with("#   ") && line.len() > 60);
    let rows = lines.filter(|line| line.contains(" used ") && !line.contains(" not used "));
    rows.map(|line| line[4..].split(" used ").next().unwrap_or_default().trim().to_owned()).collect()
}

/// The line of `check` on the objects held, without the words before it.
fn holdings(output: &Output) -> &str {
    output.stdout.lines().find_map(|line| line.split_once("storage before the first solve: ")).unwrap().1
}

/// Number of matrices, their bytes, number of vectors, their bytes.
fn held(output: &Output) -> [usize; 4] {
    let numbers: Vec<usize> = holdings(output).split(' ').filter_map(|word| word.parse().ok()).collect();
    numbers[..4].try_into().unwrap()
}

/// Bytes of one object held in addition to matrices and vectors; 0 if it does not exist.
fn bytes(output: &Output, name: &str) -> usize {
    let part = holdings(output).split(", ").find_map(|part| part.strip_prefix(name)?.strip_prefix(" of "));
    part.map_or(0, |part| part.strip_suffix(" bytes").unwrap().parse().unwrap())
}

/// Each rung of the ladder uses one feature more. Matrices and vectors that it does not use do not
/// exist, on any rank.
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
        let bodies = if name.starts_with("deformable pair") { 2 } else { 1 };
        let unknowns = 2 * bodies * (N + 1) * (N + 1);
        assert_eq!(vector_bytes, 8 * vectors * unknowns, "{name}");
        assert!(matrix_bytes > 8 * unknowns, "{name}: {matrix_bytes}");
        // Four points of each element, each with three tensors of four components.
        let branches = if name.contains("viscoelasticity") { 4 * 3 * 4 * 8 * N * N } else { 0 };
        assert_eq!(bytes(&output, "viscous branches"), branches, "{name}");
        folder.write("case.yml", &case);
        let output = run(2, &["check", "case.yml"], &folder).success();
        assert_eq!([held(&output)[0], held(&output)[2]], [matrices, vectors], "{name} on 2 ranks");
    }
}

/// The objects that an accuracy requires are listed and held only if the corresponding part is
/// requested, on any number of ranks: seven vectors for the error in time, multipliers for the
/// penetration, and what removes the mass of contact nodes.
#[test]
fn what_an_accuracy_keeps_is_listed_on_1_and_2_ranks() {
    const NAMES: [&str; 3] = [
        "displacements and errors of earlier steps",
        "multipliers of contact points",
        "massless nodes of contact surfaces",
    ];
    let (statics, dynamics) = (&ladder()[2].case, &ladder()[4].case);
    let massless = dynamics.replace("    density:", "    mass: redistributed\n    density:");
    let accuracy = |text: &str| format!("accuracy: {{ slip: none, energy: none, {text} }}\n");
    let [time, depth] = ["time: 1.0e-3, penetration: none", "time: none, penetration: 1.0e-6"].map(accuracy);
    let both = accuracy("time: 1.0e-3, penetration: 1.0e-6");
    let folder = Folder::new("needs-accuracy");
    for (case, accuracy, expected) in [
        (dynamics, "", [false; 3]),
        (dynamics, &time[..], [true, false, false]),
        (dynamics, &depth[..], [false, true, false]),
        (dynamics, &both[..], [true, true, true]),
        (&massless, "", [false, false, true]),
        (statics, &depth[..], [false, true, false]),
        (statics, "accuracy: tight\n", [false, true, false]),
    ] {
        let [estimates, multipliers, spares] = expected;
        folder.write("case.yml", &(case.to_owned() + accuracy));
        for ranks in [0, 2] {
            let output = run(ranks, &["check", "case.yml"], &folder).success();
            let listed = used(&output);
            assert_eq!(
                NAMES.map(|name| listed.iter().any(|used| used == name)),
                expected,
                "{accuracy}{}",
                output.stdout
            );
            let plain = if std::ptr::eq(case, statics) { 8 } else { 12 };
            assert_eq!(
                held(&output)[2],
                plain + if estimates { 7 } else { 0 },
                "{accuracy}{}",
                holdings(&output)
            );
            // Two numbers a point; a mark and a factor a node.
            let of_points = bytes(&output, "multipliers");
            assert!((of_points > 0) == multipliers && of_points.is_multiple_of(16), "{of_points}");
            let of_nodes = bytes(&output, "flags and factors of masses");
            assert_eq!(of_nodes >= 9 * (N + 1) * (N + 1), spares, "{of_nodes}");
        }
    }
}

/// PETSc's own log: a static run creates one matrix and its factor. Inertia adds the mass matrix,
/// its form for all components, and no other permanent object.
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

/// Without fields there is no field file and no index.
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
