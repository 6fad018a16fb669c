//! Plane stress in complete runs: every law against a solid with free sides, every element against closed
//! forms, bending, contact, energy and momentum of a tumbling block, mistakes, and equal results on any number of
//! ranks and after a restart.

mod common;

use std::fs;

use common::{Folder, Results, Table, assert_says, near, run};
use contact_petsc::output::vtu::VtuValues;
use contact_petsc::output::vtu_reader::read_piece;

/// A strip that is pulled along x. Its other sides are free.
const STRIP: &str = "
dimension: 2
plane: stress
bodies:
  strip:
    mesh: { box: { min: [0, 0], max: [1, 0.5], cells: [2, 1], element: KIND } }
    material: { LAW }
boundary:
  left: { on: strip.left, displacement: { x: 0 } }
  middle: { on: strip.bottom, displacement: { y: 0 } }
  pull: { on: strip.right, displacement: { x: 'MOST * t' } }
time: { end: 1, scheme: { static: { increments: 2 } } }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 2, stresses: true }, probes: { corner: { at: [1, 0.5] } } }
";

fn strip(kind: &str, law: &str, most: f64) -> String {
    STRIP.replace("KIND", kind).replace("LAW", law).replace("MOST", &most.to_string())
}

/// The strip as a solid of unit thickness between a plane of symmetry and a free side.
fn solid(law: &str, most: f64) -> String {
    strip("hex8", law, most)
        .replace("plane: stress\n", "")
        .replace("dimension: 2", "dimension: 3")
        .replace("[0, 0], max: [1, 0.5], cells: [2, 1]", "[0, 0, 0], max: [1, 0.5, 1], cells: [2, 1, 1]")
        .replace("on: strip.bottom, displacement: { y: 0 }", "on: strip.front, displacement: { y: 0 }")
        .replace("  pull:", "  flat: { on: strip.bottom, displacement: { z: 0 } }\n  pull:")
        .replace("at: [1, 0.5]", "at: [1, 0.5, 1]")
}

/// Every law, with the largest elongation.
const LAWS: [(&str, f64); 8] = [
    ("neo_hookean: { young_modulus: 2e6, poisson_ratio: 0.3 }", 0.8),
    ("neo_hookean: { young_modulus: 2e6, poisson_ratio: 0.499 }", -0.4),
    ("saint_venant_kirchhoff: { young_modulus: 2e6, poisson_ratio: 0.3 }", 0.3),
    ("mooney_rivlin: { c10: 3e5, c01: 1e5, bulk_modulus: 1e7 }", 0.8),
    ("yeoh: { c1: 5e5, c2: -2e4, c3: 2e3, bulk_modulus: 1e7 }", 0.8),
    ("arruda_boyce: { mu: 1e6, lambda_m: 4, bulk_modulus: 1e8 }", 0.8),
    ("gent: { mu: 1e6, j_m: 6.8, bulk_modulus: 1e8 }", 1.2),
    (
        "ogden: { terms: [{ mu: 1e6, alpha: 1.3 }, { mu: 2e4, alpha: 5 }, { mu: -2e5, alpha: -2 }], poisson_ratio: 0.4 }",
        0.8,
    ),
];

/// Force and lateral displacement of every law are those of a solid whose sides are free.
#[test]
fn every_law_agrees_with_a_solid_with_free_sides() {
    for (law, most) in LAWS {
        let pulled = |text: &str| {
            let results = Results::of(text, 1);
            let pull = results.table("reactions.csv").only("boundary", "pull");
            let probes = results.table("probes.csv");
            [pull.numbers("force_x"), probes.numbers("corner.u_y")]
        };
        let [force, lateral] = pulled(&strip("quad4", law, most));
        let [force_of_solid, lateral_of_solid] = pulled(&solid(law, most));
        assert!(force[2].abs() > 1e5, "{law}: {force:?}");
        near(&force, &force_of_solid, 1e-9);
        near(&lateral, &lateral_of_solid, 1e-9);
    }
}

/// Lateral stretch and nominal stress \[Pa\] of a neo-Hookean bar with free sides, of 1 MPa and Poisson's ratio 0.3.
fn bar(stretch: f64) -> [f64; 2] {
    let mu = 1e6 / 2.6;
    let lambda = mu * 0.6 / 0.4;
    let kirchhoff = |l: f64, across: f64| mu * (l * l - 1.0) + lambda * (stretch * across * across).ln();
    let (mut low, mut high) = (0.1, 3.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if kirchhoff(middle, middle) < 0.0 { low = middle } else { high = middle }
    }
    [low, kirchhoff(stretch, low) / stretch]
}

/// Every element follows the closed form of the bar, and its fields have the stretch of the thickness and no
/// stress across the plane.
#[test]
fn every_element_follows_the_closed_form() {
    let law = "neo_hookean: { young_modulus: 1e6, poisson_ratio: 0.3 }";
    for (kind, ranks) in [("quad4", 1), ("quad8", 2), ("quad9", 1), ("tri3", 1), ("tri6", 2)] {
        let results = Results::of(&strip(kind, law, 0.6), ranks);
        let [across, stress] = bar(1.6);
        let pull = results.table("reactions.csv").only("boundary", "pull").last("force_x");
        near(&[pull], &[0.5 * stress], 1e-9);
        near(&[results.table("probes.csv").last("corner.u_y")], &[0.5 * (across - 1.0)], 1e-9);
        let path = results.0.join("out/fields/step_000002/volume_0000.vtu");
        let piece = read_piece(&path).expect("a piece");
        let numbers = |name: &str| match &piece.cell_data[name].values {
            VtuValues::Float64(values) => values.clone(),
            other => panic!("{other:?}"),
        };
        let cauchy = stress / (across * across);
        near(&numbers("cauchy_stress")[..3], &[cauchy, 0.0, 0.0], 1e-9);
        assert_eq!(numbers("cauchy_stress")[2], 0.0);
        near(&numbers("von_mises")[..1], &[cauchy], 1e-9);
        near(&numbers("principal_stretch")[..3], &[1.6, across, across], 1e-9);
        near(&numbers("det_f")[..1], &[1.6 * across * across], 1e-9);
    }
}

/// A beam in pure bending has the curvature of Young's modulus, not that of the modulus of plane strain.
#[test]
fn a_beam_bends_with_youngs_modulus() {
    for kind in ["quad8", "quad9", "tri6"] {
        let text = format!(
            "dimension: 2\nplane: stress\nbodies:\n  beam:\n    \
             mesh: {{ box: {{ min: [0, 0], max: [4, 1], cells: [4, 2], element: {kind} }} }}\n    \
             sets: {{ pin: {{ of: nodes, where: \"x < 1e-9 and abs(y - 0.5) < 1e-9\" }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.4 }} }}\n    kinematics: linear\n\
             boundary:\n  left: {{ on: beam.left, displacement: {{ x: 0 }} }}\n  \
             pin: {{ on: beam.pin, displacement: {{ y: 0 }} }}\n  \
             bend: {{ on: beam.right, traction: {{ x: \"1000 * (y - 0.5)\" }} }}\n\
             time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}\n\
             solver: {{ newton: {{ tolerance: 1.0e-12 }} }}\n\
             output: {{ probes: {{ end: {{ at: [4, 0.5] }}, corner: {{ at: [4, 1] }} }} }}\n"
        );
        let probes = Results::of(&text, 1).table("probes.csv");
        let bent = -0.5 * 1e-3 * 16.0;
        let found = [probes.last("end.u_y"), probes.last("corner.u_y"), probes.last("corner.u_x")];
        near(&found, &[bent, bent - 0.5 * 0.4e-3 * 0.25, 1e-3 * 4.0 * 0.5], 1e-9);
    }
}

/// Two blocks whose meshes do not match are pressed onto each other. They have the uniform state of one bar.
#[test]
fn blocks_pass_the_patch_test() {
    let law = "material: { neo_hookean: { young_modulus: 1e6, poisson_ratio: 0.3 } }";
    let text = format!(
        "dimension: 2\nplane: stress\nbodies:\n  \
         upper:\n    mesh: {{ box: {{ min: [0, 1], max: [1, 1.5], cells: [3, 2] }} }}\n    {law}\n  \
         lower:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 1], cells: [4, 3], element: quad9 }} }}\n    {law}\n\
         contact:\n  face: {{ contactor: upper.bottom, target: lower.top, normal: {{ penalty: {{ compliance: 1.0e-15 }} }} }}\n\
         boundary:\n  floor: {{ on: lower.bottom, displacement: {{ y: 0 }} }}\n  \
         side: {{ on: [lower.left, upper.left], displacement: {{ x: 0 }} }}\n  \
         press: {{ on: upper.top, displacement: {{ y: -0.3 }} }}\n\
         time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}\nsolver: {{ newton: {{ tolerance: 1.0e-10 }} }}\n\
         output: {{ probes: {{ above: {{ at: [1, 1.5], on: upper }}, below: {{ at: [1, 0.5], on: lower }} }} }}\n"
    );
    let [across, stress] = bar(0.8);
    for ranks in [1, 3] {
        let results = Results::of(&text, ranks);
        let force = results.table("contact.csv").last("force_y");
        near(&[force], &[-stress], 1e-7);
        let probes = results.table("probes.csv");
        let found = [probes.last("above.u_x"), probes.last("below.u_x"), probes.last("below.u_y")];
        near(&found, &[across - 1.0, across - 1.0, -0.1], 1e-7);
    }
}

fn tumbling(kind: &str, law: &str, scheme: &str) -> String {
    format!(
        "dimension: 2\nplane: stress\nbodies:\n  block:\n    \
         mesh: {{ box: {{ min: [-0.1, -0.1], max: [0.1, 0.1], cells: [2, 2], element: {kind} }} }}\n    \
         material: {{ {law} }}\n    density: 1000\n    \
         initial_velocity: [\"30 * x - 80 * y\", \"60 * x - 40 * y + 3\"]\n\
         time: {{ end: 0.05, step: 1.0e-3, scheme: {scheme} }}\nsolver: {{ newton: {{ tolerance: 1.0e-13 }} }}\n"
    )
}

/// A block that tumbles and swings freely in 50 large steps keeps its energy to 1e-12 and its momenta to 1e-10
/// under the conserving scheme. The midpoint rule does not keep the energy.
#[test]
fn a_tumbling_block_keeps_energy_and_momentum() {
    let lost = |results: &Results| {
        let ledger = results.table("energy.csv");
        let largest = |column| ledger.numbers(column).into_iter().fold(0.0_f64, |most, e| most.max(e.abs()));
        assert!(largest("strain") > 0.05 * largest("total"));
        largest("numerical") / largest("total")
    };
    for (kind, law) in [
        ("quad4", "mooney_rivlin: { c10: 3e5, c01: 2e5, poisson_ratio: 0.45 }"),
        ("quad9", "gent: { mu: 1e6, j_m: 20, poisson_ratio: 0.45 }"),
        ("tri6", "neo_hookean: { young_modulus: 3e6, poisson_ratio: 0.4 }"),
        ("quad8", "saint_venant_kirchhoff: { young_modulus: 3e6, poisson_ratio: 0.3 }"),
    ] {
        let results = Results::of(&tumbling(kind, law, "conserving"), 1);
        let lost = lost(&results);
        assert!(lost < 1e-12, "{kind} {law}: {lost}");
        let momentum = results.table("momentum.csv");
        for column in ["linear_x", "linear_y", "angular"] {
            let name = momentum.names().find(|name| name.starts_with(column)).expect("a momentum");
            let values = momentum.numbers(name.split(' ').next().unwrap_or(name));
            let drift = values.iter().fold(0.0_f64, |most, value| most.max((value - values[0]).abs()));
            assert!(drift < 1e-10, "{kind} {law}, {column}: {drift}");
        }
    }
    let rubber = "mooney_rivlin: { c10: 3e5, c01: 2e5, poisson_ratio: 0.45 }";
    let midpoint = lost(&Results::of(&tumbling("quad4", rubber, "midpoint"), 1));
    assert!(midpoint > 1e-5, "{midpoint}");
}

/// A block that is dragged over a floor with friction.
const SLIDING: &str = "
dimension: 2
plane: stress
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [0.4, 0.4], cells: [5, 4] } }
    sets: { part: { of: elements, where: 'x + y < 0.5' } }
    material: { mooney_rivlin: { c10: 4e5, c01: 1e5, bulk_modulus: 1e8 } }
    density: 1100
    regions:
      part: { material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }, density: 1700 }
obstacles:
  floor: { plane: { point: [0, 0], normal: [0, 1] } }
contact:
  sole:
    contactor: block.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-9 } }
    friction: { coulomb: { coefficient: 0.5, regularization: { stick_velocity: 1.0e-3 } } }
boundary:
  clamp: { on: block.top, displacement: { x: '1.0 * t', y: -0.01 } }
start: { equilibrium: { friction: false, increments: 2 } }
time: { end: 0.003, step: 5.0e-4, scheme: SCHEME }
solver: { newton: { tolerance: 1.0e-12 } }
output: { bodies: true, checkpoint: { every: 2 } }
";

/// Two materials in contact give equal results on 1 to 3 ranks and after a restart on other numbers of ranks.
#[test]
fn results_are_independent_of_ranks_and_restarts() {
    let columns = [
        ("energy.csv", "strain"),
        ("energy.csv", "friction_dissipated"),
        ("reactions.csv", "force_y"),
        ("bodies.csv", "kinetic"),
    ];
    for scheme in ["{ newmark: { beta: 0.25, gamma: 0.5 } }", "conserving"] {
        let folder = Folder::new("plane-stress");
        folder.write("case.yml", &SLIDING.replace("SCHEME", scheme));
        let out = |ranks: usize| format!("on-{ranks}");
        for ranks in 1..=3 {
            run(ranks, &["case.yml", "-q", "-o", &out(ranks)], &folder).success();
        }
        for ranks in 1..=3 {
            let after = format!("after-{ranks}");
            let start = "--restart=on-2/checkpoints/step-000004.ckpt";
            run(ranks, &["case.yml", "-q", "-o", &after, start], &folder).success();
            for (table, column) in columns {
                let [one, several, after] = ["on-1", &out(ranks), &after]
                    .map(|of| Table::read(&folder.join(of).join(table)).numbers(column));
                assert!(one.iter().any(|value| value.abs() > 0.0), "{column}");
                near(&several, &one, 1e-7);
                let last = |values: &[f64]| values[values.len() - 2..].to_vec();
                assert!(after.len() < one.len());
                near(&last(&after), &last(&one), 1e-7);
            }
        }
        let rows = |of: &str| fs::read_to_string(folder.join(of).join("energy.csv")).expect("a table");
        let [whole, again] = ["on-2", "after-2"].map(rows);
        assert_eq!(whole.lines().last(), again.lines().last());
    }
}

/// What plane stress excludes is refused with its place and a remedy.
#[test]
fn what_plane_stress_excludes_is_refused() {
    let law = "neo_hookean: { young_modulus: 1e6, poisson_ratio: 0.3 }";
    let plain = strip("quad4", law, 0.1);
    let material = format!("    material: {{ {law} }}\n");
    for (text, says) in [
        (
            plain.replace("plane: stress", "plane: stres"),
            ["case.yml:3:8", "unknown state across the plane 'stres'", "stress"],
        ),
        (
            solid(law, 0.1).replace("dimension: 3\n", "dimension: 3\nplane: stress\n"),
            ["case.yml:3:8", "`plane` is for 2D", "`dimension: 2`"],
        ),
        (
            plain.replace(&material, &format!("{material}    locking: mean_dilatation\n")),
            ["case.yml:8:14", "`mean_dilatation` has no meaning under plane stress", "remove `locking`"],
        ),
        (
            plain.replace(&material, &format!("{material}    locking: selective_reduced\n")),
            ["case.yml:8:14", "`selective_reduced` has no meaning under plane stress", "remove `locking`"],
        ),
        (
            plain.replace(
                &material,
                &format!("{material}    viscoelasticity: {{ prony: [{{ share: 0.5, time: 0.1 }}] }}\n"),
            ),
            [
                "case.yml:8:22",
                "viscoelasticity is not allowed under plane stress",
                "one layer of 3D elements",
            ],
        ),
    ] {
        let folder = Folder::new("plane-stress");
        folder.write("case.yml", &text);
        let output = run(0, &["check", "case.yml"], &folder);
        assert_eq!(output.code, Some(3), "{}", output.text());
        assert_says(&output.text(), &says);
    }
}

/// `check` names the state, integrates nearly incompressible bodies in full, and has the speed of waves in a plate.
#[test]
fn check_describes_the_state() {
    let folder = Folder::new("plane-stress");
    let law = "neo_hookean: { young_modulus: 1e6, poisson_ratio: 0.4999 }";
    let text = strip("quad4", law, 0.1).replace("    material:", "    density: 1000\n    material:");
    folder.write("case.yml", &text);
    let text = run(0, &["check", "case.yml"], &folder).success().text();
    let speed = (1e6_f64 / (1.0 - 0.4999 * 0.4999) / 1000.0).sqrt();
    assert_says(&text, &["plane stress: the thickness is free", "locking: none of quad4"]);
    let printed = text.split("c_p ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a speed");
    near(&[printed.parse().expect("a number")], &[speed], 1e-4);
}

/// A Saint Venant-Kirchhoff plate has no thickness without stress beyond a strain. The run ends with the element.
#[test]
fn a_plate_without_thickness_ends_the_run() {
    let folder = Folder::new("plane-stress");
    let law = "saint_venant_kirchhoff: { young_modulus: 1e6, poisson_ratio: 0.45 }";
    let text = strip("quad4", law, 2.0).replace("displacement: { y: 0 }", "displacement: { y: '0 * t' }");
    let text = text.replace("  pull:", "  wide: { on: strip.top, displacement: { y: '1.0 * t' } }\n  pull:");
    folder.write("case.yml", &text);
    let output = run(0, &["case.yml", "--output", "out"], &folder);
    assert_eq!(output.code, Some(6), "{}", output.text());
    assert_says(&output.stderr, &["element ", "is stretched beyond the limit of its material"]);
}
